// Rendering a sheet of cloth over the ground: camera samples per CPU second, and error against
// samples measured on one picture, so that both belong to one configuration. Rendering a pool with
// a small lamp: what photons gain over paths.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "render/renderer.h"
#include "tests/bench/bench.h"

namespace drench::bench {

namespace {

constexpr int kWidth = 96, kHeight = 54;
/// A hundred times the most samples measured: 1 % of that error is the reference's own.
constexpr int kReferenceSamples = 25600;
constexpr double kMostCost = 1 / 0.3;  // CPU s per million camera samples

/// A pleated sheet of 2 x 64 x 64 triangles.
TriangleMesh pleated_sheet() {
  constexpr int kCells = 64;
  TriangleMesh mesh;
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i) {
      const float x = -0.5f + float(i) / kCells, y = 1.05f - float(j) / kCells;
      mesh.position.push_back({x, y, 0.05f * std::sin(30 * x + 3 * y) * (1.2f - y)});
      mesh.velocity.push_back({0, 0, 0});
      mesh.uv.push_back({float(i) / kCells, float(j) / kCells});
    }
  for (uint32_t j = 0; j < kCells; ++j)
    for (uint32_t i = 0; i < kCells; ++i) {
      const uint32_t a = j * (kCells + 1) + i, c = a + kCells + 1;
      mesh.triangle.push_back({a, c, a + 1});
      mesh.triangle.push_back({a + 1, c, c + 1});
    }
  return mesh;
}

Shot cloth_shot() {
  Shot shot;
  shot.render.width = kWidth;
  shot.render.height = kHeight;
  shot.render.depth = 8;
  shot.camera.position = V3d(0.7, 0.9, 2.2);
  shot.camera.target = V3d(0, 0.5, 0);
  shot.ground.present = true;
  Light lamp, sky;
  lamp.radiance = {8, 8, 8};
  lamp.center = {1.2, 2.2, 1};
  sky.type = LightType::environment;
  sky.name = "sky";
  sky.radiance = {0.5f, 0.6f, 0.8f};
  shot.light = {lamp, sky};
  return shot;
}

struct Render {
  Film film;
  RenderStats stats;
  Measured cost;
};

Render render(Shot shot, const FrameGeometry& geometry, int samples, uint32_t seed) {
  shot.render.samples = samples;
  shot.render.seed = seed;
  Render out;
  out.cost =
      measure([&] { out.film = render_frame(shot, shot.timeline.first, geometry, &out.stats); });
  return out;
}

/// mean((x - r)^2 / (r^2 + 0.01)) over pixels and channels.
double relative_mse(const Film& film, const Film& reference) {
  double sum = 0;
  for (size_t k = 0; k < film.rgba.size(); ++k) {
    if (k % 4 == 3) continue;
    const double r = reference.rgba[k], d = film.rgba[k] - r;
    sum += d * d / (r * r + 0.01);
  }
  return sum / (0.75 * double(film.rgba.size()));
}

/// Slope of the straight line through the points of log y over log x.
double log_slope(const std::vector<double>& x, const std::vector<double>& y) {
  double mx = 0, my = 0, xy = 0, xx = 0;
  for (size_t k = 0; k < x.size(); ++k) {
    mx += std::log(x[k]) / double(x.size());
    my += std::log(y[k]) / double(x.size());
  }
  for (size_t k = 0; k < x.size(); ++k) {
    xy += (std::log(x[k]) - mx) * (std::log(y[k]) - my);
    xx += (std::log(x[k]) - mx) * (std::log(x[k]) - mx);
  }
  return xy / xx;
}

/// Five seeds: the error is their mean, the cost that of the median.
struct Sampled {
  double error = 0;
  Render median;
};

Sampled sample(const Shot& shot, const FrameGeometry& geometry, int samples,
               const Film& reference) {
  constexpr int kSeeds = 5;
  Sampled out;
  std::vector<Render> renders;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    renders.push_back(render(shot, geometry, samples, uint32_t(seed)));
    out.error += relative_mse(renders.back().film, reference) / kSeeds;
  }
  std::nth_element(renders.begin(), renders.begin() + kSeeds / 2, renders.end(),
                   [](const Render& a, const Render& b) { return a.cost.cpu_s < b.cost.cpu_s; });
  out.median = renders[kSeeds / 2];
  return out;
}

Line line_of(const Sampled& sampled) {
  Line line;
  line.method = "path tracing, depth 8";
  line.resolution = std::to_string(kWidth) + " x " + std::to_string(kHeight) + " pixels";
  line.threads = hardware_threads();
  line.cost = sampled.median.cost;
  const double count = double(sampled.median.stats.camera_samples);
  line.more["samples"] = sampled.median.stats.camera_samples / (kWidth * kHeight);
  line.more["samples_per_cpu_s"] = count / sampled.median.cost.cpu_s;
  line.more["rays_per_cpu_s"] = double(sampled.median.stats.rays) / sampled.median.cost.cpu_s;
  return line;
}

void render_cloth(const Emit& emit) {
  const Shot shot = cloth_shot();
  const FrameGeometry geometry{{}, {{"cloth", pleated_sheet()}}};
  const Film reference = render(shot, geometry, kReferenceSamples, 1000).film;
  std::vector<double> counts, errors;
  Line rate;
  for (const int samples : {1, 4, 16, 64, 256}) {
    const Sampled sampled = sample(shot, geometry, samples, reference);
    Line line = line_of(sampled);
    rate = line;  // the last has so many samples that building the scene no longer counts
    counts.push_back(samples);
    errors.push_back(sampled.error);
    line.error = sampled.error;
    line.error_of = "relMSE against " + std::to_string(kReferenceSamples) + " samples";
    if (counts.size() > 1) line.more["slope"] = log_slope(counts, errors);
    emit(line);
  }
  rate.method += ", rate";
  rate.error = 1e6 / rate.more["samples_per_cpu_s"].get<double>();
  rate.error_of = "CPU s per million camera samples";
  rate.gate = kMostCost;
  emit(rate);
}

const Registration render_cloth_case{
    "render_cloth", "cloth over ground at depth 8: samples per CPU s, error at 1 to 256 samples",
    render_cloth};

/// A closed slab of water of 4 m whose top waves, its floor below the ground.
TriangleMesh wavy_pool() {
  constexpr uint32_t n = 128, row = n + 1;
  TriangleMesh mesh;
  for (const bool top : {true, false})
    for (uint32_t j = 0; j <= n; ++j)
      for (uint32_t i = 0; i <= n; ++i) {
        const float x = -2 + 4 * float(i) / n, z = -2 + 4 * float(j) / n;
        const float wave = 0.03f * (std::sin(7 * x + 2 * z) + std::sin(5 * z - 3 * x));
        mesh.position.push_back({x, top ? 0.35f + wave : -0.1f, z});
        mesh.velocity.push_back({0, 0, 0});
      }
  const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    mesh.triangle.push_back({a, b, c});
    mesh.triangle.push_back({a, c, d});
  };
  constexpr uint32_t below = row * row;
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * row + i;
      quad(a, a + row, a + row + 1, a + 1);
      quad(below + a, below + a + 1, below + a + row + 1, below + a + row);
    }
  const auto wall = [&](uint32_t a, uint32_t b) { quad(a, b, below + b, below + a); };
  for (uint32_t k = 0; k < n; ++k) {
    wall(k, k + 1);
    wall(n * row + k + 1, n * row + k);
    wall((k + 1) * row, k * row);
    wall(k * row + n, (k + 1) * row + n);
  }
  return mesh;
}

Shot pool_shot() {
  Shot shot = cloth_shot();
  shot.camera.position = V3d(0.4, 1.9, 2.3);
  shot.camera.target = V3d(0, 0.1, 0);
  shot.light[0].radiance = {900, 900, 900};
  shot.light[0].u = {0.05, 0, 0};
  shot.light[0].v = {0, 0, 0.05};
  return shot;
}

/// The reference is of paths alone. Gain: of 1 / (error x CPU s), at as many samples.
void render_caustics(const Emit& emit) {
  Shot photons = pool_shot(), paths = photons;
  paths.render.photons = 0;
  const FrameGeometry geometry{wavy_pool(), {}};
  const Film reference = render(paths, geometry, kReferenceSamples, 1000).film;
  for (const int samples : {4, 16, 64, 256}) {
    double efficiency = 0;
    for (const Shot* shot : {&paths, &photons}) {
      const Sampled sampled = sample(*shot, geometry, samples, reference);
      Line line = line_of(sampled);
      line.method = shot == &paths ? "pool, small lamp, paths" : "pool, small lamp, photons";
      const double here = 1 / (sampled.error * sampled.median.cost.cpu_s);
      line.more["rel_mse"] = sampled.error;
      if (shot == &paths) {
        efficiency = here;
      } else {
        line.more["gain"] = here / efficiency;
        line.error = efficiency / here, line.gate = 1;
        line.error_of = "efficiency of paths over that of photons";
      }
      emit(line);
    }
  }
}

const Registration render_caustics_case{
    "render_caustics", "a pool with a small lamp: error and time with photons and without",
    render_caustics};

}  // namespace

}  // namespace drench::bench

// Rendering a sheet of cloth over the ground, and a pool with a small lamp: camera samples per CPU
// second, error against samples and time. What photons gain over paths, what the denoiser and
// samples by a target gain.

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>

#include "tests/bench/render_scenes.h"

namespace drench::bench {

namespace {

constexpr int picture_width = small_width, picture_height = small_height;
std::vector<int> sample_counts() { return sizes({1, 4, 16, 64, 256}, 3); }
/// A hundred times the most samples measured: 1 % of that error is the reference's own.
int reference_samples() { return 100 * sample_counts().back(); }
constexpr double most_cost = 1 / 0.3;  // CPU s per million camera samples

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

/// Sum of the colours over the film.
double light_of(const render::Film& film) {
  double sum = 0;
  for (size_t k = 0; k < film.rgba.size(); ++k)
    if (k % 4 != 3) sum += film.rgba[k];
  return sum;
}

/// Five seeds: the error is their mean, the cost that of the median.
struct Sampled {
  double error = 0;
  Render median;
  double light = 0;  // over that of the reference
};

Sampled sample(const Shot& shot, const render::FrameGeometry& geometry, int samples,
               const render::Film& reference, const render::RenderOptions& options = {}) {
  constexpr int seeds = 5;
  Sampled out;
  std::vector<Render> renders;
  for (int seed = 1; seed <= seeds; ++seed) {
    renders.push_back(render(shot, geometry, samples, uint32_t(seed), options));
    out.error += relative_mse(renders.back().film, reference) / seeds;
    out.light += light_of(renders.back().film) / light_of(reference) / seeds;
  }
  std::nth_element(renders.begin(), renders.begin() + seeds / 2, renders.end(),
                   [](const Render& a, const Render& b) { return a.cost.cpu_s < b.cost.cpu_s; });
  out.median = renders[seeds / 2];
  return out;
}

Line line_of(const Sampled& sampled) {
  Line line;
  line.method = "path tracing, depth 8";
  line.resolution =
      std::to_string(picture_width) + " x " + std::to_string(picture_height) + " pixels";
  line.threads = hardware_threads();
  line.cost = sampled.median.cost;
  const double count = double(sampled.median.stats.camera_samples);
  line.more["samples"] = sampled.median.stats.camera_samples / (picture_width * picture_height);
  line.more["samples_per_cpu_s"] = count / sampled.median.cost.cpu_s;
  line.more["rays_per_cpu_s"] = double(sampled.median.stats.rays) / sampled.median.cost.cpu_s;
  return line;
}

/// CPU s at which a straight line between the points of log error over log CPU s meets an error;
/// none if the last point does not.
std::optional<double> time_to(double error, const std::vector<Sampled>& curve) {
  for (size_t k = 1; k < curve.size(); ++k) {
    if (curve[k].error > error) continue;
    const double from = std::log(curve[k - 1].median.cost.cpu_s),
                 to = std::log(curve[k].median.cost.cpu_s);
    const double share =
        std::log(curve[k - 1].error / error) / std::log(curve[k - 1].error / curve[k].error);
    return std::exp(from + (to - from) * std::max(share, 0.));
  }
  return {};
}

void emit_curve(const Emit& emit, const std::string& name, const Shot& shot,
                const render::FrameGeometry& geometry, const render::Film& reference) {
  std::vector<double> counts, errors;
  std::vector<Sampled> curve;
  for (const int samples : sample_counts()) {
    curve.push_back(sample(shot, geometry, samples, reference));
    counts.push_back(samples);
    errors.push_back(curve.back().error);
    Line line = line_of(curve.back());
    line.method = name;
    line.error = errors.back();
    line.error_of = "relMSE against " + std::to_string(reference_samples()) + " samples";
    if (counts.size() > 1) line.more["slope"] = log_slope(counts, errors);
    emit(line);
  }
  Line line = line_of(curve.back());
  line.method = name + ", slope";
  line.error = 1 / -log_slope(counts, errors);
  line.error_of = "1 over the power of the samples that the error falls by";
  line.gate = 1;
  for (const double error : {0.01, 0.001})
    if (const std::optional<double> cpu_s = time_to(error, curve))
      line.more[fmt::format("cpu_s_to_{}", error)] = *cpu_s;
  emit(line);
}

void render_convergence(const Emit& emit) {
  const render::FrameGeometry cloth{{}, {{"cloth", pleated_sheet()}}}, pool{wavy_pool(), {}};
  emit_curve(emit, "cloth", cloth_shot(), cloth,
             render(cloth_shot(), cloth, reference_samples(), 1000).film);
  Shot paths = pool_shot();
  paths.render.photons = 0;
  emit_curve(emit, "pool, small lamp", pool_shot(), pool,
             render(paths, pool, reference_samples(), 1000).film);
}

const Registration render_convergence_case{
    "render_convergence", "error at 1 to 256 samples, its slope, CPU s to an error",
    render_convergence, InQuick::yes};

void render_cloth(const Emit& emit) {
  const render::FrameGeometry geometry{{}, {{"cloth", pleated_sheet()}}};
  // So many samples that building the scene no longer counts.
  Line line = line_of({0, render(cloth_shot(), geometry, 256, 1)});
  line.method += ", rate";
  line.error = 1e6 / line.more["samples_per_cpu_s"].get<double>();
  line.error_of = "CPU s per million camera samples";
  line.gate = most_cost;
  emit(line);
}

const Registration render_cloth_case{
    "render_cloth", "cloth over ground at depth 8: samples per CPU s", render_cloth, InQuick::yes};

/// The reference is of paths alone, in two halves, so that its own noise is known and taken off.
/// Gain: of 1 / (error x CPU s), at as many samples.
void render_caustics(const Emit& emit) {
  Shot photons = pool_shot(), paths = photons;
  paths.render.photons = 0;
  const render::FrameGeometry geometry{wavy_pool(), {}};
  render::Film reference = render(paths, geometry, reference_samples() / 2, 1000).film;
  const render::Film half = render(paths, geometry, reference_samples() / 2, 1001).film;
  const double own = relative_mse(reference, half) / 4;
  for (size_t k = 0; k < half.rgba.size(); ++k)
    reference.rgba[k] = 0.5f * (reference.rgba[k] + half.rgba[k]);
  render::RenderOptions none;
  none.walks = render::ManifoldWalks::none;
  const std::tuple<const char*, const Shot*, render::RenderOptions> ways[] = {
      {"paths", &paths, {}}, {"photons", &photons, none}, {"photons and walks", &photons, {}}};
  for (const int samples : sizes({4, 16, 64, 256}, 2)) {
    double efficiency = 0;
    for (const auto& [name, shot, options] : ways) {
      Sampled sampled = sample(*shot, geometry, samples, reference, options);
      sampled.error -= own;
      Line line = line_of(sampled);
      line.method = std::string("pool, small lamp, ") + name;
      const double here = 1 / (sampled.error * sampled.median.cost.cpu_s);
      line.more["rel_mse"] = sampled.error;
      line.more["light"] = sampled.light;
      if (shot == &paths) {
        efficiency = here;
      } else {
        line.more["gain"] = here / efficiency;
        line.error = efficiency / here, line.gate = 1;
        line.error_of = "efficiency of paths over that of " + std::string(name);
      }
      emit(line);
    }
  }
}

const Registration render_caustics_case{
    "render_caustics", "a pool with a small lamp: error and time by paths, photons and walks",
    render_caustics, InQuick::yes};

/// Relative MSE by two references of paths alone, so that their noise adds nothing.
double error_beside(const render::Film& film, const render::Film& a, const render::Film& b) {
  double sum = 0;
  for (size_t k = 0; k < film.rgba.size(); ++k) {
    if (k % 4 == 3) continue;
    const double r = 0.5 * (double(a.rgba[k]) + double(b.rgba[k]));
    sum += (double(film.rgba[k]) - a.rgba[k]) * (double(film.rgba[k]) - b.rgba[k]) / (r * r + 0.01);
  }
  return sum / (0.75 * double(film.rgba.size()));
}

/// What waves of a height leave to photons, and whether the renderer's choice errs less in its
/// time.
void render_walks(const Emit& emit) {
  constexpr int reference_spp = 6400, spp = 64, seeds = 4;
  const Shot shot = pool_shot();
  Shot paths = shot;
  paths.render.photons = 0;
  for (const float waves : {0.f, 1.f, 2.f, 4.f}) {
    const render::FrameGeometry geometry{wavy_pool(128, waves), {}};
    const render::Film a = render(paths, geometry, reference_spp, 1000).film,
                       b = render(paths, geometry, reference_spp, 1001).film;
    double least = 1e30;  // relative MSE x CPU s
    for (const auto& [name, walks] : {std::pair{"photons", render::ManifoldWalks::none},
                                      {"photons and walks", render::ManifoldWalks::some},
                                      {"what is chosen", render::ManifoldWalks::if_calm}}) {
      render::RenderOptions options;
      options.walks = walks;
      double error = 0, cpu_s = 0;
      Render last;
      for (uint32_t seed = 1; seed <= seeds; ++seed) {
        last = render(shot, geometry, spp, seed, options);
        error += error_beside(last.film, a, b) / seeds, cpu_s += last.cost.cpu_s / seeds;
      }
      Line line = line_of({error, last});
      line.method = fmt::format("pool, waves of {:.2f} m, {}", 0.03 * double(waves), name);
      line.more["rel_mse"] = error, line.more["cpu_s"] = cpu_s;
      line.more["walked"] = last.stats.walked;
      if (walks == render::ManifoldWalks::if_calm) {
        line.error = error * cpu_s / least, line.gate = 1.15;
        line.error_of = "error x time over that of the better";
      }
      least = std::min(least, error * cpu_s);
      emit(line);
    }
  }
}

const Registration render_walks_case{
    "render_walks", "pools of four heights of waves: error and time with walks and without",
    render_walks};

/// The sheet under the sky with so many lamps of as much light together: a ceiling of panels that
/// face down, or balls and disks low over the ground that face all ways.
enum class Lamps { above, low };
Shot lamps_shot(int count, Lamps where) {
  const bool low = where == Lamps::low;
  Shot shot = cloth_shot();
  Light lamp = shot.light[0];
  const Light sky = shot.light[1];
  shot.light.clear();
  lamp.group = "lamps";
  for (int k = 0; k < count; ++k) {
    const double turn = 2.39996 * k, share = std::sqrt((k + 0.5) / count);  // a golden angle on
    const double out = low ? 0.2 + 1.6 * share : 0.4 + 3 * share, up = (7 * k % 11) / 11.;
    lamp.name = fmt::format("lamp{}", k);
    lamp.center = {out * std::cos(turn), low ? 0.06 + 0.5 * up : 1.5 + 1.5 * up,
                   out * std::sin(turn)};
    lamp.u = {0.1, 0, 0};
    lamp.v = {0, 0, 0.1};
    lamp.radiance = V3f((low ? 1500.f : 800.f) / float(count));
    if (low) lamp.type = k % 2 ? LightType::sphere : LightType::disk;
    lamp.radius = k % 2 ? 0.02 + 0.01 * (k % 3) : 0.04;
    lamp.direction = {std::cos(1.7 * k), 0.6 * std::sin(5.1 * k), std::sin(1.7 * k)};
    shot.light.push_back(lamp);
  }
  shot.light.push_back(sky);
  return shot;
}

/// Error and time by the number of lamps.
void render_lamps(const Emit& emit) {
  constexpr int reference_spp = 1600, spp = 64, seeds = 4;
  const render::FrameGeometry geometry{{}, {{"cloth", pleated_sheet()}}};
  for (const Lamps where : {Lamps::above, Lamps::low}) {
    double of_one = 0;
    for (const int count : {1, 4, 16, 64, 256}) {
      const Shot shot = lamps_shot(count, where);
      const render::Film a = render(shot, geometry, reference_spp, 1000).film,
                         b = render(shot, geometry, reference_spp, 1001).film;
      double error = 0, cpu_s = 0;
      Render last;
      for (uint32_t seed = 1; seed <= seeds; ++seed) {
        last = render(shot, geometry, spp, seed);
        error += error_beside(last.film, a, b) / seeds, cpu_s += last.cost.cpu_s / seeds;
      }
      if (count == 1) of_one = cpu_s;
      Line line = line_of({error, last});
      line.method = fmt::format("{} lamps, {}", count, where == Lamps::low ? "low" : "above");
      line.more["rel_mse"] = error, line.more["cpu_s"] = cpu_s;
      line.error = cpu_s / of_one, line.gate = 5;
      line.error_of = "CPU time over that with one lamp";
      emit(line);
    }
  }
}

const Registration render_lamps_case{"render_lamps", "a sheet under 1 to 256 lamps: error and time",
                                     render_lamps};

/// Larger than the others: what lies between edges is what a denoiser lives on.
Shot larger(Shot shot) {
  shot.render.width = 192;
  shot.render.height = 108;
  return shot;
}

/// Gain: of 1 / (error x CPU s) over the noisy picture of as many samples.
void render_denoise(const Emit& emit) {
  constexpr int reference_spp = 6400;
  Shot sky = larger(pool_shot());
  sky.light.erase(sky.light.begin());
  const render::FrameGeometry cloth{{}, {{"cloth", pleated_sheet()}}}, pool{wavy_pool(), {}},
      drops{spray(), {}};
  const std::tuple<std::string, Shot, const render::FrameGeometry*> pictures[] = {
      {"cloth", larger(cloth_shot()), &cloth},
      {"pool under the sky", sky, &pool},
      {"spray against the sun", larger(spray_shot()), &drops}};
  for (const auto& [name, shot, geometry] : pictures) {
    const render::Film reference = render(shot, *geometry, reference_spp, 1000).film;
    for (const int samples : {16, 64, 256}) {
      Shot clean = shot;
      clean.render.denoise = true;
      const Sampled noisy = sample(shot, *geometry, samples, reference);
      const Sampled denoised = sample(clean, *geometry, samples, reference);
      Line line = line_of(denoised);
      line.method = name + ", denoised";
      line.resolution = "192 x 108 pixels";
      line.error = denoised.error;
      line.error_of = "relMSE against " + std::to_string(reference_spp) + " samples";
      line.more["samples"] = samples;
      line.more["noisy_rel_mse"] = noisy.error;
      line.more["light"] = denoised.light;
      line.more["noisy_light"] = noisy.light;
      line.more["noisy_cpu_s"] = noisy.median.cost.cpu_s;
      line.more["gain"] =
          noisy.error * noisy.median.cost.cpu_s / (denoised.error * denoised.median.cost.cpu_s);
      emit(line);
    }
  }
}

const Registration render_denoise_case{
    "render_denoise", "cloth, a pool under the sky, spray: error and time with the denoiser",
    render_denoise};

/// The same error with samples spread evenly would take `even_samples` as their errors' line says.
void render_adaptive(const Emit& emit) {
  constexpr int reference_spp = 25600;
  Shot shot = pool_shot();
  shot.light.erase(shot.light.begin());
  const render::FrameGeometry geometry{wavy_pool(), {}};
  const render::Film reference = render(shot, geometry, reference_spp, 1000).film;
  std::vector<double> counts, errors;
  for (const int samples : {32, 64, 128, 256, 512}) {
    counts.push_back(std::log(double(samples)));
    errors.push_back(std::log(sample(shot, geometry, samples, reference).error));
  }
  for (const double target : {1e-3, 3e-4, 1e-4}) {
    shot.render.error = target;
    const Sampled aimed = sample(shot, geometry, 1 << 14, reference);
    size_t k = 1;
    while (k + 1 < errors.size() && errors[k] > std::log(aimed.error)) ++k;
    const double along = (std::log(aimed.error) - errors[k - 1]) / (errors[k] - errors[k - 1]);
    Line line = line_of(aimed);
    line.method = "pool under the sky, to an error";
    line.error = aimed.error / target;
    line.error_of = "relMSE over its target";
    line.more["target"] = target;
    line.more["told_rel_mse"] = aimed.median.stats.relative_mse;
    line.more["even_samples"] = std::exp(counts[k - 1] + along * (counts[k] - counts[k - 1]));
    emit(line);
  }
}

const Registration render_adaptive_case{
    "render_adaptive", "a pool under the sky: error reached and samples taken by a target",
    render_adaptive};

/// Wall time by threads, the median of three pictures each.
void render_scaling(const Emit& emit) {
  constexpr int spp = 16, gated = 16;
  constexpr double least_efficiency = 0.85;
  Shot shot = cloth_shot();
  shot.render.width = 640, shot.render.height = 360;  // 920 tiles
  const render::FrameGeometry geometry{{}, {{"cloth", pleated_sheet()}}};
  double alone_s = 0;
  std::vector<int> counts;
  for (int n = 1; n < hardware_threads(); n *= 2) counts.push_back(n);
  counts.push_back(hardware_threads());
  for (const int threads : counts) {
    const tbb::global_control some(tbb::global_control::max_allowed_parallelism, size_t(threads));
    std::vector<Measured> costs;
    for (uint32_t seed = 1; seed <= 3; ++seed)
      costs.push_back(render(shot, geometry, spp, seed).cost);
    std::sort(costs.begin(), costs.end(),
              [](const Measured& a, const Measured& b) { return a.wall_s < b.wall_s; });
    if (threads == 1) alone_s = costs[1].wall_s;
    Line line;
    line.method = "sheet over ground";
    line.resolution = "640 x 360 pixels, 16 samples";
    line.threads = threads;
    line.cost = costs[1];
    line.error = costs[1].wall_s * threads / alone_s;
    line.error_of = "wall time times threads over that of one";
    if (threads == gated) line.gate = 1 / least_efficiency;
    line.more["efficiency"] = 1 / *line.error;
    emit(line);
  }
}

const Registration render_scaling_case{
    "render_scaling", "cloth over ground: wall time by threads, 0.85 of even shares at 16",
    render_scaling};

}  // namespace

}  // namespace drench::bench

// Case render_vs_cycles: error and CPU time beside Blender's Cycles on the same geometry, camera
// and lamps (cycles_scene.py), all of it grey and flat. Efficiency is 1 / (relative MSE x CPU s),
// at equal samples; the bar is how many times Cycles' it must be.
//
// The references are paths alone, with a hundred times the samples. There are two, so that their
// own noise is known: it is taken off the errors, and picture means are compared in its units.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipeline/contract/files/mesh_file.h"
#include "surfacing/surface.h"
#include "tests/bench/render_scenes.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/surfacing/scenes.h"

namespace drench::bench {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int picture_samples = 64, reference_samples = 100 * picture_samples;
constexpr int few_samples = 16, many_samples = 256;  // between them a sample's cost is measured
constexpr uint32_t seeds = 3;

struct Picture {
  std::string name;
  Shot shot;
  render::FrameGeometry geometry;
  double bar;
};

std::vector<Material> grey_materials() {
  Material water, cotton, ground, glass;
  water.name = "water", water.type = MaterialType::dielectric;
  cotton.name = "cotton", cotton.type = MaterialType::cloth;
  cotton.reflectance = V3f(0.5f), cotton.transmittance = V3f(0.2f);
  ground.name = "ground", ground.reflectance = V3f(0.35f);
  glass.name = "glass", glass.type = MaterialType::dielectric, glass.ior = 1.5;
  return {water, cotton, ground, glass};
}

/// The same with flat triangles: renderers differ in what they make of smooth normals.
TriangleMesh flat(const TriangleMesh& mesh) {
  TriangleMesh out;
  for (const auto& t : mesh.triangle) {
    const uint32_t first = uint32_t(out.position.size());
    const V3f &a = mesh.position[t.x], &b = mesh.position[t.y], &c = mesh.position[t.z];
    for (const uint32_t v : {t.x, t.y, t.z}) {
      out.position.push_back(mesh.position[v]);
      out.velocity.push_back(mesh.velocity[v]);
      out.normal.push_back((b - a).cross(c - a).normalized());
    }
    out.triangle.push_back({first, first + 1, first + 2});
  }
  return out;
}

Picture grey(std::string name, Shot shot, render::FrameGeometry geometry, double bar) {
  shot.material = grey_materials();
  shot.fluid.material = "water";
  geometry.fluid = flat(geometry.fluid);
  for (ClothFrame& cloth : geometry.cloth) cloth.mesh = flat(cloth.mesh);
  for (ObstacleFrame& obstacle : geometry.obstacle) {
    obstacle.mesh = flat(obstacle.mesh);
    shot.obstacle.emplace_back();
    shot.obstacle.back().name = obstacle.name, shot.obstacle.back().material = "glass";
  }
  for (Light& light : shot.light)
    if (light.type == LightType::environment) light.radiance = V3f(0.6f);
  return {std::move(name), std::move(shot), std::move(geometry), bar};
}

/// Of glass, over the pool and before the sheet.
TriangleMesh ball() {
  TriangleMesh mesh = test::unit_sphere(48, 96);
  for (V3f& p : mesh.position) p = p * 0.22f + V3f(0.45f, 0.75f, 0.5f);
  return mesh;
}

/// About 500,000 triangles that move by pixels in the shutter.
TriangleMesh blurred_splash() {
  constexpr double spacing = 0.012;  // m
  ParticleFrame frame = surfacing_scenes::splash(170000, spacing, 1);
  V3f middle(0);
  for (const V3f& p : frame.position) middle += p / float(frame.position.size());
  for (size_t k = 0; k < frame.position.size(); ++k) {
    const V3f away = frame.position[k] - V3f(middle.x, 0, middle.z);
    frame.position[k] = away;
    frame.velocity[k] = V3f(away.x, 0.5f * away.y, away.z) * 4.f;
  }
  return surface_frame(frame, {});
}

std::vector<Picture> pictures() {
  const std::vector<ClothFrame> cloth{{"cloth", pleated_sheet()}};
  const render::FrameGeometry pool{wavy_pool(), cloth, {{"glass", ball()}}};
  Shot sky_only = pool_shot();
  std::erase_if(sky_only.light, [](const Light& l) { return l.type != LightType::environment; });
  Shot splash = cloth_shot();
  splash.camera.position = V3d(1.5, 1.6, 3);
  splash.camera.target = V3d(0, 0.2, 0);
  return {grey("water, glass, cloth, sky, a small lamp", pool_shot(), pool, 30),
          grey("water, glass, cloth, sky only", sky_only, pool, 1.5),
          grey("cloth and ground, lamp of 1 m", cloth_shot(), {{}, cloth}, 1.5),
          grey("moving splash", splash, {blurred_splash(), {}}, 2)};
}

json vector_of(const V3d& v) { return {v.x, v.y, v.z}; }

/// The picture as cycles_scene.py reads it; meshes go beside it.
json description_of(const Picture& picture, const fs::path& folder) {
  const Shot& shot = picture.shot;
  json meshes = json::array(), lamps = json::array();
  const auto add = [&](const TriangleMesh& mesh, const Material& material) {
    const fs::path file = folder / fmt::format("{}.ply", meshes.size());
    write_mesh(file, mesh);
    constexpr std::array types{"dielectric", "cloth", "diffuse"};
    meshes.push_back({{"file", file.string()},
                      {"material",
                       {{"type", types[size_t(material.type)]},
                        {"ior", material.ior},
                        {"reflectance", material.reflectance.x},
                        {"transmittance", material.transmittance.x}}}});
  };
  if (!picture.geometry.fluid.triangle.empty()) add(picture.geometry.fluid, shot.material[0]);
  for (const ClothFrame& cloth : picture.geometry.cloth) add(cloth.mesh, shot.material[1]);
  for (const ObstacleFrame& o : picture.geometry.obstacle) add(o.mesh, shot.material[3]);
  TriangleMesh ground;
  const float half = float(shot.ground.half_size);
  for (const float z : {-half, half})
    for (const float x : {-half, half}) ground.position.push_back({x, 0, z});
  ground.velocity.resize(4, V3f(0));
  ground.triangle = {{0, 2, 1}, {1, 2, 3}};
  add(ground, shot.material[2]);
  double sky = 0;
  for (const Light& light : shot.light) {
    if (light.type == LightType::environment) sky = light.radiance.x;
    if (light.type == LightType::rectangle)
      lamps.push_back({{"center", vector_of(light.center)},
                       {"u", vector_of(light.u)},
                       {"v", vector_of(light.v)},
                       {"radiance", light.radiance.x}});
  }
  return {{"width", small_width},
          {"height", small_height},
          {"fps", shot.timeline.fps},
          {"shutter", shot.camera.shutter_close - shot.camera.shutter_open},
          {"threads", hardware_threads()},
          {"depth", shot.render.depth},
          {"sky", sky},
          {"lamps", lamps},
          {"meshes", meshes},
          {"camera",
           {{"position", vector_of(shot.camera.position.at(0))},
            {"target", vector_of(shot.camera.target.at(0))},
            {"fov_deg", shot.camera.fov_deg.at(0)}}}};
}

struct Rendered {
  render::Film film;
  double cpu_s = 0;
};

/// Cycles' picture. @throws std::runtime_error with what Blender said last if it fails.
Rendered cycles(const fs::path& folder, int samples, uint32_t seed) {
  const fs::path out = folder / "cycles.exr";
  fs::remove(out);
  const std::string command = fmt::format(
      "blender -b --factory-startup --python-exit-code 1 --python '{}/tests/bench/cycles_scene.py' "
      "-- '{}' {} {} '{}' 2>&1",
      DRENCH_SOURCE_DIR, (folder / "scene.json").string(), samples, seed, out.string());
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) throw std::runtime_error("render_vs_cycles: blender cannot be started");
  std::string line, said;
  json result;
  for (int c; (c = std::fgetc(pipe)) != EOF;) {
    line += char(c);
    if (c != '\n') continue;
    if (line.starts_with("{\"cpu_s\"")) result = json::parse(line);
    if (line.size() > 1) said = line;
    line.clear();
  }
  if (pclose(pipe) != 0 || !result.contains("cpu_s"))
    throw std::runtime_error("render_vs_cycles: Blender failed (./test --blender installs it): " +
                             said);
  return {render::read_exr(out), result["cpu_s"]};
}

Rendered ours(const Picture& picture, int samples, uint32_t seed) {
  const Render out = render(picture.shot, picture.geometry, samples, seed);
  return {out.film, out.cost.cpu_s};
}

double mean_of(const render::Film& film) {
  double sum = 0;
  for (size_t k = 0; k < film.rgba.size(); k += 4) sum += film.rgba[k];
  return 4 * sum / double(film.rgba.size());
}

render::Film mean_of(const std::vector<render::Film>& films) {
  render::Film mean = films[0];
  for (size_t k = 0; k < mean.rgba.size(); ++k) {
    double sum = 0;
    for (const render::Film& film : films) sum += film.rgba[k];
    mean.rgba[k] = float(sum / double(films.size()));
  }
  return mean;
}

/// Variance of the picture's mean of `films`' mean, from how pixels differ between them.
double variance_of_mean(const std::vector<render::Film>& films) {
  const render::Film mean = mean_of(films);
  const double n = double(films.size()), pixels = double(mean.rgba.size()) / 4;
  double sum = 0;
  for (const render::Film& film : films)
    for (size_t k = 0; k < film.rgba.size(); k += 4)
      sum += std::pow(film.rgba[k] - mean.rgba[k], 2) / (n - 1);
  return sum / n / (pixels * pixels);
}

struct Reference {
  render::Film film;
  double rel_mse = 0;   // its own
  double variance = 0;  // of the picture's mean
};

Reference reference_of(Picture picture) {
  picture.shot.render.photons = 0;
  const std::vector<render::Film> halves{ours(picture, reference_samples, 1001).film,
                                         ours(picture, reference_samples, 1002).film};
  Reference reference{mean_of(halves), 0, variance_of_mean(halves)};
  reference.rel_mse = relative_mse(halves[0], reference.film);  // half of their mean is each
  return reference;
}

struct Contender {
  double rel_mse = 0, cpu_s = 0, whole_cpu_s = 0;  // at picture_samples; without and with set-up
  double mean = 0, variance = 0;                   // of the picture; of this mean
  double off = 0, sigmas = 0;                      // from the reference's
};

template <class F>
Contender contend(const Reference& reference, F rendered) {
  Contender out;
  std::vector<render::Film> many;
  double few_s = 1e30, many_s = 1e30, usual_s = 1e30;
  for (uint32_t seed = 1; seed <= seeds; ++seed) {
    const Rendered usual = rendered(picture_samples, seed),
                   lots = rendered(many_samples, 100 + seed);
    out.rel_mse += (relative_mse(usual.film, reference.film) - reference.rel_mse) / seeds;
    usual_s = std::min(usual_s, usual.cpu_s), many_s = std::min(many_s, lots.cpu_s);
    few_s = std::min(few_s, rendered(few_samples, 200 + seed).cpu_s);
    many.push_back(lots.film);
  }
  out.cpu_s = (many_s - few_s) * picture_samples / (many_samples - few_samples);
  out.whole_cpu_s = usual_s;
  const double right = mean_of(reference.film);
  out.mean = mean_of(mean_of(many)), out.variance = variance_of_mean(many);
  out.off = out.mean / right - 1;
  out.sigmas = (out.mean - right) / std::sqrt(out.variance + reference.variance);
  return out;
}

Line line_of(const Contender& contender) {
  Line line;
  line.resolution =
      fmt::format("{} x {} pixels, {} samples", small_width, small_height, picture_samples);
  line.threads = hardware_threads();
  line.more["rel_mse"] = contender.rel_mse;
  line.more["cpu_s_of_samples"] = contender.cpu_s;
  line.more["cpu_s_with_set_up"] = contender.whole_cpu_s;
  line.more["mean_off"] = contender.off;
  line.more["mean_off_sigmas"] = contender.sigmas;
  return line;
}

void render_vs_cycles(const Emit& emit) {
  const fs::path folder = fs::temp_directory_path() / "drench_bench_cycles";
  for (const Picture& picture : pictures()) {
    fs::create_directories(folder);
    std::ofstream(folder / "scene.json") << description_of(picture, folder);
    const Reference reference = reference_of(picture);
    const Contender theirs = contend(
        reference, [&](int samples, uint32_t seed) { return cycles(folder, samples, seed); });
    const Contender own = contend(
        reference, [&](int samples, uint32_t seed) { return ours(picture, samples, seed); });
    Line line = line_of(theirs);
    line.method = picture.name + ", Cycles";
    emit(line);
    line = line_of(own);
    line.method = picture.name + ", drench";
    const double less_noise = theirs.rel_mse / own.rel_mse;
    line.more["times_cycles"] = less_noise * theirs.cpu_s / own.cpu_s;
    line.more["times_cycles_with_set_up"] = less_noise * theirs.whole_cpu_s / own.whole_cpu_s;
    line.more["reference_rel_mse"] = reference.rel_mse;
    line.error = picture.bar / line.more["times_cycles"].get<double>(), line.gate = 1;
    line.error_of = fmt::format("{} times Cycles' efficiency over ours", picture.bar);
    emit(line);
    line.method = picture.name + ", means";
    line.more = {{"off", own.mean / theirs.mean - 1}};
    line.error = std::abs(own.mean - theirs.mean) / std::sqrt(own.variance + theirs.variance);
    line.error_of = "standard deviations between ours and Cycles'", line.gate = 3;
    emit(line);
  }
  fs::remove_all(folder);
}

const Registration render_vs_cycles_case{
    "render_vs_cycles", "error and CPU time beside Blender's Cycles, four pictures",
    render_vs_cycles};

}  // namespace

}  // namespace drench::bench

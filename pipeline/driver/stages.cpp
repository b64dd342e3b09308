#include "pipeline/driver/stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/contract/files/foam_file.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/files/particles_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/geometry/subdivision.h"
#include "pipeline/driver/contact_sheet.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/movie.h"
#include "pipeline/driver/readable.h"
#include "render/denoise/noisy_frame.h"
#include "render/display/view_transform.h"
#include "render/renderer.h"
#include "render/scene/scene_cache.h"
#include "surfacing/foam.h"
#include "surfacing/surface.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

StageReport report_of(const StepReport& step, const std::string& device) {
  StageReport report;
  json drained = json::object();
  for (const auto& [sink, count] : step.drained) drained[sink] = count;
  report.json = json{{"device", device},
                     {"steps", step.steps},
                     {"cloth_substeps", step.cloth_substeps},
                     {"time", step.time},
                     {"smallest_dt", step.smallest_dt},
                     {"largest_dt", step.largest_dt},
                     {"limit", step.limit},
                     {"particles", step.particles},
                     {"near", step.near},
                     {"max_speed", step.max_speed},
                     {"mean_compression", step.mean_compression},
                     {"max_compression", step.max_compression},
                     {"kinetic_energy", step.kinetic_energy},
                     {"momentum", step.momentum},
                     {"iterations", step.iterations},
                     {"unconverged", step.unconverged},
                     {"viscous_iterations", step.viscous_iterations},
                     {"sheet_sweeps", step.sheet_sweeps},
                     {"sheets_asleep", step.sheets_asleep},
                     {"sheets_cut_short", step.sheets_cut_short},
                     {"water_in_cloth", step.water_in_cloth},
                     {"sheet_contacts", step.cloth_contacts.sheets},
                     {"obstacle_contacts", step.cloth_contacts.obstacles},
                     {"viscous_unconverged", step.viscous_unconverged},
                     {"drained", drained},
                     {"emitted", step.emitted},
                     {"lost", step.lost},
                     {"state_mib", double(step.memory) / (1 << 20)},
                     {"guard_hits", step.guard_hits}}
                    .dump();
  report.line =
      fmt::format("steps={} cloth_substeps={} limit=\"{}\" particles={} max_speed={:.3g}",
                  step.steps, step.cloth_substeps, step.limit, step.particles, step.max_speed);
  const auto& [sheets, obstacles] = step.cloth_contacts;
  if (sheets > 0) report.line += fmt::format(" sheet_contacts={}", sheets);
  if (obstacles > 0) report.line += fmt::format(" obstacle_contacts={}", obstacles);
  if (step.sheets_asleep > 0) report.line += fmt::format(" asleep={}", step.sheets_asleep);
  if (step.emitted > 0) report.line += fmt::format(" emitted={}", step.emitted);
  for (const auto& [sink, count] : step.drained) {
    if (count > 0) report.line += fmt::format(" {}={}", sink, count);
  }
  if (step.lost > 0) report.line += fmt::format(" lost={}", step.lost);
  return report;
}

/// Of a closed surface, m^3.
double enclosed_volume(const TriangleMesh& mesh) {
  double six = 0;
  for (const auto& t : mesh.triangle) {
    const Imath::V3d a(mesh.position[t.x]), b(mesh.position[t.y]), c(mesh.position[t.z]);
    six += a.dot(b.cross(c));
  }
  return six / 6;
}

/// Of the keys of all that a frame is made from.
Digest digest_of(const Attributes& attributes) {
  Hasher hasher;
  for (const auto& [name, value] : attributes) hasher.text(name).text(value);
  return hasher.finish();
}

class ShotSimulation final : public Simulation {
 public:
  ShotSimulation(const Shot& shot, const SimulatorOptions& options)
      : simulator_(shot, options), fluid_(shot.fluid.present()) {}

  int frame() const override { return simulator_.frame(); }
  double share_of_frame() const override { return simulator_.share_of_frame(); }
  void preroll(const std::function<bool()>& keep_going) override { simulator_.preroll(keep_going); }
  StageReport advance(const std::function<bool()>& keep_going) override {
    const StepReport step = simulator_.advance_frame(keep_going);
    return report_of(step, simulator_.device_name());
  }
  std::vector<WrittenFile> write_frame(const fs::path& folder) const override {
    std::vector<WrittenFile> files;
    if (fluid_) {
      files.push_back(write_particles(folder / layout::particles(frame()), simulator_.particles()));
    }
    for (const ClothFrame& cloth : simulator_.cloth()) {
      files.push_back(write_mesh(folder / layout::cloth(cloth.name, frame()), cloth.mesh));
    }
    return files;
  }
  std::vector<WrittenFile> write_probes(const fs::path& folder) const override {
    std::vector<WrittenFile> files;
    for (const ProbeText& probe : simulator_.probes())
      files.push_back(write_file_whole(folder / layout::probe(probe.name), probe.csv));
    return files;
  }
  WrittenFile write_checkpoint(const fs::path& file) const override {
    return simulator_.write_checkpoint(file);
  }
  void read_checkpoint(const fs::path& file) override { simulator_.read_checkpoint(file); }

 private:
  Simulator simulator_;
  bool fluid_;
};

/// As it is meshed and drawn. Contact keeps it half its thickness from what it meets.
TriangleMesh sheet_of(const Cloth& cloth, const fs::path& folder, int frame) {
  const TriangleMesh mesh = read_mesh(folder / layout::cloth(cloth.name, frame));
  const int levels =
      cloth.subdivision < 0 ? automatic_levels(mesh.triangle.size()) : cloth.subdivision;
  return subdivided(mesh, levels, float(cloth.thickness / 2));
}

class ShotStages final : public Stages {
 public:
  ShotStages(const Shot& shot, const StageOptions& options)
      : shot_(shot),
        options_(options),
        cache_(std::make_shared<render::SceneCache>(
            render::PictureMemory::within(options.memory_gib))) {
    if (options.memory_gib > 0) {
      shot_.surface.memory_gib = std::min(shot_.surface.memory_gib, options.memory_gib);
    }
  }

  std::unique_ptr<Simulation> start_simulation() override {
    SimulatorOptions options;
    options.device = options_.device;
    options.level_set = level_sets_within(options_.memory_gib);
    return std::make_unique<ShotSimulation>(shot_, options);
  }

  StageReport mesh(const fs::path& folder, int frame) override {
    const ParticleFrame particles = read_particles(folder / layout::particles(frame));
    std::vector<TriangleMesh> sheets, obstacles;
    for (const Cloth& cloth : shot_.cloth) sheets.push_back(sheet_of(cloth, folder, frame));
    for (const Obstacle& obstacle : shot_.obstacle)
      obstacles.push_back(obstacle_surface(shot_, obstacle, frame));
    Surroundings around{sheets, obstacles, {}};
    if (shot_.ground.present) around.ground = float(shot_.ground.height);
    SurfaceStats stats;
    const TriangleMesh surface =
        surface_frame(particles, shot_.surface, around, InteriorBlocks::skip, &stats);
    StageReport report;
    report.files.push_back(write_mesh(folder / layout::fluid_mesh(frame), surface));
    if (shot_.surface.obj) {
      report.files.push_back(write_obj(folder / layout::fluid_obj(frame), surface));
    }
    if (shot_.surface.level_set) {
      report.files.push_back(write_level_set(folder / layout::level_set(frame), surface,
                                             shot_.surface.voxel * particles.spacing));
    }
    report.json = json{{"particles", particles.position.size()},
                       {"vertices", surface.position.size()},
                       {"triangles", surface.triangle.size()},
                       {"surface_l", 1000 * enclosed_volume(surface)},
                       {"particles_l", 1000 * double(particles.position.size()) *
                                           std::pow(double(particles.spacing), 3)},
                       {"contact", stats.contact},
                       {"crossing", stats.crossing}}
                      .dump();
    report.line = fmt::format("particles={} triangles={}", particles.position.size(),
                              surface.triangle.size());
    return report;
  }

  StageReport foam(const fs::path& folder, int frame) override {
    FoamStats stats;
    FoamFrame foam = no_foam(shot_);
    if (frame != shot_.timeline.first) {
      foam = foam_frame(shot_, frame, read_foam(folder / layout::foam(frame - 1)),
                        read_particles(folder / layout::particles(frame - 1)),
                        read_particles(folder / layout::particles(frame)),
                        level_sets_within(options_.memory_gib), &stats);
    }
    StageReport report;
    report.files.push_back(write_foam(folder / layout::foam(frame), foam));
    report.json =
        json{{"spray", stats.spray},      {"foam", stats.foam}, {"bubbles", stats.bubbles},
             {"born", stats.born},        {"died", stats.died}, {"lost", stats.lost},
             {"substeps", stats.substeps}}
            .dump();
    report.line = fmt::format("spray={} foam={} bubbles={} born={}", stats.spray, stats.foam,
                              stats.bubbles, stats.born);
    return report;
  }

  StageReport render(const fs::path& folder, int frame, const Attributes& attributes,
                     const std::function<void(double)>& progress) override {
    render::FrameGeometry geometry;
    if (shot_.fluid.present()) geometry.fluid = read_mesh(folder / layout::fluid_mesh(frame));
    if (shot_.foam.present && shot_.fluid.present())
      geometry.foam = read_foam(folder / layout::foam(frame));
    for (const Cloth& cloth : shot_.cloth)
      geometry.cloth.push_back({cloth.name, sheet_of(cloth, folder, frame)});
    for (const Obstacle& obstacle : shot_.obstacle) {
      if (obstacle.visible)
        geometry.obstacle.push_back({obstacle.name, obstacle_surface(shot_, obstacle, frame)});
    }
    render::RenderStats stats;
    render::RenderOptions options;
    options.cache = cache_;
    options.checkpoint.file = folder / layout::frame_samples(shot_.name, frame);
    options.checkpoint.inputs = digest_of(attributes);
    const bool later = shot_.render.denoise && shot_.render.denoise_frames > 0;
    if (later) options.denoised = render::Denoised::later;
    if (options_.progressive) options.refined = picture_of(folder, frame);
    const render::Film film =
        render::render_frame(shot_, frame, geometry, options, &stats, progress);
    if (options.refined) options.refined(film);
    Attributes all = attributes;
    all.emplace_back("seed", std::to_string(shot_.render.seed));
    all.emplace_back("samples", std::to_string(shot_.render.samples));
    if (shot_.render.error > 0)
      all.emplace_back("relative_mse", fmt::format("{:.3g}", stats.relative_mse));
    all.emplace_back("photons", fmt::format("{}", shot_.render.photons));
    if (stats.photon_radius > 0)  // the one part of a frame that is biased
      all.emplace_back("photon_radius_m", fmt::format("{:.3g}", stats.photon_radius));
    StageReport report;
    const std::string file =
        later ? layout::noisy(shot_.name, frame) : layout::image(shot_.name, frame);
    report.files.push_back(render::write_exr(folder / file, film, all));
    fs::remove(options.checkpoint.file);
    report.json = json{
        {"camera_samples", stats.camera_samples},
        {"rays", stats.rays},
        {"relative_mse", stats.relative_mse},
        {"photon_error", stats.photon_error},
        {"photon_radius", stats.photon_radius},
        {"walked", stats.walked},
        {"cpu_s",
         stats.cpu_s}}.dump();
    report.line = fmt::format("camera_samples={} rays={} relative_mse={:.2g}", stats.camera_samples,
                              stats.rays, stats.relative_mse);
    if (shot_.render.error > 0 && stats.photon_error > shot_.render.error / 2)
      report.line += fmt::format(
          " photon_error={:.2g}: samples alone do not bring render.error, raise render.photons",
          stats.photon_error);
    return report;
  }

  StageReport denoise(const fs::path& folder, int frame, const NoisyFiles& noisy,
                      const Attributes& attributes) override {
    const auto paths = [&](const std::vector<std::string>& files) {
      std::vector<fs::path> out;
      for (const std::string& file : files) out.push_back(folder / file);
      return out;
    };
    const render::Film film = render::denoised_film(folder / noisy.frame, paths(noisy.before),
                                                    paths(noisy.after), shot_.render.denoiser);
    StageReport report;
    report.files.push_back(
        render::write_exr(folder / layout::image(shot_.name, frame), film, attributes));
    report.json = json{{"before", noisy.before.size()}, {"after", noisy.after.size()}}.dump();
    report.line = fmt::format("before={} after={}", noisy.before.size(), noisy.after.size());
    return report;
  }

  StageReport contact_sheet(const fs::path& folder, const std::vector<int>& frames) override {
    StageReport report;
    report.files.push_back(write_contact_sheet(
        folder / layout::contact_sheet, images(folder, frames), render::ViewTransform(shot_.view)));
    return report;
  }

  StageReport movie(const fs::path& folder, const std::vector<int>& frames,
                    const std::function<bool()>& keep_going) override {
    StageReport report;
    report.files.push_back(write_movie(folder / layout::movie(shot_.name), images(folder, frames),
                                       shot_.timeline.fps, keep_going,
                                       render::ViewTransform(shot_.view)));
    return report;
  }

  std::string why_unreadable(const fs::path& file) const override {
    return drench::why_unreadable(file);
  }

 private:
  /// Writes the picture of a frame in work.
  std::function<void(const render::Film&)> picture_of(const fs::path& folder, int frame) const {
    return [view = render::ViewTransform(shot_.view),
            file = folder / layout::refining(shot_.name, frame)](const render::Film& film) {
      render::write_png(file, film.width, film.height, view(film));
    };
  }

  std::vector<NumberedImage> images(const fs::path& folder, const std::vector<int>& frames) const {
    std::vector<NumberedImage> result;
    for (const int frame : frames) {
      result.push_back({frame, folder / layout::image(shot_.name, frame)});
    }
    return result;
  }

  Shot shot_;
  StageOptions options_;
  const std::shared_ptr<render::SceneCache> cache_;
};

}  // namespace

std::vector<std::string> NoisyFiles::all() const {
  std::vector<std::string> files{frame};
  files.insert(files.end(), before.begin(), before.end());
  files.insert(files.end(), after.begin(), after.end());
  return files;
}

std::unique_ptr<Stages> shot_stages(const Shot& shot, const StageOptions& options) {
  return std::make_unique<ShotStages>(shot, options);
}

}  // namespace drench

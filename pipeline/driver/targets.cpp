#include "pipeline/driver/targets.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

#include "build_id.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/movie.h"
#include "render/denoise/oidn.h"
#include "render/display/view_transform.h"

namespace drench {

namespace {

/// A digest of each top-level section of the resolved shot: names what changed, decides nothing.
KeyParts sections_of(const Shot& shot, std::initializer_list<std::string_view> names) {
  const toml::table lock = toml::parse(shot_lock(shot));
  KeyParts parts;
  for (const std::string_view name : names) {
    const toml::node* node = lock.get(name);
    if (!node) continue;
    std::ostringstream text;
    node->visit([&](const auto& value) { text << value; });
    const std::string bytes = text.str();
    parts[std::string(name)] = short_hex(hash_bytes(bytes.data(), bytes.size()));
  }
  return parts;
}

/// Collects what a stage depends on into one digest and names its parts.
class StageKeyBuilder {
 public:
  StageKeyBuilder(std::string_view stage, std::string_view build, KeyParts sections)
      : parts_(std::move(sections)) {
    hasher_.text(stage).text(build);
    parts_["program"] = std::string(build.substr(0, 8));
  }
  StageKeyBuilder& settings(const Digest& digest) {
    hasher_.digest(digest);
    return *this;
  }
  StageKeyBuilder& number(std::string_view name, double value) {
    hasher_.text(name).value(value);
    return *this;
  }
  StageKeyBuilder& device(const std::string& name) {
    hasher_.text(name);
    parts_["device"] = name;
    return *this;
  }
  /// Nothing if there is no text.
  StageKeyBuilder& part(const std::string& name, const std::string& text) {
    if (text.empty()) return *this;
    hasher_.text(name).text(text);
    parts_[name] = short_hex(hash_bytes(text.data(), text.size()));
    return *this;
  }
  StageKeyBuilder& file(const std::filesystem::path& path) {
    if (path.empty()) return *this;
    const Digest digest = hash_file(path);
    hasher_.digest(digest);
    parts_[path.filename().string()] = short_hex(digest);
    return *this;
  }
  StageKey finish() { return {hasher_.finish(), std::move(parts_)}; }

 private:
  Hasher hasher_;
  KeyParts parts_;
};

void add_obstacle_meshes(const Shot& shot, StageKeyBuilder& builder) {
  for (const Obstacle& obstacle : shot.obstacle)
    if (!is_sequence(obstacle.mesh_file)) builder.file(obstacle.mesh_file);
}

void add_source_meshes(const Shot& shot, StageKeyBuilder& builder) {
  for (const FluidEmitter& emitter : shot.fluid.emitter) builder.file(emitter.mesh_file);
  for (const FluidVolume& volume : shot.fluid.volume) builder.file(volume.mesh_file);
  for (const Sink& sink : shot.sink) builder.file(sink.shape.mesh_file);
}

/// Of the files of a frame, and of the first, by whose polygons all are cut.
std::map<int, Digest> sequence_digests(const Shot& shot) {
  std::map<int, Digest> digests;
  Hasher first;
  for (const Obstacle& obstacle : shot.obstacle)
    if (is_sequence(obstacle.mesh_file))
      first.digest(hash_file(sequence_file(obstacle.mesh_file, shot.timeline.first)));
  const Digest of_first = first.finish();
  for (int frame = shot.timeline.first; frame <= shot.timeline.last; ++frame) {
    Hasher hasher;
    hasher.digest(of_first);
    bool any = false;
    for (const Obstacle& obstacle : shot.obstacle) {
      if (!is_sequence(obstacle.mesh_file)) continue;
      hasher.digest(hash_file(sequence_file(obstacle.mesh_file, frame)));
      any = true;
    }
    if (any) digests[frame] = hasher.finish();
  }
  return digests;
}

StageKey simulate_key(const Shot& shot, const std::string& device_class) {
  StageKeyBuilder builder("simulate", build_id::simulate,
                          sections_of(shot, {"shot", "domain", "fluid", "cloth", "obstacle", "sink",
                                             "wind", "coupling", "probe"}));
  builder.settings(stage_settings_digest(shot, Stage::simulate))
      .number("fps", shot.timeline.fps)
      .number("first", shot.timeline.first)
      .device(device_class);
  for (const Cloth& cloth : shot.cloth) builder.file(cloth.mesh_file);
  add_obstacle_meshes(shot, builder);
  add_source_meshes(shot, builder);
  return builder.finish();
}

/// Walls, obstacles, gravity, spacing and seed are the simulation's: all its settings but
/// the probes stand for them.
StageKey foam_key(const Shot& shot) {
  Shot physics = shot;
  physics.probe.clear();
  return StageKeyBuilder("foam", build_id::mesh,
                         sections_of(shot, {"shot", "domain", "fluid", "cloth", "obstacle", "sink",
                                            "wind", "coupling", "foam"}))
      .settings(stage_settings_digest(physics, Stage::simulate))
      .settings(stage_settings_digest(shot, Stage::foam))
      .number("fps", shot.timeline.fps)
      .number("first", shot.timeline.first)
      .finish();
}

StageKey mesh_key(const Shot& shot) {
  StageKeyBuilder builder("mesh", build_id::mesh,
                          sections_of(shot, {"surface", "cloth", "obstacle", "ground"}));
  builder.settings(stage_settings_digest(shot, Stage::mesh));
  add_obstacle_meshes(shot, builder);
  return builder.finish();
}

/// The release of the library that denoises; "" without one.
/// @throws Error if it is not there, before anything is made
std::string denoiser_release(const Shot& shot) {
  if (!shot.render.denoise || shot.render.denoiser != Denoiser::oidn) return "";
  return fmt::format("oidn {}", render::OpenImageDenoise().version());
}

/// @param denoiser  "" if rendering does not denoise, or by what is built in
StageKey render_key(const Shot& shot, const std::string& denoiser) {
  StageKeyBuilder builder(
      "render", build_id::render,
      sections_of(shot, {"cloth", "obstacle", "camera", "light", "material", "ground", "render"}));
  builder.settings(stage_settings_digest(shot, Stage::render))
      .number("fps", shot.timeline.fps)
      .number("first", shot.timeline.first);
  for (const Light& light : shot.light) builder.file(light.map);
  for (const Material& material : shot.material)
    builder.file(material.texture).file(material.normal_map);
  add_obstacle_meshes(shot, builder);
  for (const Obstacle& obstacle : shot.obstacle)
    if (obstacle.type == ObstacleType::plane)  // is drawn as wide as the domain
      builder.number("domain", (shot.domain.max - shot.domain.min).length());
  if (!denoiser.empty()) builder.part("denoiser", denoiser);
  return builder.finish();
}

StageKey denoise_key(const Shot& shot, const std::string& denoiser) {
  return StageKeyBuilder("denoise", build_id::render, {})
      .settings(stage_settings_digest(shot, Stage::denoise))
      .part("denoise_frames", std::to_string(shot.render.denoise_frames))
      .part("denoiser", denoiser)
      .finish();
}

StageKey dailies_key(const Shot& shot) {
  return StageKeyBuilder("dailies", build_id::dailies, {})
      .number("fps", shot.timeline.fps)
      .part("view", render::ViewTransform(shot.view).key())
      .finish();
}

}  // namespace

std::string short_hex(const Digest& digest) { return digest.hex().substr(0, 8); }

bool Targets::includes(Step step) const {
  return std::find(steps.begin(), steps.end(), step) != steps.end();
}

bool Targets::includes(int frame) const {
  return std::binary_search(frames.begin(), frames.end(), frame);
}

Targets targets_of(const Shot& shot, std::vector<int> frames, std::vector<Step> steps,
                   const std::string& device_class) {
  Targets targets;
  targets.shot = shot.name;
  targets.first = shot.timeline.first;
  targets.frames = std::move(frames);
  targets.steps = std::move(steps);
  targets.fluid = shot.fluid.present();
  targets.obj = targets.fluid && shot.surface.obj;
  targets.level_set = targets.fluid && shot.surface.level_set;
  for (const Cloth& cloth : shot.cloth) targets.cloth.push_back(cloth.name);
  targets.sequence = sequence_digests(shot);
  for (const Probe& probe : shot.probe) targets.probe.push_back(probe.name);
  targets.simulate = simulate_key(shot, device_class);
  targets.obstacles_move =
      std::any_of(shot.obstacle.begin(), shot.obstacle.end(), [](const Obstacle& o) {
        return o.position.keys.size() > 1 || o.rotation_deg.keys.size() > 1 ||
               is_sequence(o.mesh_file);
      });
  targets.mesh = mesh_key(shot);
  targets.has_foam = targets.fluid && shot.foam.present;
  if (targets.has_foam) targets.foam = foam_key(shot);
  const std::string denoiser = targets.includes(Step::render) ? denoiser_release(shot) : "";
  targets.denoised_later = shot.render.denoise && shot.render.denoise_frames > 0;
  targets.render = render_key(shot, targets.denoised_later ? "" : denoiser);
  if (targets.denoised_later) targets.denoise = denoise_key(shot, denoiser);
  if (targets.denoised_later && shot.render.denoiser == Denoiser::regression)
    targets.denoise_frames = shot.render.denoise_frames;
  if (targets.includes(Step::contact_sheet) || targets.includes(Step::movie))
    targets.dailies = dailies_key(shot);  // who shows nothing needs no OpenColorIO
  targets.has_ffmpeg = find_ffmpeg().has_value();
  return targets;
}

}  // namespace drench

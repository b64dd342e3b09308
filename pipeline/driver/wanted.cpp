#include "pipeline/driver/wanted.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

#include "build_id.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/movie.h"
#include "render/denoise/oidn.h"
#include "render/display/view_transform.h"

namespace drench {

namespace {

std::string short_hex(const Digest& digest) { return digest.hex().substr(0, 8); }

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
                          sections_of(shot, {"surface", "obstacle", "ground"}));
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
      sections_of(shot, {"obstacle", "camera", "light", "material", "ground", "render"}));
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

std::string_view step_name(Step step) {
  switch (step) {
    case Step::simulate:
      return "simulate";
    case Step::mesh:
      return "mesh";
    case Step::foam:
      return "foam";
    case Step::render:
      return "render";
    case Step::denoise:
      return "denoise";
    case Step::contact_sheet:
      return "contact sheet";
    case Step::movie:
      return "movie";
  }
  return "";
}

bool Wanted::may(Step step) const {
  return std::find(steps.begin(), steps.end(), step) != steps.end();
}

bool Wanted::wants(int frame) const {
  return std::binary_search(frames.begin(), frames.end(), frame);
}

Wanted want(const Shot& shot, std::vector<int> frames, std::vector<Step> steps,
            const std::string& device_class) {
  Wanted wanted;
  wanted.shot = shot.name;
  wanted.first = shot.timeline.first;
  wanted.frames = std::move(frames);
  wanted.steps = std::move(steps);
  wanted.fluid = shot.fluid.present();
  wanted.obj = wanted.fluid && shot.surface.obj;
  wanted.level_set = wanted.fluid && shot.surface.level_set;
  for (const Cloth& cloth : shot.cloth) wanted.cloth.push_back(cloth.name);
  wanted.sequence = sequence_digests(shot);
  for (const Probe& probe : shot.probe) wanted.probe.push_back(probe.name);
  wanted.simulate = simulate_key(shot, device_class);
  wanted.obstacles_move =
      std::any_of(shot.obstacle.begin(), shot.obstacle.end(), [](const Obstacle& o) {
        return o.position.keys.size() > 1 || o.rotation_deg.keys.size() > 1 ||
               is_sequence(o.mesh_file);
      });
  wanted.mesh = mesh_key(shot);
  wanted.has_foam = wanted.fluid && shot.foam.present;
  if (wanted.has_foam) wanted.foam = foam_key(shot);
  const std::string denoiser = wanted.may(Step::render) ? denoiser_release(shot) : "";
  wanted.denoised_later = shot.render.denoise && shot.render.denoise_frames > 0;
  wanted.render = render_key(shot, wanted.denoised_later ? "" : denoiser);
  if (wanted.denoised_later) wanted.denoise = denoise_key(shot, denoiser);
  if (wanted.denoised_later && shot.render.denoiser == Denoiser::regression)
    wanted.denoise_frames = shot.render.denoise_frames;
  if (wanted.may(Step::contact_sheet) || wanted.may(Step::movie))
    wanted.dailies = dailies_key(shot);  // who shows nothing needs no OpenColorIO
  wanted.has_ffmpeg = find_ffmpeg().has_value();
  return wanted;
}

std::vector<std::string> simulated_files(const Wanted& wanted, int frame) {
  std::vector<std::string> files;
  if (wanted.fluid) files.push_back(layout::particles(frame));
  for (const std::string& name : wanted.cloth) files.push_back(layout::cloth(name, frame));
  return files;
}

std::vector<std::string> probe_files(const Wanted& wanted) {
  std::vector<std::string> files;
  for (const std::string& name : wanted.probe) files.push_back(layout::probe(name));
  return files;
}

std::vector<std::string> mesh_files(const Wanted& wanted, int frame) {
  std::vector<std::string> files;
  if (wanted.fluid) files.push_back(layout::fluid_mesh(frame));
  if (wanted.obj) files.push_back(layout::fluid_obj(frame));
  if (wanted.level_set) files.push_back(layout::level_set(frame));
  return files;
}

std::vector<std::string> foam_inputs(const Wanted& wanted, int frame) {
  if (frame == wanted.first) return {layout::particles(frame)};
  return {layout::particles(frame - 1), layout::particles(frame), layout::foam(frame - 1)};
}

std::vector<std::string> render_inputs(const Wanted& wanted, int frame) {
  std::vector<std::string> files;
  if (wanted.fluid) files.push_back(layout::fluid_mesh(frame));
  if (wanted.has_foam) files.push_back(layout::foam(frame));
  for (const std::string& name : wanted.cloth) files.push_back(layout::cloth(name, frame));
  return files;
}

std::string render_file(const Wanted& wanted, int frame) {
  return wanted.denoised_later ? layout::noisy(wanted.shot, frame)
                               : layout::image(wanted.shot, frame);
}

InputDigests sequence_inputs(const Wanted& wanted, int first, int last) {
  InputDigests inputs;
  for (auto at = wanted.sequence.lower_bound(first);
       at != wanted.sequence.end() && at->first <= last; ++at)
    inputs.emplace_back("obstacles of frame " + std::to_string(at->first), at->second);
  return inputs;
}

std::vector<Digest> simulation_keys(const Wanted& wanted, int last) {
  std::vector<Digest> keys;
  Digest before;
  for (int frame = wanted.first; frame <= last; ++frame) {
    Hasher hasher;
    hasher.text("simulate").digest(wanted.simulate.digest).value(frame).digest(before);
    // A checkpoint may stand between this frame and the next.
    for (const auto& [name, digest] : sequence_inputs(wanted, frame, frame + 1))
      hasher.digest(digest);
    before = hasher.finish();
    keys.push_back(before);
  }
  return keys;
}

Key step_key(const StageKey& stage, Step step, int frame, const InputDigests& inputs) {
  Key key{{}, stage.parts};
  Hasher hasher;
  hasher.text(step_name(step)).digest(stage.digest).value(frame);
  for (const auto& [name, digest] : inputs) {
    hasher.text(name).digest(digest);
    key.parts[name] = short_hex(digest);
  }
  key.digest = hasher.finish();
  return key;
}

}  // namespace drench

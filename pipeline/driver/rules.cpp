#include "pipeline/driver/rules.h"

#include <algorithm>

#include "pipeline/driver/layout.h"

namespace drench {

namespace {

using Files = std::vector<std::string>;

Files particles(const Targets& targets, int frame) {
  return targets.fluid ? Files{layout::particles(frame)} : Files{};
}

Files sheets(const Targets& targets, int frame) {
  Files files;
  for (const std::string& name : targets.cloth) files.push_back(layout::cloth(name, frame));
  return files;
}

Files fluid_mesh(const Targets& targets, int frame) {
  return targets.fluid ? Files{layout::fluid_mesh(frame)} : Files{};
}

Files all_meshes(const Targets& targets, int frame) {
  Files files = fluid_mesh(targets, frame);
  if (targets.obj) files.push_back(layout::fluid_obj(frame));
  if (targets.level_set) files.push_back(layout::level_set(frame));
  return files;
}

Files foam(const Targets& targets, int frame) {
  return targets.has_foam ? Files{layout::foam(frame)} : Files{};
}

Files rendered(const Targets& targets, int frame) { return {render_file(targets, frame)}; }

Files rendered_image(const Targets& targets, int frame) {
  return targets.denoised_later ? Files{} : Files{layout::image(targets.shot, frame)};
}

Files denoised_image(const Targets& targets, int frame) {
  return targets.denoised_later ? Files{layout::image(targets.shot, frame)} : Files{};
}

Files contact_sheet(const Targets&, int) { return {std::string(layout::contact_sheet)}; }
Files movie(const Targets& targets, int) { return {layout::movie(targets.shot)}; }

constexpr Condition has_fluid{[](const Targets& t) { return t.fluid; }, "no fluid"};
constexpr Condition has_foam{[](const Targets& t) { return t.has_foam; }, ""};
constexpr Condition denoised_later{[](const Targets& t) { return t.denoised_later; }, ""};
constexpr Condition several_frames{[](const Targets& t) { return t.frames.size() > 1; },
                                   "a single frame"};
constexpr Condition has_ffmpeg{[](const Targets& t) { return t.has_ffmpeg; },
                               "ffmpeg is not installed"};

std::vector<Rule> make_rules() {
  return {
      {.step = Step::mesh,
       .frames = Frames::delivered,
       .when = {has_fluid},
       .inputs = {{.step = Step::simulate, .files = simulated_files}},
       .outputs = all_meshes,
       .settings = &Targets::mesh,
       .obstacles = Offsets{0, 0},
       .inputs_missing = "the caches of frame {} are missing",
       .used_as_they_are = "the meshes of frames {} were made with other settings; they are used "
                           "as they are. `drench mesh` brings them up to date"},

      {.step = Step::foam,
       .frames = Frames::from_first,
       .when = {has_foam},
       .inputs = {{.step = Step::simulate, .files = particles, .frames = {-1, 0}},
                  {.step = Step::foam, .files = foam, .frames = {-1, -1}}},
       .outputs = foam,
       .settings = &Targets::foam,
       .obstacles = Offsets{0, 0},
       .inputs_missing = "what the foam of frame {} is made of is missing"},

      {.step = Step::render,
       .frames = Frames::delivered,
       .when = {},
       .inputs = {{.step = Step::mesh, .files = fluid_mesh},
                  {.step = Step::foam, .files = foam},
                  {.step = Step::simulate, .files = sheets}},
       .outputs = rendered,
       .settings = &Targets::render,
       .obstacles = Offsets{-1, 1},  // their velocities come from the frames on both sides
       .inputs_missing = "the meshes of frame {} are missing"},

      {.step = Step::denoise,
       .frames = Frames::with_neighbours,
       .when = {denoised_later},
       .inputs = {{.step = Step::render,
                   .files = rendered,
                   .neighbours = &Targets::denoise_frames}},
       .outputs = denoised_image,
       .settings = &Targets::denoise,
       .obstacles = {},
       .inputs_missing = "the noisy frame {} is missing"},

      {.step = Step::contact_sheet,
       .frames = Frames::once,
       .when = {},
       .inputs = {{.step = Step::render, .files = rendered_image},
                  {.step = Step::denoise, .files = denoised_image}},
       .outputs = contact_sheet,
       .settings = &Targets::dailies,
       .obstacles = {},
       .inputs_missing = "a rendered frame is missing"},

      {.step = Step::movie,
       .frames = Frames::once,
       .when = {several_frames, has_ffmpeg},
       .inputs = {{.step = Step::render, .files = rendered_image},
                  {.step = Step::denoise, .files = denoised_image}},
       .outputs = movie,
       .settings = &Targets::dailies,
       .obstacles = {},
       .inputs_missing = "a rendered frame is missing"},
  };
}

}  // namespace

const std::vector<Rule>& rules() {
  static const std::vector<Rule> table = make_rules();
  return table;
}

const Rule& rule_of(Step step) {
  return *std::find_if(rules().begin(), rules().end(),
                       [&](const Rule& rule) { return rule.step == step; });
}

bool is_per_frame(Step step) {
  return step == Step::simulate || rule_of(step).frames != Frames::once;
}

std::optional<std::string_view> reason_to_skip(const Rule& rule, const Targets& targets) {
  for (const Condition& condition : rule.when)
    if (!condition.holds(targets)) return condition.otherwise;
  return {};
}

bool is_active(const Rule& rule, const Targets& targets) {
  return targets.includes(rule.step) && !reason_to_skip(rule, targets);
}

std::vector<std::string> simulated_files(const Targets& targets, int frame) {
  Files files = particles(targets, frame);
  for (std::string& sheet : sheets(targets, frame)) files.push_back(std::move(sheet));
  return files;
}

std::vector<std::string> probe_files(const Targets& targets) {
  Files files;
  for (const std::string& name : targets.probe) files.push_back(layout::probe(name));
  return files;
}

std::string render_file(const Targets& targets, int frame) {
  return targets.denoised_later ? layout::noisy(targets.shot, frame)
                                : layout::image(targets.shot, frame);
}

std::vector<int> frames_read(const Rule& rule, const Input& input, const Targets& targets,
                             int frame) {
  if (rule.frames == Frames::once) return targets.frames;
  std::vector<int> frames;
  for (int k = input.frames.first; k <= input.frames.last; ++k)
    if (frame + k >= targets.first) frames.push_back(frame + k);
  return frames;
}

std::vector<int> possible_frames(const Rule& rule, const Input& input, const Targets& targets,
                                 int frame) {
  std::vector<int> frames = frames_read(rule, input, targets, frame);
  const int reach = input.neighbours ? targets.*input.neighbours : 0;
  for (int k = 1; k <= reach; ++k) frames.insert(frames.end(), {frame - k, frame + k});
  return frames;
}

std::vector<std::string> possible_inputs(const Rule& rule, const Targets& targets, int frame) {
  Files files;
  for (const Input& input : rule.inputs)
    for (const int at : possible_frames(rule, input, targets, frame))
      for (std::string& file : input.files(targets, at)) files.push_back(std::move(file));
  return files;
}

}  // namespace drench

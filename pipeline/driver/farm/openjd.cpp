#include "pipeline/driver/farm/openjd.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "pipeline/driver/frame_range.h"
#include "pipeline/driver/rules.h"

namespace drench {

namespace {

using Json = nlohmann::ordered_json;  // as a reader expects it: names first

Json path_parameter(const char* name, const char* kind, const char* flow,
                    const std::filesystem::path& path, const char* description) {
  return {{"name", name},     {"type", "PATH"},           {"objectType", kind},
          {"dataFlow", flow}, {"default", path.string()}, {"description", description}};
}

/// Frames of a stage in one text.
std::string all_frames_of(const FarmStage& stage) {
  std::set<int> frames;
  for (const FarmTask& task : stage.tasks) frames.insert(task.frames.begin(), task.frames.end());
  return format_frames({frames.begin(), frames.end()});
}

bool is_chain(Step step) {
  return step == Step::simulate || rule_of(step).frames == Frames::from_first;
}

Json requirements(const FarmStage& stage, const OpenjdTemplate& what) {
  Json amounts = Json::array({{{"name", "amount.worker.vcpu"}, {"min", what.cores}}});
  const auto measured = what.measured.find(stage.step);
  if (measured != what.measured.end() && measured->second.peak_memory > 0) {
    const double mib = std::ceil(memory_margin * measured->second.peak_memory / (1 << 20));
    amounts.push_back({{"name", "amount.worker.memory"}, {"min", int64_t(mib)}});
  }
  if (stage.step == Step::simulate && what.cuda)
    amounts.push_back({{"name", "amount.worker.gpu"}, {"min", 1}});
  return {{"amounts", amounts}};
}

Json step_of(const FarmStage& stage, const OpenjdTemplate& what) {
  const bool single = is_chain(stage.step) || stage.tasks.size() == 1;
  Json step{{"name", step_word(stage.step)}};
  std::set<Step> before;
  for (const FarmTask& task : stage.tasks)
    for (const FarmTask::Before& of : task.before)
      if (of.step != stage.step) before.insert(of.step);
  for (const Step of : before) step["dependencies"].push_back({{"dependsOn", step_word(of)}});
  step["hostRequirements"] = requirements(stage, what);
  if (!single) {
    Json ranges = Json::array();
    for (const FarmTask& task : stage.tasks) ranges.push_back(task_frames(task));
    step["parameterSpace"]["taskParameterDefinitions"] =
        Json::array({{{"name", "Frames"}, {"type", "STRING"}, {"range", ranges}}});
  }
  step["script"]["actions"]["onRun"] = {
      {"command", "{{Param.Drench}}"},
      {"args",
       {"run", "{{Param.Shot}}", "--out", "{{Param.Out}}", "--steps", step_word(stage.step),
        "--frames", single ? all_frames_of(stage) : "{{Task.Param.Frames}}", "--shared", "--openjd",
        "--device", what.cuda ? "cuda" : "cpu", "--threads", std::to_string(what.cores)}}};
  return step;
}

}  // namespace

std::string openjd_template(const FarmGraph& graph, const OpenjdTemplate& what) {
  constexpr size_t longest_name = 128;
  Json job{{"specificationVersion", "jobtemplate-2023-09"},
           {"name", what.name.substr(0, longest_name)},
           {"description",
            "Every stage of a shot, by drench farm --template openjd. The folders must be the same "
            "files on every worker."}};
  job["parameterDefinitions"] = Json::array(
      {path_parameter("Drench", "FILE", "NONE", what.program, "The program, on the workers."),
       path_parameter("Shot", "FILE", "IN", what.shot, "The shot as it was when this was written."),
       path_parameter("Out", "DIRECTORY", "INOUT", what.folder, "Its output folder.")});
  job["steps"] = Json::array();
  for (const FarmStage& stage : graph.stages) job["steps"].push_back(step_of(stage, what));
  return job.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace drench

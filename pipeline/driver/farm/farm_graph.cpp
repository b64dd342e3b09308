#include "pipeline/driver/farm/farm_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "pipeline/contract/hash.h"
#include "pipeline/driver/frame_range.h"
#include "pipeline/driver/rules.h"

namespace drench {

namespace {

class GraphMaker {
 public:
  GraphMaker(const Targets& targets, const Plan& plan, int chunk);
  FarmGraph make();

 private:
  using Chunk = size_t;  // of chunks_
  std::optional<Chunk> chunk_of(int frame) const;
  void add_stage(Step step);
  std::vector<FarmTask::Before> before(const Rule& rule, Chunk chunk) const;
  std::vector<FarmTask::Before> all_before(const Rule& rule) const;

  const Targets& targets_;
  std::vector<std::vector<int>> chunks_;                      // frames delivered, in order
  std::map<Step, std::map<Chunk, std::vector<int>>> frames_;  // planned, by step and chunk
  std::map<Step, std::map<Chunk, int>> task_;                 // number within its stage
  FarmGraph graph_;
};

GraphMaker::GraphMaker(const Targets& targets, const Plan& plan, int chunk) : targets_(targets) {
  for (size_t k = 0; k < targets.frames.size(); ++k) {
    if (k % size_t(chunk) == 0) chunks_.emplace_back();
    chunks_.back().push_back(targets.frames[k]);
  }
  for (const Task& task : plan.tasks) {
    if (task.action == Action::skip) continue;
    const std::optional<Chunk> chunk = is_per_frame(task.step) ? chunk_of(task.frame) : 0;
    if (chunk) frames_[task.step][*chunk].push_back(task.frame);
  }
}

/// The first that ends with the frame or after it: a chain makes the frames before its own, too.
std::optional<GraphMaker::Chunk> GraphMaker::chunk_of(int frame) const {
  const auto found =
      std::partition_point(chunks_.begin(), chunks_.end(),
                           [&](const std::vector<int>& chunk) { return chunk.back() < frame; });
  if (found == chunks_.end()) return {};
  return Chunk(found - chunks_.begin());
}

std::vector<FarmTask::Before> GraphMaker::before(const Rule& rule, Chunk chunk) const {
  std::set<std::pair<Step, int>> found;
  for (const Input& input : rule.inputs) {
    const auto tasks = task_.find(input.step);
    if (tasks == task_.end()) continue;
    for (const int frame : frames_.at(rule.step).at(chunk))
      for (const int at : possible_frames(rule, input, targets_, frame)) {
        const std::optional<Chunk> of = chunk_of(at);
        if (!of || input.files(targets_, at).empty()) continue;
        const auto task = tasks->second.find(*of);
        const bool itself = input.step == rule.step && *of == chunk;
        if (task != tasks->second.end() && !itself) found.insert({input.step, task->second});
      }
  }
  std::vector<FarmTask::Before> before;
  for (const auto& [step, task] : found) before.push_back({step, task});
  return before;
}

std::vector<FarmTask::Before> GraphMaker::all_before(const Rule& rule) const {
  std::vector<FarmTask::Before> before;
  for (const Input& input : rule.inputs) {
    const FarmStage* const stage = graph_.stage(input.step);
    if (stage && !input.files(targets_, targets_.frames.front()).empty())
      for (size_t k = 0; k < stage->tasks.size(); ++k) before.push_back({input.step, int(k)});
  }
  return before;
}

void GraphMaker::add_stage(Step step) {
  const auto planned = frames_.find(step);
  if (planned == frames_.end()) return;
  FarmStage stage{.step = step, .tasks = {}};
  for (const auto& [chunk, frames] : planned->second) {
    FarmTask task;
    if (step == Step::simulate) {
      task.frames = chunks_[chunk];
      if (!stage.tasks.empty()) task.before = {{step, int(stage.tasks.size()) - 1}};
    } else if (rule_of(step).frames == Frames::once) {
      task.frames = targets_.frames;
      task.before = all_before(rule_of(step));
    } else {
      task.frames = chunks_[chunk];
      task.before = before(rule_of(step), chunk);
    }
    task_[step][chunk] = int(stage.tasks.size());
    stage.tasks.push_back(std::move(task));
  }
  graph_.stages.push_back(std::move(stage));
}

FarmGraph GraphMaker::make() {
  for (const Step step : all_steps()) add_stage(step);
  return std::move(graph_);
}

}  // namespace

const FarmStage* FarmGraph::stage(Step step) const {
  const auto found = std::find_if(stages.begin(), stages.end(),
                                  [&](const FarmStage& stage) { return stage.step == step; });
  return found == stages.end() ? nullptr : &*found;
}

size_t FarmGraph::task_count() const {
  size_t count = 0;
  for (const FarmStage& stage : stages) count += stage.tasks.size();
  return count;
}

FarmGraph farm_graph(const Targets& targets, const Plan& plan, int chunk) {
  return GraphMaker(targets, plan, chunk).make();
}

std::string step_word(Step step) {
  std::string word(step_name(step));
  std::replace(word.begin(), word.end(), ' ', '_');
  return word;
}

std::string task_frames(const FarmTask& task) {
  std::string frames = format_frames(task.frames);
  std::erase(frames, ' ');
  return frames;
}

std::string task_name(Step step, const FarmTask& task) {
  std::string frames = task_frames(task);
  constexpr size_t longest = 120;  // it is part of a file's name
  if (frames.size() > longest) {
    const std::string digits = hash_bytes(frames.data(), frames.size()).hex().substr(0, 8);
    frames = fmt::format("{}-{}.{}", task.frames.front(), task.frames.back(), digits);
  }
  return fmt::format("{}.{}", step_word(step), frames);
}

}  // namespace drench

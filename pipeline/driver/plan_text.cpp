#include "pipeline/driver/plan_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "pipeline/driver/frame_range.h"

namespace drench {

std::string plan_text(const Plan& plan) {
  std::string text;
  for (size_t begin = 0, end = 0; begin < plan.tasks.size(); begin = end) {
    const Task& task = plan.tasks[begin];
    std::vector<int> frames;
    for (end = begin; end < plan.tasks.size(); ++end) {
      const Task& next = plan.tasks[end];
      if (next.step != task.step || next.action != task.action || next.reason != task.reason) break;
      frames.push_back(next.frame);
    }
    text += fmt::format("{:13}  {:7}  {:24}  {}\n", step_name(task.step), action_name(task.action),
                        is_per_frame(task.step) ? format_frames(frames) : "", task.reason);
  }
  const SimulationSpan& span = plan.simulation;
  if (span.needed) {
    text += span.checkpoint.empty() ? fmt::format("simulation starts at frame {}\n", span.from)
                                    : fmt::format("simulation continues from frame {} ({})\n",
                                                  span.from, span.checkpoint);
  }
  if (!plan.beyond.empty()) {
    text += fmt::format(
        "{} files belong to frames or sheets the shot no longer has; `drench clean` "
        "removes them\n",
        plan.beyond.size());
  }
  return text;
}

void write_plan_json(const Plan& plan, const std::map<std::string, std::string>& more,
                     const std::function<void(std::string_view)>& write) {
  const auto text_of = [](const nlohmann::json& value) {
    return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  const SimulationSpan& span = plan.simulation;
  const nlohmann::json simulation{{"needed", span.needed},
                                  {"checkpoint", span.checkpoint},
                                  {"from", span.from},
                                  {"last", span.last}};
  std::string text = fmt::format(
      "{{\n\"beyond\": {},\n\"problems\": {},\n\"simulation\": {},\n\"warnings\": "
      "{},\n\"tasks\": [",
      text_of(plan.beyond), text_of(plan.problems), text_of(simulation), text_of(plan.warnings));
  for (const auto& [name, value] : more) text.insert(2, fmt::format("\"{}\": {},\n", name, value));
  constexpr size_t piece = 1 << 16;
  std::string_view before = "\n";
  for (const Task& task : plan.tasks) {
    text += fmt::format(R"({}{{"action": "{}", "frame": {}, "reason": {}, "step": "{}"}})", before,
                        action_name(task.action), task.frame, text_of(task.reason),
                        step_name(task.step));
    before = ",\n";
    if (text.size() < piece) continue;
    write(text);
    text.clear();
  }
  write(text + "\n]\n}\n");
}

}  // namespace drench

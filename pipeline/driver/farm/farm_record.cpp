#include "pipeline/driver/farm/farm_record.h"

#include <nlohmann/json.hpp>

#include "pipeline/driver/json_lines.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/standard_output.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

std::map<std::string, SubmittedTask> submitted_tasks(const fs::path& folder) {
  std::map<std::string, SubmittedTask> tasks;
  for (const json& line : read_json_lines(folder / layout::farm_tasks)) {
    const auto text = [&](const char* key) {
      const auto found = line.find(key);
      return found != line.end() && found->is_string() ? found->get<std::string>() : std::string();
    };
    const std::optional<Step> step = step_named(text("step"));
    if (!step || text("log").empty()) continue;
    tasks[text("log")] = {*step, text("frames"), text("job"), text("name"), text("log")};
  }
  return tasks;
}

void add_submitted_tasks(const fs::path& folder, const std::vector<SubmittedTask>& tasks) {
  std::string lines;
  for (const SubmittedTask& task : tasks) {
    lines += json_line({{"step", step_name(task.step)},
                        {"frames", task.frames},
                        {"job", task.job},
                        {"name", task.name},
                        {"log", task.log}});
  }
  append_lines(folder / layout::farm_tasks, lines);
}

}  // namespace drench

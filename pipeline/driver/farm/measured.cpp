#include "pipeline/driver/farm/measured.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/driver/json_lines.h"

namespace drench {

std::map<Step, Measured> measured_steps(const std::filesystem::path& stats) {
  std::map<Step, Measured> steps;
  for (const nlohmann::json& line : read_json_lines(stats)) {
    const auto name = line.find("step"), wall = line.find("wall_s"), peak = line.find("peak_mib");
    if (name == line.end() || !name->is_string() || wall == line.end() || !wall->is_number())
      continue;
    const std::optional<Step> step = step_named(name->get<std::string>());
    if (!step) continue;
    Measured& measured = steps[*step];
    ++measured.frames;
    measured.mean_s += (wall->get<double>() - measured.mean_s) / measured.frames;
    if (peak != line.end() && peak->is_number())
      measured.peak_memory = std::max(measured.peak_memory, peak->get<double>() * (1 << 20));
  }
  return steps;
}

}  // namespace drench

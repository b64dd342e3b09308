#pragma once
// What a simulation starts with, for `drench plan`.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "sim/setup/scene_report.h"

namespace drench {

/// Lines of counts, memory and steps.
std::string scene_text(const sim::SceneReport& report);
nlohmann::json scene_json(const sim::SceneReport& report);

}  // namespace drench

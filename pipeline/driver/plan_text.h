#pragma once
// What a plan says, for a person and as JSON.

#include <functional>
#include <string>
#include <string_view>

#include "pipeline/driver/plan.h"

namespace drench {

/// One line for each run of frames with the same action and reason.
std::string plan_text(const Plan& plan);
/// {"tasks": [{"step", "frame", "action", "reason"}], "simulation": {...}, ...}, a task a line,
/// handed on piece by piece: a million frames are half a gigabyte.
/// @param scene  a JSON object for "scene"; empty: none
void write_plan_json(const Plan& plan, const std::string& scene,
                     const std::function<void(std::string_view)>& write);

}  // namespace drench

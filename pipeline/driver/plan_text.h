#pragma once
// What a plan says, for a person and as JSON.

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "pipeline/driver/plan.h"

namespace drench {

/// One line for each run of frames with the same action and reason.
std::string plan_text(const Plan& plan);
/// {"tasks": [{"step", "frame", "action", "reason"}], "simulation": {...}, ...}, a task a line,
/// handed on piece by piece: a million frames are half a gigabyte.
/// @param more  further members: names, and values as JSON
void write_plan_json(const Plan& plan, const std::map<std::string, std::string>& more,
                     const std::function<void(std::string_view)>& write);

}  // namespace drench

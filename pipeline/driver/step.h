#pragma once
// The steps of a run, in order, and the names that records and messages have for them.

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace drench {

enum class Step { simulate, mesh, foam, render, denoise, contact_sheet, movie, count };
inline constexpr auto step_names = std::to_array<std::string_view>(
    {"simulate", "mesh", "foam", "render", "denoise", "contact sheet", "movie"});
static_assert(step_names.size() == size_t(Step::count));

/// What the records of files that no step delivers name in place of one.
inline constexpr std::string_view probe_record = "probe", checkpoint_record = "checkpoint",
                                  shot_record = "shot";

constexpr std::string_view step_name(Step step) { return step_names.at(size_t(step)); }

/// Nothing for a name that is no step's.
constexpr std::optional<Step> step_named(std::string_view name) {
  const auto found = std::find(step_names.begin(), step_names.end(), name);
  if (found == step_names.end()) return {};
  return Step(found - step_names.begin());
}

/// Every step, in order.
inline std::vector<Step> all_steps() {
  std::vector<Step> steps;
  for (size_t k = 0; k < size_t(Step::count); ++k) steps.push_back(Step(k));
  return steps;
}

}  // namespace drench

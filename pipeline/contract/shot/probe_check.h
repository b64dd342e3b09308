#pragma once
// What a probe can refer to, and what none of its values shows alone.

#include <optional>
#include <string_view>

#include "pipeline/contract/shot/shot.h"
#include "pipeline/contract/shot/shot_check.h"

namespace drench {

enum class Side { low, high };

/// A wall of the domain.
struct DomainWall {
  int axis = 0;
  Side side = Side::low;
};

/// "x_low" to "z_high"; nothing for any other name.
std::optional<DomainWall> wall_named(std::string_view name);

/// Index of the first obstacle of that name.
std::optional<int> obstacle_named(const Shot& shot, std::string_view name);

/// The wall that a pressure probe lies on: parallel to it and within half a spacing.
std::optional<DomainWall> wall_under(const Probe& probe, const Shot& shot);

/// @throws Error with location, keys, values, reason and remedy for the first probe that cannot be
/// right.
void check_probes(const Shot& shot, const ShotSources& sources);

}  // namespace drench

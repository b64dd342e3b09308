#pragma once
// Periods of a resolution study: a quality that changes fluid.spacing alone.

#include <string>
#include <vector>

#include "pipeline/contract/shot/shot.h"

namespace drench {

/// Where a box of fluid goes all around a periodic axis and its layers would part or overlap at the
/// seam, the period becomes the nearest multiple of fluid.spacing: domain.max moves, and with it
/// what ended there: boxes, and discs of probes that were as broad as the period. Shots with sheets
/// are left alone, whose vertices a seam joins.
/// @return a line of text for every axis that was changed.
std::vector<std::string> fit_periods(Shot& shot);

}  // namespace drench

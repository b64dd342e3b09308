#pragma once
// Frame ranges as people type them: 1001-1048, 1001-1048x2, 1001x5, 1001,1010-1020, -5--1.

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/shot/shot.h"

namespace drench {

/// Frames of a comma-separated list; each item is `a`, `a-b`, `a-bxstep` (every step-th frame from
/// a) or `axstep` (from a to the shot's last frame). Signs belong to numbers: `-5--1` is five
/// frames.
///
/// @param timeline  frames before its first do not exist; frames after its last are allowed.
/// @return sorted, each frame once, at least one.
/// @throws Error naming the item: not of these forms, backwards, step < 1, before the first frame,
/// or
///         more than 1,000,000 frames.
std::vector<int> parse_frames(std::string_view text, const Timeline& timeline);

/// Every frame of the shot.
std::vector<int> all_frames(const Timeline& timeline);

/// The shortest of the forms above: "1001-1048", "1001, 1003-1005". Empty text for no frames.
std::string format_frames(const std::vector<int>& sorted);

}  // namespace drench

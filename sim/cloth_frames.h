#pragma once
// The sheets as files hold them.

#include <vector>

#include "pipeline/contract/frames.h"
#include "sim/setup/scene.h"
#include "sim/solver.h"

namespace drench::sim {

/// Every sheet of the shot, in its order, in world coordinates.
std::vector<ClothFrame> cloth_frames(const Shot& shot, const Scene& scene, const HostState& state);

}  // namespace drench::sim

#pragma once
// Contact of the fluid's surface with obstacles, as press_onto_ground (scene.cpp) makes it with the
// ground.

#include "pipeline/contract/frames.h"
#include "render/embree.h"

namespace drench {

/// The fluid's mesh, with what lies within 0.6 spacings of an obstacle, or inside it, moved into it
/// by up to 0.75 spacings: a surface that should touch ends a little before it or behind, and a
/// film of air under water mirrors. Moved all the way on the surface, not at all at 0.6 spacings.
TriangleMesh pressed_onto_obstacles(RTCDevice device, const TriangleMesh& fluid,
                                    const std::vector<ObstacleFrame>& obstacles, float spacing);

}  // namespace drench

#pragma once
// Water goes a little into what holds it. A surface that should touch a solid ends a little
// before it or behind, and a film of air between them would mirror.

#include <optional>

#include "surfacing/cloth_contact.h"

namespace drench::surfacing {

/// What lies within 0.6 spacings of a solid, or inside it, goes into it by up to 0.75 spacings, all
/// of it on its surface and not at all at 0.6 spacings off, and never past the middle of its
/// wall: a thin wall is not seen through. Below one spacing over the ground the mesh is stretched
/// twofold, so that what touches the ground is a spacing under it. Contact with cloth stays.
/// @param ground   its height, voxels from the lattice's origin
/// @param spacing  voxels
/// @return 1 by vertex that moved; empty where there are no solids.
std::vector<uint8_t> overlap_solids(LatticeMesh& mesh, const ClothContact& contact,
                                    const NearTriangles& solids, std::optional<float> ground,
                                    float spacing);

}  // namespace drench::surfacing

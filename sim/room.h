#pragma once
// How much fluid a closed domain has room for.

#include "sim/scene.h"

namespace drench::sim {

/// Particles at rest density that fit between the walls of a domain and outside the obstacles that
/// stand; 1e30 if a side is open. On a lattice of at most two million places, so that obstacles are
/// known to a share of their surface only.
double room_of(const Shot& shot, Scene& scene);

/// Mean density over rest of the particles around an inlet, as far as a support beyond its rim; 0
/// if there are none. Where fluid has nowhere to go it
/// rises with every layer.
/// @param position  m local. @param frame  film frame.
double crowding_at(const Shot& shot, const Scene& scene, const FluidEmitter& emitter, double frame,
                   const HostVec& position, const std::vector<float>& density);
constexpr double crowded = 1.02;

}  // namespace drench::sim

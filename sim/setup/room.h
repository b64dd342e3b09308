#pragma once
// How much fluid a closed domain has room for.

#include "sim/setup/scene.h"

namespace drench::sim {

/// Which obstacles take room.
enum class Counted { standing, all };

/// Particles at rest density that fit between the walls of a domain and outside the obstacles, as
/// they are at `time`, s; 1e30 if a side is open. On a lattice of at most two million places, so
/// that obstacles are known to a share of their surface only.
double room_of(const Shot& shot, Scene& scene, Counted which, double time);

/// Means over the particles around an inlet, as far as a support beyond its rim; 0 if there are
/// none.
struct NearInlet {
  double density = 0;   // over rest
  double pressure = 0;  // over rest density, m^2/s^2
};
/// @param position  m local. @param frame  film frame. @param density  kg/m^3.
/// @param pressure_term  p / rho^2, m^5/(kg s^2); may be empty.
NearInlet near_inlet(const Shot& shot, const Scene& scene, const FluidEmitter& emitter,
                     double frame, const HostVec& position, const std::vector<float>& density,
                     const std::vector<float>& pressure_term);

/// The pressure over rest density that fluid has where it has nowhere to go, m^2/s^2: twenty times
/// the square of the speed that all of the scene's fall or this inlet brings about. The peak in a
/// vessel is nine times that square with room left, and with one layer too many 48 times it a step
/// later (tests/sim/overfill_test.cpp).
double pressure_without_room(const Scene& scene, const FluidEmitter& emitter);

}  // namespace drench::sim

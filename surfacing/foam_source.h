#pragma once
// Where fluid takes in air: how much foam each particle makes.
//
// After Ihmsen, Akinci, Akinci and Teschner 2012, with three changes. Their trapped air weighs the
// difference of velocities by 1 - cos of its angle to the line between two particles, which is not
// 0 for a body that turns: here only the speed at which neighbours close in counts. Their crests
// move along their normals in the world: here relative to the fluid around them, so that a body
// that flies makes no foam. Both count lengths in spacings instead of time, so that the amount of
// foam does not depend on the spacing; and only particles that see air can take it in.

#include "pipeline/contract/shot/shot.h"
#include "surfacing/fluid_motion.h"

namespace drench::surfacing {

/// Speed that lifts fluid by a spacing against gravity and surface tension, m/s. Motion of a
/// surface at a scale that is faster than this breaks it up (Brocchini and Peregrine 2001). Where
/// the shot leaves surface tension out, water's 0.072 N/m stands.
float breaking_speed(const Shot& shot);

/// What a particle's neighbourhood says.
struct Potential {
  V3f offset{0, 0, 0};  // spacings, from the weighted mean of the neighbours: along the normal
  float fullness = 0;   // sum of weights over that deep inside
  float closing = 0;    // m/s: mean speed at which neighbours come nearer
  float ahead = 0;      // m/s along the normal, relative to the fluid around it; 0 if not mostly so
  float curvature = 0;  // mean of 1 - cos between normals, of neighbours behind it: crests
};
std::vector<Potential> potentials(const FluidMoment& fluid, float breaking);

/// Foam particles a second that each particle makes.
std::vector<float> birth_rates(const FluidMoment& fluid, const Shot& shot);

/// An even number in [0, 1) for one draw of one particle of one frame.
float random_number(uint32_t seed, uint32_t frame, uint32_t id, uint32_t draw);

}  // namespace drench::surfacing

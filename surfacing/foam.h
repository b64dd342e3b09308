#pragma once
// Spray, foam and bubbles: particles that fluid in commotion makes, and that move with it.

#include "pipeline/contract/frames.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/shot/shot.h"

namespace drench {

/// What foam_frame did.
struct FoamStats {
  size_t born = 0, died = 0, lost = 0;  // lost: through open sides of the domain
  size_t spray = 0, foam = 0, bubbles = 0;
  int substeps = 0;
};

/// The foam of a frame from that of the frame before and the fluid of both.
///
/// Fluid particles that see air make foam (surfacing/foam_source.h), spread evenly over the time
/// since the frame before and along their own paths, in discs of half a spacing across them. Who
/// has fewer than 6 fluid particles within two spacings is spray and flies under gravity; who has
/// more than 20 is a bubble, dragged towards the fluid's velocity plus rise_speed upwards; between
/// them it is foam, has the fluid's velocity, floats to where half of its surroundings is fluid,
/// and ages. Walls and obstacles stop all; spray sticks where it hits and ages there. Open sides of
/// the domain let out.
/// @param before        foam of frame - 1; ids below next_id
/// @param fluid_before  fluid of frame - 1; @param fluid  of frame; velocities in m/s, ids rising
/// @param level_set     of obstacles' meshes; not used where there are none
/// @return sorted by id. The same bits for any number of threads: nothing but `frame`, the seed and
/// ids decides what is drawn by chance.
/// @throws Error if a particle is not finite, columns differ in length, or there would be more than
/// 2^31 foam particles in the shot or more than surface.memory_gib holds.
/// Method: Ihmsen, Akinci, Akinci, Teschner 2012.
FoamFrame foam_frame(const Shot& shot, int frame, const FoamFrame& before,
                     const ParticleFrame& fluid_before, const ParticleFrame& fluid,
                     const LevelSetMaker& level_set = {}, FoamStats* stats = nullptr);

/// The first frame of a shot: there is no foam yet.
FoamFrame no_foam(const Shot& shot);

}  // namespace drench

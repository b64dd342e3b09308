#pragma once
// Sheets under water with a known answer, run with the incompressible solver: what the tests gate
// and the bench draws as curves of time against error.

#include "pipeline/contract/shot/shot.h"

namespace drench::validation {

/// Moduli of the light cotton of a pool, N/m, of the lattice of springs, and of the sheet that
/// stretches and shears as it does: isotropic, E h / (1 - nu^2) = adjacent + diagonal, shear
/// modulus and nu E h / (1 - nu^2) = diagonal.
constexpr double adjacent = 6000, diagonal = 3000, young = 8000, poisson = 1. / 3;
/// What a sheet of `model` is made of. Its bending rigidity is cotton's, 2e-5 N m.
void make_light_cotton(Cloth& sheet, ClothModel model, double areal_density);

/// A pool of 0.1 m in a shaft of 0.3 m on a sheet that is pinned to the shaft's walls, averaged
/// over the last quarter of the time.
struct PinnedPool {
  double sag = 0;         // m, of the deepest vertex
  double static_sag = 0;  // m, of the same sheet under the hydrostatic load, in double
  double volume = 0;      // between sheet and level, as its centre of mass tells, over its own, - 1
  double speed = 0;       // m/s, RMS of the water at the end
  int particles = 0;
  int steps = 0;
  double iterations = 0, sweeps = 0;  // a step
};
/// @param across         particles across the shaft.
/// @param areal_density  of the sheet, kg/m^2; 0.2 is light cotton.
PinnedPool pinned_pool(int across, double seconds, double areal_density, ClothModel model);

/// A block of water of 0.08 m flies at 1 m/s at a free sheet of 0.2 m and light cotton, with
/// nothing outside that could give or take momentum.
struct CoupledMomentum {
  double drift = 0;  // most that |p - p_0| was over the sum of m max(speed, sqrt(g H)), g H = v^2/2
  double given = 0;  // kg m/s, most that the sheet had
  int particles = 0;
};
/// @param across  particles along an edge of the block; the sheet has twice as many cells.
CoupledMomentum coupled_momentum(int across, int steps);

}  // namespace drench::validation

#pragma once
// Sheets under water with a known answer, run with the incompressible solver: what the tests gate
// and the bench draws as curves of time against error.

namespace drench::validation {

/// A pool of 0.1 m in a shaft of 0.3 m on a sheet that is pinned to the shaft's walls, averaged
/// over the last quarter of the time.
struct PinnedPool {
  double sag = 0;         // m, of the deepest vertex
  double static_sag = 0;  // m, of the same springs under the hydrostatic load, in double
  double volume = 0;      // between sheet and level, as its centre of mass tells, over its own, - 1
  double speed = 0;       // m/s, RMS of the water at the end
  int particles = 0;
  int steps = 0;
};
/// @param across         particles across the shaft.
/// @param areal_density  of the sheet, kg/m^2; 0.2 is light cotton.
PinnedPool pinned_pool(int across, double seconds, double areal_density);

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

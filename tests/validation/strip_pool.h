#pragma once
// A pool on a sheet that spans a periodic axis: two-dimensional, with a known answer.

#include "pipeline/contract/shot/shot.h"

namespace drench::validation {

/// A pool of 0.1 m between walls 0.3 m apart in x, on a sheet that is pinned along its two edges
/// there and joined to itself in z, six spacings around. Means over the last quarter of the time.
struct StripPool {
  double sag = 0;         // m, of the deepest line of the sheet
  double static_sag = 0;  // m, of a chain of the same sheet under the hydrostatic load, in double
  double shape = 0;       // largest difference of a line's height from the chain's, over static_sag
  double spread = 0;      // m, largest difference of height within a line along z, at the end
  double lowest = 0;      // m, what the lowest particle lies above the sheet's deepest vertex
  double speed = 0;       // m/s, RMS of the water at the end
  int particles = 0;
  int steps = 0;
  double iterations = 0, sweeps = 0;  // a step
};
/// @param across  particles across the pool.
/// @param offset  m, along z, of the sheet and the water: where the seam is must not matter.
StripPool strip_pool(int across, double seconds, ClothModel model, double offset = 0);

}  // namespace drench::validation

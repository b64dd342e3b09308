#pragma once
// The seed's tables of wall density and wall viscosity: sums over a flat square lattice of wall
// particles a apart, averaged over the place of the particle above the lattice, sampled at 64
// distances and read by linear interpolation. Built once; small enough to travel by value.

#include "sim/backend/backend.h"

namespace drench::sim {

struct WallTableData {
  static constexpr int samples = 64;
  float density[samples + 1];    // h a^2 sum W_poly6, over q = d/h
  float viscosity[samples + 1];  // h^3 a^2 sum lap W_vis
};

/// Sums for a lattice with h / a = ratio.
WallTableData build_wall_table(double ratio);

namespace DRENCH_BACKEND {

struct WallTable {
  WallTableData data;

  DRENCH_HD float read(const float* values, float q) const {
    if (q >= 1.f) return 0.f;
    const float s = q * WallTableData::samples;
    const int k = int(s);
    return values[k] + (values[k + 1] - values[k]) * (s - float(k));
  }
  DRENCH_HD float density(float q) const { return read(data.density, q); }
  DRENCH_HD float viscosity(float q) const { return read(data.viscosity, q); }
};

}  // namespace DRENCH_BACKEND
}  // namespace drench::sim

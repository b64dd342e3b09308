#pragma once
// Wave gauge: where the density on a vertical line, from above, first reaches half of rest density.
// A flat surface half a spacing above the outermost particles is there: half of the kernel lies
// below it. A single drop of one particle is no surface (its own density is a third of rest).

#include <algorithm>
#include <limits>

#include "sim/backend/parallel.h"
#include "sim/neighbours/periodic.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/probe_query.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

constexpr int height_samples = 16;

/// Densities at height_samples points of the line, and where the next ones below should start.
struct LineSamples {
  float density[height_samples] = {};  // kg/m^3
  float next = -1e30f;                 // m, nothing farther down: -1e30
};
struct AddLineSamples {
  DRENCH_HD LineSamples operator()(LineSamples a, const LineSamples& b) const {
    for (int k = 0; k < height_samples; ++k) a.density[k] += b.density[k];
    a.next = maximum(a.next, b.next);
    return a;
  }
};

struct LineDensity {
  ConstVecView position;
  float x, z, from, step;  // m
  float h, scale;          // m; kg/m^3, m / h^3
  Vec3<float> period;      // m; 0 where an axis is not periodic

  DRENCH_HD LineSamples operator()(int i) const {
    LineSamples one;
    const Vec3<float> p = position[i], d = nearest({p.x - x, 0.f, p.z - z}, period);
    const float across2 = d.x * d.x + d.z * d.z;
    const float bottom = from - float(height_samples - 1) * step;
    if (!(across2 < h * h) || p.y - h > from) return one;
    if (p.y - h < bottom) one.next = minimum(p.y + h, bottom);
    if (p.y + h < bottom) return one;
    for (int k = 0; k < height_samples; ++k) {
      const float dy = p.y - (from - float(k) * step);
      const float u = max0(1.f - square_root(across2 + dy * dy) / h);
      one.density[k] = scale * WendlandC2::value(u);
    }
    return one;
  }
};

/// Half of rest density, less the fraction that lies behind walls.
struct HalfDensity {
  float half;  // kg/m^3, of what the walls beside the line leave open
  float low, high, h;
  bool walls;
  float operator()(float y) const {
    if (!walls) return half;
    if (y < low || y > high) return 1e30f;  // there is no fluid
    return half * (1.f - WendlandC2::halfspace(minimum((y - low) / h, 1.f)) -
                   WendlandC2::halfspace(minimum((high - y) / h, 1.f)));
  }
};

}  // namespace drench::sim::DRENCH_BACKEND

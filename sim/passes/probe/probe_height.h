#pragma once
// Wave gauge: where the density on a vertical line, from above, first reaches half of rest density.
// A flat surface half a spacing above the outermost particles is there: half of the kernel lies
// below it. A single drop of one particle is no surface (its own density is a third of rest).

#include <algorithm>
#include <limits>

#include "sim/backend/parallel.h"
#include "sim/neighbours/kernels.h"
#include "sim/neighbours/periodic.h"
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
  VecView position;
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

/// Half of rest density, less the share that lies behind walls.
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

inline HalfDensity half_density(const Parameters& p, const ProbeQuery& query) {
  const float h = p.support_radius;
  float half = 0.5f * p.rest_density;
  for (const int k : {0, 2}) {
    const float below = (query.place[k] - p.low[k]) / h, above = (p.high[k] - query.place[k]) / h;
    if (p.wall[k]) {
      half *= 1.f - WendlandC2::halfspace(minimum(max0(below), 1.f)) -
              WendlandC2::halfspace(minimum(max0(above), 1.f));
    }
  }
  return {half, p.low[1], p.high[1], h, p.wall[1]};
}

/// m local; NaN where no fluid reaches half of rest density over the line. From the top down in
/// steps of a quarter support, then once more in fifteenths of the step that crosses it.
inline double surface_height(const State& state, const ProbeQuery& query) {
  const Parameters& p = state.parameters;
  const HalfDensity enough = half_density(p, query);
  const float h = p.support_radius;
  LineDensity line{
      state.fluid.position.view(),   query.place[0], query.place[2], 1e30f, 0.25f * h, h,
      p.particle_mass / (h * h * h), periods_of(p)};
  bool fine = false;
  while (true) {
    const LineSamples s =
        parallel_reduce("probe: height", state.fluid.count, LineSamples{}, line, AddLineSamples{});
    int k = 0;
    while (k < height_samples && s.density[k] < enough(line.from - float(k) * line.step)) ++k;
    if (k < height_samples && fine) {
      if (k == 0) return line.from;
      const float y = line.from - float(k) * line.step;
      const float above = enough(y + line.step) - s.density[k - 1], at = s.density[k] - enough(y);
      return double(y) + double(line.step) * at / (at + above);
    }
    if (k < height_samples) {
      line.from -= float(std::max(k - 1, 0)) * line.step;
      line.step /= float(height_samples - 1);
      fine = true;
    } else if (!fine && s.next > -1e30f) {
      line.from = s.next;
    } else {
      return std::numeric_limits<double>::quiet_NaN();
    }
  }
}

}  // namespace drench::sim::DRENCH_BACKEND

#pragma once
// Probes: reductions over the columns that a step has left, so that no state is read back. They
// write to no column that a later step reads.

#include <limits>

#include "sim/passes/cloth/cloth_springs.h"
#include "sim/passes/pressure/measure_density.h"
#include "sim/passes/probe/probe_height.h"
#include "sim/passes/probe/probe_sensor.h"

namespace drench::sim::DRENCH_BACKEND {

struct VertexForce {
  ConstVecView force;
  int begin;
  DRENCH_HD Totals<3> operator()(int k) const {
    const Vec3<float> f = force[begin + k];
    return {{f.x, f.y, f.z}};
  }
};

/// Kinetic and potential energy of points, J.
struct PointEnergy {
  ConstVecView position, velocity;
  const float* masses;  // kg, or null: all have `mass`
  float mass;
  Vec3<float> gravity, zero;
  DRENCH_HD Totals<3> operator()(int i) const {
    const double m = masses ? masses[i] : mass;
    const Vec3<double> v = to_double(velocity[i]);
    const Vec3<double> x = to_double(position[i]) - to_double(zero);
    return {{0.5 * m * dot(v, v), -m * dot(to_double(gravity), x), 0}};
  }
};

/// Energy of the springs, J: each stands in the slots of both its ends.
struct SpringEnergy {
  ConstVecView position;
  SpringEnds ends;
  const float *rest_length, *stiffness;
  DRENCH_HD Totals<3> operator()(int i) const {
    double sum = 0;
    for (int s = 0; s < ends.slots; ++s) {
      const int at = s * ends.stride + i;
      Vec3<double> d = to_double(position[ends.end[at]]) - to_double(position[i]);
      if (ends.joined) d = d + to_double(ends.shift[at]);
      const double longer = length(d) - rest_length[at];
      sum += 0.25 * stiffness[at] * longer * longer;
    }
    return {{0, 0, sum}};
  }
};

/// Kinetic and potential energy of vertices, J. Explicit sheets hold the velocity of the middle of
/// the last substep: that of its end is half a substep of acceleration on, as Verlet has it
/// (Hairer, Lubich and Wanner 2003, "Geometric numerical integration illustrated by the
/// Stormer-Verlet method", section 1). Read half a substep late, energy seems to grow as it passes
/// to waves of few substeps.
struct VertexEnergy {
  PointEnergy points;
  ClothSprings springs;
  ConstVecView fluid_force;
  const float* inverse_mass;
  float behind;  // s
  DRENCH_HD Totals<3> operator()(int i) const {
    Totals<3> all = points(i);
    if (behind == 0.f || inverse_mass[i] == 0.f) return all;
    const Vec3<float> a = (springs.force(i) + fluid_force[i]) * inverse_mass[i] + points.gravity;
    const Vec3<double> v = to_double(points.velocity[i]) + to_double(a) * double(behind);
    all.value[0] = 0.5 * double(points.masses[i]) * dot(v, v);
    return all;
  }
};

struct PositionAndDensity {
  ConstVecView position;
  const float* density;
  float inverse_rest;
  DRENCH_HD Totals<4> operator()(int i) const {
    const Vec3<float> x = position[i];
    const double over = double(density[i]) * inverse_rest - 1;
    return {{x.x, x.y, x.z, over > 0 ? over : 0}};
  }
};

struct VelocityInBall {
  ConstVecView position, velocity;
  Vec3<float> centre, period;
  float radius2;
  DRENCH_HD Totals<4> operator()(int i) const {
    if (!(length2(nearest(position[i] - centre, period)) <= radius2)) return {};
    const Vec3<float> v = velocity[i];
    return {{v.x, v.y, v.z, 1}};
  }
};

struct PositionAlong {
  ConstVecView position;
  Vec3<float> normal;
  DRENCH_HD double operator()(int i) const {
    return dot(to_double(position[i]), to_double(normal));
  }
};

/// Answers in the order of the queries. Volumes go last: measuring density makes another grid.
std::vector<std::vector<double>> probe_states(State& state, const std::vector<ProbeQuery>& queries);

}  // namespace drench::sim::DRENCH_BACKEND

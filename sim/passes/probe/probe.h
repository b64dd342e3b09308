#pragma once
// Probes: reductions over the columns that a step has left, so that no state is read back. They
// write to no column that a later step reads.

#include <limits>

#include "sim/passes/cloth/cloth_springs.h"
#include "sim/passes/pressure/measure_density.h"
#include "sim/passes/probe/probe_height.h"
#include "sim/passes/probe/probe_sensor.h"

namespace drench::sim::DRENCH_BACKEND {

/// Pressure of what gravity the walls of a full box hold up, Pa; none in its middle.
inline double held_pressure(const Parameters& p, const float (&place)[3]) {
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    sum += double(p.rest_density) * p.held[k] * (place[k] - 0.5 * (p.low[k] + p.high[k]));
  return sum;
}

/// Force of the fluid on a domain wall, N: what the step took from the fluid's momentum through the
/// wall's pressure and viscosity, over dt. A particle that the pressure fails to stop and the last
/// tenth of a spacing does (move.h) is not in it.
inline std::vector<double> wall_force(const State& state, const ProbeQuery& query) {
  const Parameters& p = state.parameters;
  Totals<3> sum = sum_by_particle<3>("probe: wall force", state,
                                     WallForce{body_parts_of(state), {query.axis, query.side}});
  float centre[3];
  double area = query.side == 0 ? -1 : 1;  // along the axis
  for (int k = 0; k < 3; ++k) {
    centre[k] = 0.5f * (p.low[k] + p.high[k]);
    if (k != query.axis) area *= double(p.high[k]) - p.low[k];
  }
  centre[query.axis] = query.side == 0 ? p.low[query.axis] : p.high[query.axis];
  if (p.held[query.axis] != 0.f) sum.value[query.axis] += area * held_pressure(p, centre);
  return to_vector(sum);
}

inline double pressure(State& state, const ProbeQuery& query) {
  // What evens out a full box has had rows of its own since.
  if (state.parameters.full && query.kind == ProbeKind::inner_pressure) correct_gradients(state);
  return disc_pressure(state, query) + held_pressure(state.parameters, query.place);
}

struct VertexForce {
  VecView force;
  int begin;
  DRENCH_HD Totals<3> operator()(int k) const {
    const Vec3<float> f = force[begin + k];
    return {{f.x, f.y, f.z}};
  }
};

/// Force of the fluid on a range of vertices, N: the impulses they were given in the step, over dt.
inline std::vector<double> cloth_force(const State& state, const ProbeQuery& query) {
  return to_vector(parallel_reduce("probe: cloth force", query.end - query.begin, Totals<3>{},
                                   VertexForce{state.cloth.force.view(), query.begin},
                                   AddTotals<3>{}));
}

/// Kinetic and potential energy of points, J.
struct PointEnergy {
  VecView position, velocity;
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
  VecView position;
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
  VecView fluid_force;
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

inline std::vector<double> energy(const State& state, const ProbeQuery& query) {
  const Parameters& p = state.parameters;
  const FluidState& f = state.fluid;
  const ClothState& c = state.cloth;
  const Vec3<float> gravity{p.gravity[0] + p.held[0], p.gravity[1] + p.held[1],
                            p.gravity[2] + p.held[2]};
  const Vec3<float> zero{query.place[0], query.place[1], query.place[2]};
  const AddTotals<3> add;
  const Totals<3> fluid = parallel_reduce(
      "probe: fluid energy", f.count, Totals<3>{},
      PointEnergy{f.position.view(), f.velocity.view(), nullptr, p.particle_mass, gravity, zero},
      add);
  const float behind =
      sheets_are_implicit(p) ? 0.f : float(0.5 * state.dt / std::max(1, state.substeps));
  const Totals<3> cloth = parallel_reduce(
      "probe: cloth energy", c.vertices, Totals<3>{},
      VertexEnergy{{c.position.view(), c.velocity.view(), c.mass.data(), 0.f, gravity, zero},
                   {c.position.view(), c.velocity.view(), spring_ends_of(c), c.rest_length.data(),
                    c.stiffness.data(), c.spring_damping.data()},
                   c.force.view(),
                   c.inverse_mass.data(),
                   behind},
      add);
  const Totals<3> springs = parallel_reduce(
      "probe: spring energy", c.vertices, Totals<3>{},
      SpringEnergy{c.position.view(), spring_ends_of(c), c.rest_length.data(), c.stiffness.data()},
      add);
  return to_vector(add(add(fluid, cloth), springs));
}

struct PlaceAndDensity {
  VecView position;
  const float* density;
  float inverse_rest;
  DRENCH_HD Totals<4> operator()(int i) const {
    const Vec3<float> x = position[i];
    const double over = double(density[i]) * inverse_rest - 1;
    return {{x.x, x.y, x.z, over > 0 ? over : 0}};
  }
};

/// Measures the incompressible fluid's density anew; that of the weakly compressible one is of the
/// step's start.
inline std::vector<double> volume(State& state) {
  const int n = state.fluid.count;
  if (n > 0 && state.parameters.incompressible) measure_density(state);
  const Totals<4> sum =
      parallel_reduce("probe: volume", n, Totals<4>{},
                      PlaceAndDensity{state.fluid.position.view(), state.fluid.density.data(),
                                      1.f / state.parameters.rest_density},
                      AddTotals<4>{});
  std::vector<double> all{double(n)};
  for (const double value : sum.value)
    all.push_back(n > 0 ? value / n : std::numeric_limits<double>::quiet_NaN());
  return all;
}

struct VelocityInBall {
  VecView position, velocity;
  Vec3<float> centre, period;
  float radius2;
  DRENCH_HD Totals<4> operator()(int i) const {
    if (!(length2(nearest(position[i] - centre, period)) <= radius2)) return {};
    const Vec3<float> v = velocity[i];
    return {{v.x, v.y, v.z, 1}};
  }
};

/// Mean of the particles whose centres are in a ball, m/s.
inline std::vector<double> mean_velocity(const State& state, const ProbeQuery& q) {
  const Totals<4> sum = parallel_reduce("probe: velocity", state.fluid.count, Totals<4>{},
                                        VelocityInBall{state.fluid.position.view(),
                                                       state.fluid.velocity.view(),
                                                       {q.place[0], q.place[1], q.place[2]},
                                                       periods_of(state.parameters),
                                                       q.radius * q.radius},
                                        AddTotals<4>{});
  if (sum.value[3] == 0) return std::vector<double>(3, std::numeric_limits<double>::quiet_NaN());
  return {sum.value[0] / sum.value[3], sum.value[1] / sum.value[3], sum.value[2] / sum.value[3]};
}

struct Farthest {
  double value = -1e30;
  DRENCH_HD Farthest operator()(const Farthest& a, const Farthest& b) const {
    return b.value > a.value ? b : a;
  }
};
struct PlaceAlong {
  VecView position;
  Vec3<float> normal;
  DRENCH_HD Farthest operator()(int i) const {
    return {dot(to_double(position[i]), to_double(normal))};
  }
};

/// Half a spacing beyond the farthest particle, m local.
inline double front(const State& state, const ProbeQuery& q) {
  if (state.fluid.count == 0) return std::numeric_limits<double>::quiet_NaN();
  return 0.5 * state.parameters.spacing +
         parallel_reduce(
             "probe: front", state.fluid.count, Farthest{},
             PlaceAlong{state.fluid.position.view(), {q.normal[0], q.normal[1], q.normal[2]}},
             Farthest{})
             .value;
}

inline std::vector<double> vertex(const State& state, int v) {
  const VecColumn& x = state.cloth.position;
  return {value_at(x.x, v), value_at(x.y, v), value_at(x.z, v)};
}

inline std::vector<double> probe_state(State& state, const ProbeQuery& query) {
  switch (query.kind) {
    case ProbeKind::height:
      return {surface_height(state, query)};
    case ProbeKind::wall_pressure:
    case ProbeKind::inner_pressure:
      return {pressure(state, query)};
    case ProbeKind::wall_force:
      return wall_force(state, query);
    case ProbeKind::cloth_force:
      return cloth_force(state, query);
    case ProbeKind::obstacle_force:
      return {};  // the solver adds what its obstacles received
    case ProbeKind::vertex:
      return vertex(state, query.begin);
    case ProbeKind::energy:
      return energy(state, query);
    case ProbeKind::velocity:
      return mean_velocity(state, query);
    case ProbeKind::front:
      return {front(state, query)};
    case ProbeKind::volume:
      return volume(state);
  }
  return {};
}

/// Answers in the order of the queries. Volumes go last: measuring density makes another grid.
inline std::vector<std::vector<double>> probe_states(State& state,
                                                     const std::vector<ProbeQuery>& queries) {
  std::vector<std::vector<double>> answers(queries.size());
  for (const bool last : {false, true}) {
    for (size_t k = 0; k < queries.size(); ++k) {
      if ((queries[k].kind == ProbeKind::volume) == last)
        answers[k] = probe_state(state, queries[k]);
    }
  }
  return answers;
}

}  // namespace drench::sim::DRENCH_BACKEND

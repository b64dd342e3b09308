#pragma once
// An incompressible fluid with its neighbour lists, open to tests of rows.

#include "sim/columns.h"
#include "sim/neighbours/sort_particles.h"
#include "sim/passes/pressure/incompressible.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {

inline Shot water() {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  return shot;
}

/// L = 1: rows that are the derivative of the kernel's sum.
inline void remove_correction(sim::cpu::State& state) {
  sim::cpu::PressureState& s = state.pressure;
  for (int i = 0; i < state.fluid.count; ++i)
    s.correction.data()[i] = {1, 1, 1, 0}, s.correction_cross.data()[i] = {0, 0, 0, 0};
}

/// `count` particles at random in a cube of `side` m inside walls, as a state that a step would
/// predict: sorted, with lists.
struct Listed {
  sim::cpu::State state;

  Listed(int count, double side)
      : Listed(at_random(count, side), side, {Axis::walls, Axis::open, Axis::walls}) {}
  /// Particles at the given places, m, in a cube of `side` m.
  Listed(const std::vector<V3d>& places, double side, std::array<Axis, 3> axis) {
    Shot shot = water();
    shot.domain.min = V3d(0), shot.domain.max = V3d(side);
    shot.domain.axis = axis;
    add_box(shot, V3d(0), {1, 1, 1});
    const int count = int(places.size());
    state.parameters = sim::build_scene(shot).parameters;
    sim::cpu::FluidState& f = state.fluid;
    f.count = count;
    using enum sim::ColumnGroup;
    sim::cpu::resize_particles(state,
                               position | velocity | cells | sorting | density | pressure | lists |
                                   projection | solve | scratch,
                               size_t(count));
    const sim::cpu::VecView x = f.position.view();
    for (int i = 0; i < count; ++i) {
      const V3d& p = places[size_t(i)];
      x.set(i, {float(p.x), float(p.y), float(p.z)});
    }
    sim::cpu::PressureState& s = state.pressure;
    sim::cpu::sort_particles(state);
    sim::cpu::find_neighbours(state);
    s.control.data()->done = 0;
  }
  int count() const { return state.fluid.count; }
  V3d place(int i) const {
    const sim::cpu::Vec3<float> p = state.fluid.position.view()[i];
    return V3d(p.x, p.y, p.z);
  }

 private:
  static std::vector<V3d> at_random(int count, double side) {
    Random random(11);
    std::vector<V3d> places;
    for (int i = 0; i < count; ++i) {
      const double x = side * random(), y = side * random(), z = side * random();
      places.push_back(V3d(x, y, z));
    }
    return places;
  }
};

}  // namespace drench::sim_tests

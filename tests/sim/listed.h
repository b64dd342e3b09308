#pragma once
// An incompressible fluid with its neighbour lists, open to tests of rows.

#include "sim/passes/incompressible.h"
#include "sim/passes/sort_particles.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {

inline Shot water() {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  return shot;
}

/// `count` particles at random in a cube of `side` m inside walls, as a state that a step would
/// predict: sorted, with lists.
struct Listed {
  sim::cpu::State state;

  Listed(int count, double side) {
    Shot shot = water();
    shot.domain.min = V3d(0), shot.domain.max = V3d(side);
    shot.domain.axis = {Axis::walls, Axis::open, Axis::walls};
    add_box(shot, V3d(0), {1, 1, 1});
    state.parameters = sim::build_scene(shot).parameters;
    sim::cpu::FluidState& f = state.fluid;
    f.count = count;
    Random random(11);
    for (sim::cpu::VecColumn* c : {&f.position, &f.velocity, &state.swap_vector}) c->resize(count);
    for (sim::cpu::Column<int>* c : {&f.id, &f.cell, &f.order, &state.swap_int}) c->resize(count);
    for (sim::cpu::Column<float>* c : {&f.density, &f.pressure_term}) c->resize(count);
    const sim::cpu::VecView x = f.position.view();
    for (int i = 0; i < count; ++i)
      x.set(i, {float(side * random()), float(side * random()), float(side * random())});
    sim::cpu::PressureState& s = state.pressure;
    for (auto* c : {&s.place, &s.vector, &s.wall}) c->resize(count);
    for (auto* c : {&s.inverse_diagonal, &s.source, &s.before, &s.next, &s.product})
      c->resize(count);
    s.control.resize(1);
    sim::cpu::sort_particles(state);
    sim::cpu::find_neighbours(state);
    s.control.data()->done = 0;
  }
  int count() const { return state.fluid.count; }
  V3d place(int i) const {
    const sim::cpu::Vec3<float> p = state.fluid.position.view()[i];
    return V3d(p.x, p.y, p.z);
  }
};

}  // namespace drench::sim_tests

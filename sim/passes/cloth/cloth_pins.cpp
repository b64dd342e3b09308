#include "sim/passes/cloth/cloth_pins.h"

#include "sim/passes/cloth/shell_system.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Ways of vertices to their pins, m.
struct PinWays {
  const int* vertex;
  const float* pull;
  ConstVecView place, low, velocity;
  ConstVecView position, rounding;
  bool shells;

  DRENCH_HD bool holds(int k) const { return pull[k] == 0.f; }
  DRENCH_HD bool soft(int k) const { return pull[k] > 0.f; }
  DRENCH_HD Vec3<float> way(int k) const {
    const int v = vertex[k];
    const Vec3<float> whole = place[k] - position[v];
    return whole + (shells ? low[k] - rounding[v] : low[k]);
  }
};

PinWays pin_ways_of(const State& state) {
  const PinState& p = state.pins;
  return {.vertex = p.vertex.data(),
          .pull = p.pull.data(),
          .place = p.place.view(),
          .low = p.low.view(),
          .velocity = p.velocity.view(),
          .position = state.cloth.position.view(),
          .rounding = state.shell.rounding.view(),
          .shells = state.shell.any};
}

}  // namespace

void find_pin_paths(State& state) {
  const PinWays pins = pin_ways_of(state);
  const ConstVecView v = state.cloth.velocity.view();
  const VecView path = state.shell.path.view();
  const float inverse_dt = float(1 / state.dt);
  parallel_for(
      state.queue, "pins: paths", state.pins.count, DRENCH_LAMBDA(int k) {
        const int i = pins.vertex[k];
        if (pins.holds(k)) path.set(i, pins.way(k) * inverse_dt - (pins.velocity[k] - v[i]));
      });
}

void find_anchors(State& state) {
  ClothSystem& s = state.cloth_system;
  s.anchor.clear_bytes(state.queue, 0), s.anchor_pull.clear(state.queue);
  const PinWays pins = pin_ways_of(state);
  const ConstVecView path = path_velocity_of(state);
  const VecView pull = s.anchor_pull.view();
  float* anchor = s.anchor.data();
  const float dt = float(state.dt), dt2 = float(new_force_share(state) * state.dt * state.dt);
  parallel_for(
      state.queue, "pins: anchors", state.pins.count, DRENCH_LAMBDA(int k) {
        const int i = pins.vertex[k];
        if (!pins.soft(k)) return;
        anchor[i] = pins.pull[k] * dt2;
        pull.set(i, (pins.way(k) - path[i] * dt) * anchor[i]);
      });
}

void place_pins(State& state) {
  const PinWays pins = pin_ways_of(state);
  const ConstVecView path = path_velocity_of(state);
  const VecView change = state.cloth_system.change.view();
  const float dt = float(state.dt);
  parallel_for(
      state.queue, "pins: places", state.pins.count, DRENCH_LAMBDA(int k) {
        const int i = pins.vertex[k];
        if (pins.holds(k)) change.set(i, pins.way(k) - path[i] * dt);
      });
}

void finish_pins(State& state) {
  const PinWays pins = pin_ways_of(state);
  ClothState& c = state.cloth;
  const VecView next = c.next.view(), velocity = c.next_velocity.view(),
                predicted = c.predicted.view();
  parallel_for(
      state.queue, "pins: finish", state.pins.count, DRENCH_LAMBDA(int k) {
        const int i = pins.vertex[k];
        if (!pins.holds(k)) return;
        next.set(i, pins.place[k]);
        velocity.set(i, pins.velocity[k]), predicted.set(i, pins.velocity[k]);
      });
}

}  // namespace drench::sim::DRENCH_BACKEND

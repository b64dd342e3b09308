#pragma once
// Steps of a scene: how long they may be, and what the solver is told before each.

#include <cstdint>
#include <memory>

#include "sim/setup/scene.h"
#include "sim/solver.h"
#include "sim/stable_step.h"

namespace drench::sim {

/// A solver, the scene that it runs and the time that it has come to. Open, so that whoever steps
/// it may read all of it.
struct Stepper {
  Scene scene;
  std::unique_ptr<Solver> solver;
  Limits limits;      // of the last step, or of the state that was loaded
  double time = 0;    // s since the first frame; negative in the pre-roll
  int64_t steps = 0;  // since the start

  /// Begins with the scene's start. @param solver  of its parameters and cloth
  Stepper(Scene scene, std::unique_ptr<Solver> solver, double time = 0);
  /// Takes up a state, obstacles and sinks where they stand at its time. `limits` are its limits,
  /// `rest` what is known of its sheets; empty: nothing.
  void load(const HostState& state, const Limits& limits, double time,
            const SheetRestState& rest = {});

  /// The longest stable step, s, of gravity and the frame's motion as they are now.
  StepLimit stable_limit();
  /// The longest step, s, that is also short enough for the obstacles' motion.
  StepLimit limit();
  /// Cloth steps within a step of dt seconds, as the cloth's own limit asks.
  int cloth_substeps(double dt) const;
  /// One step of dt seconds, whatever the limits.
  void step(double dt) { step_to(time + dt, dt); }
  /// One of the equal steps of `longest` seconds at most that lead to `end`, or to a time before it
  /// that a step has to land on. The last one lands exactly. @return its length, s.
  double step_towards(double end, double longest);

 private:
  void step_to(double end, double dt);
};

}  // namespace drench::sim

// Case obstacle_cost: what obstacles add to a step, the same collapsing column with none, with one
// out of reach and with wet ones. Case obstacle_buoyancy: the force on a submerged body against the
// weight of what it displaces (tests/sim/obstacle_scenes.h).

#include <cmath>
#include <string>

#include "tests/bench/bench.h"
#include "tests/sim/obstacle_scenes.h"

namespace drench::bench {
namespace {

using sim_tests::Stepper;

/// 16,000 particles; `spheres` of 3 spacings stand in them, `far` ones where none come.
Shot scene(int spheres, int far) {
  Shot shot = sim_tests::tank_shot(1);
  const double a = shot.fluid.spacing;
  shot.fluid.box.clear();
  shot.domain.max = V3d(80 * a, 60 * a, 20 * a);
  sim_tests::add_box(shot, V3d(0), {40, 20, 20});
  for (int k = 0; k < spheres; ++k)
    sim_tests::add_sphere(shot, V3d(10 * a * (k % 4) + 5 * a, 6 * a, (k / 4 ? 15 : 5) * a), 3 * a);
  for (int k = 0; k < far; ++k) sim_tests::add_sphere(shot, V3d(3, 0, 0), 0.1);
  return shot;
}

void cost(const Emit& emit) {
  struct Case {
    const char* name;
    int spheres, far;
  };
  for (const Case& c : {Case{"none", 0, 0}, Case{"one out of reach", 0, 1},
                        Case{"one wet sphere", 1, 0}, Case{"eight wet spheres", 8, 0}}) {
    Stepper run(scene(c.spheres, c.far));
    for (int k = 0; k < 20; ++k) run.step(2e-3);
    Line line;
    int iterations = 0;
    constexpr int steps = 60;
    line.cost = measure([&] {
      for (int k = 0; k < steps; ++k) run.step(2e-3), iterations += run.limits.iterations;
    });
    line.method = c.name;
    line.resolution = std::to_string(run.solver->particles()) + " particles";
    line.threads = hardware_threads();
    line.more["cpu_ms_a_step"] = 1e3 * line.cost->cpu_s / steps;
    line.more["iterations_a_step"] = double(iterations) / steps;
    emit(line);
  }
}

void buoyancy(const Emit& emit) {
  for (const ObstacleType type : {ObstacleType::sphere, ObstacleType::box}) {
    for (const double spacings : sizes({3., 4.5, 6.}, 2)) {
      sim_tests::Lift lift;
      Line line;
      line.cost = measure([&] { lift = sim_tests::lift_of(type, spacings); });
      line.method = type == ObstacleType::sphere ? "sphere" : "box";
      line.resolution = std::to_string(spacings) + " spacings of radius or half edge";
      line.error = std::abs(lift.error), line.gate = 0.05;
      line.error_of = "mean vertical force over the displaced weight, less 1";
      line.more["signed"] = lift.error;
      line.more["sideways"] = lift.sideways;
      emit(line);
    }
  }
}

const Registration obstacle_cost{"obstacle_cost", "what obstacles add to a step", cost,
                                 InQuick::yes};
const Registration obstacle_buoyancy{"obstacle_buoyancy", "force on a submerged body", buoyancy,
                                     InQuick::yes};

}  // namespace
}  // namespace drench::bench

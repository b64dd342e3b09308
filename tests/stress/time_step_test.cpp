// Steps from a quarter of the stable one to sixteen times it.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/contract/error.h"
#include "sim/simulator.h"
#include "sim/stable_step.h"
#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

constexpr double times[] = {0.25, 0.5, 1, 2, 4, 8, 16};

class TimeStep : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Times, TimeStep, testing::ValuesIn(times),
                         [](const auto& p) { return std::to_string(int(100 * p.param)); });

// What no shot can ask for: the solver itself at so many times the estimate, without the rules that
// make a step follow the one before. It is to stay bounded; how good it is then is reported.
TEST_P(TimeStep, OfTheSolverStaysBounded) {
  Watch watch(fall_on_sheet(100));
  const auto estimate = [&] {
    sim::Limits limits = watch.run.limits;
    limits.step = 0;
    return sim::stable_step(watch.run.scene.parameters, limits).dt;
  };
  while (watch.run.time < 0.4 && watch.step(GetParam() * estimate())) {
  }
  Gates gates;
  if (GetParam() > 1) {
    gates = squeezed();
    gates.energy = not_gated, gates.speed = 1.5;
  }
  report("time step", fmt::format("solver at {}x", GetParam()), watch, gates);
}

// A fixed step above the stable one is refused with a message, at the start or when it comes to be
// too long; others run.
TEST_P(TimeStep, IsRefusedWhereItIsFixedAndTooLong) {
  Shot shot = fall_on_sheet(100);
  const double stable = 0.4 * shot.fluid.spacing / 3;  // at 3 m/s, twice as fast as it falls
  shot.time_step = GetParam() * stable, shot.timeline = {1001, 1006, 24};
  std::string said = "ran";
  double fastest = 0;
  try {
    Simulator simulator(shot, {});
    for (int frame = 0; frame < 5; ++frame)
      fastest = std::max(fastest, simulator.advance_frame().max_speed);
  } catch (const Error& error) {
    said = error.what();
  }
  const bool refused = said.find("shot.time_step is") != std::string::npos;
  // The gravity limit, 0.08 sqrt(a / g) = 3.6 ms, is 1.35 times the step.
  const bool right = GetParam() < 1.3 ? !refused && fastest < 8 : refused;
  report("time step", fmt::format("fixed, {}x the step at 3 m/s", GetParam()), right,
         refused ? "refused: " + said.substr(said.find("shot.time_step"), 60) + "..."
                 : fmt::format("{}, {:.2f} m/s at most", said, fastest));
}

// Adaptive steps shrink on impact, and the report of the frame names what ruled them.
TEST(TimeStep, OfAdaptiveRunsShrinksAndSaysWhy) {
  Shot shot = fall_on_sheet(100);
  shot.fluid.box[0].velocity = V3d(0, -20, 0), shot.timeline = {1001, 1003, 24};
  Simulator simulator(shot, {});
  double smallest = 1, largest = 0;
  std::string limits;
  for (int frame = 0; frame < 2; ++frame) {
    const StepReport step = simulator.advance_frame();
    smallest = std::min(smallest, step.smallest_dt), largest = std::max(largest, step.largest_dt);
    limits += (frame ? ", " : "") + step.limit;
  }
  report("time step", "adaptive, 20 m/s", smallest < 0.5 * largest && !limits.empty(),
         fmt::format("{:.2g} to {:.2g} ms; ruled by {}", 1e3 * smallest, 1e3 * largest, limits));
}

}  // namespace
}  // namespace drench::stress_tests

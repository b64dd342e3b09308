// Numbers that are none, in shots and in states.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/shot_file.h"
#include "sim/simulator.h"
#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

constexpr const char* rest_of_shot =
    "[domain]\nmin = [-1, -1, -1]\nmax = [1, 1, 1]\n"
    "[[cloth]]\ncorner = [-0.1, 0, -0.1]\nu = [0.2, 0, 0]\nv = [0, 0, 0.2]\ncells = [4, 4]\n";

/// What simulating two frames of a shot says.
std::string outcome(const std::string& text) {
  try {
    Shot shot = parse_shot(text, "bad.toml");
    Simulator simulator(shot, {});
    double speed = 0;
    for (int k = 0; k < 2; ++k) speed = std::max(speed, simulator.advance_frame().max_speed);
    return speed < 5 ? "ran" : fmt::format("ran, {} m/s", speed);
  } catch (const Error& error) {
    return error.what();
  }
}

std::string box(const std::string& min, const std::string& velocity = "0") {
  return "[[fluid.box]]\nmin = [" + min + ", 0.1, -0.05]\nmax = [0.05, 0.2, 0.05]\nvelocity = [" +
         velocity + ", 0, 0]\n";
}

// Every number that is not finite or far too large is refused by its key; a denormal is a zero.
TEST(BadInput, OfShotsIsRefusedByItsKey) {
  const std::string good = box("-0.05");
  EXPECT_EQ(outcome(good + rest_of_shot), "ran");
  const std::string spacing = "[fluid]\nspacing = ";
  struct Case {
    const char* what;
    std::string text;
    const char* key;
  };
  for (const std::string bad : {"nan", "inf", "-inf", "1e30"}) {
    const std::string bad_positive = bad;
    for (const Case& c :
         {Case{"position", box(bad) + rest_of_shot, "fluid.box[0].min"},
          Case{"velocity", box("-0.05", bad) + rest_of_shot, "velocity"},
          Case{"spacing", spacing + bad + "\n" + good + rest_of_shot, "spacing"},
          Case{"density", "[fluid]\nrest_density = " + bad + "\n" + good + rest_of_shot,
               "rest_density"},
          Case{"time step", "[shot]\ntime_step = " + bad + "\n" + good + rest_of_shot, "time_step"},
          Case{"areal density", good + rest_of_shot + "areal_density = " + bad + "\n",
               "areal_density"},
          Case{"stiffness", good + rest_of_shot + "adjacent_stiffness = " + bad + "\n",
               "adjacent_stiffness"},
          Case{"sheet velocity", good + rest_of_shot + "velocity = [0, " + bad + ", 0]\n",
               "velocity"}}) {
      const std::string said = outcome(c.text);
      const bool named = said.find(c.key) != std::string::npos;
      if (!named || bad == "nan")
        report("bad input", fmt::format("{} = {}", c.what, bad), named, said.substr(0, 90));
    }
  }
}

TEST(BadInput, OfDenormalsIsHarmlessOrRefused) {
  const std::string tiny = "1e-310", good = box("-0.05");
  report("bad input", "position = 1e-310", outcome(box(tiny) + rest_of_shot) == "ran", "ran");
  report("bad input", "velocity = 1e-310", outcome(box("-0.05", tiny) + rest_of_shot) == "ran",
         "ran");
  for (const auto& [what, text] :
       {std::pair{"spacing", "[fluid]\nspacing = " + tiny + "\n" + good + rest_of_shot},
        {"rest_density", "[fluid]\nrest_density = " + tiny + "\n" + good + rest_of_shot},
        {"areal_density", good + rest_of_shot + "areal_density = " + tiny + "\n"}}) {
    const std::string said = outcome(text);
    report("bad input", fmt::format("{} = 1e-310", what), said.find(what) != std::string::npos,
           said.substr(0, 90));
  }
}

// A time step so short that time does not pass would never end.
TEST(BadInput, OfATimeStepThatDoesNotEndIsRefused) {
  for (const std::string bad : {"1e-310", "1e-18", "-0.001"}) {
    const std::string said =
        outcome("[shot]\ntime_step = " + bad + "\n" + box("-0.05") + rest_of_shot);
    report("bad input", "time step = " + bad, said.find("time_step") != std::string::npos,
           said.substr(0, 90));
  }
}

TEST(BadInput, OfNothingIsRefused) {
  const std::string said = outcome("[domain]\nmin = [-1, -1, -1]\nmax = [1, 1, 1]\n");
  report("bad input", "neither fluid nor cloth", said.find("nothing to simulate") != said.npos,
         said.substr(0, 90));
  report("bad input", "no fluid", outcome(rest_of_shot) == "ran", "ran");
  report("bad input", "no cloth",
         outcome(box("-0.05") + "[domain]\nmin = [-1, -1, -1]\nmax = [1, 1, 1]\n") == "ran", "ran");
}

/// Particles but one that are not finite or faster than anything that falls in the scene.
int infected(const sim::HostState& state, int poisoned) {
  int count = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    const double speed = at(state.velocity, i).length(), place = at(state.position, i).length();
    count += state.id[i] != poisoned && !(speed < 10 && place < 1e6);
  }
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
    count += !(at(state.cloth_velocity, v).length() < 10);
  return count;
}

void poison(const std::string& what, float value, bool place, bool walls) {
  Shot shot = fall_on_sheet(100);
  if (!walls) shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  Stepper run(shot);
  for (int k = 0; k < 30; ++k) run.step();  // it has met the sheet
  sim::HostState state = run.solver->save();
  const int poisoned = state.id[300];
  (place ? state.position : state.velocity).x[300] = value;
  run.solver->load(state);
  for (int k = 0; k < 2 && run.limits.bad_particle < 0; ++k) run.step(1e-3);
  const int bad = run.limits.bad_particle;
  const bool named = bad >= 0 && run.solver->save().id[size_t(bad)] == poisoned;
  for (int k = 0; k < 98 && bad < 0 && run.limits.bad_particle < 0; ++k) run.step(1e-3);
  const int others = infected(run.solver->save(), poisoned);
  const bool clean = bad < 0 && run.limits.bad_particle < 0 && others == 0;
  report("bad input",
         fmt::format("{} of one particle = {}, {}", place ? "place" : "velocity", what,
                     walls ? "walls" : "open"),
         named || clean,
         named ? "refused by its number within two steps"
               : fmt::format("goes on; {} others infected after 100 steps", others));
}

// One particle of a state is poisoned, as a fault of memory would: a step names it, and the run
// ends, or it stands alone at a wall, or is lost past an open side.
TEST(BadInput, OfOneParticleDoesNotSpread) {
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  for (const auto& [what, value] :
       {std::pair{"NaN", nan}, {"Inf", inf}, {"1e30", 1e30f}, {"1e-40", 1e-40f}}) {
    for (const bool walls : {true, false}) {
      poison(what, value, true, walls);
      poison(what, value, false, walls);
    }
  }
}

}  // namespace
}  // namespace drench::stress_tests

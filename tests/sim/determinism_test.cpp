// Same bits for any number of threads, after a resume, and wherever the scene stands.

#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "pipeline/contract/error.h"
#include "sim/simulator.h"
#include "tests/sim/same_state.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// A block that falls on a sheet over a floor, moved by `shift` m.
Shot splash(double shift = 0) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.domain.min = V3d(shift - 0.3, -0.2, -0.3), shot.domain.max = V3d(shift + 0.3, 0.6, 0.3);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(shift - 0.08, 0.01, -0.08), {16, 8, 16}, V3d(0, -1, 0));
  add_sheet(shot, 0.3, 0, 24).corner.x += shift;
  return shot;
}

/// The same onto cotton that is a shell.
Shot shell_splash(double shift = 0) {
  Shot shot = splash(shift);
  shot.fluid.solver = FluidSolver::incompressible;
  shot.cloth[0].model = ClothModel::shell;
  return shot;
}

TEST(Determinism, AnyNumberOfThreadsGivesTheSameBits) {
  for (int k = 0; k < 3; ++k) {
    Shot shot = splash();
    const CouplingScheme scheme = k == 1 ? CouplingScheme::paper : CouplingScheme::exact;
    shot.coupling.scheme = scheme;
    if (k == 2) shot.fluid.solver = FluidSolver::incompressible;
    if (scheme == CouplingScheme::paper)
      shot.cloth[0].areal_density = 5;  // it diverges on light cloth
    expect_same_bits_on_threads(shot, 60);
  }
}

// Scratch of one solver is of no other, whichever of them asks for more of it.
TEST(Determinism, SolversBesideEachOtherGiveTheBitsOfEachAlone) {
  Shot one = splash(), other = splash();
  other.fluid.solver = FluidSolver::incompressible;
  add_box(other, V3d(-0.08, 0.17, -0.08), {16, 8, 16}, V3d(0, -1, 0));
  const int steps = 40;
  const sim::HostState one_alone = after(one, steps), other_alone = after(other, steps);

  Stepper first(one), second(other);
  for (int k = 0; k < steps; ++k) first.step(), second.step();
  expect_same_state(one_alone, first.solver->save());
  expect_same_state(other_alone, second.solver->save());

  sim::HostState of_thread;
  std::thread thread([&] { of_thread = after(other, steps); });
  const sim::HostState meanwhile = after(one, steps);
  thread.join();
  expect_same_state(one_alone, meanwhile);
  expect_same_state(other_alone, of_thread);
}

// A million lattice steps away the local state is the same to the last bit.
TEST(Determinism, ALatticeShiftOfTenKilometresGivesTheSameBits) {
  for (FluidSolver solver : {FluidSolver::weakly_compressible, FluidSolver::incompressible}) {
    Shot here = splash(), there = splash(1e4);
    here.fluid.solver = there.fluid.solver = solver;
    expect_same_state(after(here, 60), after(there, 60));
  }
}

TEST(Determinism, ShellsHaveTheSameBitsOnThreadsElsewhereAndResumed) {
  const Shot here = shell_splash();
  expect_same_bits_on_threads(here, 60);
  expect_same_state(after(here, 60), after(shell_splash(1e4), 60));
  expect_same_bits_when_resumed(here, 60, 0);
  Shot alone = here;  // on its own step, without fluid
  alone.fluid.box.clear(), alone.cloth[0].pin = {{.vertices = {0, 24}, .box = {}}};
  expect_same_bits_on_threads(alone, 60);
  expect_same_bits_when_resumed(alone, 60, 0);
}

// A spacing that is no binary fraction: rest lengths are rounded where the shot stands.
TEST(Determinism, ALatticeShiftLeavesTheRestLengthsOfSheets) {
  Shot here = splash(), there = splash(1e4);
  for (Shot* shot : {&here, &there}) {
    shot->fluid.spacing = 0.02;
    shot->cloth[0].corner.x += 0.15 - 0.16, shot->cloth[0].u.x = 0.32;
    shot->cloth[0].v.z = 0.32, shot->cloth[0].cells = V2i(16, 16);
  }
  const sim::Scene a = sim::build_scene(here), b = sim::build_scene(there);
  EXPECT_EQ(a.cloth.rest_length, b.cloth.rest_length);
}

// A sheet so light is thrown about faster than the water: particles far from it are guarded, too,
// and which these are must not hang on what was found out before the pause.
TEST(Determinism, AViolentSplashIsResumedWithTheSameBits) {
  Shot shot = splash();
  shot.fluid.box.clear();
  add_box(shot, V3d(-0.08, 0.01, -0.08), {16, 16, 16}, V3d(0, -9, 0));
  Cloth& sheet = shot.cloth[0];
  const uint32_t side = 25;
  sheet.areal_density = 0.05;
  sheet.pin = {{.vertices = {0, side - 1, side * (side - 1), side * side - 1}, .box = {}}};
  expect_same_bits_when_resumed(shot, 600, 0);
}

class Resume : public testing::TestWithParam<FluidSolver> {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("drench_resume_" + std::to_string(::getpid()) + "_" +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  Shot shot() const {
    Shot shot = splash();
    shot.fluid.solver = GetParam();
    shot.timeline = {1001, 1010, 60};
    FluidEmitter emitter;
    emitter.center = V3d(0.1, 0.4, 0.1), emitter.radius = 0.03, emitter.speed = 1;
    shot.fluid.emitter.push_back(emitter);
    if (GetParam() == FluidSolver::incompressible) {
      shot.wind.present = true, shot.wind.gust = 2;
      shot.wind.velocity.keys = {{1001, V3d(0)}, {1004, V3d(6, 0, 1)}};
      Cloth shell = shot.cloth[0];  // in the company of springs
      shell.name = "shell", shell.model = ClothModel::shell;
      shell.corner.y -= 0.1, shell.cells = V2i(8, 8);
      shot.cloth.push_back(shell);
    }
    Sink sink;  // below the emitter
    sink.shape.type = ObstacleType::sphere, sink.shape.radius = 0.04;
    sink.shape.position.keys = {{1001, V3d(0.1, 0.36, 0.1)}, {1005, V3d(0.1, 0.33, 0.1)}};
    shot.sink.push_back(sink);
    return shot;
  }
  std::string bytes(const std::filesystem::path& path) const {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  }
  std::filesystem::path folder_;
};

INSTANTIATE_TEST_SUITE_P(Solvers, Resume,
                         testing::Values(FluidSolver::weakly_compressible,
                                         FluidSolver::incompressible));

// A checkpoint holds every state there is, so equal checkpoints at the end are equal runs.
TEST_P(Resume, GivesTheSameBitsAsARunWithoutPause) {
  Simulator whole(shot(), {});
  for (int k = 0; k < 2; ++k) whole.advance_frame();
  whole.write_checkpoint(folder_ / "middle");
  for (int k = 0; k < 2; ++k) whole.advance_frame();
  whole.write_checkpoint(folder_ / "whole");

  Simulator resumed(shot(), {});
  resumed.read_checkpoint(folder_ / "middle");
  EXPECT_EQ(resumed.frame(), 1003);
  for (int k = 0; k < 2; ++k) resumed.advance_frame();
  resumed.write_checkpoint(folder_ / "resumed");
  EXPECT_GT(bytes(folder_ / "whole").size(), 10000u);
  EXPECT_TRUE(bytes(folder_ / "whole") == bytes(folder_ / "resumed"));
}

// Asked to stop before every fifth step of the pre-roll; the state is whole each time.
TEST_P(Resume, OfAPrerollThatWasStoppedGivesTheSameBits) {
  Shot slow = shot();
  slow.preroll = 0.05;
  Simulator whole(slow, {}), stopped(slow, {});
  const int steps = whole.preroll().steps;
  EXPECT_EQ(whole.preroll().steps, 0) << "there is one pre-roll";
  int stops = 0;
  for (bool done = false; !done; ++stops) {
    ASSERT_LE(stops, steps);
    int asked = 0;
    try {
      stopped.preroll([&] { return ++asked <= 5; });
      done = true;
    } catch (const Stopped&) {
    }
  }
  EXPECT_EQ(stops, (steps + 4) / 5);
  for (Simulator* simulator : {&whole, &stopped}) simulator->advance_frame();
  whole.write_checkpoint(folder_ / "whole");
  stopped.write_checkpoint(folder_ / "stopped");
  EXPECT_TRUE(bytes(folder_ / "whole") == bytes(folder_ / "stopped"));
}

TEST_P(Resume, RefusesADamagedCheckpoint) {
  Simulator simulator(shot(), {});
  simulator.write_checkpoint(folder_ / "good");
  const std::string good = bytes(folder_ / "good");
  for (size_t k = 0; k < 40; ++k) {
    std::string bad = good;
    bad[k * (good.size() - 1) / 39] ^= 0x10;  // from the first byte to the last
    if (k % 4 == 3) bad = good.substr(0, k * good.size() / 40);
    std::ofstream(folder_ / "bad", std::ios::binary) << bad;
    EXPECT_THROW(simulator.read_checkpoint(folder_ / "bad"), Error) << k;
  }
  EXPECT_NO_THROW(simulator.read_checkpoint(folder_ / "good"));
}

TEST_P(Resume, RefusesTheCheckpointOfAnotherShot) {
  Simulator(shot(), {}).write_checkpoint(folder_ / "one");
  Shot other = shot();
  other.gravity = V3d(0, -3, 0);
  Simulator simulator(other, {});
  EXPECT_THROW(simulator.read_checkpoint(folder_ / "one"), Error);
}

}  // namespace
}  // namespace drench::sim_tests

// Inlets into closed boxes that are full, and what the message of a blow-up names.

#include <gtest/gtest.h>

#include "sim/blow_up.h"
#include "sim/setup/room.h"
#include "sim/simulator.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

constexpr double a = 0.025;  // m

/// A closed box of 12 cells a side, ten layers of water in it, and a hose of 4 m/s below the
/// surface: full after 0.05 s.
Shot overfilled() {
  Shot shot = empty_shot();
  shot.timeline = {1001, 1007, 24};
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.spacing = a, shot.fluid.tolerance = 1e-3;
  shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.min = V3d(0), shot.domain.max = V3d(12 * a);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {12, 10, 12});
  FluidEmitter hose;
  hose.center = V3d(0.15, 0.2, 0.15), hose.radius = 0.06, hose.speed = 4;
  shot.fluid.emitter.push_back(hose);
  return shot;
}

struct Ran {
  size_t particles = 0;
  double max_speed = 0;  // m/s, of the last frame
  uint64_t emitted = 0;
  std::string log;
};

Ran run(const Shot& shot, int frames) {
  Ran ran;
  testing::internal::CaptureStderr();
  Simulator simulator(shot, {.device = Device::cpu});
  for (int k = 0; k < frames; ++k) {
    const StepReport report = simulator.advance_frame();
    ran.particles = report.particles, ran.max_speed = report.max_speed;
    ran.emitted += report.emitted;
  }
  ran.log = testing::internal::GetCapturedStderr();
  return ran;
}

size_t count_of(const std::string& text, const std::string& word) {
  size_t n = 0;
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
  return n;
}

TEST(Overfill, InletSendsNothingIntoAFullBox) {
  const Ran ran = run(overfilled(), 6);
  EXPECT_LE(ran.particles, 12u * 12 * 12);
  EXPECT_GT(ran.particles, 12u * 12 * 12 - 60);
  EXPECT_LT(ran.max_speed, 10);
  EXPECT_EQ(count_of(ran.log, "fluid.emitter[0] has no room"), 1u) << ran.log;
}

// What a drain takes is filled up again.
TEST(Overfill, InletGoesOnWhenASinkMakesRoom) {
  Shot shot = overfilled();
  const uint64_t alone = run(shot, 6).emitted;
  Sink drain;
  drain.shape.type = ObstacleType::box, drain.shape.name = "drain";
  drain.shape.size = V3d(0.1, 0.05, 0.1), drain.shape.position = V3d(0.05, 0.02, 0.05);
  drain.start = 0.1;
  shot.sink.push_back(drain);
  const Ran ran = run(shot, 6);
  EXPECT_GT(ran.emitted, alone + 100);
  EXPECT_LE(ran.particles, 12u * 12 * 12);
}

// A sealed box of 8 cells a side in a wide open domain: no count of the domain knows that it is
// full.
TEST(Overfill, InletSendsNothingIntoAFullVessel) {
  Shot shot = overfilled();
  shot.domain.min = V3d(-1), shot.domain.max = V3d(1);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  const double size = 12 * a;
  for (int k = 0; k < 6; ++k) {  // plates of three spacings around it
    V3d at(0.5 * size);
    at[k / 2] = k % 2 ? -1.5 * a : size + 1.5 * a;
    Obstacle& plate = add_obstacle(shot, ObstacleType::box, at);
    plate.size = V3d(size + 6 * a), plate.size[k / 2] = 3 * a;
    plate.name = "plate" + std::to_string(k);
  }
  const Ran ran = run(shot, 6);
  EXPECT_GT(ran.particles, 1650u);
  EXPECT_LT(ran.particles, 1728u * 1.03);
  EXPECT_LT(ran.max_speed, 10);
  EXPECT_EQ(count_of(ran.log, "fluid.emitter[0] has no room"), 1u) << ran.log;
}

// Below the surface of a pool that has room to rise, and as a free jet: nothing is held back.
TEST(Overfill, InletsWithRoomAreNotHeldBack) {
  for (const double height : {1.2, 0.6}) {
    Shot shot = overfilled();
    shot.domain.max.y = height;
    shot.fluid.emitter[0].speed = height < 1 ? 1 : 4;
    if (height > 1) shot.fluid.emitter[0].center = V3d(0.15, 1.0, 0.15);
    const double flow = M_PI * 0.06 * 0.06 * shot.fluid.emitter[0].speed;
    const Ran ran = run(shot, 6);
    EXPECT_NEAR(double(ran.emitted), flow * 0.25 / (a * a * a), 25) << height;
    EXPECT_EQ(count_of(ran.log, "no room"), 0u) << ran.log;
  }
}

// An obstacle takes room: the box is full before its walls alone would say so.
TEST(Overfill, RoomIsWhatObstaclesLeave) {
  Shot shot = overfilled();
  EXPECT_EQ(sim::build_scene(shot).report.particles, 1440u);
  sim::Scene scene = sim::build_scene(shot);
  EXPECT_NEAR(sim::room_of(shot, scene, sim::Counted::standing, 0), 1728, 1e-6);
  Obstacle& block = add_obstacle(shot, ObstacleType::box, V3d(0.15, 0.025, 0.15));
  block.size = V3d(0.1, 0.05, 0.1);
  scene = sim::build_scene(shot);
  EXPECT_NEAR(sim::room_of(shot, scene, sim::Counted::standing, 0), 1728 - 4 * 2 * 4, 1e-6);
  shot.domain.axis[1] = Axis::open;
  scene = sim::build_scene(shot);
  EXPECT_GT(sim::room_of(shot, scene, sim::Counted::standing, 0), 1e20);
}

// Nothing but the state decides: a run that goes on from a checkpoint has the same bits.
TEST(Overfill, ResumedWhileFullIsTheSame) {
  const test::TemporaryFolder folder;
  const Shot shot = overfilled();
  testing::internal::CaptureStderr();
  Simulator whole(shot, {.device = Device::cpu}), resumed(shot, {.device = Device::cpu});
  for (int k = 0; k < 4; ++k) {
    whole.advance_frame();
    if (k == 1) whole.write_checkpoint(folder / "two");
  }
  resumed.read_checkpoint(folder / "two");
  for (int k = 0; k < 2; ++k) resumed.advance_frame();
  testing::internal::GetCapturedStderr();
  const ParticleFrame one = whole.particles(), other = resumed.particles();
  EXPECT_EQ(one.id, other.id);
  EXPECT_EQ(one.position, other.position);
  EXPECT_EQ(one.velocity, other.velocity);
}

std::string cause(const Shot& shot, sim::Scene& scene, const sim::HostState& state,
                  const sim::Culprit& culprit) {
  return sim::cause_of_blow_up(shot, scene, state, std::vector<float>(state.id.size(), 1000.f),
                               std::vector<bool>(shot.fluid.emitter.size(), false), culprit, 0.1,
                               1e-4);
}

TEST(BlowUpCause, IsTheInletOfAFullDomain) {
  const Shot shot = overfilled();
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState state = scene.start;
  EXPECT_EQ(cause(shot, scene, state, {}).find("emitter"), std::string::npos);
  state.id.resize(1720);
  const std::string text = cause(shot, scene, state, {});
  EXPECT_NE(text.find("100 % full: fluid.emitter[0]"), std::string::npos) << text;
}

// One that had no room a moment before, though the domain has.
TEST(BlowUpCause, IsAnInletThatHadNoRoom) {
  const Shot shot = overfilled();
  sim::Scene scene = sim::build_scene(shot);
  const sim::HostState state = scene.start;
  const std::vector<float> density(state.id.size(), 1000.f);
  const auto text = [&](bool crowded) {
    return sim::cause_of_blow_up(shot, scene, state, density, {crowded}, {}, 0.1, 1e-4);
  };
  EXPECT_EQ(text(false).find("emitter"), std::string::npos);
  EXPECT_NE(text(true).find("fluid.emitter[0] had no room"), std::string::npos);
}

// A lid that is pressed into a box of water: it slides along the walls and closes on none of them.
TEST(BlowUpCause, IsALidThatLeavesNoRoom) {
  Shot shot = overfilled();
  shot.fluid.emitter.clear();
  Obstacle& lid = add_obstacle(shot, ObstacleType::box, V3d(0));
  lid.name = "lid", lid.size = V3d(0.3, 0.1, 0.3);
  lid.position.keys = {{1001, V3d(0.15, 0.31, 0.15)}, {1003, V3d(0.15, 0.27, 0.15)}};
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState state = scene.start;
  state.position.x[0] = scene.frame.to_local(0, 0.01);
  state.position.y[0] = scene.frame.to_local(1, 0.21);
  state.velocity.y[0] = 0;
  const std::string text = cause(shot, scene, state, {true, 0});
  EXPECT_NE(text.find("leaves room for 12"), std::string::npos) << text;
  EXPECT_NE(text.find("obstacle \"lid\""), std::string::npos) << text;
  state.id.resize(1000);
  const std::string calm = cause(shot, scene, state, {true, 0});
  EXPECT_EQ(calm.find("closes on"), std::string::npos) << calm;
}

// A tank that is open at its top is no vessel, however an inlet presses.
TEST(Overfill, InletAtTheBottomOfAHalfFullTankSends) {
  Shot shot = overfilled();
  shot.domain.max.y = 40 * a;
  shot.fluid.emitter[0].center = V3d(0.15, a, 0.15), shot.fluid.emitter[0].direction = V3d(0, 1, 0);
  shot.fluid.emitter[0].speed = 1;
  const Ran ran = run(shot, 4);
  EXPECT_EQ(ran.log.find("no room"), std::string::npos) << ran.log;
  EXPECT_GT(ran.emitted, 100u);
}

// A ball that comes down on the floor, and one that stands there.
TEST(BlowUpCause, IsAnObstacleThatClosesOnAWall) {
  Shot shot = overfilled();
  shot.fluid.emitter.clear();
  Obstacle& ball = add_obstacle(shot, ObstacleType::sphere, V3d(0.15, 0.2, 0.15));
  ball.name = "ball", ball.radius = 0.05;
  ball.position.keys = {{1001, V3d(0.15, 0.2, 0.15)}, {1003, V3d(0.15, 0.07, 0.15)}};
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState state = scene.start;
  state.position.x[0] = scene.frame.to_local(0, 0.15),
  state.position.z[0] = scene.frame.to_local(2, 0.15);
  state.position.y[0] = scene.frame.to_local(1, 0.01);
  state.velocity.y[0] = 0;
  const std::string text = cause(shot, scene, state, {true, 0});
  EXPECT_NE(text.find("obstacle \"ball\" closes on the domain's wall y_low"), std::string::npos)
      << text;
  shot.obstacle[0].position = V3d(0.15, 0.07, 0.15);
  scene = sim::build_scene(shot);
  EXPECT_EQ(cause(shot, scene, state, {true, 0}).find("closes"), std::string::npos);
}

TEST(BlowUpCause, IsASheetStretchedBeyondItsLength) {
  Shot shot = empty_shot();
  shot.cloth.clear();
  pin_edges(add_sheet(shot, 0.5, 0, 10));
  shot.cloth[0].name = "flag";
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState state = scene.start;
  const std::string calm = cause(shot, scene, state, {false, 60});
  EXPECT_EQ(calm.find("flag"), std::string::npos) << calm;
  EXPECT_EQ(calm.substr(0, 3), "Try");
  state.cloth_position.y[60] += 0.5f;  // one vertex that was thrown
  const std::string thrown = cause(shot, scene, state, {false, 60});
  EXPECT_EQ(thrown.find("in the mean"), std::string::npos) << thrown;
  EXPECT_NE(thrown.find("Cloth \"flag\" has a triangle there that is stretched to"),
            std::string::npos)
      << thrown;
  for (float& x : state.cloth_position.x) x *= 2;
  const std::string text = cause(shot, scene, state, {false, 60});
  EXPECT_NE(text.find("Cloth \"flag\" is stretched to"), std::string::npos) << text;
}

// Slower than what counts as absurd: the stretch alone tells.
TEST(BlowUp, IsAShellThatIsStretchedMoreThanTenfold) {
  Shot shot = empty_shot();
  shot.cloth.clear();
  pin_edges(add_sheet(shot, 0.5, 0, 10));
  shot.cloth[0].name = "flag", shot.cloth[0].model = ClothModel::shell;
  sim::Scene scene = sim::build_scene(shot);
  const auto solver = sim::cpu::make_solver(scene.parameters, scene.cloth);
  const float rest = scene.start.cloth_position.y[60];
  for (const bool torn : {false, true}) {
    scene.start.cloth_position.y[60] = rest + (torn ? 1.f : 0.2f);
    solver->load(scene.start);
    EXPECT_EQ(solver->measure().bad_vertex >= 0, torn);
  }
}

}  // namespace
}  // namespace drench::sim_tests

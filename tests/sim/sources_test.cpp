// How much fluid the sources make, and where.

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/contract/error.h"
#include "sim/simulator.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

Shot rain(int count, int particles, uint32_t seed) {
  Shot shot = empty_shot();
  shot.seed = seed;
  FluidDrops drops;
  drops.min = V3d(-0.6), drops.max = V3d(0.6);
  drops.radius = 0.1, drops.count = count, drops.particles = particles;
  shot.fluid.drops.push_back(drops);
  return shot;
}

TEST(Drops, MakeExactlyAsManyParticlesAsAsked) {
  for (int count : {1, 7, 24}) {
    EXPECT_EQ(sim::initial_fluid(rain(count, 16384 / (count == 1 ? 8 : 1), 1)).position.size(),
              size_t(16384 / (count == 1 ? 8 : 1)))
        << count;
  }
}

// Within a drop neighbours are a spacing apart, so links of at most 1.01 spacings find the drops.
TEST(Drops, AreAsManyAsAskedAndApart) {
  for (uint32_t seed : {1u, 2u, 3u}) {
    const sim::InitialFluid fluid = sim::initial_fluid(rain(12, 3000, seed));
    const size_t n = fluid.position.size();
    std::vector<size_t> root(n);
    for (size_t i = 0; i < n; ++i) root[i] = i;
    const auto find = [&](size_t i) {
      while (root[i] != i) i = root[i] = root[root[i]];
      return i;
    };
    size_t groups = n;
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j < i; ++j) {
        if ((fluid.position[i] - fluid.position[j]).length() > 0.0101 || find(i) == find(j))
          continue;
        root[find(i)] = find(j);
        --groups;
      }
    }
    EXPECT_EQ(groups, 12u) << seed;
  }
}

TEST(Drops, ThatCannotFitAreRefused) { EXPECT_THROW(sim::build_scene(rain(5000, 0, 1)), Error); }

// 30, 30.6 and 30.4 cells of 10 mm: whole cells alone, none of which reaches out of the box.
TEST(Box, HoldsTheWholeCellsThatFit) {
  Shot shot = empty_shot();
  const FluidBox box{V3d(-0.15), V3d(0.15, 0.156, 0.154), V3d(0)};
  shot.fluid.box.push_back(box);
  const sim::InitialFluid fluid = sim::initial_fluid(shot);
  EXPECT_EQ(fluid.position.size(), size_t(30 * 30 * 30));
  for (const V3d& p : fluid.position) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(p[k] - box.min[k], 0.005 - 1e-9);
      EXPECT_GE(box.max[k] - p[k], 0.005 - 1e-9);
    }
  }
}

// A ball of radius 0.1 m has 4/3 pi 10^3 = 4189 lattice cells; the surface is uncertain by a few of
// its 1257 cells in random sign: 1 %.
TEST(Sphere, HasTheVolumeOfItsRadius) {
  Shot shot = empty_shot();
  shot.fluid.sphere.push_back({V3d(0), 0.1, V3d(0)});
  EXPECT_NEAR(double(sim::initial_fluid(shot).position.size()), 4. / 3 * M_PI * 1000, 42);
}

// Where two sources overlap there is one lattice, not two.
TEST(Sources, ThatOverlapDoNotFillSpaceTwice) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {10, 10, 10});
  add_box(shot, V3d(0.05, 0, 0), {10, 10, 10});
  EXPECT_EQ(sim::initial_fluid(shot).position.size(), 1500u);
}

/// Least distance between any two particles, m.
double least_distance(const std::vector<V3d>& points) {
  double least = 1e30;
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t j = 0; j < i; ++j) least = std::min(least, (points[i] - points[j]).length());
  }
  return least;
}

// Lattices that are half a cell apart in all axes stand nowhere nearer than 0.866 spacings: nothing
// but the whole second lattice may go, or density would be doubled. At rest and without gravity the
// fluid then stays where it is.
TEST(Sources, ThatOverlapOffTheLatticeDoNotFillSpaceTwice) {
  for (const double shift : {0.5, 0.37, 0.13}) {
    Shot shot = empty_shot();
    shot.fluid.solver = FluidSolver::incompressible;
    const double a = shot.fluid.spacing;
    add_box(shot, V3d(0), {10, 10, 10});
    add_box(shot, V3d(5 + shift, shift, shift) * a, {10, 10, 10});
    shot.fluid.sphere.push_back({V3d(0.05, 0.1, 0.05), 0.05, V3d(0)});
    const sim::InitialFluid fluid = sim::initial_fluid(shot);
    EXPECT_GT(least_distance(fluid.position), 0.9 * a);
    EXPECT_GT(fluid.overlapping, 300u);
    Stepper run(shot);
    double fastest = 0, sharpest = 0;
    for (int k = 0; k < 20; ++k) {
      run.step(1e-3);
      fastest = std::max(fastest, double(run.limits.max_speed));
      for (const float density : run.solver->density())
        sharpest = std::max(sharpest, double(density));
    }
    EXPECT_LT(fastest, 1e-3) << shift;  // m/s; rounding of the density, over a step
    EXPECT_LT(sharpest, 1001) << shift;
  }
}

TEST(Sources, ThatLieWhollyInOthersAreRefused) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {10, 10, 10});
  shot.fluid.sphere.push_back({V3d(0.05), 0.03, V3d(0)});
  try {
    sim::initial_fluid(shot);
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("fluid.sphere[0] lies wholly"), std::string::npos);
  }
}

FluidEmitter disc(double radius, double speed) {
  FluidEmitter emitter;
  emitter.radius = radius, emitter.speed = speed;
  return emitter;
}

/// Particles that an emitter alone has sent by `end` s.
size_t sent_by(const FluidEmitter& emitter, double end) {
  Shot shot = empty_shot();
  shot.domain.min = V3d(-100), shot.domain.max = V3d(100);
  shot.timeline = {1001, 1002, 1 / end};
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  return simulator.advance_frame().particles;
}

// Area x speed x time of fluid at rest density, whatever the inlet is of the lattice: to the layer
// that is half out, and no drift from there.
TEST(Emitter, DeliversAreaTimesSpeedTimesTime) {
  const double end = 2;  // s
  for (const double radius : {0.006, 0.013, 0.021, 0.0334, 0.05}) {
    const double volume = double(sent_by(disc(radius, 1), end)) * 1e-6;
    const double expected = M_PI * radius * radius * 1 * end;
    EXPECT_NEAR(volume, expected, 0.01 * expected) << radius;
  }
  FluidEmitter inlet;
  inlet.type = EmitterType::rectangle, inlet.speed = 0.7;
  inlet.u = V3d(0.031, 0, 0), inlet.v = V3d(0, 0.0112, 0.0112);
  const double expected = 4 * inlet.u.length() * inlet.v.length() * 0.7 * end;
  EXPECT_NEAR(double(sent_by(inlet, end)) * 1e-6, expected, 0.01 * expected);
}

/// A jet without gravity, after `end` s.
sim::HostState jet(const FluidEmitter& emitter, double end) {
  Shot shot = empty_shot();
  shot.domain.min = V3d(-10), shot.domain.max = V3d(10);
  shot.fluid.solver = FluidSolver::incompressible;
  shot.timeline = {1001, 1002, 1 / end};
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  simulator.advance_frame();
  const ParticleFrame frame = simulator.particles();
  sim::HostState state;
  for (size_t i = 0; i < frame.position.size(); ++i) {
    state.position.push(frame.position[i].x, frame.position[i].y, frame.position[i].z);
    state.velocity.push(frame.velocity[i].x, frame.velocity[i].y, frame.velocity[i].z);
  }
  return state;
}

// Layers leave whole, a spacing apart: a jet in free flight has no pair nearer than 0.9 spacings,
// and every particle still has the inlet's speed to 1 %.
TEST(Emitter, KeepsParticlesASpacingApart) {
  for (const double radius : {0.025, 0.034}) {
    const sim::HostState state = jet(disc(radius, 1), 0.3);
    std::vector<V3d> points;
    double slowest = 1e30, fastest = 0;
    for (size_t i = 0; i < state.position.size(); ++i) {
      points.push_back(at(state.position, i));
      slowest = std::min(slowest, -at(state.velocity, i).y);
      fastest = std::max(fastest, -at(state.velocity, i).y);
    }
    EXPECT_GT(least_distance(points), 0.009) << radius;
    EXPECT_GT(slowest, 0.99) << radius;
    EXPECT_LT(fastest, 1.01) << radius;
  }
}

// An inlet that moves sideways at 2 m/s throws its fluid sideways at 2 m/s: the jet stays a
// straight column beneath it.
TEST(Emitter, CarriesItsFluidAlong) {
  const double end = 0.2;
  FluidEmitter emitter = disc(0.03, 1);
  emitter.center.keys = {{1001, V3d(0)}, {1002, V3d(2 * end, 0, 0)}};
  const sim::HostState state = jet(emitter, end);
  ASSERT_GT(state.position.size(), 100u);
  for (size_t i = 0; i < state.position.size(); ++i) {
    EXPECT_NEAR(at(state.velocity, i).x, 2, 0.02);
    EXPECT_LT(std::hypot(at(state.position, i).x - 2 * end, at(state.position, i).z), 0.033);
  }
}

// Its start counts from the simulation's start: the pre-roll fills the shot's first frame.
TEST(Emitter, DeliversDuringThePreroll) {
  Shot shot = empty_shot();
  shot.preroll = 0.4;
  FluidEmitter emitter;
  emitter.center = V3d(0), emitter.radius = 0.1, emitter.speed = 1, emitter.start = 0.2;
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  EXPECT_EQ(simulator.particles().position.size(), 0u);
  const double volume = double(simulator.preroll().particles) * 1e-6,
               expected = M_PI * 0.01 * 1 * 0.2;
  EXPECT_EQ(simulator.frame(), 1001);
  EXPECT_NEAR(volume, expected, 0.03 * expected);  // half a layer of 20
}

// Its stop does too: after the pre-roll this emitter is silent.
TEST(Emitter, StopsDuringThePreroll) {
  Shot shot = empty_shot();
  shot.preroll = 0.4;
  FluidEmitter emitter = disc(0.1, 1);
  emitter.stop = 0.3;
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  const size_t before = simulator.preroll().particles;
  EXPECT_NEAR(double(before) * 1e-6, M_PI * 0.01 * 0.3, 0.03 * M_PI * 0.01 * 0.3);
  EXPECT_EQ(simulator.advance_frame().particles, before);
}

TEST(Emitter, IsSilentBeforeItsStartAndAfterItsStop) {
  Shot shot = empty_shot();
  shot.timeline = {1001, 1005, 20};
  FluidEmitter emitter;
  emitter.center = V3d(0), emitter.radius = 0.03, emitter.speed = 1, emitter.start = 0.07,
  emitter.stop = 0.12;
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  EXPECT_EQ(simulator.advance_frame().particles, 0u);  // to 0.05 s
  EXPECT_GT(simulator.advance_frame().particles, 0u);
  const size_t third = simulator.advance_frame().particles;  // to 0.15 s
  EXPECT_EQ(simulator.advance_frame().particles, third);
}

// A box that is there and two emitters, after a pre-roll and a restart: every particle knows which
// it came from and since when.
TEST(Births, GiveSourcesAndAges) {
  Shot shot = empty_shot();
  shot.fluid.write_source = shot.fluid.write_age = true;
  shot.preroll = 0.05;
  shot.fluid.box.push_back({V3d(-0.3, -0.9, -0.1), V3d(-0.2, -0.8, 0.1)});
  FluidEmitter emitter;
  emitter.radius = 0.03, emitter.speed = 1;
  emitter.center = V3d(0.2, 0.5, 0);
  shot.fluid.emitter.push_back(emitter);
  emitter.center = V3d(0.5, 0.5, 0);
  emitter.start = 0.1;  // s after the start of the pre-roll
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  for (int frame = 0; frame < 3; ++frame) simulator.advance_frame();
  const ParticleFrame frame = simulator.particles();
  const double now = 3 / shot.timeline.fps;
  const float total = float(now + shot.preroll);
  size_t seen[3] = {};
  for (size_t i = 0; i < frame.position.size(); ++i) {
    ASSERT_LT(frame.source[i], 3);
    ++seen[frame.source[i]];
    const float x = frame.position[i].x;
    EXPECT_EQ(frame.source[i], x < 0 ? 0 : x < 0.35f ? 1 : 2);
    if (frame.source[i] == 0) {
      EXPECT_FLOAT_EQ(frame.age[i], total);
      continue;
    }
    const float age = frame.age[i];  // at 1 m/s down; a layer may press on the one before
    EXPECT_NEAR(0.5f - frame.position[i].y, age, 2.5 * shot.fluid.spacing);
    EXPECT_LE(age, frame.source[i] == 1 ? total : total - 0.1f);
  }
  EXPECT_EQ(seen[0], 10u * 10 * 20);
  EXPECT_GT(seen[1], 1.5 * double(seen[2]));
  EXPECT_GT(seen[2], 100u);

  const auto folder = std::filesystem::temp_directory_path() / "drench_births";
  simulator.write_checkpoint(folder);
  Simulator resumed(shot, {});
  resumed.read_checkpoint(folder);
  std::filesystem::remove(folder);
  EXPECT_EQ(resumed.particles().age, frame.age);
  EXPECT_EQ(resumed.particles().source, frame.source);
}

}  // namespace
}  // namespace drench::sim_tests

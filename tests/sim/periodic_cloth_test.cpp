// Sheets and periodic axes: what spans a period has no edge, what lies across a seam is whole, and
// nothing tells where the seam is.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "sim/probe_series.h"
#include "sim/simulator.h"
#include "tests/sim/crossings.h"
#include "tests/sim/periodic_scenes.h"
#include "tests/sim/said.h"
#include "tests/sim/same_state.h"
#include "tests/temporary_folder.h"
#include "tests/validation/strip_pool.h"

namespace drench::sim_tests {
namespace {

constexpr double a = 0.01;  // m, spacing

/// A horizontal sheet with its corner at `corner` of cells of a spacing.
Cloth& add_grid(Shot& shot, V3d corner, int nx, int nz) {
  Cloth& sheet = shot.cloth.emplace_back();
  sheet.corner = corner, sheet.u = V3d(nx * a, 0, 0), sheet.v = V3d(0, 0, nz * a);
  sheet.cells = V2i(nx, nz), sheet.damping = 0;
  return sheet;
}

// --- Topology -----------------------------------------------------------------------------------

TEST(JoinedSheet, HasNoEdgeAtTheSeamAndNoSpringTooFew) {
  Shot shot = slab({10, 20, 6});
  add_grid(shot, V3d(0.02, 0.1, 0.013), 7, 6);  // spans z alone
  const sim::Scene scene = sim::build_scene(shot);
  const sim::ClothTopology& t = scene.cloth;
  ASSERT_EQ(t.vertices(), 8 * 6);
  for (int v = 0; v < t.vertices(); ++v) {
    const bool edge = v % 8 == 0 || v % 8 == 7;
    EXPECT_EQ(t.rim[v] != 0, edge) << v;
    EXPECT_EQ(t.spring_start[v + 1] - t.spring_start[v], edge ? 5 : 8);
    EXPECT_NEAR(t.mass[v], 0.2 * a * a * (edge ? 0.5 : 1), 1e-10);
    for (int k = t.spring_start[v]; k < t.spring_start[v + 1]; ++k) {
      const V3d d = at(scene.start.cloth_position, t.spring_end[k]) + at(t.spring_shift, k) -
                    at(scene.start.cloth_position, v);
      EXPECT_NEAR(d.length(), t.rest_length[k], 1e-8);
      EXPECT_LT(d.length(), 1.5 * a);
    }
  }
  for (int k = 0; k < t.triangles(); ++k) {
    V3d x[3];
    for (int e = 0; e < 3; ++e) {
      x[e] = at(scene.start.cloth_position, t.corner[3 * k + e]) + at(t.corner_shift, 3 * k + e);
    }
    EXPECT_NEAR((x[1] - x[0]).cross(x[2] - x[0]).y, a * a, 1e-9);
  }
}

// Both axes: a torus without any edge, whose four corners are one node.
TEST(JoinedSheet, SpansTwoAxes) {
  Shot shot = slab({6, 20, 8});
  add_grid(shot, V3d(-0.03, 0.1, 0.05), 6, 8);
  const sim::ClothTopology t = sim::build_scene(shot).cloth;
  ASSERT_EQ(t.vertices(), 48);
  EXPECT_EQ(std::count(t.rim.begin(), t.rim.end(), 0), 48);
  EXPECT_EQ(std::count(t.neighbour.begin(), t.neighbour.end(), -1), 0);
  EXPECT_EQ(t.spring_end.size(), size_t(48 * 8));
}

// The same sheet from a file, whose vertices know nothing of each other.
TEST(JoinedSheet, AMeshFileIsJoinedAsAGridIs) {
  const test::TemporaryFolder folder;
  Shot shot = slab({10, 20, 6});
  Cloth& sheet = add_grid(shot, V3d(0.02, 0.1, 0), 5, 6);
  const sim::ClothTopology grid = sim::build_scene(shot).cloth;
  std::string obj;
  for (int j = 0; j <= 6; ++j) {
    for (int i = 0; i <= 5; ++i)
      obj += "v " + std::to_string(0.02 + i * a) + " 0.1 " + std::to_string(j * a) + "\n";
  }
  for (int j = 0; j < 6; ++j) {
    for (int i = 1; i <= 5; ++i) {
      const auto name = [&](int p, int q) { return " " + std::to_string((j + q) * 6 + i + p); };
      obj += "f" + name(0, 0) + name(0, 1) + name(1, 1) + "\nf" + name(0, 0) + name(1, 1) +
             name(1, 0) + "\n";
    }
  }
  write_file_whole(folder / "sheet.obj", obj);
  sheet.mesh_file = folder / "sheet.obj";
  const sim::ClothTopology mesh = sim::build_scene(shot).cloth;
  EXPECT_EQ(mesh.corner, grid.corner);
  EXPECT_EQ(mesh.neighbour, grid.neighbour);
  EXPECT_EQ(mesh.rim, grid.rim);
  EXPECT_EQ(mesh.corner_shift.z, grid.corner_shift.z);
  // Each of its 5 x 6 squares has a diagonal edge; the other diagonal is the bend across it, and
  // edges inside have a bend as well: 6 x 6 along z, 5 x 6 along x, less 2 x 6 at the rim.
  EXPECT_EQ(mesh.spring_end.size() / 2, size_t(30 + 30 + 36 + 30 + (36 - 12) + 30));
}

TEST(JoinedSheet, RefusesASlitAndTooFewCells) {
  Shot shot = slab({10, 20, 6});
  Cloth& sheet = add_grid(shot, V3d(0.02, 0.1, 0), 5, 6);
  EXPECT_EQ(refusal(shot), "");
  sheet.v.z = 5.7 * a;
  EXPECT_NE(refusal(shot).find("fluid would leak there"), std::string::npos) << refusal(shot);
  sheet.v.z = 5.4 * a;
  EXPECT_EQ(refusal(shot), "");
  sheet.v.z = 6 * a, sheet.cells.y = 2;
  EXPECT_NE(refusal(shot).find("three cells around"), std::string::npos) << refusal(shot);
}

// Fluid on an image of a sheet is fluid inside the sheet.
TEST(JoinedSheet, RefusesFluidInsideAnImage) {
  Shot shot = slab({12, 20, 12});
  add_grid(shot, V3d(0.09, 0.1, 0.09), 6, 6);  // to 0.15
  add_box(shot, V3d(0, 0.1 - a / 2, 0), {2, 1, 2});
  EXPECT_NE(refusal(shot).find("fluid starts inside cloth"), std::string::npos);
  shot.fluid.box[0].min.x += 0.05, shot.fluid.box[0].max.x += 0.05;
  EXPECT_EQ(refusal(shot), "");
}

// --- Statics ------------------------------------------------------------------------------------

class StripPool : public testing::TestWithParam<std::tuple<ClothModel, int>> {};
INSTANTIATE_TEST_SUITE_P(Springs, StripPool,
                         testing::Combine(testing::Values(ClothModel::springs),
                                          testing::Values(15, 20, 30)));
INSTANTIATE_TEST_SUITE_P(Shell, StripPool,
                         testing::Combine(testing::Values(ClothModel::shell),
                                          testing::Values(15, 20, 30)));

// Two-dimensional in all that can be measured: see strip_pool.h. Measured: docs/benchmarks.
TEST_P(StripPool, HangsAsAPlaneChainDoes) {
  const auto [model, across] = GetParam();
  const validation::StripPool pool = validation::strip_pool(across, 1, model);
  const double spacing = 0.3 / across;
  ASSERT_GT(pool.static_sag, 0.02);
  EXPECT_NEAR(pool.sag / pool.static_sag, 1, 0.02);
  EXPECT_LT(pool.shape, 0.02);
  EXPECT_LT(pool.spread, 0.02 * pool.static_sag);
  EXPECT_GT(pool.lowest, 0);
  EXPECT_LT(pool.lowest, 0.8 * spacing);
}

// --- Nothing tells where the seam is -------------------------------------------------------------

enum class Sheets { joined, loose };

/// Water that hits a sheet, all of it moved by `shift` m and flying by `drift` m/s.
Shot splash(Sheets sheets, const V3d& shift, const V3d& drift = V3d(0)) {
  Shot shot = slab({15, 40, 12});
  shot.domain.axis[1] = Axis::periodic;
  shot.fluid.tolerance = 1e-6;  // coarse levels stand at other places: solves agree when done
  const V3d corner = V3d(0.03, 0.1, 0.03) + shift;
  Cloth& sheet = sheets == Sheets::joined ? add_grid(shot, V3d(0.005, 0.1, 0.005) + shift, 15, 12)
                                          : add_grid(shot, corner, 8, 8);
  sheet.velocity = drift;
  add_box(shot, corner + V3d(a, 0.011, 0), {6, 5, 5}, V3d(0.3, -1, 0.2) + drift);
  return shot;
}

class Seam : public testing::TestWithParam<Sheets> {};
INSTANTIATE_TEST_SUITE_P(Sheet, Seam, testing::Values(Sheets::joined, Sheets::loose),
                         [](const auto& sheets) {
                           return sheets.param == Sheets::joined ? "Joined" : "Loose";
                         });

// Moved by a third of the period along x and z and so that all of it lies across the seam of y.
TEST_P(Seam, IsNowhere) {
  const V3d shift(0.05, 0.285, 0.04);
  Stepper here(splash(GetParam(), V3d(0))), there(splash(GetParam(), shift));
  const V3d period = period_of(splash(GetParam(), V3d(0)));
  for (int k = 0; k < 60; ++k) here.step(2e-4), there.step(2e-4);
  const sim::HostState p = here.solver->save(), q = there.solver->save();
  double push = 0;  // they did meet
  for (const float v : p.cloth_velocity.y) push = std::max(push, double(std::abs(v)));
  ASSERT_GT(push, 0.3);
  EXPECT_LT(difference(p, q, shift, period), 2e-6);
}

// The same as it flies through all seams: sheets keep coordinates of their own, particles do not.
TEST_P(Seam, IsNowhereInFlight) {
  const V3d drift(11, -4, 9);
  const auto scene_of = [](const V3d& drift) {
    Shot shot = splash(GetParam(), V3d(0), drift);
    shot.fluid.tolerance = 1e-6;  // an iteration more or less is not to count
    sim::Scene scene = sim::build_scene(shot);
    scene.parameters.sound_speed = 15;  // the automatic one counts the drift
    return scene;
  };
  Stepper still(scene_of(V3d(0))), flying(scene_of(drift));
  const V3d period = period_of(splash(GetParam(), V3d(0)));
  constexpr int steps = 70;
  for (int k = 0; k < steps; ++k) still.step(2e-4), flying.step(2e-4);
  const V3d shift = drift * (steps * 2e-4);
  ASSERT_GT(shift.z, period.z);
  EXPECT_LT(difference(still.solver->save(), flying.solver->save(), shift, period), 1e-5);
}

// A lattice on both sides of a sheet that spans both axes, all of it at rest.
TEST(JoinedSheet, ALatticeAroundItStaysAtRest) {
  Shot shot = slab({6, 12, 9});
  shot.domain.axis[1] = Axis::periodic;
  Cloth& sheet = add_grid(shot, V3d(0.02, 0.02, 0.05), 6, 9);
  sheet.thickness = 1e-6;
  add_box(shot, V3d(0, 0.02, 0), {6, 12, 9});
  Stepper run(shot);
  for (int k = 0; k < 50; ++k) run.step(1e-3);
  const sim::HostState state = run.solver->save();
  EXPECT_LT(difference(run.scene.start, state, V3d(0), period_of(shot)), 1e-4 * a);
  EXPECT_EQ(state.guard_hits, 0u);
}

// --- Conservation -------------------------------------------------------------------------------

TEST_P(Seam, KeepsMomentum) {
  for (const double speed : {1., 6.}) {
    Shot shot = splash(GetParam(), V3d(0.05, 0.285, 0.04));
    shot.fluid.box[0].velocity = V3d(0.3, -1, 0.2) * speed;
    Stepper run(shot);
    const V3d before = total_momentum(run.scene, run.scene.start);
    double worst = 0, cloth = 0;
    for (int k = 0; k < 250; ++k) {
      run.step(std::min(run.stable_dt(), 3e-4 / speed));
      const sim::HostState state = run.solver->save();
      worst = std::max(worst, (total_momentum(run.scene, state) - before).length() /
                                  momentum_scale(run.scene, state, speed / std::sqrt(2.)));
      V3d own(0);
      for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
        own += at(state.cloth_velocity, v) * double(run.scene.cloth.mass[v]);
      cloth = std::max(cloth, own.length());
    }
    EXPECT_LT(worst, 1e-5) << speed;
    EXPECT_GT(cloth, 1e-4 * speed) << speed;
  }
}

// --- Crossings ----------------------------------------------------------------------------------

/// Every path of every substep against all images of the sheet.
int crossings(Stepper& run, const V3d& period, int steps, double dt) {
  sim::HostState before = run.solver->save();
  int count = 0;
  run.solver->observe_substeps([&](const sim::HostState& state) {
    count += count_crossings(run.scene.cloth, before, state, period);
    before = state;
  });
  for (int k = 0; k < steps; ++k) {
    run.step(std::min(run.stable_dt(), dt));
    if (run.limits.bad_particle < 0 && run.limits.bad_vertex < 0) continue;
    ADD_FAILURE() << "blew up in step " << k;
    break;
  }
  run.solver->observe_substeps({});
  return count;
}

// A block at the seam of a pinned sheet that spans z: falls, jets and grazing ones.
TEST(JoinedSheet, NothingCrossesAtTheSeam) {
  struct Case {
    V3d velocity;
    double stiffness;  // N/m; soft cotton gives way until the collision test has to act
    int steps;
  };
  for (const auto& [velocity, stiffness, steps] :
       {Case{V3d(0, -1, 0), 400, 250}, Case{V3d(0, -10, 0), 6000, 250},
        Case{V3d(0, -3, 9), 6000, 250}, Case{V3d(0, -10, 0), 400, 100}}) {
    Shot shot = slab({40, 60, 14});
    shot.domain.axis[0] = shot.domain.axis[1] = Axis::walls;
    shot.gravity = V3d(0, -9.81, 0);
    Cloth& sheet = add_grid(shot, V3d(0.08, 0.2, 0.03), 24, 14);
    sheet.adjacent_stiffness = stiffness, sheet.diagonal_stiffness = stiffness / 2;
    ClothPin pin;
    for (int j = 0; j <= 14; ++j) {
      for (const int i : {0, 24}) pin.vertices.push_back(uint32_t(25 * j + i));
    }
    sheet.pin.push_back(pin);
    add_box(shot, V3d(0.16, 0.215, 0.105), {8, 8, 8}, velocity);  // the seam in its middle
    Stepper run(shot);
    EXPECT_EQ(crossings(run, period_of(shot), steps, 4e-4), 0) << velocity.y;
    double push = 0;
    for (const float v : run.solver->save().cloth_velocity.y)
      push = std::max(push, double(std::abs(v)));
    EXPECT_GT(push, 0.05);
    if (steps == 100) {
      EXPECT_GT(run.solver->save().guard_hits, 100u);
    }
  }
}

TEST_P(Seam, IsCrossedBySheetsAndByNoPathThroughThem) {
  Stepper run(splash(GetParam(), V3d(0.05, 0.285, 0.04), V3d(2, 0.5, -1)));
  EXPECT_EQ(crossings(run, period_of(splash(GetParam(), V3d(0))), 150, 3e-4), 0);
}

// --- Determinism and files ----------------------------------------------------------------------

TEST_P(Seam, SameBitsForAnyNumberOfThreads) {
  expect_same_bits_on_threads(splash(GetParam(), V3d(0.05, 0.285, 0.04)), 60, 2e-4);
}

// Both edges at the seam are drawn, a period apart and moving as one.
TEST_P(Seam, ResumesWithTheSameBitsAndDrawsNoHole) {
  const test::TemporaryFolder folder;
  Shot shot = splash(GetParam(), V3d(0.05, 0.285, 0.04));
  shot.timeline = {1, 10, 120};
  Simulator whole(shot, {.device = Device::cpu}), first(shot, {.device = Device::cpu}),
      second(shot, {.device = Device::cpu});
  whole.advance_frame(), first.advance_frame();
  first.write_checkpoint(folder / "state");
  second.read_checkpoint(folder / "state");
  for (int frame = 0; frame < 2; ++frame) whole.advance_frame(), second.advance_frame();
  EXPECT_EQ(whole.particles().position, second.particles().position);
  EXPECT_EQ(whole.particles().velocity, second.particles().velocity);
  const TriangleMesh mesh = whole.cloth()[0].mesh;
  EXPECT_EQ(mesh.position, second.cloth()[0].mesh.position);
  EXPECT_EQ(mesh.velocity, second.cloth()[0].mesh.velocity);
  if (GetParam() == Sheets::loose) return;
  ASSERT_EQ(mesh.position.size(), size_t(16 * 13));
  for (size_t j = 0; j < 13; ++j) {
    const V3f d = mesh.position[16 * j + 15] - mesh.position[16 * j];
    EXPECT_LT((d - V3f(0.15f, 0, 0)).length(), 1e-6f);
    EXPECT_EQ(mesh.velocity[16 * j + 15], mesh.velocity[16 * j]);
  }
}

// --- Other parts that look at sheets -------------------------------------------------------------

// Sheets alone, explicit steps: a joined sheet that is stretched along the periodic axis pulls on
// nothing, one that waves along it swings as it does elsewhere.
TEST(JoinedSheet, AloneItSwingsTheSameWhereverTheSeamIs) {
  const auto swing = [](double offset) {
    Shot shot = slab({12, 20, 12});
    add_grid(shot, V3d(0, 0.1, offset), 12, 12);
    sim::Scene scene = sim::build_scene(shot);
    for (int v = 0; v < scene.cloth.vertices(); ++v)
      scene.start.cloth_velocity.y[size_t(v)] = float(0.3 * std::sin(2 * M_PI * (v / 12) / 12.));
    Stepper run(scene);
    for (int k = 0; k < 100; ++k) run.step(5e-4);
    return run.solver->save();
  };
  const sim::HostState here = swing(0), there = swing(0.04);
  double high = 0;
  for (size_t v = 0; v < here.cloth_position.size(); ++v) {
    EXPECT_NEAR(here.cloth_position.y[v], there.cloth_position.y[v], 1e-6);
    EXPECT_NEAR(here.cloth_position.z[v] + 0.04, there.cloth_position.z[v], 1e-6);
    high = std::max(high, std::abs(here.cloth_position.y[v] - 0.1));
  }
  EXPECT_GT(high, 1e-3);
}

// A closed sheet falls through air as fast as one that is free all around, of whatever size:
// sqrt(2 sigma g / (rho C)).
TEST(JoinedSheet, FallsThroughAirAsFastAsItsWeightSays) {
  Shot shot = slab({12, 200, 12});
  shot.domain.axis[1] = Axis::periodic;
  shot.gravity = V3d(0, -9.81, 0);
  shot.wind.present = true;
  add_grid(shot, V3d(0.005, 0.1, 0.005), 12, 12);
  Stepper run(shot);
  for (int k = 0; k < 2000; ++k) run.step(1e-3);
  const double speed =
      std::sqrt(2 * 0.2 * 9.81 / (run.scene.parameters.air_density * shot.wind.cloth_drag));
  for (const float v : run.solver->save().cloth_velocity.y) EXPECT_NEAR(-v / speed, 1, 1e-3);
}

// Energy of a strained sheet by its probe: each spring counts once, those across the seam too.
TEST(JoinedSheet, ProbesCountSpringsAcrossTheSeam) {
  Shot shot = slab({12, 20, 12});
  add_grid(shot, V3d(0, 0.1, 0.02), 12, 12);
  Probe& probe = shot.probe.emplace_back();
  probe.name = "energy", probe.type = ProbeType::energy;
  sim::Scene scene = sim::build_scene(shot);
  for (float& length : scene.cloth.rest_length) length *= 0.9f;
  Stepper run(scene);
  sim::ProbeSeries series(shot, run.scene);
  series.start(0, *run.solver);
  // 288 adjacent springs of 400 N/m strained by a tenth of a, 288 diagonal ones by that of their
  // length.
  const double strain = 0.1 * a, expected = 288 * 0.5 * strain * strain * (400 + 200 * 2);
  EXPECT_NEAR(series.rows()[3], expected, 1e-4 * expected);
}

// Gauges and sensors at the seam and half a period from it, in a basin that a wave crosses: the
// same.
TEST(PeriodicProbes, SeeImages) {
  Shot shot = slab({16, 40, 6});
  shot.gravity = V3d(0.5, -9.81, 0);
  shot.domain.axis[0] = shot.domain.axis[1] = Axis::walls;
  add_box(shot, V3d(0), {16, 12, 6});
  for (const double z : {0., 0.03}) {
    Probe& gauge = shot.probe.emplace_back();
    gauge.type = ProbeType::height, gauge.name = z > 0 ? "middle" : "seam";
    gauge.position = V3d(0.08, 0, z);
    Probe sensor = gauge;
    sensor.type = ProbeType::pressure, sensor.name += " inside", sensor.radius = 0.02;
    sensor.position.y = 0.05, sensor.normal = V3d(0, 1, 0);
    shot.probe.push_back(sensor);
    sensor.name += " wall", sensor.position.y = 0;
    shot.probe.push_back(sensor);
  }
  Stepper run(shot);
  sim::ProbeSeries series(shot, run.scene);
  series.start(0, *run.solver);
  while (run.time < 0.2) {
    run.step();
    series.record(run.time, *run.solver);
  }
  const std::vector<double>& rows = series.rows();
  // Per probe: a height, or a pressure and its mean over a window.
  const size_t width = 1 + 2 * (1 + 2 + 2);
  ASSERT_EQ(rows.size() % width, 0u);
  const double* row = rows.data() + rows.size() - width;
  EXPECT_NEAR(row[1], 0.12, 0.01);
  EXPECT_NEAR(row[2], 9810 * 0.07, 150);
  for (size_t k = 1; k <= 5; ++k) EXPECT_NEAR(row[k], row[k + 5], 0.02 * row[k]) << k;
}

// --- Skips --------------------------------------------------------------------------------------

Shot far_from_sides(Axis sides) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.gravity = V3d(0, -9.81, 0);
  shot.domain.axis = {sides, Axis::walls, sides};
  pin_edges(add_sheet(shot, 0.2, 0, 10));
  add_box(shot, V3d(-0.03, 0.02, -0.03), {6, 4, 6});
  return shot;
}

// Sheets that span nothing have no shift; periodic axes bring no pass and no group of columns.
TEST(PeriodicClothSkip, WhatSpansNothingHasNoShift) {
  const Stepper open(far_from_sides(Axis::open)), periodic(far_from_sides(Axis::periodic));
  EXPECT_EQ(periodic.scene.cloth.corner_shift.size(), 0u);
  EXPECT_EQ(periodic.scene.cloth.spring_shift.size(), 0u);
  EXPECT_EQ(periodic.scene.cloth.rest_period.size(), 0u);
  ASSERT_EQ(open.solver->plan().size(), periodic.solver->plan().size());
  for (size_t k = 0; k < open.solver->plan().size(); ++k)
    EXPECT_EQ(open.solver->plan()[k].name, periodic.solver->plan()[k].name);
  EXPECT_EQ(open.solver->allocated(), periodic.solver->allocated());
}

TEST(PeriodicClothSkip, SidesOutOfReachChangeNothingButRounding) {
  Stepper open(far_from_sides(Axis::open)), periodic(far_from_sides(Axis::periodic));
  for (int k = 0; k < 60; ++k) open.step(1e-3), periodic.step(1e-3);
  const sim::HostState p = open.solver->save(), q = periodic.solver->save();
  EXPECT_LT(difference(p, q, V3d(0), V3d(2, 0, 2)), 2e-5);
}

}  // namespace
}  // namespace drench::sim_tests

// What a scene does not contain costs nothing and changes nothing.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "pipeline/contract/shot/shot_file.h"
#include "sim/probe_series.h"
#include "sim/step_plan.h"
#include "tests/sim/same_state.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

constexpr sim::ColumnSet cloth_columns = sim::ColumnGroup::cloth | sim::ColumnGroup::near_cloth |
                                         sim::ColumnGroup::memory | sim::ColumnGroup::contact;

constexpr sim::ColumnSet fluid_columns = sim::ColumnGroup::position | sim::ColumnGroup::velocity |
                                         sim::ColumnGroup::density | sim::ColumnGroup::cells;

TEST(Skip, FluidAloneHasNoClothPassAndNoClothColumn) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {4, 4, 4});
  const Stepper run(shot);
  ASSERT_FALSE(run.solver->plan().empty());
  for (const sim::PassInfo& pass : run.solver->plan())
    EXPECT_FALSE(((pass.reads | pass.writes) & cloth_columns).any()) << pass.name;
  EXPECT_FALSE((run.solver->allocated() & cloth_columns).any());
}

TEST(Skip, ClothAloneHasNoFluidPassAndNoFluidColumn) {
  Shot shot = empty_shot();
  add_sheet(shot, 0.2, 0, 4);
  const Stepper run(shot);
  ASSERT_FALSE(run.solver->plan().empty());
  EXPECT_FALSE((run.solver->allocated() & fluid_columns).any());
}

TEST(Skip, EachCouplingBringsItsOwnPassesOnly) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0, 0.05, 0), {4, 4, 4});
  add_sheet(shot, 0.2, 0, 4);
  for (CouplingScheme scheme : {CouplingScheme::exact, CouplingScheme::paper}) {
    shot.coupling.scheme = scheme;
    const bool published = scheme == CouplingScheme::paper;
    const Stepper run(shot);
    for (const sim::PassInfo& pass : run.solver->plan()) {
      EXPECT_EQ(pass.name == "contact_exact" && published, false);
      EXPECT_EQ(pass.name.rfind("paper", 0) == 0 && !published, false) << pass.name;
    }
    EXPECT_EQ(run.solver->allocated().contains(sim::ColumnGroup::memory), !published);
  }
}

// So that a change of any pass shows in the digests of tests/bits.
TEST(Passes, AreAllUsedByTheShotsWhoseBitsAreKept) {
  std::set<std::string> used;
  for (const auto& entry : std::filesystem::directory_iterator(DRENCH_SOURCE_DIR "/tests/bits")) {
    if (entry.path().extension() != ".toml") continue;
    Shot shot = read_shot(entry.path(), {});
    // A mesh needs OpenVDB, which these tests do not link; a ball takes the same passes.
    for (Obstacle& obstacle : shot.obstacle)
      if (obstacle.type == ObstacleType::mesh)
        obstacle.type = ObstacleType::sphere, obstacle.radius = obstacle.scale;
    shot.fluid.volume.clear();
    for (const sim::PassInfo& pass : Stepper(shot).solver->plan()) used.insert(pass.name);
  }
  std::set<std::string> all;
  for (const sim::cpu::Pass& pass : sim::cpu::every_pass()) all.insert(pass.name);
  EXPECT_EQ(used, all);
}

std::set<std::string> names(const std::vector<sim::PassInfo>& plan) {
  std::set<std::string> out;
  for (const sim::PassInfo& pass : plan) out.insert(pass.name);
  return out;
}

TEST(Skip, OnlyAFullBoxMakesItsDensityEven) {
  Shot full = empty_shot();
  full.fluid.solver = FluidSolver::incompressible;
  full.domain.axis = {Axis::walls, Axis::periodic, Axis::walls};
  full.domain.min = V3d(0), full.domain.max = V3d(8 * full.fluid.spacing);
  add_box(full, V3d(0), {8, 8, 8});
  Shot missing = full;  // a layer
  missing.fluid.box.clear();
  add_box(missing, V3d(0), {8, 8, 7});
  const auto with = names(Stepper(full).solver->plan()),
             without = names(Stepper(missing).solver->plan());
  EXPECT_TRUE(with.count("project_closed_domain") && !with.count("project_density"));
  EXPECT_TRUE(!without.count("project_closed_domain") && without.count("project_density"));
}

TEST(Skip, AWeaklyCompressibleFluidHasNothingOfThePressureSolve) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {4, 4, 4});
  for (const auto solver : {FluidSolver::weakly_compressible, FluidSolver::incompressible}) {
    shot.fluid.solver = solver;
    const Stepper run(shot);
    const bool solves = solver == FluidSolver::incompressible;
    EXPECT_EQ(names(run.solver->plan()).count("find_neighbours"), solves);
    const auto groups = run.solver->memory();
    EXPECT_EQ(std::any_of(groups.begin(), groups.end(),
                          [](const sim::ColumnMemory& group) {
                            return group.name.find("pressure solve") != std::string::npos;
                          }),
              solves);
  }
}

/// A shell of cotton without water, held by an edge.
Shot hanging_shell() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  Cloth& sheet = add_sheet(shot, 0.2, 0, 8);
  sheet.model = ClothModel::shell;
  sheet.pin.push_back({{0, 1, 2, 3, 4, 5, 6, 7, 8}, {}});
  return shot;
}

TEST(Skip, AShellWithoutRigidityHasNoRowsOfBending) {
  Shot shot = hanging_shell();
  const auto of_bending = [](const sim::ShellTopology& shell) {
    size_t all = shell.column.size();
    for (const int ring : shell.ring) all -= size_t(ring);
    return all;
  };
  EXPECT_GT(of_bending(sim::build_scene(shot).cloth.shell), 500u);
  shot.cloth[0].bend_warp = shot.cloth[0].bend_weft = shot.cloth[0].bend_bias = 0;
  EXPECT_EQ(of_bending(sim::build_scene(shot).cloth.shell), 0u);
}

TEST(Skip, PatchesAreOfShellsWhoseBendingIsDamped) {
  Shot shot = hanging_shell();
  const auto patches = [&] { return sim::build_scene(shot).cloth.shell.patch.node.size(); };
  shot.cloth[0].damping_time = 0.005;
  EXPECT_GT(patches(), 0u);
  shot.cloth[0].bend_warp = shot.cloth[0].bend_weft = shot.cloth[0].bend_bias = 0;
  EXPECT_EQ(patches(), 0u);
  shot = hanging_shell(), shot.cloth[0].damping_time = 0;
  EXPECT_EQ(patches(), 0u);
}

// Files hold it; steps do not know.
TEST(Skip, StrainThatIsWrittenIsNoPartOfAStep) {
  Shot shot = hanging_shell();
  Stepper plain(shot);
  shot.cloth[0].write_strain = true;
  Stepper written(shot);
  EXPECT_EQ(names(plain.solver->plan()), names(written.solver->plan()));
  EXPECT_EQ(plain.solver->allocated(), written.solver->allocated());
  for (int k = 0; k < 20; ++k) plain.step(2e-3), written.step(2e-3);
  expect_same_state(plain.solver->save(), written.solver->save());
}

/// A block that falls onto a floor, with or without a sheet 0.5 m away.
sim::HostState splash(int steps, bool with_cloth) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.domain.axis[1] = Axis::walls;
  add_box(shot, V3d(0, -0.98, 0), {8, 8, 8});
  if (with_cloth) pin_edges(add_sheet(shot, 0.2, 0, 8));
  Stepper run(shot);
  for (int k = 0; k < steps; ++k) run.step(5e-4);
  return run.solver->save();
}

TEST(Skip, ClothFarAwayChangesNoBitOfTheFluid) {
  const sim::HostState without = splash(200, false), with = splash(200, true);
  EXPECT_EQ(without.id, with.id);
  EXPECT_EQ(without.position.x, with.position.x);
  EXPECT_EQ(without.position.y, with.position.y);
  EXPECT_EQ(without.position.z, with.position.z);
  EXPECT_EQ(without.velocity.x, with.velocity.x);
  EXPECT_EQ(without.velocity.y, with.velocity.y);
  EXPECT_EQ(without.velocity.z, with.velocity.z);
}

// Paths are tested of those particles alone that could meet a sheet within the step.
TEST(Skip, PathsThatNeedNoTestEndWhereTheyWould) {
  for (const FluidSolver solver : {FluidSolver::incompressible, FluidSolver::weakly_compressible}) {
    const auto fall = [&](bool every_path) {
      Shot shot = empty_shot();
      shot.fluid.solver = solver;
      shot.gravity = V3d(0, -9.81, 0);
      add_box(shot, V3d(-0.04, 0.02, -0.04), {8, 8, 8}, V3d(0.3, -3, 0));
      pin_edges(add_sheet(shot, 0.2, 0, 16));
      sim::Scene scene = sim::build_scene(shot);
      scene.parameters.every_path = every_path;
      Stepper run(scene);
      // As long as one substep of the explicit sheet: a path in parts rounds otherwise.
      const double dt = solver == FluidSolver::incompressible ? 3e-4 : 6e-5;
      while (run.time < 0.03) run.step(dt);
      return run.solver->save();
    };
    expect_same_state(fall(true), fall(false));
  }
}

// How far off a particle was is known from step to step and in no checkpoint: a run that forgets it
// in every step looks for all triangles anew.
TEST(Skip, WhatIsKnownOfFarParticlesChangesNoBit) {
  for (const FluidSolver solver : {FluidSolver::incompressible, FluidSolver::weakly_compressible}) {
    const auto meet = [&](bool forgets) {
      Shot shot = empty_shot();
      shot.fluid.solver = solver;
      shot.gravity = V3d(0, -9.81, 0);
      add_box(shot, V3d(-0.05, 0.08, -0.05), {10, 12, 10}, V3d(0.5, -1, 0));
      add_sheet(shot, 0.2, 0, 16).velocity = V3d(-1, 3, 0);
      Stepper run(shot);
      const auto near = [&] {
        const std::vector<int> triangle = run.solver->near_triangles();
        return std::count_if(triangle.begin(), triangle.end(), [](int t) { return t >= 0; });
      };
      run.step(1e-4);
      EXPECT_EQ(near(), 0);
      while (run.time < 0.04) {
        if (forgets) run.solver->load(run.solver->save());
        run.step(1e-4);
      }
      EXPECT_GT(near(), 200);
      return run.solver->save();
    };
    expect_same_state(meet(true), meet(false));
  }
}

/// A block that falls onto a sheet and a floor, measured by one probe of every kind or by none.
sim::HostState probed_splash(FluidSolver solver, bool probed, std::vector<std::string>& plan,
                             sim::ColumnSet& allocated) {
  Shot shot = empty_shot();
  shot.fluid.solver = solver;
  shot.gravity = V3d(0, -9.81, 0);
  shot.domain.axis[1] = Axis::walls;
  add_box(shot, V3d(0, -0.98, 0), {8, 8, 8});
  if (solver == FluidSolver::weakly_compressible) pin_edges(add_sheet(shot, 0.2, -0.99, 8));
  Probe probe;
  probe.position = V3d(0.04, -1, 0.04), probe.radius = 0.03;
  for (const ProbeType type : {ProbeType::volume, ProbeType::height, ProbeType::pressure,
                               ProbeType::force, ProbeType::energy}) {
    probe.type = type;
    if (probed) shot.probe.push_back(probe);
  }
  probe.type = ProbeType::pressure, probe.position.y = -0.96;
  if (probed) shot.probe.push_back(probe);
  Stepper run(shot);
  sim::ProbeSeries series(shot, run.scene);
  series.start(0, *run.solver);
  for (int k = 0; k < 200; ++k) {
    run.step(5e-4);
    series.record(run.time, *run.solver);
  }
  EXPECT_EQ(series.rows().empty(), !probed);
  for (const sim::PassInfo& pass : run.solver->plan()) plan.push_back(pass.name);
  allocated = run.solver->allocated();
  return run.solver->save();
}

TEST(Skip, ProbesAddNoPassAndNoColumnAndChangeNoBit) {
  for (const auto solver : {FluidSolver::incompressible, FluidSolver::weakly_compressible}) {
    std::vector<std::string> plan, probed_plan;
    sim::ColumnSet columns, probed_columns;
    const sim::HostState a = probed_splash(solver, false, plan, columns),
                         b = probed_splash(solver, true, probed_plan, probed_columns);
    EXPECT_EQ(plan, probed_plan);
    EXPECT_EQ(columns, probed_columns);
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.position.x, b.position.x);
    EXPECT_EQ(a.position.y, b.position.y);
    EXPECT_EQ(a.velocity.y, b.velocity.y);
    EXPECT_EQ(a.pressure_term, b.pressure_term);
    EXPECT_EQ(a.cloth_position.y, b.cloth_position.y);
  }
}

// refresh() between steps, as every frame's end makes it, changes nothing either.
TEST(Skip, RefreshChangesNoBit) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  add_box(shot, V3d(-0.04, 0.01, -0.04), {8, 8, 8});
  add_sheet(shot, 0.2, 0, 8);
  Stepper plain(shot), refreshed(shot);
  for (int k = 0; k < 60; ++k) {
    plain.step(3e-4), refreshed.step(3e-4);
    refreshed.solver->refresh();
  }
  plain.solver->refresh();
  const sim::HostState a = plain.solver->save(), b = refreshed.solver->save();
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.position.y, b.position.y);
  EXPECT_EQ(a.velocity.y, b.velocity.y);
  EXPECT_EQ(a.cloth_position.y, b.cloth_position.y);
}

/// Half a ball on a plane.
Shot sessile(double angle_deg, double tension) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = 0.001, shot.fluid.surface_tension = tension;
  shot.fluid.sphere.push_back({V3d(0), 0.005});
  Obstacle& plane = shot.obstacle.emplace_back();
  plane.type = ObstacleType::plane, plane.contact_angle_deg = angle_deg;
  return shot;
}

bool has_contact_angles(const Shot& shot) {
  const Stepper run(shot);
  bool any = false;
  for (const sim::PassInfo& pass : run.solver->plan()) any |= pass.name == "apply_contact_angles";
  return any;
}

TEST(Skip, OnlyOtherAnglesThanRightOnesOfATenseFluidHaveAPass) {
  EXPECT_TRUE(has_contact_angles(sessile(60, 0.072)));
  EXPECT_FALSE(has_contact_angles(sessile(90, 0.072)));
  EXPECT_FALSE(has_contact_angles(sessile(60, 0)));
  Shot far = sessile(90, 0.072);  // walls that there are none of
  far.domain.axis = {Axis::open, Axis::open, Axis::open}, far.domain.contact_angle_deg = 60;
  EXPECT_FALSE(has_contact_angles(far));
}

}  // namespace
}  // namespace drench::sim_tests

// Sheets of springs against their closed forms (tests/validation/README.md).

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// A sheet that hangs in the plane z = 0 from its upper edge at y = 0.
Shot hanging_sheet(double length, int cells, double adjacent) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  Cloth cloth;
  cloth.corner = V3d(0), cloth.u = V3d(length / 2, 0, 0), cloth.v = V3d(0, -length, 0);
  cloth.cells = V2i(cells / 2, cells);
  cloth.adjacent_stiffness = adjacent, cloth.diagonal_stiffness = 0;
  ClothPin upper;
  for (int i = 0; i <= cells / 2; ++i) upper.vertices.push_back(uint32_t(i));
  cloth.pin.push_back(upper);
  shot.cloth.push_back(cloth);
  return shot;
}

/// Kinetic, spring and gravity energy, J.
struct Energy {
  double kinetic = 0, potential = 0;
  double total() const { return kinetic + potential; }
};

Energy energy_of(const Stepper& run, const V3d& gravity) {
  const sim::HostState state = run.solver->save();
  const sim::ClothTopology& t = run.scene.cloth;
  Energy energy;
  for (int v = 0; v < t.vertices(); ++v) {
    const V3d x = at(state.cloth_position, v);
    energy.kinetic += 0.5 * t.mass[v] * at(state.cloth_velocity, v).length2();
    energy.potential -= t.mass[v] * gravity.dot(x - V3d(1));
    for (int k = t.spring_start[v]; k < t.spring_start[v + 1]; ++k) {  // each spring stands twice
      const double stretch =
          (at(state.cloth_position, t.spring_end[k]) - x).length() - t.rest_length[k];
      energy.potential += 0.25 * t.stiffness[k] * stretch * stretch;
    }
  }
  return energy;
}

// u/L = w L / (2 k) for any number of links, end nodes of half mass. Positions are known to 5e-7 m
// of 12 mm.
TEST(Cloth, HangingSheetStretchesAsItsClosedForm) {
  const double length = 0.5, adjacent = 20, weight = 0.2 * 9.81;
  for (const auto& row : read_validation("hanging_sheet_stretch.csv")) {
    if (row[0] == "n_springs" || std::stoi(row[0]) > 16) continue;
    Shot shot = hanging_sheet(length, std::stoi(row[0]), adjacent);
    shot.cloth[0].damping = 60;  // near critical for the slowest wave of the sheet
    Stepper run(shot);
    run.advance(2);
    const sim::HostState state = run.solver->save();
    const double tip = state.cloth_position.y.back() - state.cloth_position.y.front();
    const double beta = weight * length / adjacent;
    EXPECT_NEAR((-tip - length) / length, std::stod(row[1]) * beta, 2e-3 * beta) << row[0];
  }
}

/// Largest in-plane displacement of a free sheet after 300 steps of `share` times 2/omega.
double checker_growth(double share) {
  Shot shot = empty_shot();
  Cloth& cloth = add_sheet(shot, 0.32, 0, 16);
  cloth.damping = 0, cloth.spring_damping = 0;
  sim::Scene scene = sim::build_scene(shot);
  const double mass = 0.2 * 0.02 * 0.02;
  const double omega = std::sqrt(4 * (cloth.adjacent_stiffness + cloth.diagonal_stiffness) / mass);
  const sim::HostVec rest = scene.start.cloth_position;
  for (int v = 0; v < scene.cloth.vertices(); ++v) {
    scene.start.cloth_position.x[v] += (v % 17) % 2 ? 2e-5f : -2e-5f;
  }
  scene.parameters.cloth_dt_limit = 1;  // no sub-steps: the step is what is tested
  Stepper run(std::move(scene));
  for (int k = 0; k < 300; ++k) run.step(share * 2 / omega);
  const sim::HostState state = run.solver->save();
  double largest = 0;
  for (size_t v = 0; v < rest.size(); ++v) {
    const double moved = (at(state.cloth_position, v) - at(rest, v)).length();
    largest = std::isfinite(moved) ? std::max(largest, moved) : 1e30;
  }
  return largest / 2e-5;
}

// omega^2 = 4 (k_adj + k_diag) / m: columns that move against each other, the stiffest wave there
// is.
TEST(Cloth, VerletIsStableUpToTheHighestFrequencyOfTheLattice) {
  EXPECT_LT(checker_growth(0.97), 20);
  EXPECT_GT(checker_growth(1.03), 1000);
}

// The simulator keeps 0.7 of 2 / omega with a bound on omega that looks at one vertex at a time: at
// a free corner (a quarter of the mass, half of two springs and one diagonal) omega^2 = (4 k_adj +
// 8 k_diag)/m.
TEST(Cloth, StepLimitLiesBetweenTheLatticeAndItsCorner) {
  Shot shot = empty_shot();
  Cloth& cloth = add_sheet(shot, 0.32, 0, 32);
  cloth.spring_damping = 0;
  const double mass = 0.2 * 0.01 * 0.01, k = cloth.adjacent_stiffness, d = cloth.diagonal_stiffness;
  const double limit = sim::build_scene(shot).parameters.cloth_dt_limit;
  EXPECT_LT(limit, 0.7 * 2 / std::sqrt(4 * (k + d) / mass));
  EXPECT_GT(limit, 0.7 * 2 / std::sqrt(1.02 * (4 * k + 8 * d) / mass));  // 1 % over the eigenvalue
}

// A symplectic step keeps the energy of a swinging sheet within a band that does not widen: its
// error is of order omega dt, and here at most 3 % of the energy that swings.
TEST(Cloth, EnergyOfAnUndampedSheetIsBounded) {
  Shot shot = hanging_sheet(0.5, 16, 100);
  shot.cloth[0].v = V3d(0, 0, 0.5);  // held out and let go
  shot.cloth[0].diagonal_stiffness = 50;
  shot.cloth[0].damping = 0, shot.cloth[0].spring_damping = 0;
  Stepper run(shot);
  const double dt = 0.25 * run.stable_dt(), start = energy_of(run, V3d(0, -9.81, 0)).total();
  double swing = 0, worst_early = 0, worst = 0;
  const int steps = int(2 / dt);
  for (int k = 0; k < steps; ++k) {
    run.step(dt);
    if (k % 10 != 0) continue;
    const Energy energy = energy_of(run, V3d(0, -9.81, 0));
    swing = std::max(swing, energy.kinetic);
    (k < steps / 2 ? worst_early : worst) =
        std::max(k < steps / 2 ? worst_early : worst, std::abs(energy.total() - start));
  }
  RecordProperty("error_of_swing", std::to_string(std::max(worst, worst_early) / swing));
  EXPECT_GT(swing, 0.05);
  EXPECT_LT(worst_early, 0.03 * swing);
  EXPECT_LT(worst, 0.03 * swing);
}

// Eq (3) with d = exp(-c dt): a sheet that glides without force loses exp(-c t) whatever the step.
// The factor of a step is a float near one, an eighth power of one: known to 5e-7, which the steps
// add up.
TEST(Cloth, DampingDoesNotDependOnTheStep) {
  Shot shot = empty_shot();
  Cloth& cloth = add_sheet(shot, 0.1, 0, 4);
  cloth.velocity = V3d(1, 0, 0), cloth.damping = 2;
  cloth.adjacent_stiffness = 1, cloth.diagonal_stiffness = 0.5;  // stable at every step tried
  for (double dt : {1e-4, 3e-4, 1e-3}) {
    sim::Scene scene = sim::build_scene(shot);
    scene.parameters.cloth_dt_limit = 1;
    Stepper run(std::move(scene));
    while (run.time < 0.6 - 1e-9) run.step(dt);
    const sim::HostState state = run.solver->save();
    const double velocity = total_momentum(run.scene, state).x / (0.2 * 0.1 * 0.1);
    const double exact = std::exp(-2 * 0.6);
    EXPECT_NEAR(velocity, exact, 5e-7 * run.steps * exact) << dt;
  }
}

// Springs and their damping act on both ends alike: a free sheet that folds keeps its momentum.
TEST(Cloth, SpringsKeepTheMomentumOfAFreeSheet) {
  Shot shot = empty_shot();
  Cloth& cloth = add_sheet(shot, 0.2, 0, 16);
  cloth.damping = 0, cloth.velocity = V3d(0.3, 0.1, -0.2);
  sim::Scene scene = sim::build_scene(shot);
  Random random(3);
  for (int v = 0; v < scene.cloth.vertices(); ++v) {
    scene.start.cloth_velocity.y[v] += float(2 * random() - 1);
  }
  Stepper run(std::move(scene));
  const V3d before = total_momentum(run.scene, run.solver->save());
  for (int k = 0; k < 500; ++k) run.step(run.stable_dt());
  const sim::HostState state = run.solver->save();
  EXPECT_LT((total_momentum(run.scene, state) - before).length(),
            1e-5 * momentum_scale(run.scene, state, 0.1));
}

/// Period over 2 pi sqrt(l / g) of a square of four vertices that is let go at an angle.
double swing_period(double degrees) {
  const double length = 0.5, angle = degrees * M_PI / 180;
  Shot shot = hanging_sheet(length, 2, 4000);
  shot.cloth[0].cells = V2i(1, 1);  // the upper edge is held: a pendulum without a mass in its rod
  shot.cloth[0].v = length * V3d(0, -std::cos(angle), std::sin(angle));
  shot.cloth[0].damping = 0;
  Stepper run(shot);
  std::vector<double> crossings;
  const float middle = run.solver->save().cloth_position.z.front();
  for (double before = 1; crossings.size() < 3;) {
    const double start = run.time;
    run.step(0.5 * run.stable_dt());
    const double now = run.solver->save().cloth_position.z.back() - middle;
    if (now * before < 0) crossings.push_back(start + (run.time - start) * before / (before - now));
    before = now;
  }
  return (crossings[2] - crossings[0]) / (2 * M_PI * std::sqrt(length / 9.81));
}

// (2 / pi) K(sin^2(angle / 2)). Springs give by 1e-4 under the weight, and up to three times as
// much at the lowest point of a swing.
TEST(Cloth, ASquareSwingsAsAPendulum) {
  for (const auto& row : read_validation("pendulum_period.csv")) {
    if (row[0] == "theta0_deg" || row[0] == "179") continue;
    EXPECT_NEAR(swing_period(std::stod(row[0])) / std::stod(row[1]), 1, 3e-4) << row[0];
  }
}

/// Sag over span of a strip of `cells` links that is longer than its span.
double strip_sag(double length_over_span, int cells) {
  const double span = 0.5, length = length_over_span * span;
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  Cloth strip;
  strip.corner = V3d(0), strip.u = V3d(length, 0, 0), strip.v = V3d(0, 0, length / cells);
  strip.cells = V2i(cells, 1);
  strip.adjacent_stiffness = 4000, strip.diagonal_stiffness = 0, strip.damping = 20;
  ClothPin ends;
  ends.vertices = {0, uint32_t(cells), uint32_t(cells + 1), uint32_t(2 * cells + 1)};
  strip.pin.push_back(ends);
  shot.cloth.push_back(strip);
  sim::Scene scene = sim::build_scene(shot);
  sim::HostVec& x = scene.start.cloth_position;
  const float left = x.x[0];
  for (size_t v = 0; v < x.size(); ++v) {  // two straight halves down to the middle
    const double along = (x.x[v] - left) / length;
    x.x[v] = float(left + along * span);
    x.y[v] -= float(std::min(along, 1 - along) * std::sqrt(length * length - span * span));
  }
  Stepper run(std::move(scene));
  run.advance(2);
  const sim::HostState state = run.solver->save();
  return (state.cloth_position.y[0] - state.cloth_position.y[size_t(cells / 2)]) / span;
}

// A chain of links hangs as the catenary but for the square of a link's length: half the links,
// four times as far off at most.
TEST(Cloth, AStripHangsInACatenary) {
  for (const auto& row : read_validation("catenary.csv")) {
    if (row[0] == "S_over_L" || std::stod(row[0]) < 1.1 || std::stod(row[0]) > 2) continue;
    const double exact = std::stod(row[2]);
    EXPECT_NEAR(strip_sag(std::stod(row[0]), 24) / exact, 1, 2e-3) << row[0];
    EXPECT_NEAR(strip_sag(std::stod(row[0]), 12) / exact, 1, 8e-3) << row[0];
  }
}

}  // namespace
}  // namespace drench::sim_tests

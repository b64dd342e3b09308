// Air against closed forms: terminal speeds, the angle of a hanging sheet, the gusts' own
// statistics.

#include <gtest/gtest.h>

#include <cmath>

#include "sim/passes/air/wind_on_cloth.h"
#include "sim/setup/wind.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81, air = 1.2;

/// @param size  m, half the domain: positions are floats from its corner.
Shot windy_shot(const V3d& velocity, double size = 2) {
  Shot shot = empty_shot();
  shot.domain.min = V3d(-size), shot.domain.max = V3d(size);
  shot.gravity = V3d(0, -g, 0);
  shot.wind.present = true, shot.wind.velocity = velocity;
  return shot;
}

/// Sheets take explicit steps alone, implicit ones beside incompressible fluid, here a far drop.
void make_implicit(Shot& shot) {
  shot.fluid.solver = FluidSolver::incompressible;
  shot.wind.fluid_drag = 0;
  add_box(shot, V3d(1.5, 0, 0), {1, 1, 1});
}

double mean_speed(const sim::HostState& state) {
  double sum = 0;
  for (size_t i = 0; i < state.cloth_velocity.size(); ++i)
    sum -= state.cloth_velocity.y[i] / double(state.cloth_velocity.size());
  return sum;
}

Cloth& falling_sheet(Shot& shot, double areal_density) {
  Cloth& sheet = add_sheet(shot, 0.4, 0, 8);
  sheet.areal_density = areal_density, sheet.damping = 0;
  return sheet;
}

// sigma g = 1/2 rho C_d v^2, to what is left after ten times v / g: nothing. From silk to a plate,
// and the lightest that a shot may have, whose drag an explicit step would not survive.
TEST(WindOnCloth, LetsAFlatSheetFallAtItsTerminalSpeed) {
  for (const bool implicit : {false, true}) {
    for (const double areal_density : {1e-4, 0.02, 0.2, 2.}) {
      Shot shot = windy_shot(V3d(0));
      falling_sheet(shot, areal_density);
      if (implicit) make_implicit(shot);
      const double expected = std::sqrt(2 * areal_density * g / (air * shot.wind.cloth_drag));
      Stepper run(shot);
      const double dt = implicit ? 4e-3 : 1e-3;
      for (double t = 0; t < 5 * expected / g + 10 * dt; t += dt) run.step(dt);
      EXPECT_NEAR(mean_speed(run.solver->save()), expected, 1e-3 * expected)
          << areal_density << (implicit ? " implicit" : " explicit");
    }
  }
}

// v(t) = v_t tanh(g t / v_t): the error falls with the step, first order, three steps. Explicit
// steps are far shorter, for the springs, and their error is rounding.
TEST(WindOnCloth, ApproachesTheTerminalSpeedAsTheClosedForm) {
  for (const bool implicit : {false, true}) {
    double last = 1;
    for (const double coarse : {8e-3, 4e-3, 2e-3}) {
      const double dt = implicit ? coarse : coarse / 32;
      Shot shot = windy_shot(V3d(0));
      falling_sheet(shot, 0.2);
      if (implicit) make_implicit(shot);
      const double top = std::sqrt(2 * 0.2 * g / (air * shot.wind.cloth_drag));
      Stepper run(shot);
      ASSERT_LE(dt, run.scene.parameters.cloth_dt_limit);
      while (run.time < 0.16 - 1e-9) run.step(dt);
      const double error =
          std::abs(mean_speed(run.solver->save()) / (top * std::tanh(g * run.time / top)) - 1);
      EXPECT_LT(error, implicit ? std::min(0.01, 0.65 * last) : 5e-4) << dt;
      last = error;
    }
  }
}

/// tan of the angle from the vertical of a sheet that hangs from its upper edge in a steady wind.
double hanging_slope(double speed, int cells, bool implicit) {
  Shot shot = windy_shot(V3d(speed, 0, 0));
  Cloth sheet;
  sheet.corner = V3d(0, 0, 0), sheet.u = V3d(0, 0, 0.2), sheet.v = V3d(0, -0.4, 0);
  sheet.cells = V2i(cells / 2, cells);
  sheet.areal_density = 0.2, sheet.damping = 20;  // it would flap for ever
  sheet.adjacent_stiffness = 4000, sheet.diagonal_stiffness = 2000;
  ClothPin pin;
  for (int i = 0; i <= cells / 2; ++i) pin.vertices.push_back(uint32_t(i));
  sheet.pin.push_back(pin);
  shot.cloth.push_back(sheet);
  if (implicit) make_implicit(shot);
  Stepper run(shot);
  for (int k = 0; k < (implicit ? 1000 : 2000); ++k) run.step(implicit ? 4e-3 : 2e-3);
  const sim::HostState state = run.solver->save();
  const int row = cells / 2 + 1, last = row * cells;
  const V3d down = at(state.cloth_position, last) - at(state.cloth_position, 0);
  return down.x / -down.y;
}

// Of every piece of a straight sheet at angle t, normal to it: sigma g sin t = 1/2 rho C (V cos
// t)^2; what is along it the tension bears. So the sheet is straight, whatever its cells.
TEST(WindOnCloth, HangsAtTheAngleOfTheBalance) {
  const auto expected = [](double speed) {  // q (1 - s^2) = s with q = 1/2 rho C V^2 / (sigma g)
    const double q = 0.5 * air * 1.2 * speed * speed / (0.2 * g);
    const double sine = (std::sqrt(1 + 4 * q * q) - 1) / (2 * q);
    return sine / std::sqrt(1 - sine * sine);
  };
  for (const int cells : {4, 8, 16})
    EXPECT_NEAR(hanging_slope(3, cells, false), expected(3), 0.005 * expected(3)) << cells;
  EXPECT_NEAR(hanging_slope(3, 16, true), expected(3), 0.005 * expected(3));
  EXPECT_NEAR(hanging_slope(1.5, 16, true), expected(1.5), 0.005 * expected(1.5));
}

/// A drop of one particle that falls, until it falls no faster, m/s.
double drop_speed(double spacing, double dt) {
  Shot shot = windy_shot(V3d(0), 1000);
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = spacing;
  add_box(shot, V3d(0), {1, 1, 1});
  Stepper run(shot);
  double last = -1, speed = 0;
  for (int k = 0; k < 400000 && speed > last; ++k) {
    last = speed;
    for (int s = 0; s < 20; ++s) run.step(dt);
    speed = -at(run.solver->save().velocity, 0).y;
  }
  return speed;
}

// rho_w V g = 1/2 rho_a C_d(Re) pi R^2 v^2 with Schiller and Naumann's coefficient of a sphere:
// drops of 0.12, 1.2 and 12 mm. Gravity comes before drag in a step: up to g dt / 2 v too slow.
TEST(WindOnFluid, LetsADropFallAtItsTerminalSpeed) {
  for (const double spacing : {1e-4, 1e-3, 1e-2}) {
    const double radius = std::cbrt(3 / (4 * M_PI)) * spacing;
    double low = 0, high = 100;
    while (high - low > 1e-9) {
      const double v = 0.5 * (low + high), re = 2 * air * v * radius / 1.8e-5;
      const double coefficient = re > 1000 ? 0.424 : 24 / re * (1 + std::pow(re, 2. / 3) / 6);
      const bool slow = 0.5 * air * coefficient * M_PI * radius * radius * v * v <
                        1000 * std::pow(spacing, 3) * g;
      (slow ? low : high) = v;
    }
    EXPECT_NEAR(drop_speed(spacing, 0.002 * low / g), low, 0.005 * low) << spacing;
  }
}

// A ball of 12 spacings in a wind along x: what is inside feels nothing, nor does the lee; the push
// on all is that of a blunt body of its size, of a coefficient between a sphere's and a plate's.
TEST(WindOnFluid, PushesTheWindwardSideAlone) {
  Shot shot = windy_shot(V3d(10, 0, 0));
  shot.gravity = V3d(0);
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.xsph = 0;
  shot.fluid.sphere.push_back({V3d(0), 0.06, V3d(0)});
  const double dt = 1e-3;
  Stepper run(shot);
  run.step(dt);
  shot.wind.velocity = V3d(0);
  Stepper still(shot);
  still.step(dt);
  const sim::HostState state = run.solver->save(), calm = still.solver->save();
  ASSERT_EQ(state.id, calm.id);
  double force = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    V3d p;
    for (int k = 0; k < 3; ++k) p[k] = run.scene.frame.to_world(k, at(state.position, i)[k]);
    const V3d v = at(state.velocity, i) - at(calm.velocity, i);
    if (p.length() < 0.035 || p.x > 0.02) {
      EXPECT_LT(std::abs(v.x), 1e-6) << p.x;
    }
    force += v.x * run.scene.parameters.particle_mass / dt;
  }
  const double coefficient = force / (0.5 * air * 100 * M_PI * 0.06 * 0.06);
  RecordProperty("coefficient", std::to_string(coefficient));
  EXPECT_GT(coefficient, 0.3);
  EXPECT_LT(coefficient, 1.3);
}

// A wind along an endless level surface finds every particle in the shelter of the next.
TEST(WindOnFluid, PassesOverAPool) {
  Shot shot = windy_shot(V3d(10, 0, 0));
  shot.fluid.solver = FluidSolver::incompressible;
  shot.gravity = V3d(0);
  shot.domain.min = V3d(0), shot.domain.max = V3d(0.1, 0.3, 0.1);
  shot.domain.axis = {Axis::periodic, Axis::walls, Axis::periodic};
  add_box(shot, V3d(0), {10, 10, 10});
  Stepper run(shot);
  run.step(1e-3);
  EXPECT_LT(run.limits.max_speed, 1e-4);
}

// Of many places and times: no mean, the RMS that was asked for, and no divergence.
TEST(Gusts, HaveTheirMeanSizeAndNoDivergence) {
  Shot shot = windy_shot(V3d(4, 0, 1));
  shot.wind.gust = 1.5, shot.wind.gust_size = 0.8;
  const sim::LocalFrame frame{{0, 0, 0}, 0.01};
  const sim::Wind wind(shot, frame);
  Random random(3);
  V3d mean(0);
  double square = 0, divergence2 = 0, gradient2 = 0;
  const int n = 40000;
  const auto at_place = [&](const sim::WindNow& now, const V3d& x) {
    const auto u = sim::cpu::wind_at(now, {float(x.x), float(x.y), float(x.z)});
    return V3d(u.x, u.y, u.z) - V3d(4, 0, 1);
  };
  for (int i = 0; i < n; ++i) {
    const sim::WindNow now = wind.at(10 * random());
    const V3d x(10 * random(), 10 * random(), 10 * random());
    const V3d u = at_place(now, x);
    mean += u / n, square += u.length2() / n;
    if (i % 40 != 0) continue;
    const double e = 0.01;
    double divergence = 0;
    for (int k = 0; k < 3; ++k) {
      V3d step(0);
      step[k] = e;
      const V3d d = (at_place(now, x + step) - at_place(now, x - step)) / (2 * e);
      divergence += d[k], gradient2 += d.length2();
    }
    divergence2 += divergence * divergence;
  }
  EXPECT_LT(mean.length(), 0.05);
  EXPECT_NEAR(std::sqrt(square), 1.5, 0.03);
  EXPECT_LT(divergence2, 1e-4 * gradient2);
}

// The mean wind carries gusts along: with the same phase, the same at x + V t. Their own turning
// over is left out by comparing short times.
TEST(Gusts, AreCarriedByTheWind) {
  Shot shot = windy_shot(V3d(20, 0, 0));
  shot.wind.gust = 0.2, shot.wind.gust_size = 1;
  const sim::Wind wind(shot, {{0, 0, 0}, 0.01});
  double change = 0, stays = 0;
  for (int k = 0; k < 200; ++k) {
    const float x = 0.05f * float(k);
    const auto before = sim::cpu::wind_at(wind.at(0.3), {x, 0.f, 0.f});
    const auto later = sim::cpu::wind_at(wind.at(0.32), {x + 0.4f, 0.f, 0.f});
    const auto there = sim::cpu::wind_at(wind.at(0.32), {x, 0.f, 0.f});
    change += length2(later - before), stays += length2(there - before);
  }
  EXPECT_LT(change, 0.02 * stays);
}

}  // namespace
}  // namespace drench::sim_tests

// Viscosity of the incompressible solver: its rows, its solve, walls, and what it must conserve.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/passes/viscosity/viscosity_solve.h"
#include "tests/sim/listed.h"
#include "tests/sim/same_state.h"

namespace drench::sim_tests {
namespace {

/// dt nu / h^2 of a step of `dt` s.
double viscosity_for(const Shot& shot, double strength, double dt) {
  const double h = 2.15 * shot.fluid.spacing;
  return strength * h * h / dt;
}

/// A cube of 10 x 10 x 10 particles in weightlessness, viscous so that a step of 1 ms has the
/// strength, with random velocities up to 0.05 m/s.
constexpr double cube_dt = 1e-3;
sim::Scene shaken_cube(double strength) {
  Shot shot = water();
  shot.fluid.xsph = 0;
  shot.fluid.kinematic_viscosity = viscosity_for(shot, strength, cube_dt);
  add_box(shot, V3d(0), {10, 10, 10});
  sim::Scene scene = sim::build_scene(shot);
  Random random(9);
  sim::HostVec& v = scene.start.velocity;
  for (std::vector<float>* c : {&v.x, &v.y, &v.z}) {
    for (float& value : *c) value = float(0.1 * (random() - 0.5));
  }
  return scene;
}

struct Motion {
  V3d momentum{0}, angular{0};   // about the centre of mass, both over the mass of a particle
  double energy = 0, rigid = 0;  // m^2/s^2, sums; rigid: of the translation alone
};
Motion motion_of(const sim::HostState& state) {
  Motion motion;
  const V3d centre = centre_of_mass(state);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d v = at(state.velocity, i);
    motion.momentum += v;
    motion.angular += (at(state.position, i) - centre).cross(v);
    motion.energy += 0.5 * v.length2();
  }
  motion.rigid = 0.5 * motion.momentum.length2() / double(state.id.size());
  return motion;
}

class Strength : public testing::TestWithParam<double> {};

// At any step, explicit or implicit, viscosity takes energy out of random motion until the cube
// moves as a rigid body, and neither momentum changes.
TEST_P(Strength, ViscosityTakesEnergyOutAndKeepsMomenta) {
  Stepper run(shaken_cube(GetParam()));
  const Motion start = motion_of(run.solver->save());
  const double scale = std::sqrt(2 * start.energy * double(run.solver->particles()));
  double energy = start.energy;
  for (int k = 0; k < 10; ++k) {
    run.step(cube_dt);
    const Motion now = motion_of(run.solver->save());
    EXPECT_LT(now.energy, energy * (1 + 1e-5)) << k;
    // Rounding grows with the matrix, whose rows sum to 30 strengths: 7e-6 at 100.
    EXPECT_LT((now.momentum - start.momentum).length(), 2e-5 * scale) << k;
    EXPECT_LT((now.angular - start.angular).length(), 2e-5 * scale * 0.05) << k;
    EXPECT_EQ(run.limits.viscous_residual, 0);
    energy = now.energy;
  }
  EXPECT_EQ(run.limits.viscous_iterations > 0, GetParam() > 0.01);
  EXPECT_LT(energy - start.rigid, 0.3 * start.energy);
}

INSTANTIATE_TEST_SUITE_P(Viscosity, Strength, testing::Values(0.0099, 0.0101, 1., 100.));

// A drop of something as thick as pitch turns once in 200 steps as a rigid body; Brookshaw's form,
// which acts along the difference of velocities, would brake it within one of them. 0.1 % leaves
// room for the displacements by pressure; 1e-6 measured.
TEST(Viscosity, ARotatingDropKeepsItsAngularMomentumOverATurn) {
  Shot shot = water();
  shot.fluid.xsph = 0;  // it acts along the difference of velocities as well
  shot.fluid.sphere.push_back({V3d(0), 0.06});
  shot.fluid.kinematic_viscosity = 1;
  sim::Scene scene = sim::build_scene(shot);
  const V3d centre = centre_of_mass(scene.start);
  sim::HostVec& v = scene.start.velocity;
  for (size_t i = 0; i < v.size(); ++i) {
    const V3d d = at(scene.start.position, i) - centre;
    v.x[i] = float(-d.y), v.y[i] = float(d.x);  // 1 rad/s about z
  }
  Stepper run(scene);
  const double start = motion_of(run.solver->save()).angular.z;
  constexpr int n = 200;
  for (int k = 0; k < n; ++k) run.step(2 * M_PI / n);
  const V3d end = motion_of(run.solver->save()).angular;
  EXPECT_NEAR(end.z, start, 1e-3 * start);
  EXPECT_NEAR(std::hypot(end.x, end.y), 0, 1e-3 * start);
}

// The two sides of the choice between explicit and implicit steps: a shear wave of 20 spacings
// decays by the same rate. Their difference is of second order in the rate, 0.5 % a step here.
TEST(Viscosity, ExplicitAndImplicitStepsAgreeWhereTheyMeet) {
  const auto left = [](double strength) {
    Shot shot = water();
    shot.fluid.xsph = 0;
    shot.fluid.kinematic_viscosity = viscosity_for(shot, strength, cube_dt);
    add_box(shot, V3d(0), {4, 20, 4});
    sim::Scene scene = sim::build_scene(shot);
    const float top = scene.start.position.y.back(), bottom = scene.start.position.y.front();
    for (size_t i = 0; i < scene.start.id.size(); ++i) {
      const double phase = (scene.start.position.y[i] - bottom) / (top - bottom);
      scene.start.velocity.x[i] = float(1e-3 * std::cos(M_PI * phase));
    }
    Stepper run(scene);
    for (int k = 0; k < 20; ++k) run.step(cube_dt);
    return std::sqrt(motion_of(run.solver->save()).energy);
  };
  const double below = left(0.00999), above = left(0.01001);
  EXPECT_NEAR(below / above, 1, 5e-3);
}

// Viscosity too weak to count beside the smoothing of velocities is added to it, a stronger one is
// a pass of its own. Both make a shear wave in a periodic box, 20 spacings long, decay as nu k^2 t
// says, up to what kernels as wide as a tenth of it miss.
TEST(Viscosity, SmoothingTakesOnWhatIsWeak) {
  constexpr int steps = 20, wave = 20;
  const auto amplitude = [](double strength) {
    Shot shot = water();
    const double a = shot.fluid.spacing;
    shot.domain.axis = {Axis::periodic, Axis::periodic, Axis::periodic};
    shot.domain.min = V3d(0), shot.domain.max = V3d(6, wave, 6) * a;
    shot.domain.slip = Slip::free, shot.fluid.xsph = 1;
    shot.fluid.kinematic_viscosity = viscosity_for(shot, strength, cube_dt);
    add_box(shot, V3d(0), {6, wave, 6});
    sim::Scene scene = sim::build_scene(shot);
    EXPECT_EQ(sim::smoothing_takes_viscosity(scene.parameters, cube_dt), strength < 0.01 / 30);
    const auto mode = [&](float y) { return std::cos(2 * M_PI * y / (wave * a)); };
    for (size_t i = 0; i < scene.start.id.size(); ++i)
      scene.start.velocity.x[i] = float(1e-3 * mode(scene.start.position.y[i]));
    Stepper run(scene);
    for (int k = 0; k < steps; ++k) run.step(cube_dt);
    const sim::HostState end = run.solver->save();
    double sum = 0;
    for (size_t i = 0; i < end.id.size(); ++i) sum += end.velocity.x[i] * mode(end.position.y[i]);
    return sum;
  };
  const double inviscid = amplitude(0), kh = 2 * M_PI * 2.15 / wave;
  for (const double strength : {0.99 * 0.01 / 30, 1.01 * 0.01 / 30}) {
    const double decay = std::log(inviscid / amplitude(strength));
    EXPECT_NEAR(decay / (steps * strength * kh * kh), 1, 0.05) << strength;
  }
}

// Random particles between no-slip walls: the matrix is symmetric, takes no energy in, and its
// inverse blocks are inverse.
class ViscousMatrix : public testing::Test {
 protected:
  Listed listed{500, 0.07};
  sim::cpu::Column<sim::cpu::Float4> vector, product;
  int done = 0;

  ViscousMatrix() {
    sim::Parameters& p = listed.state.parameters;
    p.dynamic_viscosity = 5, p.no_slip = true, listed.state.dt = 1e-3;
    vector.resize(500), product.resize(500);
  }
  std::vector<V3d> times(const std::vector<V3d>& x) {
    for (size_t i = 0; i < x.size(); ++i)
      vector.data()[i] = {float(x[i].x), float(x[i].y), float(x[i].z), 0.f};
    for_each_neighbour(listed.state.queue, "product", listed.state.pressure.lists, listed.count(),
                       sim::cpu::ViscousProduct<sim::cpu::Straight>{
                           viscous_pairs_of(listed.state, sim::cpu::Straight{}), vector.data(),
                           product.data(), &done});
    std::vector<V3d> y;
    for (size_t i = 0; i < x.size(); ++i)
      y.emplace_back(product.data()[i].x, product.data()[i].y, product.data()[i].z);
    return y;
  }
  std::vector<V3d> random_vector(uint64_t seed) const {
    Random random(seed);
    std::vector<V3d> x(size_t(listed.count()));
    for (V3d& v : x) v = V3d(random() - 0.5, random() - 0.5, random() - 0.5);
    return x;
  }
};
double inner(const std::vector<V3d>& a, const std::vector<V3d>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

TEST_F(ViscousMatrix, IsSymmetricAndNotNegative) {
  const std::vector<V3d> a = random_vector(3), b = random_vector(5);
  const std::vector<V3d> ka = times(a), kb = times(b);
  EXPECT_NEAR(inner(a, kb), inner(b, ka), 1e-5 * inner(a, ka));
  EXPECT_GT(inner(a, ka), 0);
  EXPECT_GT(inner(b, kb), 0);
}

TEST_F(ViscousMatrix, LeavesRigidMotionAloneAwayFromWalls) {
  listed.state.parameters.no_slip = false;
  std::vector<V3d> rigid, shear;
  for (int i = 0; i < listed.count(); ++i) {
    const V3d x = listed.place(i);
    rigid.push_back(V3d(0.1, -0.2, 0.3) + V3d(1, 2, 3).cross(x));
    shear.push_back(V3d(3 * x.y, 0, 0));
  }
  double most = 0, of_shear = 0;
  for (const V3d& v : times(rigid)) most = std::max(most, v.length());
  for (const V3d& v : times(shear)) of_shear = std::max(of_shear, v.length());
  EXPECT_LT(most, 1e-4 * of_shear);
}

TEST_F(ViscousMatrix, BlocksAreInverse) {
  sim::cpu::Column<sim::cpu::Float4> diagonal, cross;
  diagonal.resize(500), cross.resize(500);
  for_each_neighbour(
      listed.state.queue, "blocks", listed.state.pressure.lists, listed.count(),
      sim::cpu::ViscousBlocks<sim::cpu::Straight>{
          viscous_pairs_of(listed.state, sim::cpu::Straight{}), diagonal.data(), cross.data()});
  for (const size_t i : {size_t(0), size_t(170), size_t(499)}) {
    const sim::cpu::Float4 d = diagonal.data()[i], c = cross.data()[i];
    const V3d inverse[3] = {V3d(d.x, c.x, c.z), V3d(c.x, d.y, c.y), V3d(c.z, c.y, d.z)};
    for (int column = 0; column < 3; ++column) {
      std::vector<V3d> unit(500, V3d(0));
      unit[i][column] = 1;
      const V3d of_unit = unit[i] + times(unit)[i];  // a column of the block of 1 + K
      for (int row = 0; row < 3; ++row)
        EXPECT_NEAR(inverse[row].dot(of_unit), row == column ? 1 : 0, 1e-4) << i;
    }
  }
}

/// Honey, or water, 0.1 m deep in a glass of 0.1 m.
Shot glass(double viscosity) {
  Shot shot = water();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.kinematic_viscosity = viscosity;
  shot.domain.min = V3d(0), shot.domain.max = V3d(0.1, 0.2, 0.1);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {10, 10, 10});
  return shot;
}

// Held by walls at its sides and by pressure from below honey stands still: with friction taken
// before the pressures it would climb the walls by about dt g = 25 mm/s. What is left, 1.1 mm/s, is
// what the pressures' tolerance lets through.
TEST(Viscosity, HoneyInAGlassRests) {
  Shot shot = glass(1e-2);
  shot.fluid.tolerance = 1e-5, shot.fluid.xsph = 0;
  Stepper run(shot);
  ASSERT_TRUE(run.scene.parameters.no_slip);
  run.advance(0.5);
  EXPECT_LT(std::sqrt(2 * motion_of(run.solver->save()).energy / 1000), 2e-3);
}

// sqrt(nu 1 s): 1 mm of water, 10 cm of honey, against particles 1 cm apart.
TEST(Viscosity, WallsHoldWhatTheyCanBeSeenToHold) {
  const auto held = [](const Shot& shot) { return sim::build_scene(shot).parameters.no_slip; };
  Shot shot = glass(1e-6);
  EXPECT_FALSE(held(shot));
  EXPECT_TRUE(held(glass(1e-2)));
  shot.domain.slip = Slip::none;
  EXPECT_TRUE(held(shot));
  shot.domain.slip = Slip::automatic, shot.domain.wall_velocity.y_high = V3d(1, 0, 0);
  EXPECT_TRUE(held(shot));
  shot = glass(1e-2), shot.domain.slip = Slip::free;
  EXPECT_FALSE(held(shot));
}

// Two iterations are not enough: it is told, and nothing is made of what they left.
TEST(Viscosity, ASolveCutShortIsToldAndMakesNoEnergy) {
  sim::Scene scene = shaken_cube(10);
  scene.parameters.most_viscous_iterations = 2;
  Stepper run(scene);
  double energy = motion_of(run.solver->save()).energy;
  for (int k = 0; k < 10; ++k) {
    run.step(cube_dt);
    EXPECT_EQ(run.limits.viscous_iterations, 2);
    EXPECT_GT(run.limits.viscous_residual, scene.parameters.viscous_tolerance);
    const double now = motion_of(run.solver->save()).energy;
    EXPECT_LT(now, energy) << k;
    energy = now;
  }
}

TEST(Viscosity, SetsNoLimitToTheStep) {
  Shot thin = glass(0), thick = glass(1);
  EXPECT_EQ(Stepper(thin).stable_dt(), Stepper(thick).stable_dt());
}

TEST(Viscosity, AnyNumberOfThreadsGivesTheSameBits) {
  Shot shot = glass(2e-2);
  shot.domain.max = V3d(0.4, 0.4, 0.2);
  shot.fluid.box.clear();
  add_box(shot, V3d(0), {14, 30, 14});  // more than one chunk of the reductions
  expect_same_bits_on_threads(shot, 15, 2e-3);
}

TEST(Viscosity, ASavedStateGoesOnWithTheSameBits) {
  Shot shot = glass(1e-2);
  shot.domain.max.x = 0.3;
  expect_same_bits_when_resumed(shot, 40, 2e-3);
}

}  // namespace
}  // namespace drench::sim_tests

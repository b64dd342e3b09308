// Contact of shells with themselves and each other (sim/passes/cloth/self_contact.h).

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/same_state.h"
#include "tests/sim/sheet_crossings.h"

namespace drench::sim_tests {
namespace {

constexpr double thickness = 0.001;  // m

Shot shells_alone() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.spacing = 0.01;
  return shot;
}

Cloth& add_shell(Shot& shot, double size, double height, int cells) {
  Cloth& sheet = add_sheet(shot, size, height, cells);
  sheet.name = fmt::format("sheet{}", shot.cloth.size());
  sheet.model = ClothModel::shell;
  sheet.thickness = thickness;
  return sheet;
}

/// Layers of cotton, a fifth more than a thickness apart, the lowest `height` above the floor.
Shot stack(int layers, double height) {
  Shot shot = shells_alone();
  shot.domain.axis[1] = Axis::walls;
  for (int k = 0; k < layers; ++k)
    add_shell(shot, 0.2, -1 + 0.003 + height + 1.2 * k * thickness, 10);
  return shot;
}

/// What a run has gone through, seen after every step.
class Watched {
 public:
  explicit Watched(const Shot& shot) : Watched(sim::build_scene(shot)) {}
  explicit Watched(sim::Scene scene) : run(std::move(scene)) {
    energy_ = least_energy_ = most_energy_ = energy();
  }

  void until(double end, double longest = 1) {
    while (run.time < end) {
      run.step_towards(end, std::min(run.next_dt(), longest));
      const sim::HostState state = run.solver->save();
      crossings += count_sheet_crossings(run.scene.cloth, state.cloth_position);
      nearest = std::min(
          nearest, least_distance_of_sheets(run.scene.cloth, state.cloth_position, 2 * thickness));
      const double now = energy();
      most_energy_ = std::max(most_energy_, now), least_energy_ = std::min(least_energy_, now);
    }
  }
  /// Kinetic and of gravity, above the start, over what fell.
  double gain() const {
    return (most_energy_ - energy_) / std::max(1e-12, energy_ - least_energy_);
  }
  V3d mean_velocity() const {
    const sim::HostState state = run.solver->save();
    V3d sum(0);
    double mass = 0;
    for_each_free([&](size_t v, double m) { sum += at(state.cloth_velocity, v) * m, mass += m; });
    return sum / mass;
  }

  Stepper run;
  int crossings = 0;
  double nearest = 1;  // m

 private:
  template <class F>
  void for_each_free(const F& f) const {
    for (size_t v = 0; v < run.scene.cloth.mass.size(); ++v)
      if (run.scene.cloth.inverse_mass[v] > 0) f(v, double(run.scene.cloth.mass[v]));
  }
  double energy() const {
    const sim::HostState state = run.solver->save();
    const float* g = run.scene.parameters.gravity;
    double sum = 0;
    for_each_free([&](size_t v, double m) {
      sum += m * (0.5 * at(state.cloth_velocity, v).length2() -
                  V3d(g[0], g[1], g[2]).dot(at(state.cloth_position, v)));
    });
    return sum;
  }

  double energy_, least_energy_, most_energy_;
};

class LayersOfCloth : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Stack, LayersOfCloth, testing::Values(2, 10));

TEST_P(LayersOfCloth, RestOnTheFloorApart) {
  Watched watch(stack(GetParam(), 0));
  watch.until(0.3);
  EXPECT_EQ(watch.crossings, 0);
  EXPECT_GE(watch.nearest, 0.5 * thickness);
  EXPECT_LE(watch.gain(), 0.02);
  EXPECT_LT(watch.run.limits.max_speed, 0.01);
}

TEST_P(LayersOfCloth, FallOnTheFloorAndStayApart) {
  Watched watch(stack(GetParam(), 0.1));
  watch.until(0.3);
  EXPECT_EQ(watch.crossings, 0);
  EXPECT_GE(watch.nearest, 0.5 * thickness);
  EXPECT_LE(watch.gain(), 0.02);
  EXPECT_LT(watch.run.limits.max_speed, 0.05);
}

// Rounds take in rows that the step began without. The preconditioner has to know them: blocks of
// the levels that did not threw the sheet at up to 60 m/s, from one start of some forty an ulp
// apart.
TEST(SelfContact, ALightSheetOnAPinnedOneIsNotThrown) {
  Shot shot = shells_alone();
  Cloth& lower = add_shell(shot, 0.06, 0, 6);
  for (uint32_t k = 0; k < 7; ++k)
    for (uint32_t at : {k, 42 + k, 7 * k, 7 * k + 6}) lower.pin.emplace_back().vertices = {at};
  Cloth& upper = add_shell(shot, 0.05, 0.8 * thickness, 5);
  upper.corner += V3d(0.0013, 0, 0.0007);
  upper.u = V3d(0.05, 0, 0.002), upper.v = V3d(-0.002, 0, 0.05);
  upper.velocity = V3d(0.3, -0.2, 0.1), upper.areal_density = 0.2;
  for (Cloth& sheet : shot.cloth) sheet.friction = 0;
  for (int start = 0; start < 60; ++start) {
    shot.cloth[1].corner.y = (0.7 + 0.004 * start) * thickness;
    Stepper run(shot);
    for (int k = 0; k < 3; ++k) run.step(2e-3);
    EXPECT_LT(run.limits.max_speed, 1) << start;
  }
}

// Two sheets that meet at ten thicknesses a step.
TEST(SelfContact, SheetsThatMeetFastDoNotCross) {
  Shot shot = shells_alone();
  shot.gravity = V3d(0);
  add_shell(shot, 0.2, 0, 10).velocity = V3d(0, 2, 0);
  add_shell(shot, 0.2, 0.02, 13).velocity = V3d(0.3, -2, 0);
  Watched watch(shot);
  watch.until(0.02);
  EXPECT_EQ(watch.crossings, 0);
  EXPECT_LE(watch.gain(), 0.02);
  EXPECT_LT(std::abs(watch.mean_velocity().y), 0.05);
}

// Held along its middle line, both halves swing down and clap.
TEST(SelfContact, ASheetFoldedInTwoDoesNotCross) {
  Shot shot = shells_alone();
  Cloth& sheet = add_shell(shot, 0.3, 0, 20);
  ClothPin pin;
  for (uint32_t j = 0; j <= 20; ++j) pin.vertices.push_back(21 * j + 10);
  sheet.pin.push_back(pin);
  Watched watch(shot);
  watch.until(0.5);
  EXPECT_EQ(watch.crossings, 0);
  EXPECT_LE(watch.gain(), 0.02);
  EXPECT_LT(watch.run.limits.max_speed, 0.5);
}

// Dropped on its edge. Steps of a millisecond: in longer ones cotton that buckles standing up gains
// energy, with contact or without.
TEST(SelfContact, AHeapDoesNotCross) {
  Shot shot = shells_alone();
  shot.domain.axis[1] = Axis::walls;
  Cloth& sheet = add_shell(shot, 0.2, 0, 16);
  sheet.corner = V3d(-0.1, -0.95, 0.001), sheet.u = V3d(0.2, 0, 0.01);
  sheet.v = V3d(0.005, 0.2, 0.003);
  Watched watch(shot);
  watch.until(0.5, 1e-3);
  EXPECT_EQ(watch.crossings, 0);
  EXPECT_LE(watch.gain(), 0.02);
}

// A strip as it is after ten turns about its length, shorter than its twisted edges are: it coils,
// as violently as cotton that is stretched by a third does.
TEST(SelfContact, AStripOfTenTurnsDoesNotCross) {
  constexpr int cells = 80, across = 4;
  constexpr double length = 0.8, width = 0.03, shorter = 0.8;
  Shot shot = shells_alone();
  Cloth& strip = add_shell(shot, 1, 0, cells);
  strip.corner = V3d(-length / 2, 0, -width / 2), strip.u = V3d(length, 0, 0);
  strip.v = V3d(0, 0, width), strip.cells = V2i(cells, across);
  ClothPin pin;
  for (uint32_t j = 0; j <= across; ++j)
    pin.vertices.insert(pin.vertices.end(), {(cells + 1) * j, (cells + 1) * j + cells});
  strip.pin.push_back(pin);
  sim::Scene scene = sim::build_scene(shot);
  sim::HostVec& x = scene.start.cloth_position;
  for (size_t v = 0; v < x.size(); ++v) {
    const double along = x.x[v] - 1, side = x.z[v] - 1, angle = 20 * M_PI * along / length;
    x.x[v] = float(1 + shorter * along), x.y[v] = float(1 + side * std::sin(angle));
    x.z[v] = float(1 + side * std::cos(angle));
  }
  Watched watch(std::move(scene));
  watch.until(0.02, 1e-3);
  EXPECT_EQ(watch.crossings, 0);
  EXPECT_LT(watch.run.limits.bad_vertex, 0);
}

/// A sheet on a pinned one, on a slope of 1 in 2.
Shot slope(double friction) {
  Shot shot = shells_alone();
  const double angle = std::atan(0.5);
  shot.gravity = V3d(std::sin(angle), -std::cos(angle), 0) * 9.81;
  Cloth& lower = add_shell(shot, 0.4, 0, 16);
  ClothPin all;
  for (uint32_t v = 0; v < 17 * 17; ++v) all.vertices.push_back(v);
  lower.pin.push_back(all);
  add_shell(shot, 0.12, thickness, 7).corner.x -= 0.05;
  for (Cloth& sheet : shot.cloth) sheet.friction = friction, sheet.damping = 0;
  return shot;
}

// It slides by g (sin a - mu cos a) where mu < tan a, 0.088 m/s^2; else it stays.
TEST(SelfContact, ASheetSlidesDownASlopeSteeperThanFriction) {
  Watched slides(slope(0.49));
  slides.until(0.5);
  const double expected = 9.81 * std::cos(std::atan(0.5)) * 0.01 * 0.5;
  EXPECT_NEAR(slides.mean_velocity().x, expected, 0.35 * expected);
  Watched rests(slope(0.51));
  rests.until(0.5);
  EXPECT_LT(std::abs(rests.mean_velocity().x), 1e-3 * 9.81 * 0.5);
  EXPECT_EQ(slides.crossings + rests.crossings, 0);
}

// The friction of two sheets is the geometric mean: 1 and 0.25 hold what 0.5 does.
TEST(SelfContact, FrictionOfTwoFabricsIsTheGeometricMean) {
  Shot shot = slope(1.04);
  shot.cloth[1].friction = 0.25;  // 0.51
  Watched rests(shot);
  rests.until(0.2);
  EXPECT_LT(std::abs(rests.mean_velocity().x), 1e-3 * 9.81 * 0.2);
  shot.cloth[1].friction = 0.2;  // 0.456
  Watched slides(shot);
  slides.until(0.2);
  EXPECT_GT(slides.mean_velocity().x, 0.02);
}

sim::HostState after(const Shot& shot, double end) {
  Stepper run(shot);
  run.advance(end);
  return run.solver->save();
}

TEST(SelfContact, ChangesNoBitWhereNothingIsNear) {
  Shot shot = shells_alone();
  add_shell(shot, 0.4, 0, 24).pin.push_back({{0, 24}, {}});
  add_shell(shot, 0.2, 0.5, 12);
  const sim::HostState met = after(shot, 0.2);
  for (Cloth& sheet : shot.cloth) sheet.self_collision = false;
  expect_same_vectors(met.cloth_position, after(shot, 0.2).cloth_position);
}

// Cells of a fifth of the thickness keep their distance at rest.
TEST(SelfContact, AFineMeshOfThickClothDoesNotPushItselfApart) {
  Shot shot = shells_alone();
  shot.gravity = V3d(0);
  add_shell(shot, 0.04, 0, 20).thickness = 0.01;
  const sim::HostState met = after(shot, 0.1);
  shot.cloth[0].self_collision = false;
  expect_same_vectors(met.cloth_position, after(shot, 0.1).cloth_position);
}

TEST(SelfContact, HasTheSameBitsOnAnyNumberOfThreads) {
  const Shot shot = stack(4, 0.02);
  sim::HostVec one, two;
  {
    tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
    one = after(shot, 0.15).cloth_position;
  }
  {
    tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 2);
    two = after(shot, 0.15).cloth_position;
  }
  expect_same_vectors(one, two);
}

// Layers on a ball: what obstacles move out is not moved through another layer.
TEST(SelfContact, LayersOnABallDoNotCross) {
  Shot shot = shells_alone();
  add_sphere(shot, V3d(0, -0.11, 0), 0.1);
  for (int k = 0; k < 3; ++k) add_shell(shot, 0.2, 0.01 + 1.2 * k * thickness, 12);
  Watched watch(shot);
  watch.until(0.3);
  EXPECT_EQ(watch.crossings, 0);
  EXPECT_GE(watch.nearest, 0.5 * thickness);
}

// Loose layers meet where another sheet goes around a periodic axis, which meets none.
TEST(SelfContact, LayersBesideAJoinedSheetStayApart) {
  Shot shot = stack(2, 0.1);
  shot.domain.axis[0] = Axis::periodic;
  const double length = shot.domain.max.x - shot.domain.min.x;
  Cloth& endless = add_shell(shot, length, 0.5, 8);
  endless.corner.x = shot.domain.min.x;
  pin_edges(endless);
  const sim::Scene scene = sim::build_scene(shot);
  EXPECT_GT(scene.cloth.corner_shift.size(), 0u);
  Watched watch(scene);
  watch.until(0.3);
  EXPECT_GE(watch.nearest, 0.5 * thickness);  // crossings are not counted across seams
}

// What collisions of particles hold back does not let the layer above through.
TEST(SelfContact, LayersUnderWaterDoNotCross) {
  Shot shot = shells_alone();
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = 0.02;
  for (int k = 0; k < 2; ++k) pin_edges(add_shell(shot, 0.24, -1.2 * k * thickness, 12));
  add_box(shot, V3d(-0.06, 0.03, -0.06), {6, 4, 6}, V3d(0, -3, 0));
  Watched watch(shot);
  watch.until(0.1);
  EXPECT_EQ(watch.crossings, 0);
}

TEST(SelfContact, StartsThatCrossAreRefusedByTriangleAndPlace) {
  Shot shot = shells_alone();
  add_shell(shot, 0.2, 0, 4);
  Cloth& upright = add_shell(shot, 0.2, 0, 4);
  upright.corner = V3d(-0.1, -0.1, 0.013), upright.v = V3d(0, 0.2, 0.01);
  try {
    sim::build_scene(shot);
    FAIL();
  } catch (const Error& error) {
    const std::string text = error.what();
    for (const char* part : {"starts through cloth", "triangle 16 of cloth \"sheet1\"", "sheet2",
                             "near (", "self_collision = false"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  upright.self_collision = false;
  EXPECT_NO_THROW(sim::build_scene(shot));
}

TEST(SelfContact, StartsThatTouchAreRefused) {
  Shot shot = shells_alone();
  add_shell(shot, 0.2, 0, 4);
  add_shell(shot, 0.2, 0, 4);
  EXPECT_THROW(sim::build_scene(shot), Error);
}

}  // namespace
}  // namespace drench::sim_tests

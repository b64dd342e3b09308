// Jets at every part of a sheet, drops beside its edge, and water that starts around it.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

struct Target {
  const char* name;
  V3d place;  // m, on the sheet
};
constexpr double cell = 0.01;  // m
// The sheet's cells are cut from corner to corner, so that a cell's middle is on an edge too.
const Target targets[] = {{"face", V3d(cell / 3, 0, 2 * cell / 3)},
                          {"edge", V3d(cell / 2, 0, 0)},
                          {"vertex", V3d(0)},
                          {"free edge", V3d(5 * cell, 0, 0)}};

enum class Angle { normal, grazing };

/// Water of 3 x 12 x 3 particles, 5 mm apart, on its way to a place on a sheet of 0.1 m.
Shot jet(const Target& target, Angle angle, double speed) {
  const double a = 0.005, graze = 5 * M_PI / 180;
  Shot shot = water(a);
  Cloth& sheet = add_sheet(shot, 10 * cell, 0, 10);
  cotton(sheet);
  pin_edges(sheet);
  auto& pinned = sheet.pin[0].vertices;  // all but the edge at high x, without its ends
  std::erase_if(pinned, [](uint32_t v) { return v % 11 == 10 && v != 10 && v != 120; });
  const V3d direction =
      angle == Angle::normal ? V3d(0, -1, 0) : V3d(std::cos(graze), -std::sin(graze), 0);
  const std::array<int, 3> cells =
      angle == Angle::normal ? std::array{3, 12, 3} : std::array{12, 3, 3};
  // Its front's middle goes for the target from where its lowest layer is clear of the sheet.
  const double clear = a;
  const V3d first =
      target.place + V3d(0, clear, 0) - V3d(direction.x, 0, 0) * (clear / std::abs(direction.y));
  const V3d corner = first - V3d(angle == Angle::normal ? 1.5 * a : 12 * a, 0, 1.5 * a);
  add_box(shot, corner, cells, direction * speed);
  return shot;
}

/// @param reaches  v dt over epsilon; 0 takes the solver's own steps.
void run_jet(const Target& target, Angle angle, double speed, double reaches) {
  Watch watch(jet(target, angle, speed));
  const double a = 0.005, reach = 0.5 * (a + 1e-3);  // epsilon
  const double seconds = (angle == Angle::normal ? 24 : 60) * a / speed;
  while (watch.run.time < seconds &&
         watch.step(reaches > 0 ? reaches * reach / speed : watch.run.stable_dt())) {
  }
  Gates gates;
  // What leaves the rim of an impact is faster than what arrives; without a fall the bound is that.
  gates.speed = 1.25;
  // A flat sheet has no tension in the one linear step that it takes: across, the slowest jet moves
  // it freely by 1.5 mm, which stretches it, and nothing pays. In steps half as long nothing gains.
  if (speed == 1) gates.energy = 0.035;
  if (reaches > 0) {  // no shot can ask for such steps: nothing crosses, nothing blows up
    gates = squeezed();
    gates.energy = not_gated, gates.speed = 2;
  }
  report("jets",
         fmt::format("{} m/s, {}, {}{}", speed, angle == Angle::normal ? "normal" : "5 deg",
                     target.name, reaches > 0 ? fmt::format(", v dt = {} epsilon", reaches) : ""),
         watch, gates);
}

class Jet : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Speeds, Jet, testing::Values(1., 10., 50., 100.),
                         [](const auto& p) { return std::to_string(int(p.param)); });

TEST_P(Jet, NormalStaysOnItsSide) {
  for (const Target& target : targets) run_jet(target, Angle::normal, GetParam(), 0);
}
TEST_P(Jet, GrazingStaysOnItsSide) {
  for (const Target& target : targets) run_jet(target, Angle::grazing, GetParam(), 0);
}
TEST_P(Jet, ThatComesFiveReachesAStepStaysOnItsSide) {
  for (const Target& target : targets) {
    run_jet(target, Angle::normal, GetParam(), 5);
    if (long_form()) run_jet(target, Angle::grazing, GetParam(), 5);
  }
}

// Drops that fall past a free edge and past a corner, a tenth of a reach to two reaches away: each
// is as fast as one that falls alone, to the last bit.
TEST(FreeEdge, HasNoPhantomRim) {
  for (const double a : {0.01, 0.02, 0.04}) {
    Shot shot = water(a);
    Cloth& sheet = add_sheet(shot, 0.2, 0, 10);
    cotton(sheet);
    pin_edges(sheet);
    const double reach = 0.5 * (a + sheet.thickness);
    constexpr int drops = 20;
    shot.domain.min = V3d(-4), shot.domain.max = V3d(4);
    sim::Scene scene;
    {
      Shot one = shot;
      add_box(one, V3d(3, 0.05, 0), {2 * drops + 1, 1, 1});
      scene = sim::build_scene(one);
    }
    sim::HostVec& x = scene.start.position;
    for (int k = 0; k < drops; ++k) {
      const double beside = 0.1 * (k + 1) * reach, turn = 4 * a * (k - drops / 2);
      x.x[k] = float(4.1 + beside), x.z[k] = float(4 + turn);
      const double across = beside / std::sqrt(2.);  // of a corner
      const int c = drops + k;
      x.x[c] = float(4.1 + across), x.z[c] = float(4.1 + across), x.y[c] += float(3 * a * (k + 1));
    }
    x.x[2 * drops] = 7, x.z[2 * drops] = 7;
    // Those beside the edge stand in a line beyond its ends as well: only those beside it count.
    Watch watch(std::move(scene), 0);
    std::vector<float> from = watch.state().position.x;
    watch.until(long_form() ? 0.5 : 0.3);
    const std::vector<int> place = place_of_id(watch.state());
    const sim::HostState& state = watch.state();
    double worst = 0;
    for (int k = 0; k < 2 * drops; ++k) {
      const V3d v = at(state.velocity, size_t(place[k])),
                alone = at(state.velocity, size_t(place[2 * drops]));
      worst = std::max(worst, (v - alone).length());
    }
    EXPECT_EQ(worst, 0);
    report("free edge", fmt::format("edges of {:.1f} spacings", 0.02 / a), watch, {},
           fmt::format("{:.1g} m/s beside one that falls alone", worst));
  }
}

// A sheet in a block of 12^3 particles, as wide as it is.
TEST(Overlap, AtTheStartIsRefused) {
  Shot shot = water(0.01);
  add_box(shot, V3d(-0.06), {12, 12, 12});
  cotton(add_sheet(shot, 0.12, 0.005, 12));
  const std::string said = test::error_of([&] { sim::build_scene(shot); });
  report("overlap at start", "sheet in a layer of particles",
         said.find("inside cloth") != std::string::npos, said.substr(0, 90));
}

// The solver itself, with the sheet put there afterwards. A sheet that is exactly in a layer, which
// belongs to neither side, throws it: 1.6 m/s after 10 steps.
TEST(Overlap, OfTheSolverComesApartSlowly) {
  for (const double beside : {0., 0.25, 0.45}) {
    const double a = 0.01;
    Shot shot = water(a);
    add_box(shot, V3d(-6 * a, -6 * a, -6 * a), {12, 12, 12});
    Cloth& sheet = add_sheet(shot, 12 * a, 0.5, 12);
    cotton(sheet);
    sim::Scene scene = sim::build_scene(shot);
    for (float& y : scene.start.cloth_position.y) y = float(1 + beside * a);
    Watch watch(std::move(scene));
    watch.steps(10);
    const double after = watch.last_speed();
    EXPECT_LT(after, 1) << beside;
    watch.steps(long_form() ? 200 : 50);
    Gates gates;
    // A twentieth of a spacing off the sheet it is pushed off for long: 2.4 % after 200 steps.
    if (beside > 0.4) gates.energy = 0.03;
    report("overlap at start",
           fmt::format("sheet {} spacings off the middle of two layers", beside), watch, gates,
           fmt::format("{:.2f} m/s after 10 steps", after));
  }
}

}  // namespace
}  // namespace drench::stress_tests

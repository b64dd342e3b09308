// Many drops, many steps.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

/// `side`^2 particles in `layers` layers, `apart` spacings from one another, over one pinned sheet
/// of the size that the separate ones take.
sim::Scene rain(int side, int layers, double apart) {
  const double a = 0.01, size = 2.5 * a * side;
  Shot shot = water(a);
  shot.domain.min = V3d(-size, -1, -size), shot.domain.max = V3d(size, 3, size);
  Cloth& sheet = add_sheet(shot, size, 0, std::max(2, side));
  cotton(sheet);
  pin_edges(sheet);
  add_box(shot, V3d(-0.5 * side * a, a, -0.5 * side * a), {side, layers, side}, V3d(0, -1, 0));
  sim::Scene scene = sim::build_scene(shot);
  sim::HostVec& x = scene.start.position;
  const double middle[3] = {size, 1, size};  // m local
  for (size_t i = 0; i < x.size(); ++i) {
    const auto spread = [&](float& c, int k) { c = float(middle[k] + apart * (c - middle[k])); };
    spread(x.x[i], 0), spread(x.y[i], 1), spread(x.z[i], 2);
  }
  return scene;
}

// Particles that touch nothing but the sheet against a block of as many.
TEST(Drops, ThatAreSeparateCostWhatABlockCosts) {
  const int side = long_form() ? 316 : 45, layers = 10, steps = long_form() ? 40 : 25;
  double cpu[2] = {0, 0};
  for (const bool separate : {true, false}) {
    Watch watch(rain(side, layers, separate ? 2.5 : 1), 0);
    watch.steps(steps);
    cpu[separate ? 0 : 1] = watch.figures().cpu_ms;
    report("separate drops", separate ? "2.5 spacings apart" : "the same as a block", watch, {},
           separate ? "" : fmt::format("drops over block: {:.2f}", cpu[0] / cpu[1]));
  }
}

// A pool at rest on a sheet.
TEST(LongRun, OfAPoolAtRestStaysAtRest) {
  const double a = 0.03, half = 4 * a;
  Shot shot = water(a);
  shot.domain.min = V3d(-half, -0.3, -half), shot.domain.max = V3d(half, 0.5, half);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  Cloth& sheet = add_sheet(shot, 2 * half, 0, 8);
  cotton(sheet);
  sheet.damping = 5;
  pin_edges(sheet);
  add_box(shot, V3d(-half, 0.5 * sheet.thickness, -half), {8, 4, 8});
  Watch watch(shot, long_form() ? 1000 : 20);
  const auto height = [&] { return centre_of_mass(watch.state()).y; };
  const auto kinetic = [&] {
    double sum = 0;
    for (size_t i = 0; i < watch.state().id.size(); ++i)
      sum += 0.5 * at(watch.state().velocity, i).length2() / double(watch.state().id.size());
    return sum;
  };
  // The first second lets the sheet sag and the water settle.
  watch.until(1.5);
  const double start = height(), settled = kinetic();
  double worst = 0, recent = 0, least = 1e30;
  int from = 0;
  for (const int end : long_form() ? std::vector{1000, 3000, 10000, 30000, 100000, 300000, 1000000}
                                   : std::vector{1000, 3000}) {
    recent = 0;
    for (int k = from; k < end && watch.step(); ++k)
      worst = std::max(worst, std::abs(height() - start)), recent += kinetic() / (end - from);
    from = end, least = std::min(least, recent);
    EXPECT_LT(worst, 0.5 * a);
    EXPECT_LT(recent, std::max(2 * least, 1e-6)) << end;
    report("long run", fmt::format("{} steps of a pool at rest", end), watch, {},
           fmt::format("height {:.3f} spacings off at most; RMS speed {:.2g} m/s since the row "
                       "before, {:.2g} m/s at first",
                       worst / a, std::sqrt(2 * recent), std::sqrt(2 * settled)));
  }
}

}  // namespace
}  // namespace drench::stress_tests

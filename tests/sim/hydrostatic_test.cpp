// A column at rest: p = rho g (H - z).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

struct Profile {
  double rms = 0;     // of the mean p of slabs one spacing thick, less rho g depth, over rho g H
  double bottom = 0;  // mean density of the lowest layer over its closed form, less one
  double speed = 0;   // m/s, largest left
};

/// A column of height 0.2 m in walls, settled for 1.5 s and averaged over 0.3 s more.
Profile settled_column(int layers) {
  const double height = 0.2, g = 9.81;
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -g, 0);
  shot.fluid.spacing = height / layers;
  const int side = std::max(12, layers / 2);
  shot.domain.min = V3d(0),
  shot.domain.max = V3d(side * shot.fluid.spacing, 0.4, side * shot.fluid.spacing);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {side, layers, side});
  Stepper run(shot);
  run.advance(1.5);
  const double c2 = double(run.scene.parameters.sound_speed) * run.scene.parameters.sound_speed;
  const double a = shot.fluid.spacing;
  Profile profile;
  double bottom = 0, bottom_depth = 0;
  int bottoms = 0;
  std::vector<double> excess(layers + 4, 0);  // by slab
  std::vector<int> count(layers + 4, 0);
  for (int sample = 1; sample <= 30; ++sample) {
    run.advance(1.5 + 0.01 * sample);
    run.solver->refresh();
    const sim::HostState state = run.solver->save();
    const std::vector<float> density = run.solver->density();
    float top = 0;
    for (float y : state.position.y) top = std::max(top, y);
    const double surface = top + 0.5 * a;
    for (size_t i = 0; i < density.size(); ++i) {
      const double y = state.position.y[i], depth = surface - y;
      const double pressure = c2 * std::max(0.0, density[i] - 1000.0);
      if (y < a) bottom += density[i], bottom_depth += depth, ++bottoms;
      const double x = state.position.x[i], z = state.position.z[i], width = side * a, h = 2 * a;
      const bool inner = x > h && z > h && x < width - h && z < width - h;
      if (!inner || y < a || depth < 2 * a) continue;
      const size_t slab = size_t(y / a);
      excess[slab] += pressure - 1000 * g * depth, ++count[slab];
    }
  }
  double squares = 0;
  int slabs = 0;
  for (size_t k = 0; k < excess.size(); ++k) {
    if (count[k] > 0) squares += std::pow(excess[k] / count[k], 2), ++slabs;
  }
  profile.rms = std::sqrt(squares / slabs) / (1000 * g * height);
  profile.bottom = bottom / bottoms / (1000 * (1 + g * bottom_depth / bottoms / c2)) - 1;
  profile.speed = run.limits.max_speed;
  return profile;
}

class Hydrostatic : public testing::TestWithParam<int> {};

// Slab means more than a support from the side walls. Pressure is never negative, so density noise
// of a tenth of the 1 % compression at the bottom shows as bias: 5 % measured at all three
// resolutions, 7 % gated. The density at the bottom is 1 % above rest by design; 2 % is the error
// allowed to it.
TEST_P(Hydrostatic, SettledColumnHasTheLinearProfile) {
  const Profile profile = settled_column(GetParam());
  RecordProperty("rms", std::to_string(profile.rms));
  EXPECT_LT(profile.rms, 0.07);
  EXPECT_LT(std::abs(profile.bottom), 0.02);
  EXPECT_LT(profile.speed, 0.1 * std::sqrt(2 * 9.81 * 0.2));
}

INSTANTIATE_TEST_SUITE_P(Layers, Hydrostatic, testing::Values(10, 16, 24));

}  // namespace
}  // namespace drench::sim_tests

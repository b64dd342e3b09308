#include "tests/stress/shell_scenes.h"

#include <fmt/format.h>

#include "tests/sim/obstacle_scenes.h"

namespace drench::stress_tests {

using namespace sim_tests;

namespace {

constexpr double spacing = 0.02;  // m

/// Keys that change a value evenly from the start on.
Animated<V3d> evenly(const Shot& shot, V3d change, double seconds) {
  Animated<V3d> track;
  track.keys = {{frame_at(shot, 0), V3d(0)}, {frame_at(shot, seconds), change}};
  return track;
}

}  // namespace

double frame_at(const Shot& shot, double seconds) {
  return shot.timeline.first + seconds * shot.timeline.fps;
}

Cloth& add_shell(Shot& shot, V3d corner, V3d u, V3d v, V2i cells) {
  Cloth& sheet = shot.cloth.emplace_back();
  sheet.name = fmt::format("sheet{}", shot.cloth.size());
  sheet.model = ClothModel::shell;
  sheet.corner = corner, sheet.u = u, sheet.v = v, sheet.cells = cells;
  return sheet;
}

void set_moduli(Cloth& sheet, double young, double rigidity) {
  sheet.young_warp = sheet.young_weft = young, sheet.poisson = 0.2;
  sheet.shear_modulus = young / (2 * (1 + sheet.poisson));
  sheet.bend_warp = sheet.bend_weft = sheet.bend_bias = rigidity;
}

Shot fall_on_ball(int cells) {
  Shot shot = water(spacing);
  shot.domain.min = V3d(-0.5, -0.15, -0.5), shot.domain.max = V3d(0.5, 0.5, 0.5);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_sphere(shot, V3d(0, -0.06, 0), 0.06);
  add_shell(shot, V3d(-0.2, 0.05, -0.2), V3d(0.4, 0, 0), V3d(0, 0, 0.4), V2i(cells, cells));
  return shot;
}

Shot pile(int layers, int cells) {
  Shot shot = water(spacing);
  shot.domain.min = V3d(-0.5, 0, -0.5), shot.domain.max = V3d(0.5);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  for (int k = 0; k < layers; ++k) {
    const double height = 0.05 + 1.2 * k * Cloth{}.thickness;
    add_shell(shot, V3d(-0.1, height, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.2), V2i(cells, cells));
  }
  return shot;
}

Shot standing(int cells) {
  Shot shot = water(spacing);
  shot.domain.min = V3d(-0.5, 0, -0.5), shot.domain.max = V3d(0.5);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_shell(shot, V3d(0, 0.01, -0.15), V3d(0.01, 0.35, 0), V3d(0, 0, 0.3),
            V2i(cells, cells * 6 / 7));
  return shot;
}

Shot twisted_strip(double length, double width, V2i cells, double turns, double nearer,
                   double seconds) {
  Shot shot = water(spacing);
  Cloth& strip =
      add_shell(shot, V3d(-length / 2, 0, -width / 2), V3d(length, 0, 0), V3d(0, 0, width), cells);
  for (const int end : {0, 1}) {
    ClothPin& pin = strip.pin.emplace_back();
    for (int j = 0; j <= cells.y; ++j)
      pin.vertices.push_back(uint32_t(j * (cells.x + 1) + end * cells.x));
    const double sense = end == 0 ? 0.5 : -0.5;
    pin.rotation_deg = evenly(shot, V3d(sense * 360 * turns, 0, 0), seconds);
    pin.position = evenly(shot, V3d(sense * nearer, 0, 0), seconds);
  }
  return shot;
}

}  // namespace drench::stress_tests

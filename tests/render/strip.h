#pragma once
// A black strip that moves before the sky.

#include <vector>

#include "tests/render/support.h"

namespace drench::render::test {

/// Mean darkness of every column of a film of a black thing before a sky of radiance 1.
inline std::vector<double> darkness_of_columns(const Film& film) {
  std::vector<double> out(film.width);
  for (int y = 0; y < film.height; ++y)
    for (int x = 0; x < film.width; ++x)
      out[x] += (1 - film.rgba[4 * (size_t(y) * film.width + x)]) / film.height;
  return out;
}

/// A black strip of `width` pixels before the sky, whose middle moves `travel` pixels.
struct Strip {
  Shot shot = plain_shot(256);
  FrameGeometry geometry;
  static constexpr double pixel = 0.02;  // m: 64 pixels over 1.28 m at distance 1

  Strip(double width, double travel) {
    shot.render.width = 64;
    shot.render.height = 16;
    shot.render.motion_blur = true;
    shot.camera.position = V3d(0, 0, 1);
    shot.camera.target = V3d(0, 0, 0);
    shot.camera.fov_deg = 2 * std::atan(0.64) * 180 / pi64;
    shot.light = {sky(1)};
    shot.material = {diffuse("cotton", 0)};
    TriangleMesh mesh;
    const float half = float(width * pixel / 2);
    mesh.position = {{-half, -0.2f, 0}, {half, -0.2f, 0}, {half, 0.2f, 0}, {-half, 0.2f, 0}};
    mesh.triangle = {{0, 1, 2}, {0, 2, 3}};
    const double shutter = (shot.camera.shutter_close - shot.camera.shutter_open) / 24;  // s
    mesh.velocity.assign(4, V3f(float(travel * pixel / shutter), 0, 0));
    geometry.cloth = {{"cloth", mesh}};
  }
};

}  // namespace drench::render::test

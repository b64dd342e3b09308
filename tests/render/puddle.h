#pragma once
// Water with waves and a sun over it.

#include "tests/render/support.h"

namespace drench::render::test {

/// Of 2 W/m^2 on a surface that faces it.
inline Light sun(const V3d& direction, double angle_deg) {
  Light light;
  light.type = LightType::sun;
  light.name = "sun";
  light.direction = direction;
  light.angle_deg = angle_deg;
  light.radiance = V3f(2);
  return light;
}

/// Looks down on water of an absorption (1/m) over a grey ground, 512 samples.
inline Shot puddle_shot(const V3f& absorption) {
  Shot shot = plain_shot(512, 8);
  add_ground(shot, 0.5f, 6);
  shot.material.push_back(dielectric("water", 1.333, absorption));
  shot.camera.position = V3d(0, 3, 1);
  shot.camera.target = V3d(0, 0, 0);
  shot.camera.fov_deg = 20.0;
  return shot;
}

/// A puddle of 4 m with waves.
inline TriangleMesh waves() {
  TriangleMesh mesh = sphere_mesh(6);
  for (V3f& p : mesh.position)
    p = {2 * p.x, p.y > 0 ? 0.4f * p.y + 0.02f * std::sin(9 * p.x) * p.y : 0.3f * p.y, 2 * p.z};
  mesh.normal.clear();
  return mesh;
}

}  // namespace drench::render::test

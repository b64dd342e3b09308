#pragma once
// A mesh whose distance field is known.

#include <cmath>

#include "pipeline/contract/frames.h"

namespace drench::test {

/// A closed sphere of radius 1 around the origin from a latitude-longitude grid.
inline TriangleMesh unit_sphere(uint32_t rings, uint32_t segments) {
  constexpr double pi = 3.14159265358979323846;
  TriangleMesh mesh;
  mesh.position.emplace_back(0.f, 1.f, 0.f);
  for (uint32_t j = 1; j < rings; ++j) {
    for (uint32_t i = 0; i < segments; ++i) {
      const double theta = pi * j / rings, phi = 2 * pi * i / segments;
      mesh.position.emplace_back(float(std::sin(theta) * std::cos(phi)), float(std::cos(theta)),
                                 float(-std::sin(theta) * std::sin(phi)));
    }
  }
  mesh.position.emplace_back(0.f, -1.f, 0.f);
  const auto at = [&](uint32_t j, uint32_t i) { return 1 + (j - 1) * segments + i % segments; };
  const auto south = uint32_t(mesh.position.size() - 1);
  for (uint32_t i = 0; i < segments; ++i) {
    mesh.triangle.emplace_back(0, at(1, i), at(1, i + 1));
    mesh.triangle.emplace_back(south, at(rings - 1, i + 1), at(rings - 1, i));
    for (uint32_t j = 1; j + 1 < rings; ++j) {
      mesh.triangle.emplace_back(at(j, i), at(j + 1, i), at(j + 1, i + 1));
      mesh.triangle.emplace_back(at(j, i), at(j + 1, i + 1), at(j, i + 1));
    }
  }
  mesh.velocity.resize(mesh.position.size(), Imath::V3f(0));
  return mesh;
}

}  // namespace drench::test

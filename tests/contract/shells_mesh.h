#pragma once
// Meshes of several shells.

#include <cmath>

#include "tests/contract/box_mesh.h"
#include "tests/contract/sphere_mesh.h"

namespace drench::test {

/// Both meshes as one.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto first = uint32_t(a.position.size());
  a.position.insert(a.position.end(), b.position.begin(), b.position.end());
  for (const auto& t : b.triangle) a.triangle.push_back(t + Imath::Vec3<uint32_t>(first));
  a.velocity.resize(a.position.size(), Imath::V3f(0));
  return a;
}

inline TriangleMesh reversed(TriangleMesh mesh) {
  for (auto& t : mesh.triangle) std::swap(t.y, t.z);
  return mesh;
}

inline TriangleMesh ball(float radius, const Imath::V3f& centre = Imath::V3f(0)) {
  TriangleMesh mesh = unit_sphere(24, 48);
  for (Imath::V3f& p : mesh.position) p = p * radius + centre;
  return mesh;
}

/// A ring about the y axis: circles of radius `small` whose middles are `large` from the axis.
inline TriangleMesh torus(float large, float small, uint32_t around, uint32_t across) {
  TriangleMesh mesh;
  for (uint32_t i = 0; i < around; ++i) {
    for (uint32_t j = 0; j < across; ++j) {
      const double a = 2 * M_PI * i / around, b = 2 * M_PI * j / across;
      const double r = large + small * std::cos(b);
      mesh.position.emplace_back(float(r * std::cos(a)), float(small * std::sin(b)),
                                 float(-r * std::sin(a)));
    }
  }
  const auto at = [&](uint32_t i, uint32_t j) { return i % around * across + j % across; };
  for (uint32_t i = 0; i < around; ++i) {
    for (uint32_t j = 0; j < across; ++j) {
      mesh.triangle.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangle.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  mesh.velocity.resize(mesh.position.size(), Imath::V3f(0));
  return mesh;
}

}  // namespace drench::test

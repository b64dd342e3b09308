#pragma once
// Small scenes and means with their standard error, for tests against closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>

#include "pipeline/contract/error.h"
#include "render/options.h"
#include "render/renderer.h"

namespace drench::render::test {

inline constexpr double pi64 = std::numbers::pi;

/// A shot that renders nothing yet: 16 x 16 pixels, no ground, no light, no blur, no photons, which
/// err in all pixels together.
inline Shot plain_shot(int samples, int size = 16) {
  Shot shot;
  shot.render.width = shot.render.height = size;
  shot.render.samples = samples;
  shot.render.motion_blur = false;
  shot.render.photons = 0;
  return shot;
}

/// Looks from `position` to `target` through so narrow a field that one direction is seen.
inline void aim_narrow(Shot& shot, const V3d& position, const V3d& target, double fov_deg = 0.01) {
  shot.camera.position = position;
  shot.camera.target = target;
  shot.camera.fov_deg = fov_deg;
  const V3d along = (target - position).normalized();
  shot.camera.up = std::abs(along.y) > 0.9 ? V3d(0, 0, -1) : V3d(0, 1, 0);
}

inline Light sky(float radiance) {
  Light light;
  light.type = LightType::environment;
  light.name = "sky";
  light.radiance = V3f(radiance);
  return light;
}

/// A rectangle of the given half sizes in x and z that shines down (or up).
enum class Facing { down, up };
inline Light panel(const V3d& center, double half_x, double half_z, float radiance,
                   Facing facing = Facing::down) {
  Light light;
  light.type = LightType::rectangle;
  light.name = "panel";
  light.radiance = V3f(radiance);
  light.center = center;
  light.u = {half_x, 0, 0};
  light.v = {0, 0, facing == Facing::down ? half_z : -half_z};
  return light;
}

inline Material diffuse(const std::string& name, float reflectance) {
  Material m;
  m.name = name;
  m.type = MaterialType::diffuse;
  m.reflectance = V3f(reflectance);
  return m;
}

inline Material dielectric(const std::string& name, double ior, const V3f& absorption = V3f(0)) {
  Material m;
  m.name = name;
  m.type = MaterialType::dielectric;
  m.ior = ior;
  m.absorption = absorption;
  return m;
}

inline void add_ground(Shot& shot, float reflectance, double half_size = 50) {
  shot.ground.present = true;
  shot.ground.half_size = half_size;
  shot.material.push_back(diffuse("ground", reflectance));
}

/// A closed box with outward triangles and vertices shared by faces only through flat normals.
inline TriangleMesh box_mesh(const V3f& min, const V3f& max) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      const uint32_t first = uint32_t(mesh.position.size());
      for (int corner = 0; corner < 4; ++corner) {
        V3f p;
        p[axis] = side ? max[axis] : min[axis];
        p[a] = (corner & 1) ? max[a] : min[a];
        p[b] = (corner & 2) ? max[b] : min[b];
        mesh.position.push_back(p);
        V3f n(0);
        n[axis] = side ? 1.f : -1.f;
        mesh.normal.push_back(n);
        mesh.velocity.push_back(V3f(0));
      }
      if (side) {
        mesh.triangle.push_back({first, first + 1, first + 3});
        mesh.triangle.push_back({first, first + 3, first + 2});
      } else {
        mesh.triangle.push_back({first, first + 3, first + 1});
        mesh.triangle.push_back({first, first + 2, first + 3});
      }
    }
  return mesh;
}

/// An octahedron refined `levels` times and pushed onto the unit sphere; closed and outward.
inline TriangleMesh sphere_mesh(int levels) {
  TriangleMesh mesh;
  mesh.position = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangle = {{4, 0, 2}, {0, 5, 2}, {5, 1, 2}, {1, 4, 2},
                   {0, 4, 3}, {5, 0, 3}, {1, 5, 3}, {4, 1, 3}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle;
    const auto between = [&](uint32_t a, uint32_t b) {
      const auto [entry, fresh] =
          middle.try_emplace(std::minmax(a, b), uint32_t(mesh.position.size()));
      if (fresh) mesh.position.push_back((mesh.position[a] + mesh.position[b]).normalized());
      return entry->second;
    };
    std::vector<Imath::Vec3<uint32_t>> finer;
    for (const auto& t : mesh.triangle) {
      const uint32_t a = between(t.x, t.y), b = between(t.y, t.z), c = between(t.z, t.x);
      finer.push_back({t.x, a, c});
      finer.push_back({a, t.y, b});
      finer.push_back({c, b, t.z});
      finer.push_back({a, b, c});
    }
    mesh.triangle = finer;
  }
  mesh.normal = mesh.position;
  mesh.velocity.assign(mesh.position.size(), V3f(0));
  return mesh;
}

/// The same surface with three vertices a triangle and flat normals.
inline TriangleMesh flat_mesh(const TriangleMesh& mesh) {
  TriangleMesh out;
  for (const auto& t : mesh.triangle) {
    const uint32_t first = uint32_t(out.position.size());
    const V3f a = mesh.position[t.x], b = mesh.position[t.y], c = mesh.position[t.z];
    const V3f normal = ((b - a) % (c - a)).normalized();
    for (const V3f& p : {a, b, c}) {
      out.position.push_back(p);
      out.normal.push_back(normal);
      out.velocity.push_back(V3f(0));
    }
    out.triangle.push_back({first, first + 1, first + 2});
  }
  return out;
}

/// A horizontal or wavy sheet over [-1, 1]^2 with uv, n x n cells, height(x, z).
template <class Height>
TriangleMesh sheet_mesh(int n, const Height& height) {
  TriangleMesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const float x = -1 + 2 * float(i) / float(n), z = -1 + 2 * float(j) / float(n);
      mesh.position.push_back({x, height(x, z), z});
      mesh.velocity.push_back(V3f(0));
      mesh.uv.push_back({float(i) / float(n), float(j) / float(n)});
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const uint32_t a = uint32_t(j * (n + 1) + i), b = a + 1, c = a + uint32_t(n) + 1, d = c + 1;
      mesh.triangle.push_back({a, c, b});
      mesh.triangle.push_back({b, c, d});
    }
  return mesh;
}

inline void translate(TriangleMesh& mesh, const V3f& by) {
  for (V3f& p : mesh.position) p += by;
}

/// Mean of a channel and its standard error, from the spread of the pixels. For an image of one
/// expected value only; stratified samples err less than this says.
struct Mean {
  double value = 0, error = 0;
};

inline Mean channel_mean(const Film& film, int channel) {
  const size_t n = film.rgba.size() / 4;
  double sum = 0, square = 0;
  for (size_t p = 0; p < n; ++p) {
    sum += film.rgba[4 * p + channel];
    square += double(film.rgba[4 * p + channel]) * film.rgba[4 * p + channel];
  }
  const double mean = sum / double(n);
  const double variance = std::max(0., square / double(n) - mean * mean);
  return {mean, std::sqrt(variance / double(n))};
}

/// Four standard errors (a false alarm in 16,000), plus float's rounding over a path.
inline double bound(const Mean& mean) { return 4 * mean.error + 2e-5 * std::abs(mean.value); }

/// Mean and standard error of the whole film from independent renders of different seeds.
inline Mean mean_over_seeds(Shot shot, const FrameGeometry& geometry, const RenderOptions& options,
                            int seeds) {
  double sum = 0, square = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    shot.render.seed = uint32_t(seed);
    const double mean = channel_mean(render_frame(shot, 1001, geometry, options), 1).value;
    sum += mean;
    square += mean * mean;
  }
  const double mean = sum / seeds;
  return {mean, std::sqrt(std::max(0., square / seeds - mean * mean) / (seeds - 1))};
}

/// mean((x - r)^2 / (r^2 + 0.01)) over pixels and colours.
inline double relative_mse(const Film& film, const Film& reference) {
  double sum = 0;
  for (size_t p = 0; p < film.rgba.size(); p += 4)
    for (size_t c = 0; c < 3; ++c) {
      const double r = reference.rgba[p + c], d = film.rgba[p + c] - r;
      sum += d * d / (r * r + 0.01) / 3;
    }
  return sum * 4 / double(film.rgba.size());
}

/// Photons and paths alone give one mean, with walks and without. Half a percent is for the blur at
/// the rims.
inline void expect_photons_as_paths(Shot shot, const FrameGeometry& geometry) {
  const Mean paths = mean_over_seeds(shot, geometry, {}, 16);
  EXPECT_LT(paths.error, 0.01 * paths.value);
  shot.render.photons = 6;
  for (const ManifoldWalks walks : {ManifoldWalks::none, ManifoldWalks::some}) {
    RenderOptions options;
    options.walks = walks;
    const Mean photons = mean_over_seeds(shot, geometry, options, 16);
    EXPECT_NEAR(photons.value, paths.value,
                4 * std::hypot(photons.error, paths.error) + 0.005 * paths.value)
        << (walks == ManifoldWalks::some ? "with walks" : "without");
  }
}

/// Light sampling, surface sampling and both give one mean, and know it well enough to say so.
inline void expect_estimators_agree(const Shot& shot, const FrameGeometry& geometry) {
  const auto mean = [&](Estimator estimator) {
    RenderOptions options;
    options.estimator = estimator;
    return mean_over_seeds(shot, geometry, options, 24);
  };
  const Mean mis = mean(Estimator::mis), light = mean(Estimator::light_only),
             bsdf = mean(Estimator::bsdf_only);
  EXPECT_LT(mis.error, 0.003 * mis.value);
  EXPECT_LT(light.error, 0.01 * mis.value);
  EXPECT_LT(bsdf.error, 0.01 * mis.value);
  EXPECT_NEAR(light.value, mis.value, 4 * std::hypot(light.error, mis.error));
  EXPECT_NEAR(bsdf.value, mis.value, 4 * std::hypot(bsdf.error, mis.error));
}

}  // namespace drench::render::test

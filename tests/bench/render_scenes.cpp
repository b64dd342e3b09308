#include "tests/bench/render_scenes.h"

#include <cmath>

#include "render/sampler.h"
#include "tests/contract/sphere_mesh.h"

namespace drench::bench {

TriangleMesh pleated_sheet(uint32_t cells) {
  TriangleMesh mesh;
  const float n = float(cells);
  for (uint32_t j = 0; j <= cells; ++j)
    for (uint32_t i = 0; i <= cells; ++i) {
      const float x = -0.5f + float(i) / n, y = 1.05f - float(j) / n;
      mesh.position.push_back({x, y, 0.05f * std::sin(30 * x + 3 * y) * (1.2f - y)});
      mesh.velocity.push_back({0, 0, 0});
      mesh.uv.push_back({float(i) / n, float(j) / n});
    }
  for (uint32_t j = 0; j < cells; ++j)
    for (uint32_t i = 0; i < cells; ++i) {
      const uint32_t a = j * (cells + 1) + i, c = a + cells + 1;
      mesh.triangle.push_back({a, c, a + 1});
      mesh.triangle.push_back({a + 1, c, c + 1});
    }
  return mesh;
}

Shot cloth_shot() {
  Shot shot;
  shot.render.width = small_width;
  shot.render.height = small_height;
  shot.render.depth = 8;
  shot.camera.position = V3d(0.7, 0.9, 2.2);
  shot.camera.target = V3d(0, 0.5, 0);
  shot.ground.present = true;
  Light lamp, sky;
  lamp.radiance = {8, 8, 8};
  lamp.center = {1.2, 2.2, 1};
  sky.type = LightType::environment;
  sky.name = "sky";
  sky.radiance = {0.5f, 0.6f, 0.8f};
  shot.light = {lamp, sky};
  return shot;
}

TriangleMesh wavy_pool(uint32_t n, float waves) {
  const uint32_t row = n + 1, below = row * row;
  TriangleMesh mesh;
  for (const bool top : {true, false})
    for (uint32_t j = 0; j <= n; ++j)
      for (uint32_t i = 0; i <= n; ++i) {
        const float x = -2 + 4 * float(i) / n, z = -2 + 4 * float(j) / n;
        const float wave = 0.03f * waves * (std::sin(7 * x + 2 * z) + std::sin(5 * z - 3 * x));
        mesh.position.push_back({x, top ? 0.35f + wave : -0.1f, z});
        mesh.velocity.push_back({0, 0, 0});
      }
  const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    mesh.triangle.push_back({a, b, c});
    mesh.triangle.push_back({a, c, d});
  };
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * row + i;
      quad(a, a + row, a + row + 1, a + 1);
      quad(below + a, below + a + 1, below + a + row + 1, below + a + row);
    }
  const auto wall = [&](uint32_t a, uint32_t b) {  // of its own vertices, which keeps it flat
    const uint32_t first = uint32_t(mesh.position.size());
    for (const uint32_t v : {a, b, below + b, below + a}) {
      mesh.position.push_back(V3f(mesh.position[v]));
      mesh.velocity.push_back({0, 0, 0});
    }
    quad(first, first + 1, first + 2, first + 3);
  };
  for (uint32_t k = 0; k < n; ++k) {
    wall(k, k + 1);
    wall(n * row + k + 1, n * row + k);
    wall((k + 1) * row, k * row);
    wall(k * row + n, (k + 1) * row + n);
  }
  return mesh;
}

Shot pool_shot() {
  Shot shot = cloth_shot();
  shot.camera.position = V3d(0.4, 1.9, 2.3);
  shot.camera.target = V3d(0, 0.1, 0);
  shot.light[0].radiance = {900, 900, 900};
  shot.light[0].u = {0.05, 0, 0};
  shot.light[0].v = {0, 0, 0.05};
  return shot;
}

TriangleMesh spray() {
  constexpr uint32_t drops = 400, rings = 12;
  const TriangleMesh drop = test::unit_sphere(rings, 2 * rings);
  const auto number = [](uint32_t k) { return render::unit_float(render::hash_bits(k)); };
  TriangleMesh mesh;
  for (uint32_t k = 0; k < drops; ++k) {
    const V3f place(0.5f * (number(4 * k) - 0.5f), 0.05f + 0.3f * number(4 * k + 1),
                    0.3f * (number(4 * k + 2) - 0.5f));
    const float radius = 0.0015f + 0.0035f * number(4 * k + 3);
    const uint32_t first = uint32_t(mesh.position.size());
    for (const V3f& p : drop.position) {
      mesh.position.push_back(place + p * radius);
      mesh.normal.push_back(p);
      mesh.velocity.push_back({0, 0, 0});
    }
    for (const auto& t : drop.triangle)
      mesh.triangle.push_back({first + t.x, first + t.y, first + t.z});
  }
  return mesh;
}

Shot spray_shot() {
  Shot shot = cloth_shot();
  shot.camera.position = V3d(0, 0.3, 1.2);
  shot.camera.target = V3d(0, 0.2, 0);
  shot.camera.fov_deg = 27.0;
  shot.light[0] = {};
  shot.light[0].type = LightType::sun;
  shot.light[0].name = "sun";
  shot.light[0].direction = {-0.5, -1, 0.75};
  shot.light[0].angle_deg = 2;
  shot.light[0].radiance = {4.6f, 3.9f, 3.f};
  return shot;
}

Render render(Shot shot, const render::FrameGeometry& geometry, int samples, uint32_t seed,
              const render::RenderOptions& options) {
  shot.render.samples = samples;
  shot.render.seed = seed;
  Render out;
  out.cost = measure([&] {
    out.film = render::render_frame(shot, shot.timeline.first, geometry, options, &out.stats);
  });
  return out;
}

double relative_mse(const render::Film& film, const render::Film& reference) {
  double sum = 0;
  for (size_t k = 0; k < film.rgba.size(); ++k) {
    if (k % 4 == 3) continue;
    const double r = reference.rgba[k], d = film.rgba[k] - r;
    sum += d * d / (r * r + 0.01);
  }
  return sum / (0.75 * double(film.rgba.size()));
}

}  // namespace drench::bench

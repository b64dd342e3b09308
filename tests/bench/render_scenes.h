#pragma once
// Pictures that the renderer's cases are measured on.

#include "render/options.h"
#include "render/renderer.h"
#include "tests/bench/bench.h"

namespace drench::bench {

inline constexpr int small_width = 96, small_height = 54;  // pixels

/// A pleated sheet of 2 x cells x cells triangles.
TriangleMesh pleated_sheet(uint32_t cells = 64);
/// A sheet over the ground under a lamp of 1 m and a sky, depth 8.
Shot cloth_shot();
/// A closed slab of water of 4 m whose top waves, its floor below the ground, of 4 n (n + 2)
/// triangles.
/// @param waves  how high, over waves of 0.03 m
TriangleMesh wavy_pool(uint32_t n = 128, float waves = 1);
/// The slab under a lamp of 0.1 m.
Shot pool_shot();

/// 400 drops of 1.5 to 5 mm in a box of 0.5 x 0.3 x 0.3 m.
TriangleMesh spray();
/// The drops against the sun, 3 mm a pixel over 192 pixels.
Shot spray_shot();

struct Render {
  render::Film film;
  render::RenderStats stats;
  Measured cost;
};
Render render(Shot shot, const render::FrameGeometry& geometry, int samples, uint32_t seed,
              const render::RenderOptions& options = {});

/// mean((x - r)^2 / (r^2 + 0.01)) over pixels and channels.
double relative_mse(const render::Film& film, const render::Film& reference);

}  // namespace drench::bench

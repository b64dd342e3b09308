#include "surfacing/anisotropy.h"

#include <Imath/ImathMatrixAlgo.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "surfacing/spline.h"

namespace drench::surfacing {
namespace {

constexpr float thinnest = 0.25f;      // shortest half axis / longest
constexpr float fattest = 0.9f;        // the same: an axis must be left to draw in along
constexpr float centre_moved = 0.9f;   // of the distance to the mean of the neighbours
constexpr float film_voxels = 2.2f;    // least thickness of a film in the field
constexpr float thread_voxels = 1.2f;  // least radius of a thread
constexpr float film_level = 0.30652f, film_weight = 2.01815f;      // t, pi / (16 t P(t))
constexpr float thread_level = 0.31814f, thread_weight = 2.88684f;  // t, 1 / (8 t^2 Q(t))

float ramp(float v, float from, float to) {
  const float t = std::clamp((v - from) / (to - from), 0.f, 1.f);
  return t * t * (3 - 2 * t);
}

/// Half axis and size for a surface `wanted` from the middle of the kernel, at `level` half axes.
Squeeze squeeze(float wanted, float least, float level, float support) {
  const float half_axis =
      std::clamp(std::max(wanted, least) / level, thinnest * support, fattest * support);
  return {half_axis, 0, level * half_axis};
}

/// Weighted sums over the particles around eight of them, distances in supports.
struct Moments {
  Pack colour{}, count{}, x{}, y{}, z{}, xx{}, yy{}, zz{}, xy{}, xz{}, yz{};

  void add(Pack dx, Pack dy, Pack dz) {
    const Pack square = multiply_add(dx, dx, multiply_add(dy, dy, dz * dz));
    colour = add_spline(colour, square, pack(2.f), pack(8.f));
    const Pack w = larger(1.f - square, Pack{});
    const Pack wx = w * dx, wy = w * dy, wz = w * dz;
    count += w;
    x += wx, y += wy, z += wz;
    xx = multiply_add(wx, dx, xx), yy = multiply_add(wy, dy, yy), zz = multiply_add(wz, dz, zz);
    xy = multiply_add(wx, dy, xy), xz = multiply_add(wx, dz, xz), yz = multiply_add(wy, dz, yz);
  }
};

/// Where one particle's neighbours lie; lengths in supports.
struct Neighbours {
  float count, colour;      // of a kernel with scale 1
  V3f mean;                 // from the particle
  V3f variance;             // along the axes, falling
  std::array<V3f, 3> axis;  // unit vectors
};

Neighbours neighbours_of(const Moments& sums, uint32_t k) {
  const float inverse = 1 / sums.count[k];
  const V3f m = inverse * V3f(sums.x[k], sums.y[k], sums.z[k]);
  const float xy = sums.xy[k] * inverse - m.x * m.y, xz = sums.xz[k] * inverse - m.x * m.z,
              yz = sums.yz[k] * inverse - m.y * m.z;
  Imath::M33f covariance(sums.xx[k] * inverse - m.x * m.x, xy, xz,  //
                         xy, sums.yy[k] * inverse - m.y * m.y, yz,  //
                         xz, yz, sums.zz[k] * inverse - m.z * m.z);
  V3f value;
  Imath::M33f vectors;
  Imath::jacobiEigenSolver(covariance, value, vectors);
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int a, int b) { return value[a] > value[b]; });
  Neighbours result{sums.count[k], sums.colour[k], m, V3f(0), {}};
  for (int a = 0; a < 3; ++a) {
    result.variance[a] = std::max(value[order[a]], 0.f);
    for (int row = 0; row < 3; ++row) result.axis[a][row] = vectors[row][order[a]];
  }
  return result;
}

/// Of a particle whose round kernel has `weight`.
Ellipsoid ellipsoid_of(const Neighbours& near, Thinness thin, float weight, const Lattice& lattice,
                       const ColourKernel& kernel) {
  const float support = kernel.support, voxel = 1 / lattice.voxels_per_spacing;
  const float c = near.colour * kernel.scale();
  const float thickness = film_thickness(c, support), radius = thread_radius(c, support);
  const Squeeze film = squeeze_film(thickness, voxel, kernel);
  const Squeeze thread = squeeze_thread(radius, voxel, kernel);
  const float round = 1 - thin.film - thin.thread;
  const float across =
      round + (thin.film * film.half_axis + thin.thread * thread.half_axis) / support;
  const float middle = 1 - thin.thread + thin.thread * thread.half_axis / support;
  const float blended = std::exp(round * std::log(weight) + thin.film * std::log(film.weight) +
                                 thin.thread * std::log(thread.weight));
  // The mesh of a thread lies within its field: chords of a voxel cut voxel^2 / 12 R off a circle.
  const float cut = voxel * voxel / (12 * thread.size);
  const V3f n = near.axis[2], m = near.axis[1];
  const float g = 1 / (across * across) - 1, h = 1 / (middle * middle) - 1;
  Ellipsoid shape;
  shape.xx = 1 + g * n.x * n.x + h * m.x * m.x;
  shape.yy = 1 + g * n.y * n.y + h * m.y * m.y;
  shape.zz = 1 + g * n.z * n.z + h * m.z * m.z;
  shape.xy = g * n.x * n.y + h * m.x * m.y;
  shape.xz = g * n.x * n.z + h * m.x * m.z;
  shape.yz = g * n.y * n.z + h * m.y * m.z;
  shape.peak = blended / (across * middle);
  shape.shift =
      centre_moved * lattice.reach *
      ((thin.film + thin.thread) * n.dot(near.mean) * n + thin.thread * m.dot(near.mean) * m);
  const float drawn = thin.film * (1 - thickness / (2 * film.size)) +
                      thin.thread * (1 - (radius + cut) / thread.size);
  shape.pull = drawn / g;
  return shape;
}

/// Vertices [begin, begin + count) of one block, count <= 8, and what may be near them.
struct VertexPack {
  uint32_t begin, count;
  PointPack points;  // voxels from the block's corner
  const NearParticles& near;
  float reach;

  /// Calls f(w, x, y, z, ellipsoid or null) for particles in reach, w = (1 - q^2)^2, (x, y, z) from
  /// the particle.
  template <class F>
  void for_each(const Ellipsoids& ellipsoids, F f) const {
    const Pack x = load(points.x.data()), y = load(points.y.data()), z = load(points.z.data());
    const Pack step = pack(1 / (reach * reach));
    for_each_close(near, points, reach, [&](size_t j) {
      const Pack dx = x - near.x[j], dy = y - near.y[j], dz = z - near.z[j];
      const Pack square = multiply_add(dx, dx, multiply_add(dy, dy, dz * dz));
      const Pack left = larger(1.f - square * step, Pack{});
      f(left * left, dx, dy, dz, ellipsoids.find(near.index[j]));
    });
  }
};

/// Whether a particle within a ring of blocks has an ellipsoid.
bool may_be_near(const BinnedParticles& particles, V3i block) {
  const int ring = particles.lattice.ring();
  V3i step;
  for (step.z = -ring; step.z <= ring; ++step.z)
    for (step.y = -ring; step.y <= ring; ++step.y)
      for (step.x = -ring; step.x <= ring; ++step.x) {
        const uint32_t b = particles.map.find(block + step);
        if (b != BlockMap::none && particles.ellipsoids.in_block[b]) return true;
      }
  return false;
}

/// Calls f for packs of all vertices that may have an ellipsoid within two spacings.
template <class F>
void for_each_thin_pack(const LatticeMesh& mesh, const BinnedParticles& particles, F f) {
  const Ellipsoids& ellipsoids = particles.ellipsoids;
  const Lattice& lattice = particles.lattice;
  const float reach = std::min(lattice.reach, 2 * lattice.voxels_per_spacing);
  tbb::enumerable_thread_specific<NearParticles> nears;
  tbb::parallel_for(size_t{0}, mesh.block.size(), [&](size_t b) {
    const BlockVertices& block = mesh.block[b];
    if (!may_be_near(particles, block.block)) return;
    NearParticles& near = nears.local();
    gather_near(particles, block.block, block_edge, reach, near);
    const auto thin = [&](uint32_t i) { return ellipsoids.find(i) != nullptr; };
    if (std::none_of(near.index.begin(), near.index.begin() + ptrdiff_t(near.size()), thin)) return;
    for (uint32_t v = block.begin; v < block.end; v += pack_width) {
      const uint32_t count = std::min<uint32_t>(pack_width, block.end - v);
      const V3f corner(block.block * block_edge);
      f(VertexPack{v, count, points_of(mesh.position, v, count, corner), near, reach});
    }
  });
}

}  // namespace

float film_thickness(float c, float support) { return std::min(5 * c * support / 7, 1.f); }

float thread_radius(float c, float support) {
  return std::min(support * std::sqrt(c / 6), std::sqrt(1 / std::numbers::pi_v<float>));
}

Squeeze squeeze_film(float thickness, float voxel, const ColourKernel& kernel) {
  Squeeze result = squeeze(thickness / 2, film_voxels * voxel / 2, film_level, kernel.support);
  result.weight = film_weight * kernel.iso_value * 2 * result.size / thickness;
  return result;
}

Squeeze squeeze_thread(float radius, float voxel, const ColourKernel& kernel) {
  Squeeze result = squeeze(radius, thread_voxels * voxel, thread_level, kernel.support);
  const float ratio = result.size / radius;
  result.weight = thread_weight * kernel.iso_value * ratio * ratio;
  return result;
}

Thinness thinness(const V3f& variance, float count) {
  const float extended = ramp(count, 1.9f, 2.2f) * ramp(variance.x, 0.05f, 0.1f);
  if (extended == 0) return {};
  const float wide = ramp(variance.y / variance.x, 0.05f, 0.2f);
  const float flat = variance.y > 0 ? 1 - ramp(variance.z / variance.y, 0.1f, 0.3f) : 0;
  return {extended * wide * flat * ramp(count, 2.2f, 2.7f), extended * (1 - wide)};
}

void add_ellipsoids(const BinnedParticles& particles, const std::vector<float>& weight,
                    const ColourKernel& kernel, const NearParticles& near,
                    const std::vector<uint32_t>& wanted, std::vector<FoundEllipsoid>& found) {
  const float reach = particles.lattice.reach, step = 1 / reach;
  for (size_t begin = 0; begin < wanted.size(); begin += pack_width) {
    const size_t count = std::min(pack_width, wanted.size() - begin);
    PointPack points;
    for (size_t k = 0; k < pack_width; ++k) {
      const uint32_t i = wanted[begin + std::min(k, count - 1)];
      points.x[k] = particles.x[i], points.y[k] = particles.y[i], points.z[k] = particles.z[i];
    }
    const Pack x = load(points.x.data()), y = load(points.y.data()), z = load(points.z.data());
    Moments sums;
    for_each_close(near, points, reach, [&](size_t j) {
      sums.add((near.x[j] - x) * step, (near.y[j] - y) * step, (near.z[j] - z) * step);
    });
    for (uint32_t k = 0; k < count; ++k) {
      const uint32_t i = wanted[begin + k];
      const Neighbours around = neighbours_of(sums, k);
      const Thinness thin = thinness(around.variance, around.count);
      if (thin.film + thin.thread < 0.01f) continue;
      found.push_back({i, ellipsoid_of(around, thin, weight[i], particles.lattice, kernel)});
    }
  }
}

Ellipsoids collected(const std::vector<std::vector<FoundEllipsoid>>& by_block, size_t particles) {
  Ellipsoids result;
  result.of.assign(particles, Ellipsoids::none);
  for (const std::vector<FoundEllipsoid>& part : by_block) {
    result.in_block.push_back(!part.empty());
    for (const FoundEllipsoid& one : part) {
      result.of[one.particle] = static_cast<uint32_t>(result.shape.size());
      result.shape.push_back(one.shape);
    }
  }
  return result;
}

void splat_ellipsoid(V3f p, const Ellipsoid& shape, float scale, float step, BlockValues& value) {
  p += shape.shift * step;
  const Pack dx = lanes() * step - p.x;
  const Pack along = shape.xx * dx * dx;
  const float weight = scale * shape.peak;
  const Pack weight2 = pack(2 * weight), weight8 = pack(8 * weight);
  float* row = value.data();
  for (int z = 0; z < block_edge; ++z)
    for (int y = 0; y < block_edge; ++y, row += block_edge) {
      const float dy = y * step - p.y, dz = z * step - p.z;
      if (dy * dy + dz * dz >= 1) continue;  // beyond a ball around it
      const float mixed = shape.xy * dy + shape.xz * dz;
      const float rest = shape.yy * dy * dy + 2 * shape.yz * dy * dz + shape.zz * dz * dz;
      if (rest - mixed * mixed / shape.xx >= 1) continue;  // the least of the square on this line
      const Pack square = multiply_add(dx, pack(2 * mixed), along + rest);
      store(row, add_spline(load(row), larger(square, Pack{}), weight2, weight8));
    }
}

void draw_in(LatticeMesh& mesh, const BinnedParticles& particles) {
  if (particles.ellipsoids.shape.empty()) return;
  for_each_thin_pack(mesh, particles, [&](const VertexPack& vertices) {
    Pack weight{}, move_x{}, move_y{}, move_z{};
    vertices.for_each(particles.ellipsoids,
                      [&](Pack w, Pack x, Pack y, Pack z, const Ellipsoid* e) {
                        weight += w;
                        if (!e) return;
                        const Pack pull = w * e->pull;
                        x -= e->shift.x, y -= e->shift.y, z -= e->shift.z;
                        move_x += pull * ((e->xx - 1) * x + e->xy * y + e->xz * z);
                        move_y += pull * (e->xy * x + (e->yy - 1) * y + e->yz * z);
                        move_z += pull * (e->xz * x + e->yz * y + (e->zz - 1) * z);
                      });
    for (uint32_t k = 0; k < vertices.count; ++k)
      if (weight[k] > 0)
        mesh.position[vertices.begin + k] -= V3f(move_x[k], move_y[k], move_z[k]) / weight[k];
  });
}

}  // namespace drench::surfacing

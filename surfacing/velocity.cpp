#include "surfacing/velocity.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <array>

namespace drench::surfacing {
namespace {

struct PackVector {
  Pack x{}, y{}, z{};
};

Pack dot(const PackVector& a, const PackVector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Weighted sums over the particles around eight vertices. d: from the vertex to the particle, in
/// units of the reach; u: velocity of the particle relative to a nearby one.
struct Moments {
  Pack weight{};
  PackVector d, u;
  Pack dxx{}, dyy{}, dzz{}, dxy{}, dxz{}, dyz{};
  PackVector ud[3];  // sums of u_k d
  Pack uu{};

  void add(Pack dx, Pack dy, Pack dz, const V3f& velocity) {
    const Pack near = larger(1.f - (dx * dx + dy * dy + dz * dz), Pack{});
    const Pack w = near * near * near;  // poly6's shape: smooth, and no square root
    const Pack wx = w * dx, wy = w * dy, wz = w * dz;
    weight += w;
    d = {d.x + wx, d.y + wy, d.z + wz};
    dxx = multiply_add(wx, dx, dxx), dyy = multiply_add(wy, dy, dyy);
    dzz = multiply_add(wz, dz, dzz), dxy = multiply_add(wx, dy, dxy);
    dxz = multiply_add(wx, dz, dxz), dyz = multiply_add(wy, dz, dyz);
    const Pack v[3] = {pack(velocity.x), pack(velocity.y), pack(velocity.z)};
    u = {multiply_add(w, v[0], u.x), multiply_add(w, v[1], u.y), multiply_add(w, v[2], u.z)};
    uu = multiply_add(w, v[0] * v[0] + v[1] * v[1] + v[2] * v[2], uu);
    for (int k = 0; k < 3; ++k) {
      ud[k].x = multiply_add(wx, v[k], ud[k].x);
      ud[k].y = multiply_add(wy, v[k], ud[k].y);
      ud[k].z = multiply_add(wz, v[k], ud[k].z);
    }
  }

  /// The fit at the vertices themselves: the mean of u, less the fitted gradient times the mean of
  /// d.
  PackVector fit() const {
    const Pack one = pack(1.f), inverse = one / larger(weight, pack(1e-30f));
    const PackVector m{d.x * inverse, d.y * inverse, d.z * inverse};
    Pack cxx = dxx * inverse - m.x * m.x, cyy = dyy * inverse - m.y * m.y,
         czz = dzz * inverse - m.z * m.z;
    const Pack cxy = dxy * inverse - m.x * m.y, cxz = dxz * inverse - m.x * m.z,
               cyz = dyz * inverse - m.y * m.z;
    // A direction spanned by less than a twentieth of the mean extent gives no gradient worth
    // having.
    const Pack lean = multiply_add(cxx + cyy + czz, pack(1e-3f), pack(1e-6f));
    cxx += lean, cyy += lean, czz += lean;
    // g = C^-1 m by the adjugate of the symmetric matrix; then G m = sum of cov(u, d) g.
    const Pack axx = cyy * czz - cyz * cyz, ayy = cxx * czz - cxz * cxz,
               azz = cxx * cyy - cxy * cxy;
    const Pack axy = cxz * cyz - cxy * czz, axz = cxy * cyz - cxz * cyy,
               ayz = cxy * cxz - cxx * cyz;
    const Pack scale = one / (cxx * axx + cxy * axy + cxz * axz);
    const PackVector g{(axx * m.x + axy * m.y + axz * m.z) * scale,
                       (axy * m.x + ayy * m.y + ayz * m.z) * scale,
                       (axz * m.x + ayz * m.y + azz * m.z) * scale};
    const PackVector mean{u.x * inverse, u.y * inverse, u.z * inverse};
    const auto slope = [&](Pack average, const PackVector& sums) {
      return (sums.x * inverse - average * m.x) * g.x + (sums.y * inverse - average * m.y) * g.y +
             (sums.z * inverse - average * m.z) * g.z;
    };
    const PackVector step{slope(mean.x, ud[0]), slope(mean.y, ud[1]), slope(mean.z, ud[2])};
    // The step from the mean stays within twice the spread of the particles' velocities: in a
    // rotation it is about as large as the spread, in a wild splash a gradient of noise would
    // overshoot.
    // A millionth is taken off for rounding, so that a lone particle has no spread at all.
    const Pack square = uu * inverse;
    const Pack spread2 = larger(square * (1 - 1e-6f) - dot(mean, mean), Pack{});
    const Pack limit = square_root(4.f * spread2 / larger(dot(step, step), pack(1e-30f)));
    const Pack fraction = smaller(limit, one);
    return {mean.x - fraction * step.x, mean.y - fraction * step.y, mean.z - fraction * step.z};
  }
};

/// Velocities at vertices [begin, begin + count) of one block, count <= 8.
void pack_velocities(const std::vector<V3f>& position, uint32_t begin, uint32_t count, V3f corner,
                     const NearParticles& near, const std::vector<V3f>& relative, float reach,
                     V3f* result) {
  const PointPack points = points_of(position, begin, count, corner);
  const Pack x = load(points.x.data()), y = load(points.y.data()), z = load(points.z.data());
  const Pack step = pack(1 / reach);
  Moments moments;
  for_each_close(near, points, reach, [&](size_t j) {
    moments.add((near.x[j] - x) * step, (near.y[j] - y) * step, (near.z[j] - z) * step,
                relative[j]);
  });
  const PackVector fit = moments.fit();
  std::array<float, pack_width> weight, u, v, w;
  store(weight.data(), moments.weight);
  store(u.data(), fit.x), store(v.data(), fit.y), store(w.data(), fit.z);
  for (uint32_t k = 0; k < count; ++k)
    result[k] = weight[k] > 1e-12f
                    ? V3f(u[k], v[k], w[k])
                    : relative[nearest_of(near, {points.x[k], points.y[k], points.z[k]})];
}

}  // namespace

std::vector<V3f> vertex_velocities(const LatticeMesh& mesh, const BinnedParticles& particles,
                                   const std::vector<V3f>& velocity, float reach) {
  std::vector<V3f> result(mesh.position.size());
  struct Scratch {
    NearParticles near;
    std::vector<V3f> relative;
  };
  tbb::enumerable_thread_specific<Scratch> scratches;
  tbb::parallel_for(size_t{0}, mesh.block.size(), [&](size_t b) {
    const BlockVertices& block = mesh.block[b];
    auto& [near, relative] = scratches.local();
    gather_near(particles, block.block, block_edge, particles.lattice.reach, near);
    relative.clear();
    if (near.size() == 0) return;  // cannot be: the field here comes from particles in reach
    const V3f base = velocity[particles.source[near.index[0]]];
    for (size_t j = 0; j < near.size(); ++j)
      relative.push_back(velocity[particles.source[near.index[j]]] - base);
    const V3f corner(block.block * block_edge);
    for (uint32_t v = block.begin; v < block.end; v += pack_width) {
      const uint32_t count = std::min<uint32_t>(pack_width, block.end - v);
      pack_velocities(mesh.position, v, count, corner, near, relative, reach, result.data() + v);
      for (uint32_t k = 0; k < count; ++k) result[v + k] += base;
    }
  });
  return result;
}

}  // namespace drench::surfacing

#include "surfacing/near_triangles.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/triangle.h"

namespace drench::surfacing {

TriangleSphere::TriangleSphere(const std::array<V3f, 3>& t) : center((t[0] + t[1] + t[2]) / 3) {
  for (const V3f& p : t) radius = std::max(radius, (p - center).length());
}

TriangleBox box_of(const std::array<V3f, 3>& t, float grown) {
  TriangleBox box{t[0], t[0]};
  for (const V3f& p : t)
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], p[axis]);
      box.high[axis] = std::max(box.high[axis], p[axis]);
    }
  return {box.low - V3f(grown), box.high + V3f(grown)};
}

namespace {

V3f weights_of(const std::array<V3f, 3>& t, const V3f& p) {
  const V3f u = t[1] - t[0], v = t[2] - t[0], w = p - t[0];
  const float uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), wu = w.dot(u), wv = w.dot(v);
  const float determinant = uu * vv - uv * uv;
  if (!(determinant > 0)) return {1, 0, 0};
  const float b = std::clamp((vv * wu - uv * wv) / determinant, 0.f, 1.f),
              c = std::clamp((uu * wv - uv * wu) / determinant, 0.f, 1 - b);
  return {1 - b - c, b, c};
}

void check(const TriangleMesh& mesh, const char* what, size_t number, const char* cure) {
  const auto fail = [&](const std::string& why) {
    throw Error(fmt::format("surfacing: {} {}: {}; {}", what, number, why, cure));
  };
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const V3f& p = mesh.position[v];
    if (!std::isfinite(p.x + p.y + p.z)) fail(fmt::format("vertex {} is not finite", v));
  }
  for (size_t t = 0; t < mesh.triangle.size(); ++t)
    if (std::max({mesh.triangle[t].x, mesh.triangle[t].y, mesh.triangle[t].z}) >=
        mesh.position.size())
      fail(fmt::format("triangle {} names a vertex beyond the last", t));
}

}  // namespace

NearTriangles::NearTriangles(std::span<const TriangleMesh> meshes, const BinnedParticles& particles,
                             float reach, const char* what, const char* cure)
    : reach_(reach) {
  for (size_t k = 0; k < meshes.size(); ++k) {
    const TriangleMesh& mesh = meshes[k];
    check(mesh, what, k, cure);
    for (const auto& t : mesh.triangle) {
      std::array<V3f, 3>& corner = corner_.emplace_back();
      for (int c = 0; c < 3; ++c)
        for (int axis = 0; axis < 3; ++axis)
          corner[c][axis] =
              static_cast<float>(particles.lattice.to_voxels(mesh.position[t[c]][axis], axis));
      sphere_.emplace_back(corner);
    }
  }
  if (!corner_.empty()) list_near(particles);
}

void NearTriangles::list_near(const BinnedParticles& particles) {
  BlockMap wet(27 * particles.block.size());
  std::vector<BlockKey> blocks;
  for (const BlockKey key : particles.block)
    for (int k = 0; k < 27; ++k) {
      const BlockKey next = key_of(block_of(key) + V3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
      if (wet.insert(next, 0)) blocks.push_back(next);
    }
  using Entry = std::pair<BlockKey, uint32_t>;
  tbb::enumerable_thread_specific<std::vector<Entry>> found;
  tbb::parallel_for(size_t{0}, corner_.size(), [&](size_t t) {
    const auto& triangle = corner_[t];
    const float grown = reach_ + 0.5f;
    const TriangleBox box = box_of(triangle, grown);
    const auto consider = [&](BlockKey key) {
      constexpr float half = 0.5f * block_edge;
      const V3f middle = V3f(block_of(key) * block_edge) + V3f(half);
      const V3f at = closest_on_triangle(middle, triangle[0], triangle[1], triangle[2]);
      if ((at - middle).length() < grown + half * 1.7321f)
        found.local().push_back({key, static_cast<uint32_t>(t)});
    };
    V3i low, high;
    double count = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto block = [](float v) {
        return static_cast<int>(std::clamp(std::floor(v / block_edge), -1.f, float(max_block)));
      };
      low[axis] = std::max(0, block(box.low[axis])), high[axis] = block(box.high[axis]);
      count *= high[axis] - low[axis] + 1;
    }
    if (count > static_cast<double>(blocks.size())) {  // a triangle far larger than the fluid
      for (const BlockKey key : blocks) consider(key);
      return;
    }
    V3i b;
    for (b.z = low.z; b.z <= high.z; ++b.z)
      for (b.y = low.y; b.y <= high.y; ++b.y)
        for (b.x = low.x; b.x <= high.x; ++b.x)
          if (wet.find(key_of(b)) != BlockMap::none) consider(key_of(b));
  });
  std::vector<Entry> entries;
  for (const auto& part : found) entries.insert(entries.end(), part.begin(), part.end());
  tbb::parallel_sort(entries.begin(), entries.end());
  for (const auto& [key, triangle] : entries) {
    if (map_.insert(key, static_cast<uint32_t>(first_.size())))
      first_.push_back(static_cast<uint32_t>(member_.size()));
    member_.push_back(triangle);
  }
  first_.push_back(static_cast<uint32_t>(member_.size()));
}

Foot NearTriangles::foot(V3i block, const V3f& p) const {
  Foot foot;
  float least = reach_ * reach_, distance = reach_, facing = 0;
  for_each_near(block, [&](uint32_t triangle) {
    if (!sphere_[triangle].within(p, distance)) return;
    const auto& t = corner_[triangle];
    const V3f at = closest_on_triangle(p, t[0], t[1], t[2]);
    const float square = (at - p).length2();
    if (square > least * (1 + 1e-5f)) return;
    // Of triangles that share the nearest point, the one that faces it most says on which side.
    const V3f normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    const float faces = std::abs(normal.dot(p - at));
    if (foot.found() && square > least * (1 - 1e-5f) && faces <= facing) return;
    least = std::min(least, square), distance = std::sqrt(least), facing = faces;
    foot.point = at, foot.normal = normal, foot.triangle = triangle;
  });
  if (!foot.found()) return foot;
  foot.distance = (foot.point - p).length();
  foot.weight = weights_of(corner_[foot.triangle], foot.point);
  return foot;
}

}  // namespace drench::surfacing

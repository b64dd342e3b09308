#include "surfacing/slivers.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

namespace drench::surfacing {
namespace {

constexpr float thin = 0.9690f;  // squared cosine of 10.1 degrees

bool has_angle_below(float cos2, const V3f& a, const V3f& b, const V3f& c) {
  const std::array corner{&a, &b, &c};
  for (size_t k = 0; k < 3; ++k) {
    const V3f u = *corner[(k + 1) % 3] - *corner[k], w = *corner[(k + 2) % 3] - *corner[k];
    const float dot = u.dot(w);
    if (dot >= 0 && dot * dot >= cos2 * u.length2() * w.length2()) return true;
  }
  return false;
}

bool is_sliver(const V3f& a, const V3f& b, const V3f& c) { return has_angle_below(thin, a, b, c); }

/// One pass of merges, each away from the others, so that the rings stay true for all.
class Merges {
 public:
  Merges(const LatticeMesh& mesh, const VertexRings& rings, const ClothContact& contact,
         const ClothSolids& cloth)
      : mesh_(mesh),
        rings_(rings),
        contact_(contact),
        cloth_(cloth),
        into_(mesh.position.size()),
        taken_(mesh.position.size(), 0) {
    std::iota(into_.begin(), into_.end(), 0u);
  }

  /// Tries to merge v into one of its ring.
  void try_vertex(uint32_t v) {
    if (!free(v)) return postponed_.push_back(v);
    const size_t before = slivers_around(v, v);
    if (before == 0) return;
    uint32_t best = v;
    size_t least = before;
    for (const uint32_t w : ring(v)) {
      if (!may_merge(v, w)) continue;
      if (const size_t after = slivers_around(v, w); after < least) best = w, least = after;
    }
    if (best == v) return;
    into_[v] = best;
    ++count_;
    taken_[v] = 1;
    for (const uint32_t w : ring(v)) taken_[w] = 1;
  }

  size_t count() const { return count_; }
  /// Is there a sliver that could not be tried beside the others?
  bool unfinished() const {
    return std::any_of(postponed_.begin(), postponed_.end(), [&](uint32_t v) {
      bool found = false;
      rings_.for_each_triangle(v, [&](uint32_t a, uint32_t b) {
        const uint32_t p = into_[v], q = into_[a], r = into_[b];
        found = found || (p != q && q != r && r != p && is_sliver(at(p), at(q), at(r)));
      });
      return found;
    });
  }
  const std::vector<uint32_t>& into() const { return into_; }

 private:
  std::span<const uint32_t> ring(uint32_t v) const {
    return {rings_.neighbour.begin() + rings_.first[v],
            rings_.neighbour.begin() + rings_.first[v + 1]};
  }
  const V3f& at(uint32_t v) const { return mesh_.position[v]; }
  bool free(uint32_t v) const {
    return !taken_[v] &&
           std::none_of(ring(v).begin(), ring(v).end(), [&](uint32_t w) { return taken_[w] != 0; });
  }

  /// Slivers of v's triangles if v stood at w; those with w are gone then.
  size_t slivers_around(uint32_t v, uint32_t w) const {
    size_t slivers = 0;
    rings_.for_each_triangle(v, [&](uint32_t a, uint32_t b) {
      slivers += a != w && b != w && is_sliver(at(w), at(a), at(b));
    });
    return slivers;
  }

  bool may_merge(uint32_t v, uint32_t w) const {
    if (!contact_.side.empty() && contact_.side[v] != contact_.side[w] && contact_.side[v] != 0)
      return false;
    size_t common = 0;
    for (const uint32_t n : ring(v)) {
      if (n == w || std::find(ring(w).begin(), ring(w).end(), n) == ring(w).end()) continue;
      ++common;
      if (ring(n).size() < 4) return false;
    }
    if (common != 2) return false;
    bool good = true;
    rings_.for_each_triangle(v, [&](uint32_t a, uint32_t b) {
      if (!good || a == w || b == w) return;
      const V3f before = (at(a) - at(v)).cross(at(b) - at(v)),
                after = (at(a) - at(w)).cross(at(b) - at(w));
      const float dot = before.dot(after);  // turned by less than 45 degrees
      good = dot > 0 && dot * dot > 0.5f * before.length2() * after.length2() &&
             !crosses_cloth(mesh_, {w, a, b}, cloth_);
    });
    return good;
  }

  const LatticeMesh& mesh_;
  const VertexRings& rings_;
  const ClothContact& contact_;
  const ClothSolids& cloth_;
  std::vector<uint32_t> into_;
  std::vector<uint8_t> taken_;  // in a merge or beside one
  std::vector<uint32_t> postponed_;
  size_t count_ = 0;
};

std::vector<uint32_t> corners_of_slivers(const LatticeMesh& mesh, const VertexRings& rings,
                                         const ClothSolids& cloth) {
  std::vector<std::vector<uint32_t>> found(mesh.block.size());
  tbb::parallel_for(size_t{0}, mesh.block.size(), [&](size_t b) {
    if (!cloth.near(mesh.block[b].block)) return;
    for (uint32_t v = mesh.block[b].begin; v < mesh.block[b].end; ++v)
      if (has_sliver(mesh.position, rings, v, thin)) found[b].push_back(v);
  });
  std::vector<uint32_t> all;
  for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
  return all;
}

template <class T>
void keep(std::vector<T>& column, const std::vector<uint32_t>& into) {
  if (column.empty()) return;
  size_t next = 0;
  for (uint32_t v = 0; v < into.size(); ++v)
    if (into[v] == v) column[next++] = column[v];
  column.resize(next);
}

/// Takes the merged vertices out, and the triangles that have lost a side.
void compact(LatticeMesh& mesh, ClothContact& contact, std::vector<V3f>& normal,
             const std::vector<uint32_t>& into) {
  std::vector<uint32_t> name(into.size() + 1, 0);  // of a vertex that stays, from now on
  for (uint32_t v = 0; v < into.size(); ++v) name[v + 1] = name[v] + (into[v] == v);
  for (BlockVertices& block : mesh.block) block = {block.block, name[block.begin], name[block.end]};
  size_t next = 0;
  for (Triangle t : mesh.triangle) {
    for (int k = 0; k < 3; ++k) t[k] = name[into[t[k]]];
    if (t.x != t.y && t.y != t.z && t.z != t.x) mesh.triangle[next++] = t;
  }
  mesh.triangle.resize(next);
  keep(mesh.position, into);
  keep(contact.side, into);
  keep(contact.extracted, into);
  keep(normal, into);
}

}  // namespace

bool has_sliver(const std::vector<V3f>& position, const VertexRings& rings, uint32_t v,
                float cos2) {
  bool found = false;
  rings.for_each_triangle(v, [&](uint32_t a, uint32_t b) {
    found = found || has_angle_below(cos2, position[v], position[a], position[b]);
  });
  return found;
}

size_t remove_slivers(LatticeMesh& mesh, VertexRings rings, ClothContact& contact,
                      const ClothSolids& cloth, std::vector<V3f>& normal) {
  if (cloth.empty()) return 0;
  size_t removed = 0;
  for (int pass = 0; pass < 4; ++pass) {
    if (pass > 0) rings = rings_of(mesh);
    Merges merges(mesh, rings, contact, cloth);
    for (const uint32_t v : corners_of_slivers(mesh, rings, cloth)) merges.try_vertex(v);
    removed += merges.count();
    if (merges.count() == 0) break;
    const bool last = !merges.unfinished();
    compact(mesh, contact, normal, merges.into());
    if (last) break;
  }
  return removed;
}

}  // namespace drench::surfacing

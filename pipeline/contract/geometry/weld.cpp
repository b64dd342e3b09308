#include "pipeline/contract/geometry/weld.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace drench {

namespace {

using Imath::V3d;
using Cell = std::array<int64_t, 3>;

/// Cells of a given edge, m, and the vertices in them.
class Cells {
 public:
  explicit Cells(double edge) : edge_(edge) {}

  void add(const V3d& p, uint32_t vertex) { members_[cell(p)].push_back(vertex); }

  template <class F>
  void for_each_near(const V3d& p, const F& f) const {
    const Cell middle = cell(p);
    for (int64_t k = 0; k < 27; ++k) {
      const auto found =
          members_.find({middle[0] + k % 3 - 1, middle[1] + k / 3 % 3 - 1, middle[2] + k / 9 - 1});
      if (found == members_.end()) continue;
      for (const uint32_t v : found->second) f(v);
    }
  }

 private:
  Cell cell(const V3d& p) const {
    constexpr double most = 1e18;
    Cell c;
    for (int k = 0; k < 3; ++k)
      c[size_t(k)] = int64_t(std::clamp(std::floor(p[k] / edge_), -most, most));
    return c;
  }

  double edge_;
  std::map<Cell, std::vector<uint32_t>> members_;
};

}  // namespace

double diagonal_of(const TriangleMesh& mesh) {
  Imath::Box3d box;
  for (const auto& t : mesh.triangle)
    for (const uint32_t v : {t.x, t.y, t.z}) box.extendBy(V3d(mesh.position[v]));
  return box.isEmpty() ? 0 : box.size().length();
}

std::vector<uint32_t> points_of(const TriangleMesh& mesh) {
  if (!mesh.point.empty()) return mesh.point;
  std::vector<uint32_t> itself(mesh.position.size());
  for (uint32_t v = 0; v < itself.size(); ++v) itself[v] = v;
  return itself;
}

std::vector<std::pair<uint32_t, uint32_t>> free_edges(const TriangleMesh& mesh,
                                                      const std::vector<uint32_t>& first) {
  struct Passed {
    uint32_t low, high;
    int sign;
  };
  std::vector<Passed> passed;
  passed.reserve(3 * mesh.triangle.size());
  for (const auto& t : mesh.triangle) {
    for (int c = 0; c < 3; ++c) {
      const uint32_t a = first[t[c]], b = first[t[(c + 1) % 3]];
      if (a != b) passed.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  }
  std::sort(passed.begin(), passed.end(), [](const Passed& p, const Passed& q) {
    return std::pair(p.low, p.high) < std::pair(q.low, q.high);
  });
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  for (size_t k = 0; k < passed.size();) {
    const size_t start = k;
    int sum = 0;
    while (k < passed.size() && passed[k].low == passed[start].low &&
           passed[k].high == passed[start].high)
      sum += passed[k++].sign;
    if (sum != 0) edges.emplace_back(passed[start].low, passed[start].high);
  }
  return edges;
}

Welded weld(const TriangleMesh& mesh, double distance) {
  Welded out;
  out.first = points_of(mesh);
  if (!(distance > 0)) return out;
  std::vector<uint32_t> rim;
  for (const auto& [a, b] : free_edges(mesh, out.first)) rim.push_back(a), rim.push_back(b);
  std::sort(rim.begin(), rim.end());
  rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
  Cells cells(distance);
  std::vector<uint32_t> joined = out.first;
  for (const uint32_t v : rim) {
    const V3d p(mesh.position[v]);
    uint32_t earliest = v;
    cells.for_each_near(p, [&](uint32_t u) {
      if ((V3d(mesh.position[u]) - p).length() <= distance) earliest = std::min(earliest, u);
    });
    if (earliest == v) {
      cells.add(p, v);
      continue;
    }
    joined[v] = earliest;
    ++out.count;
    out.widest = std::max(out.widest, (V3d(mesh.position[earliest]) - p).length());
  }
  for (uint32_t& v : out.first) v = joined[v];
  return out;
}

}  // namespace drench

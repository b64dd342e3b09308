#include "sim/setup/sheet_crossing.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "sim/passes/coupling/geometry.h"

namespace drench::sim {

namespace {

using Point = cpu::Vec3<double>;

struct Piece {
  int index;
  std::array<int, 3> vertex;
  std::array<Point, 3> at;
  Point low, high;
  double half;  // m, of the thickness

  bool has(int v) const { return std::find(vertex.begin(), vertex.end(), v) != vertex.end(); }
};

std::vector<Piece> pieces_of(const ClothTopology& cloth, const HostVec& x) {
  std::vector<Piece> all;
  const std::vector<int> point = sewn_points(cloth);  // what a seam joins may start at one place
  for (int t = 0; t < cloth.triangles(); ++t) {
    Piece p{t, {}, {}, {1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}, cloth.half_thickness[t]};
    for (size_t c = 0; c < 3; ++c) {
      const int v = cloth.corner[3 * size_t(t) + c];
      p.vertex[c] = point[size_t(v)];
      const Point at = p.at[c] = {x.x[v], x.y[v], x.z[v]};
      p.low = {std::min(p.low.x, at.x), std::min(p.low.y, at.y), std::min(p.low.z, at.z)};
      p.high = {std::max(p.high.x, at.x), std::max(p.high.y, at.y), std::max(p.high.z, at.z)};
    }
    if (cloth.meets_sheets[size_t(cloth.corner[3 * size_t(t)])]) all.push_back(p);
  }
  return all;
}

/// What the corners and sides of one do to the other.
std::optional<SheetCrossing::Kind> meeting(const Piece& one, const Piece& other) {
  const double least = 1e-3 * (one.half + other.half);
  for (size_t c = 0; c < 3; ++c) {
    const size_t d = (c + 1) % 3;
    if (other.has(one.vertex[c])) continue;
    if (!other.has(one.vertex[d]) &&
        cpu::segment_crosses(one.at[c], one.at[d], other.at[0], other.at[1], other.at[2]))
      return SheetCrossing::Kind::crosses;
    if (cpu::closest_point(one.at[c], other.at[0], other.at[1], other.at[2]).distance2 <
        least * least)
      return SheetCrossing::Kind::touches;
  }
  return {};
}

}  // namespace

std::optional<SheetCrossing> find_sheet_crossing(const ClothTopology& cloth,
                                                 const HostVec& position) {
  std::vector<Piece> piece = pieces_of(cloth, position);
  std::stable_sort(piece.begin(), piece.end(),
                   [](const Piece& a, const Piece& b) { return a.low.x < b.low.x; });
  std::optional<SheetCrossing> first;
  for (size_t i = 0; i < piece.size(); ++i) {
    const Piece& a = piece[i];
    const double room = 2e-3 * a.half;
    for (size_t j = i + 1; j < piece.size() && piece[j].low.x <= a.high.x + room; ++j) {
      const Piece& b = piece[j];
      if (a.low.y > b.high.y + room || b.low.y > a.high.y + room || a.low.z > b.high.z + room ||
          b.low.z > a.high.z + room)
        continue;
      auto kind = meeting(a, b);
      if (!kind || *kind == SheetCrossing::Kind::touches) {
        const auto back = meeting(b, a);
        if (back && (!kind || *back == SheetCrossing::Kind::crosses)) kind = back;
      }
      const auto [low, high] = std::minmax(a.index, b.index);
      if (kind &&
          (!first || low < first->triangle || (low == first->triangle && high < first->other)))
        first = SheetCrossing{low, high, *kind};
    }
  }
  return first;
}

}  // namespace drench::sim

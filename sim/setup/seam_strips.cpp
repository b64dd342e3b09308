#include "sim/setup/seam_strips.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "pipeline/contract/shot/shot.h"

namespace drench::sim {

namespace {

using Edge = std::pair<int, int>;

/// Side `edge` of a triangle, from one vertex to the next.
struct Side {
  int triangle, edge;
};

class Strips {
 public:
  Strips(const ClothTopology& cloth, double spacing) : cloth_(cloth), spacing_(spacing) {
    made_.neighbour = cloth.neighbour;
    for (const SeamSpring& s : cloth.seam) sewn_[s.a].insert(s.b), sewn_[s.b].insert(s.a);
    for (int t = 0; t < cloth.triangles(); ++t)
      for (int e = 0; e < 3; ++e) add_side({t, e});
  }

  SeamStrips make() {
    for (int t = 0; t < cloth_.triangles(); ++t) {
      for (int e = 0; e < 3; ++e)
        if (cloth_.neighbour[size_t(3 * t + e)] < 0) close({t, e});
    }
    if (made_.beside.empty()) return {};
    join();
    fill_fans();
    return std::move(made_);
  }

 private:
  int corner(Side s, int end) const {
    return cloth_.corner[size_t(3 * s.triangle + (s.edge + end) % 3)];
  }
  /// From the first end of a side to the second as the triangle has them, less where the vertices
  /// are, m: what of a period is between.
  V3d turn(Side s) const {
    if (cloth_.corner_shift.size() == 0) return V3d(0);
    const auto at = [&](int end) {
      const auto k = size_t(3 * s.triangle + (s.edge + end) % 3);
      return V3d(cloth_.corner_shift.x[k], cloth_.corner_shift.y[k], cloth_.corner_shift.z[k]);
    };
    return at(1) - at(0);
  }
  bool free(Side s) const { return cloth_.neighbour[size_t(3 * s.triangle + s.edge)] < 0; }
  /// Free sides are the ones to sew to, should there be a choice.
  void add_side(Side s) {
    const Edge key = std::minmax(corner(s, 0), corner(s, 1));
    const auto [at, added] = side_.emplace(key, s);
    if (!added && free(s)) at->second = s;
  }
  std::set<int> sewn_to(int vertex) const {
    std::set<int> all{vertex};
    const auto found = sewn_.find(vertex);
    if (found != sewn_.end()) all.insert(found->second.begin(), found->second.end());
    return all;
  }

  void close(Side side) {
    const int p = corner(side, 0), q = corner(side, 1);
    const Edge here = std::minmax(p, q);
    for (const int p2 : sewn_to(p)) {
      for (const int q2 : sewn_to(q)) {
        const Edge there = std::minmax(p2, q2);
        const auto found = side_.find(there);
        if (there == here || found == side_.end()) continue;
        const Side other = found->second;
        if (other.triangle == side.triangle) continue;
        if (closed_.insert(std::minmax(here, there)).second) add(side, other, p2, q2);
      }
    }
  }

  /// Two triangles between side p q and p2 q2 of another, one where they meet in a point.
  void add(Side side, Side other, int p2, int q2) {
    const int p = corner(side, 0), q = corner(side, 1);
    const V3d along = turn(side), there = corner(other, 0) == p2 ? turn(other) : -turn(other);
    if ((along - there).length() > 1e-3 * spacing_) return;  // around different ways
    const auto half = [&](Side s) { return cloth_.half_thickness[size_t(s.triangle)]; };
    const float reach = float(0.5 * spacing_) + half(side) + half(other);
    std::array<std::array<int, 3>, 2> triangles{{{q, p, p2}, {q, p2, q2}}};
    for (const auto& k : triangles) {
      if (k[0] == k[1] || k[1] == k[2] || k[2] == k[0]) continue;
      const int strip = cloth_.triangles() + int(made_.beside.size());
      made_.beside.push_back(side.triangle), made_.reach.push_back(reach);
      for (const int v : {p, p2, q, q2}) made_.pair.push_back(v);
      for (int e = 0; e < 3; ++e) {
        made_.corner.push_back(k[size_t(e)]), made_.neighbour.push_back(-1);
        const bool first = k[size_t(e)] == p || k[size_t(e)] == p2;
        const V3d shift = first ? V3d(0) : along;
        if (cloth_.corner_shift.size() > 0)
          made_.shift.push(float(shift.x), float(shift.y), float(shift.z));
        const Edge edge = std::minmax(k[size_t(e)], k[size_t((e + 1) % 3)]);
        strip_side_[edge].push_back({strip, e});
        for (const Side s : {side, other})
          if (edge == Edge(std::minmax(corner(s, 0), corner(s, 1)))) meet({strip, e}, s);
      }
    }
  }
  /// The first strip at a side of a sheet is its neighbour.
  void meet(Side strip, Side sheet) {
    made_.neighbour[size_t(3 * strip.triangle + strip.edge)] = sheet.triangle;
    int& back = made_.neighbour[size_t(3 * sheet.triangle + sheet.edge)];
    if (back < 0) back = strip.triangle;
  }
  /// Strips that follow each other along a seam, or around a point where several meet.
  void join() {
    for (const auto& [edge, sides] : strip_side_) {
      for (const Side s : sides) {
        int& other = made_.neighbour[size_t(3 * s.triangle + s.edge)];
        for (const Side o : sides)
          if (other < 0 && o.triangle != s.triangle) other = o.triangle;
      }
    }
  }

  void fill_fans() {
    std::vector<std::vector<int>> more(size_t(cloth_.vertices()));
    for (size_t k = 0; k < made_.corner.size(); ++k)
      more[size_t(made_.corner[k])].push_back(3 * cloth_.triangles() + int(k));
    made_.fan_start.push_back(0);
    for (size_t v = 0; v < more.size(); ++v) {
      const auto begin = cloth_.fan_entry.begin();
      std::vector<int>& all = made_.fan_entry;
      all.insert(all.end(), begin + cloth_.fan_start[v], begin + cloth_.fan_start[v + 1]);
      all.insert(all.end(), more[v].begin(), more[v].end());
      made_.fan_start.push_back(int(all.size()));
    }
  }

  const ClothTopology& cloth_;
  double spacing_;
  SeamStrips made_;
  std::map<int, std::set<int>> sewn_;
  std::map<Edge, Side> side_;
  std::map<Edge, std::vector<Side>> strip_side_;
  std::set<std::pair<Edge, Edge>> closed_;
};

}  // namespace

SeamStrips seam_strips(const ClothTopology& cloth, double spacing) {
  return cloth.seam.empty() ? SeamStrips{} : Strips(cloth, spacing).make();
}

}  // namespace drench::sim

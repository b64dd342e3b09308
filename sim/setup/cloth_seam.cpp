// Sheets that span the period of a periodic axis: vertices on free edges that are images of one
// another become one mass point, so that there is no edge at the seam.

#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

using Edge = std::pair<uint32_t, uint32_t>;
using Bin = std::array<int64_t, 3>;

std::vector<uint32_t> vertices_on_free_edges(const Sheet& sheet) {
  std::set<Edge> edges;
  for (const auto& t : sheet.triangle) {
    for (int c = 0; c < 3; ++c) edges.insert({sheet.welded[t[c]], sheet.welded[t[(c + 1) % 3]]});
  }
  std::set<uint32_t> rim;
  for (const auto& [a, b] : edges) {
    if (!edges.count({b, a})) rim.insert(a), rim.insert(b);
  }
  return {rim.begin(), rim.end()};
}

/// Bins of at least `edge` m over space, a whole number of them to a period: images are one place.
class Bins {
 public:
  Bins(const V3d& period, double edge) : period_(period) {
    for (int k = 0; k < 3; ++k) {
      count_[k] = std::max(1.0, std::floor(period[k] / edge));
      edge_[k] = period[k] > 0 ? period[k] / count_[k] : edge;
    }
  }

  void add(const V3d& p, uint32_t vertex) { members_[bin(p)].push_back(vertex); }

  /// Calls f(vertex) for all within an edge of p, and some more.
  template <class F>
  void for_each_near(const V3d& p, const F& f) const {
    std::set<Bin> seen;
    for (int k = 0; k < 27; ++k) {
      const V3d step(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
      const Bin b = bin(p + step * edge_);
      const auto found = members_.find(b);
      if (found == members_.end() || !seen.insert(b).second) continue;
      for (const uint32_t v : found->second) f(v);
    }
  }

 private:
  Bin bin(const V3d& p) const {
    Bin b;
    for (int k = 0; k < 3; ++k) {
      const double place = std::floor(p[k] / edge_[k]);
      const double around = period_[k] > 0 ? count_[k] * std::floor(place / count_[k]) : 0;
      b[size_t(k)] = int64_t(place - around);
    }
    return b;
  }
  V3d period_, edge_, count_;
  std::map<Bin, std::vector<uint32_t>> members_;
};

/// Periods from the image of q nearest to p to q itself.
Imath::V3i image_between(const V3d& p, const V3d& q, const V3d& period) {
  Imath::V3i image(0);
  for (int k = 0; k < 3; ++k)
    if (period[k] > 0) image[k] = int(std::lround((q[k] - p[k]) / period[k]));
  return image;
}

[[noreturn]] void refuse_gap(const Sheet& sheet, const V3d& p, double gap, const Seams& seams) {
  throw Error(fmt::format(
      "cloth \"{}\": its edge at ({:.6g}, {:.6g}, {:.6g}) m comes within {:.3g} m of its own image "
      "across the seam of a periodic axis and does not meet it; fluid would leak there. Make it "
      "as long as the period, then the two edges are joined, or leave a gap of at least {:.3g} m",
      sheet.name, p.x, p.y, p.z, gap, seams.least_gap));
}

/// With fewer than three cells around, two springs or two triangles would have the same ends.
void check_around(const Sheet& sheet) {
  std::set<Edge> directed;
  for (const auto& t : sheet.triangle) {
    for (int c = 0; c < 3; ++c) {
      const auto a = uint32_t(sheet.node[t[c]]), b = uint32_t(sheet.node[t[(c + 1) % 3]]);
      if (a != b && directed.insert({a, b}).second) continue;
      throw Error(fmt::format(
          "cloth \"{}\" spans a periodic axis and is joined to itself there, but with fewer than "
          "three cells around. Use at least three",
          sheet.name));
    }
  }
}

/// Joins vertices that are images of one another: `first` of an image is the one it is joined to.
/// @return how many.
size_t join_images(Sheet& sheet, const Seams& seams, std::vector<uint32_t>& first) {
  Bins bins(seams.period, seams.least_gap);
  size_t joined = 0;
  for (const uint32_t v : vertices_on_free_edges(sheet)) {
    const V3d& p = sheet.position[v];
    bins.for_each_near(p, [&](uint32_t u) {
      const Imath::V3i image = image_between(sheet.position[u], p, seams.period);
      if (first[v] != v || image == Imath::V3i(0)) return;
      const V3d off = p - sheet.position[u] - V3d(image) * seams.period;
      if (off.length() < seams.tolerance) {
        first[v] = u, sheet.image[v] = image;
        ++joined;
      } else if (off.length() < seams.least_gap) {
        refuse_gap(sheet, p, off.length(), seams);
      }
    });
    if (first[v] == v) bins.add(p, v);
  }
  return joined;
}

}  // namespace

Seams seams_of(const Shot& shot) {
  Seams seams;
  for (int k = 0; k < 3; ++k) {
    if (shot.domain.axis[size_t(k)] == Axis::periodic)
      seams.period[k] = shot.domain.max[k] - shot.domain.min[k];
  }
  seams.tolerance = 1e-3 * shot.fluid.spacing;
  seams.least_gap = 0.5 * shot.fluid.spacing;
  return seams;
}

void join_at_seams(Sheet& sheet, const Seams& seams) {
  const size_t n = sheet.position.size();
  sheet.period = seams.period;
  sheet.image.assign(n, Imath::V3i(0));
  std::vector<uint32_t> first(n);
  std::iota(first.begin(), first.end(), 0u);
  const size_t joined = seams.period.length() > 0 ? join_images(sheet, seams, first) : 0;
  for (size_t v = 0; v < n; ++v) {
    const uint32_t one = sheet.welded[v];
    if (one != v) first[v] = first[one], sheet.image[v] = sheet.image[one];
  }
  sheet.node.assign(n, 0);
  sheet.point.clear();
  for (size_t v = 0; v < n; ++v) {
    if (first[v] != v) continue;
    sheet.node[v] = int(sheet.point.size());
    sheet.point.push_back(uint32_t(v));
  }
  for (size_t v = 0; v < n; ++v) sheet.node[v] = sheet.node[first[v]];
  if (joined > 0) check_around(sheet);
}

}  // namespace drench::sim

#include "sim/setup/cloth_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/setup/sheet_crossing.h"

namespace drench::sim {

namespace {

using Point = cpu::Vec3<float>;
using Triangle = std::array<Point, 3>;

/// The images of a triangle of which something lies within `reach` of the domain, along periodic
/// axes.
std::vector<Triangle> images_of(const Triangle& triangle, float reach, const Parameters& p) {
  std::vector<Triangle> images{triangle};
  for (int k = 0; k < 3; ++k) {
    if (!p.periodic[k]) continue;
    const auto along = [k](auto& v) -> auto& { return k == 0 ? v.x : k == 1 ? v.y : v.z; };
    const float period = p.high[k] - p.low[k];
    float low = 1e30f, high = -1e30f;
    for (const auto& c : triangle)
      low = std::min(low, along(c) - reach), high = std::max(high, along(c) + reach);
    std::vector<Triangle> moved;
    for (float n = std::ceil((p.low[k] - high) / period); low + n * period < p.high[k]; ++n) {
      for (Triangle image : images) {
        for (auto& c : image) along(c) += n * period;
        moved.push_back(image);
      }
    }
    images = moved;
  }
  return images;
}

/// The first place of a sheet that walls would sweep in, half a spacing beyond one or more; empty
/// if there is none.
std::string place_beyond_walls(const Shot& shot, const Sheet& sheet) {
  const Domain& domain = shot.domain;
  const double slack = 0.5 * shot.fluid.spacing + 1e-9;
  for (size_t v = 0; v < sheet.point.size(); ++v) {
    if (sheet.pinned[v]) continue;  // stays where it is
    const V3d& p = sheet.position[sheet.point[v]];
    for (int k = 0; k < 3; ++k) {
      if (domain.axis[size_t(k)] != Axis::walls) continue;
      if (p[k] >= domain.min[k] - slack && p[k] <= domain.max[k] + slack) continue;
      return fmt::format(
          "vertex {} is at {:.6g} m in {}, they stand at {:.6g} and {:.6g} m. Move it, widen "
          "[domain], or open the side ({} = \"open\")",
          sheet.point[v], p[k], "xyz"[k], domain.min[k], domain.max[k], "xyz"[k]);
    }
  }
  return "";
}

/// Walls sweep cloth in within the first step: that is refused beside fluid, which it would throw.
void check_cloth_within_walls(const Shot& shot, Scene& scene) {
  for (size_t s = 0; s < scene.sheet.size(); ++s) {
    const std::string place = place_beyond_walls(shot, scene.sheet[s]);
    if (place.empty()) continue;
    const std::string guess = guess_of_unit(shot.domain, shot.cloth[s], scene.sheet[s]);
    const std::string text =
        fmt::format("cloth \"{}\" starts beyond the domain's walls, which sweep it in: {}{}{}",
                    scene.sheet[s].name, place, guess.empty() ? "" : ": ", guess);
    if (shot.fluid.present()) throw Error(fmt::format("{}: {}", shot.file.string(), text));
    scene.report.notes.push_back(text);
  }
}

/// Particles by cells of a spacing.
class ParticleCells {
 public:
  ParticleCells(const HostVec& position, float spacing) : x_(position), spacing_(spacing) {
    for (size_t i = 0; i < x_.size(); ++i) {
      const std::array<int64_t, 3> c = cell({x_.x[i], x_.y[i], x_.z[i]});
      for (int k = 0; k < 3; ++k)
        first_[k] = std::min(first_[k], c[k]), last_[k] = std::max(last_[k], c[k]);
      particle_.emplace(key(c), int(i));
    }
  }
  /// Calls f with each particle in the cells from `low` to `high`, and perhaps more.
  template <class F>
  void for_each_in(const Point& low, const Point& high, const F& f) const {
    if (x_.size() == 0) return;
    std::array<int64_t, 3> from = cell(low), to = cell(high);
    for (int k = 0; k < 3; ++k)
      from[k] = std::max(from[k], first_[k]), to[k] = std::min(to[k], last_[k]);
    for (int64_t z = from[2]; z <= to[2]; ++z) {
      for (int64_t y = from[1]; y <= to[1]; ++y) {
        for (int64_t x = from[0]; x <= to[0]; ++x) {
          const auto [begin, end] = particle_.equal_range(key({x, y, z}));
          for (auto it = begin; it != end; ++it) {
            const auto i = size_t(it->second);
            f(Point{x_.x[i], x_.y[i], x_.z[i]});
          }
        }
      }
    }
  }

 private:
  std::array<int64_t, 3> cell(const Point& p) const {
    const auto c = [this](float s) { return int64_t(std::floor(double(s) / double(spacing_))); };
    return {c(p.x), c(p.y), c(p.z)};
  }
  static uint64_t key(const std::array<int64_t, 3>& c) {
    const auto bits = [](int64_t n) { return uint64_t(n & 0x1fffff); };
    return bits(c[0]) << 42 | bits(c[1]) << 21 | bits(c[2]);
  }

  const HostVec& x_;
  float spacing_;
  std::array<int64_t, 3> first_{INT64_MAX, INT64_MAX, INT64_MAX},
      last_{INT64_MIN, INT64_MIN, INT64_MIN};
  std::unordered_multimap<uint64_t, int> particle_;
};

/// A triangle of the sheets where the first step has it, m local: walls keep off what is not
/// pinned.
Triangle held_triangle(const Scene& scene, int t) {
  const Parameters& p = scene.parameters;
  const HostVec &v = scene.start.cloth_position, &shift = scene.cloth.corner_shift;
  const auto held = [&](int vertex, int axis, float x) {
    const float margin = cloth_wall_margin * p.spacing;
    const bool moves = scene.cloth.inverse_mass[size_t(vertex)] > 0;
    return moves && p.wall[axis]
               ? std::max(std::min(x, p.high[axis] - margin), p.low[axis] + margin)
               : x;
  };
  Triangle corner;
  for (int k = 0; k < 3; ++k) {
    const int c = scene.cloth.corner[3 * t + k];
    corner[k] = {held(c, 0, v.x[c]), held(c, 1, v.y[c]), held(c, 2, v.z[c])};
    if (shift.size() > 0)
      corner[k] = corner[k] + Point{shift.x[3 * t + k], shift.y[3 * t + k], shift.z[3 * t + k]};
  }
  return corner;
}

/// Refuses particles closer to a sheet than a quarter spacing: the side they belong to is a guess.
void check_overlap(const Shot& shot, const Scene& scene) {
  const float a = scene.parameters.spacing;
  const ParticleCells cells(scene.start.position, a);
  for (int t = 0; t < scene.cloth.triangles(); ++t) {
    const float reach = 0.25f * a + scene.cloth.half_thickness[t];
    for (const Triangle& corner : images_of(held_triangle(scene, t), reach, scene.parameters)) {
      Point low{1e30f, 1e30f, 1e30f}, high{-1e30f, -1e30f, -1e30f};
      for (const Point& c : corner) {
        low = {std::min(low.x, c.x), std::min(low.y, c.y), std::min(low.z, c.z)};
        high = {std::max(high.x, c.x), std::max(high.y, c.y), std::max(high.z, c.z)};
      }
      const Point more{reach, reach, reach};
      cells.for_each_in(low - more, high + more, [&](const Point& p) {
        const float d2 = cpu::closest_point(p, corner[0], corner[1], corner[2]).distance2;
        if (d2 >= reach * reach) return;
        throw Error(fmt::format(
            "{}: fluid starts inside cloth \"{}\": the particle at ({:.4g}, {:.4g}, {:.4g}) m is "
            "{:.2g} m from where it starts, nearer than {:.2g} m (a quarter spacing and half the "
            "thickness), so it has no side. Walls keep cloth a quarter spacing off. Move the fluid "
            "or the cloth at least half a spacing ({:.3g} m) apart",
            shot.file.string(), scene.sheet[size_t(scene.cloth.sheet[t])].name,
            scene.frame.to_world(0, p.x), scene.frame.to_world(1, p.y),
            scene.frame.to_world(2, p.z), std::sqrt(d2), reach, 0.5 * a));
      });
    }
  }
}

/// Refuses free vertices farther inside an obstacle than the first step may move them out.
void check_cloth_outside(const Shot& shot, Scene& scene) {
  if (scene.obstacles.count() == 0) return;
  for (size_t s = 0; s < scene.sheet.size(); ++s) {
    const Sheet& sheet = scene.sheet[s];
    for (size_t v = 0; v < sheet.point.size(); ++v) {
      const V3d p = sheet.position[sheet.point[v]];
      if (sheet.pinned[v]) continue;
      const double distance = scene.obstacles.distance(p, -shot.preroll);
      if (distance > -0.25 * shot.fluid.spacing) continue;
      throw Error(
          fmt::format("{}: cloth \"{}\" starts inside an obstacle: vertex {} at ({:.4g}, {:.4g}, "
                      "{:.4g}) m is {:.2g} m deep in it. Move the cloth or the obstacle, or pin "
                      "the vertex: pinned ones may be inside",
                      shot.file.string(), sheet.name, sheet.point[v], p.x, p.y, p.z, -distance));
    }
  }
}

/// Refuses shells that start through themselves or each other: contact only keeps apart.
void check_sheets_apart(const Shot& shot, const Scene& scene) {
  if (!scene.parameters.self_contact) return;
  const auto crossing = find_sheet_crossing(scene.cloth, scene.start.cloth_position);
  if (!crossing) return;
  const auto triangle_text = [&](int t) {
    const auto s = size_t(scene.cloth.sheet[t]);
    const HostVec& x = scene.start.cloth_position;
    const int v = scene.cloth.corner[3 * t];
    return fmt::format("triangle {} of cloth \"{}\" near ({:.4g}, {:.4g}, {:.4g}) m",
                       t - scene.first_triangle[s], scene.sheet[s].name,
                       scene.frame.to_world(0, x.x[v]), scene.frame.to_world(1, x.y[v]),
                       scene.frame.to_world(2, x.z[v]));
  };
  const bool crosses = crossing->kind == SheetCrossing::Kind::crosses;
  throw Error(fmt::format(
      "{}: cloth starts {}: {} and {}. Contact keeps sheets apart that start apart, and knows no "
      "side where they do not. Move them a thickness apart, or let the sheet pass through others: "
      "self_collision = false",
      shot.file.string(), crosses ? "through cloth" : "on cloth, with no room between",
      triangle_text(crossing->triangle), triangle_text(crossing->other)));
}

}  // namespace

void check_cloth_start(const Shot& shot, Scene& scene) {
  check_cloth_within_walls(shot, scene);
  check_overlap(shot, scene);
  check_cloth_outside(shot, scene);
  check_sheets_apart(shot, scene);
}

}  // namespace drench::sim

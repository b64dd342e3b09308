// Where particles come from: lattices in boxes and balls, drops, and the layers of emitters.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <unordered_map>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/source_check.h"
#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

struct Source {
  std::vector<V3d> position;
  V3d velocity;
  double volume = 0;  // m^3 that are asked for; 0: not known
  std::string name = {};
};

double ball_volume(double radius) { return 4. / 3 * std::numbers::pi * std::pow(radius, 3); }

Source lattice_box(const FluidBox& box, double a) {
  const V3d size = box.max - box.min;
  Source source{{}, box.velocity, size.x * size.y * size.z};
  int n[3];
  // Whole cells only: a layer that reached out of the box could stand in a wall.
  for (int k = 0; k < 3; ++k) n[k] = std::max(1, int(size[k] / a + 1e-6));
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x)
        source.position.push_back(box.min + V3d(x + 0.5, y + 0.5, z + 0.5) * a);
    }
  }
  return source;
}

/// Lattice points around a centre, nearest first (ties by lattice order): the first n make a ball.
std::vector<V3d> ball_points(double radius, double a) {
  const int reach = int(std::ceil(radius / a)) + 1;
  std::vector<V3d> points;
  for (int z = -reach; z < reach; ++z) {
    for (int y = -reach; y < reach; ++y) {
      for (int x = -reach; x < reach; ++x) points.push_back(V3d(x + 0.5, y + 0.5, z + 0.5) * a);
    }
  }
  std::stable_sort(points.begin(), points.end(),
                   [](const V3d& p, const V3d& q) { return p.length2() < q.length2(); });
  return points;
}

size_t points_within(const std::vector<V3d>& points, double radius) {
  size_t n = 0;
  while (n < points.size() && points[n].length2() <= radius * radius) ++n;
  return n;
}

Source lattice_ball(const FluidSphere& sphere, double a) {
  Source source{ball_points(sphere.radius, a), sphere.velocity, ball_volume(sphere.radius)};
  source.position.resize(std::max<size_t>(1, points_within(source.position, sphere.radius)));
  for (V3d& p : source.position) p += sphere.center;
  return source;
}

/// The image of a point inside the domain.
V3d inside(const Domain& domain, V3d p) {
  for (int k = 0; k < 3; ++k) {
    const double low = domain.min[k], period = domain.max[k] - low;
    if (domain.axis[size_t(k)] == Axis::periodic)
      p[k] -= period * std::floor((p[k] - low) / period);
  }
  return p;
}

/// From one point to the nearest image of another.
V3d nearest_image(const Domain& domain, V3d d) {
  for (int k = 0; k < 3; ++k) {
    const double period = domain.max[k] - domain.min[k];
    if (domain.axis[size_t(k)] == Axis::periodic) d[k] -= period * std::round(d[k] / period);
  }
  return d;
}

/// Centres drawn evenly in the box, each at least a drop's width from the others.
std::vector<V3d> drop_centres(const FluidDrops& drops, const Domain& domain, double reach, double a,
                              uint32_t seed) {
  std::mt19937 random(seed);
  const auto unit = [&] {
    return double(random()) / 4294967296.0;
  };  // std distributions differ by library
  const V3d low = drops.min + V3d(reach), high = drops.max - V3d(reach);
  std::vector<V3d> centres;
  for (int tries = 0; int(centres.size()) < drops.count; ++tries) {
    if (tries > 2000 * drops.count) {
      throw Error(
          "fluid.drops: only " + std::to_string(centres.size()) + " of " +
          std::to_string(drops.count) +
          " drops fit into the box without touching. Use fewer or smaller drops, or a larger box");
    }
    V3d c;
    for (int k = 0; k < 3; ++k) c[k] = low[k] + unit() * std::max(0.0, high[k] - low[k]);
    const auto close = [&](const V3d& o) {
      return nearest_image(domain, o - c).length() < 2 * reach + a;
    };
    if (std::none_of(centres.begin(), centres.end(), close)) centres.push_back(c);
  }
  return centres;
}

Source lattice_drops(const FluidDrops& drops, const Domain& domain, double a, uint32_t seed) {
  Source source{{}, drops.velocity, drops.count * ball_volume(drops.radius)};
  if (drops.count <= 0) return source;
  const std::vector<V3d> ball = ball_points(std::max(drops.radius, a), a);
  size_t each = std::max<size_t>(1, points_within(ball, drops.radius)), larger = 0;
  if (drops.particles > 0)
    each = size_t(drops.particles / drops.count), larger = drops.particles % drops.count;
  if (drops.particles > 0) source.volume = 0;
  if (each + (larger > 0) > ball.size() || each == 0) {
    throw Error("fluid.drops: " + std::to_string(drops.particles) + " particles in " +
                std::to_string(drops.count) + " drops do not fit a radius of " +
                std::to_string(drops.radius) + " m. Use a larger radius or other counts");
  }
  const double reach = ball[each + (larger > 0) - 1].length() + 0.5 * a;
  for (const V3d& c : drop_centres(drops, domain, reach, a, seed)) {
    const size_t n = each + (larger > 0 ? 1 : 0);
    if (larger > 0) --larger;
    for (size_t k = 0; k < n; ++k) source.position.push_back(c + ball[k]);
  }
  return source;
}

/// Cells of one spacing: finds an earlier particle closer than 0.9 spacings.
class Occupancy {
 public:
  Occupancy(double a, const Domain& domain) : a_(a), domain_(domain) {}
  /// @param p  and all points inside the domain where it is periodic.
  bool taken(const V3d& p, const std::vector<V3d>& points) const {
    return taken_around(p, 0, points);
  }
  void add(const V3d& p, size_t index) {
    const auto c = cell(p);
    cells_.emplace(key(c[0], c[1], c[2]), index);
  }

 private:
  /// Is p taken, or an image of it that a periodic axis from `axis` on puts beside the domain?
  bool taken_around(const V3d& p, int axis, const std::vector<V3d>& points) const {
    if (axis == 3) return taken_there(p, points);
    if (taken_around(p, axis + 1, points)) return true;
    if (domain_.axis[size_t(axis)] != Axis::periodic) return false;
    const double low = domain_.min[axis], high = domain_.max[axis];
    for (const double side : {low - high, high - low}) {
      V3d image = p;
      image[axis] += side;
      const bool beside = image[axis] > low - a_ && image[axis] < high + a_;
      if (beside && taken_around(image, axis + 1, points)) return true;
    }
    return false;
  }
  bool taken_there(const V3d& p, const std::vector<V3d>& points) const {
    const auto c = cell(p);
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto [begin, end] = cells_.equal_range(key(c[0] + dx, c[1] + dy, c[2] + dz));
          for (auto it = begin; it != end; ++it) {
            if ((points[it->second] - p).length2() < 0.81 * a_ * a_) return true;
          }
        }
      }
    }
    return false;
  }
  std::array<int64_t, 3> cell(const V3d& p) const {
    return {int64_t(std::floor(p.x / a_)), int64_t(std::floor(p.y / a_)),
            int64_t(std::floor(p.z / a_))};
  }
  static uint64_t key(int64_t x, int64_t y, int64_t z) {
    return (uint64_t(x & 0x1fffff) << 42) | (uint64_t(y & 0x1fffff) << 21) | uint64_t(z & 0x1fffff);
  }
  double a_;
  const Domain& domain_;
  std::unordered_multimap<uint64_t, size_t> cells_;
};

}  // namespace

EmitterLayer emitter_layer(const FluidEmitter& emitter, double a) {
  const double area = inlet_area(emitter), eps = 1e-6;
  EmitterLayer layer{};
  if (emitter.type == EmitterType::mesh) return layer;
  if (emitter.type == EmitterType::disc) {  // the lattice points nearest to the centre
    const int reach = int(std::ceil(emitter.radius / a)) + 1;
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) layer.place.push_back({i * a, j * a});
    }
    const auto far2 = [](const std::array<double, 2>& p) { return p[0] * p[0] + p[1] * p[1]; };
    std::stable_sort(layer.place.begin(), layer.place.end(),
                     [&](const auto& p, const auto& q) { return far2(p) < far2(q); });
    layer.place.resize(std::max<size_t>(1, size_t(std::ceil(area / (a * a) - eps))));
  } else {
    const auto cells = [&](const V3d& half) {
      return std::max(1, int(std::ceil(2 * half.length() / a - eps)));
    };
    const int n[2] = {cells(emitter.u), cells(emitter.v)};
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i)
        layer.place.push_back({(i + 0.5 - 0.5 * n[0]) * a, (j + 0.5 - 0.5 * n[1]) * a});
    }
  }
  layer.interval = double(layer.place.size()) * a * a * a / (area * emitter.speed);
  return layer;
}

Inlet inlet_at(const FluidEmitter& emitter, const Timeline& time, double frame) {
  constexpr double step = 1e-3;  // frames
  Inlet inlet;
  inlet.center = emitter.center.at(frame);
  V3d d;
  if (emitter.type == EmitterType::disc) {
    d = emitter.direction.at(frame).normalized();
    const V3d helper = std::abs(d.x) < 0.6 ? V3d(1, 0, 0) : V3d(0, 1, 0);
    inlet.axis[0] = d.cross(helper).normalized(), inlet.axis[1] = d.cross(inlet.axis[0]);
  } else {
    inlet.axis[0] = emitter.u.normalized(), inlet.axis[1] = emitter.v.normalized();
    d = inlet.axis[0].cross(inlet.axis[1]);
  }
  const V3d carried =
      (emitter.center.at(frame + step) - emitter.center.at(frame - step)) * (time.fps / (2 * step));
  inlet.velocity = d * emitter.speed + carried;
  return inlet;
}

namespace {

/// All sources in the order in which they fill space.
std::vector<Source> all_sources(const Shot& shot, const LevelSetMaker& make_level_set) {
  const double a = shot.fluid.spacing;
  std::vector<Source> sources;
  const auto add = [&](Source source, const char* section, size_t index) {
    source.name = fmt::format("fluid.{}[{}]", section, index);
    sources.push_back(std::move(source));
  };
  const Fluid& fluid = shot.fluid;
  for (size_t k = 0; k < fluid.box.size(); ++k) add(lattice_box(fluid.box[k], a), "box", k);
  for (size_t k = 0; k < fluid.sphere.size(); ++k)
    add(lattice_ball(fluid.sphere[k], a), "sphere", k);
  for (size_t k = 0; k < fluid.drops.size(); ++k)
    add(lattice_drops(fluid.drops[k], shot.domain, a, shot.seed + uint32_t(k)), "drops", k);
  for (size_t k = 0; k < fluid.volume.size(); ++k) {
    const FluidVolume& volume = fluid.volume[k];
    const std::string name = fmt::format("fluid.volume[{}]", k);
    FilledVolume filled = fill_volume(shot, volume, name, make_level_set);
    add({std::move(filled.place), volume.velocity, filled.volume}, "volume", k);
  }
  return sources;
}

}  // namespace

InitialFluid initial_fluid(const Shot& shot, const LevelSetMaker& make_level_set) {
  const std::vector<Source> sources = all_sources(shot, make_level_set);
  InitialFluid fluid;
  Occupancy occupied(shot.fluid.spacing, shot.domain);
  for (size_t k = 0; k < sources.size(); ++k) {
    const Source& source = sources[k];
    const size_t before = fluid.position.size(), overlapping = fluid.overlapping;
    for (const V3d& place : source.position) {
      const V3d p = inside(shot.domain, place);
      if (before > 0 && occupied.taken(p, fluid.position)) {
        ++fluid.overlapping;
        continue;
      }
      fluid.position.push_back(p);
      fluid.velocity.push_back(source.velocity);
      fluid.source.push_back(int(k));
    }
    if (fluid.position.size() == before && !source.position.empty()) {
      throw Error(fmt::format(
          "{}: {} lies wholly in the fluid of other sources: boxes fill space first, then spheres, "
          "drops and volumes, each in the order of the shot. Move it, remove it, or make room",
          shot.file.string(), source.name));
    }
    fluid.report.push_back({.name = source.name,
                            .volume = source.volume,
                            .asked = source.position.size(),
                            .overlapping = fluid.overlapping - overlapping,
                            .lost = {}});
    if (sources.size() > 1) {
      for (size_t i = before; i < fluid.position.size(); ++i) occupied.add(fluid.position[i], i);
    }
  }
  return fluid;
}

}  // namespace drench::sim

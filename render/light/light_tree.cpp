#include "render/light/light_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace drench::render {

namespace {

using Imath::V3d;

constexpr float relative_slack = 1e-5f;  // of boxes, for their rounding

/// What a node knows of its lights, as sums.
struct Cluster {
  Imath::Box3f bounds;
  double power = 0, flat = 0, square = 0;
  V3d normal = V3d(0), weighted_center = V3d(0);

  void add(const LightTree::Light& light) {
    bounds.extendBy(light.bounds);
    const double p = double(light.power);
    const V3d center = V3d(light.bounds.center());
    power += p;
    if (!is_black(light.normal)) flat += p;
    normal += V3d(light.normal) * p;
    weighted_center += center * p;
    square += p * (center.length2() + double(light.bounds.size().length2()) / 8);
  }
  V3d center() const { return power > 0 ? weighted_center / power : V3d(bounds.center()); }
  double spread() const {
    const double least = 1e-12 * double(bounds.size().length2());
    return power > 0 ? std::max(square / power - center().length2(), least) : 0;
  }
  /// How badly one number stands for all its lights: power x spread x that of normals.
  double cost() const { return power > 0 ? power * spread() * (2 - normal.length() / power) : 0; }
};

}  // namespace

LightTree::LightTree(const std::array<std::vector<Light>, 2>& kinds) {
  std::vector<Light> lights(kinds[0]);
  lights.insert(lights.end(), kinds[1].begin(), kinds[1].end());
  order_.resize(lights.size());
  std::iota(order_.begin(), order_.end(), 0u);
  const uint32_t first[] = {0, uint32_t(kinds[0].size()), uint32_t(lights.size())};
  for (size_t k = 0; k < 2; ++k) {
    has_[k] = first[k] < first[k + 1];
    if (has_[k]) root_[k] = build(lights, first[k], first[k + 1], 0);
  }
  slot_.resize(order_.size());
  for (uint32_t slot = 0; slot < order_.size(); ++slot) slot_[order_[slot]] = slot;
}

uint32_t LightTree::build(std::span<const Light> lights, uint32_t first, uint32_t last, int depth) {
  Cluster all;
  for (uint32_t slot = first; slot < last; ++slot) all.add(lights[order_[slot]]);
  const uint32_t number = uint32_t(nodes_.size());
  Node node;
  const V3f slack = (absolute(all.bounds.center()) + all.bounds.size()) * relative_slack;
  node.bounds = {all.bounds.min - slack, all.bounds.max + slack};
  node.center = V3f(all.center());
  node.spread = float(all.spread());
  if (all.flat > 0) node.normal = V3f(all.normal / all.flat);
  node.flat = float(all.flat);
  node.round = float(all.power - all.flat);
  node.first = first, node.last = last;
  nodes_.push_back(node);
  if (node.is_leaf()) return number;
  const uint32_t middle = split(lights, first, last, depth);
  build(lights, first, middle, depth + 1);
  const uint32_t second = build(lights, middle, last, depth + 1);
  nodes_[number].second = second;
  return number;
}

/// Orders slots from `first` to `last` so that those before the returned one are the first child.
/// Deep down in halves: 2^32 lights end above max_depth.
uint32_t LightTree::split(std::span<const Light> lights, uint32_t first, uint32_t last, int depth) {
  const auto begin = order_.begin() + first, end = order_.begin() + last;
  const auto sort_along = [&](int axis) {
    std::sort(begin, end, [&](uint32_t a, uint32_t b) {
      const float x = lights[a].bounds.center()[axis], y = lights[b].bounds.center()[axis];
      return x != y ? x < y : a < b;
    });
  };
  const uint32_t count = last - first;
  double least = std::numeric_limits<double>::infinity();
  int best_axis = 0;
  uint32_t best = count / 2;
  std::vector<double> cost_after(count);
  for (int axis = 0; axis < 3 && depth < max_depth / 2; ++axis) {
    sort_along(axis);
    Cluster after, before;
    for (uint32_t k = count; k-- > 1;) {
      after.add(lights[begin[k]]);
      cost_after[k] = after.cost();
    }
    for (uint32_t k = 1; k < count; ++k) {
      before.add(lights[begin[k - 1]]);
      const double cost = before.cost() + cost_after[k];
      if (cost < least) least = cost, best_axis = axis, best = k;
    }
  }
  sort_along(best_axis);
  return first + best;
}

/// With the mean of 1 / distance^2 in a ball of lights, and with the mean of max(0, c) over cosines
/// c of mean m: 1/4 where normals point everywhere (m = 0), c where all are one, (m + sqrt(m^2 +
/// s)) / 2 between, where s is a quarter of what c varies by. As seen from among the lights they
/// vary most.
float LightTree::cluster_importance(const Node& node, const V3f& from) const {
  constexpr float inside_factor = 0.55f;  // 5/9: 3 / R^2 at the middle of a ball of spread 3/5 R^2
  constexpr float min_variance = 1e-6f;   // more than rounding
  const V3f away = from - node.center;
  const float distance2 = dot(away, away);
  const float seen = 1 / (distance2 + node.spread);
  const float m = dot(away, node.normal) * std::sqrt(seen);
  const float parallel = dot(node.normal, node.normal) * distance2 * seen;
  const float s = std::max(1 - parallel, min_variance) / 4;
  const float root = std::sqrt(m * m + s);
  const float cosine = m > 0 ? (m + root) / 2 : s / (2 * (root - m));
  return (node.round + node.flat * cosine) / std::max(distance2, inside_factor * node.spread);
}

}  // namespace drench::render

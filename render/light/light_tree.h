#pragma once
// A tree over many lights: draws one of them, and finds those that a ray may meet, without asking
// each. After Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
// Splitting": a cluster that a point is among is split, others are weighed whole. They weigh one by
// a bound of what its lights give, here it is an estimate (decision 0104): bounds draw distant
// clusters too often.

#include <Imath/ImathBox.h>

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "render/box_test.h"
#include "render/vector.h"

namespace drench::render {

class LightTree {
 public:
  struct Light {
    Imath::Box3f bounds;  // m, of all that shines
    V3f normal;           // unit, of one that shines by the cosine with it; 0 if all around alike
    float power = 0;      // importance x m^2 from 1 m along the normal; W/sr
  };

  LightTree() = default;
  /// @param kinds  lights whose number is their index in all of these together. Draws are from all
  ///               kinds or from the first alone
  explicit LightTree(const std::array<std::vector<Light>, 2>& kinds);

  bool empty() const { return nodes_.empty(); }

  /// Clusters that are weighed for a point, each light in one of them.
  struct Cut {
    static constexpr uint32_t max_nodes = 8;
    std::array<uint32_t, max_nodes> node;
    std::array<float, max_nodes> weight;
    uint32_t size = 0;
    float total = 0;
  };

  /// @param kinds       to draw from, 1 or 2
  /// @param importance  of a light by its number at `from`, 0 only where it gives nothing
  template <class Importance>
  Cut cut(int kinds, const V3f& from, const Importance& importance) const;
  /// @param target  in [0, cut.total)
  /// @return a light and its part of the total, which is 0 if the draw leads nowhere
  template <class Importance>
  std::pair<uint32_t, float> choose(const Cut& cut, const V3f& from, float target,
                                    const Importance& importance) const;
  /// The part of the total with which `choose` finds a light; above 0 where its importance is.
  template <class Importance>
  float part(const Cut& cut, const V3f& from, uint32_t light, const Importance& importance) const;

  /// Calls `meet(light)` for lights of the first kind whose box a ray meets before the distance
  /// that the last call has returned.
  template <class Meet>
  void along(const V3f& origin, const V3f& direction, float reach, const Meet& meet) const;

 private:
  static constexpr int max_depth = 64;

  struct Node {
    Imath::Box3f bounds;
    V3f center;                    // of power
    float spread = 0;              // m^2, mean square of the distance from it
    V3f normal = V3f(0);           // mean of those that have one
    float flat = 0;                // power of these
    float round = 0;               // power of the others
    uint32_t first = 0, last = 0;  // its lights' slots
    uint32_t second = 0;           // child; the other one follows the node

    bool is_leaf() const { return last - first == 1; }
    bool holds(uint32_t slot) const { return first <= slot && slot < last; }
  };

  uint32_t build(std::span<const Light> lights, uint32_t first, uint32_t last, int depth);
  uint32_t split(std::span<const Light> lights, uint32_t first, uint32_t last, int depth);
  /// What a cluster's lights give together, about; never 0 if they give anything anywhere.
  float cluster_importance(const Node& node, const V3f& from) const;
  template <class Importance>
  float weight(uint32_t node, const V3f& from, const Importance& importance) const {
    const Node& n = nodes_[node];
    return n.is_leaf() ? importance(order_[n.first]) : cluster_importance(n, from);
  }
  /// Goes down from `node`; `first(probability)` tells whether by the first child, whose
  /// probability it is given.
  template <class Importance, class First>
  std::pair<uint32_t, float> descend(uint32_t node, const V3f& from, const Importance& importance,
                                     const First& first) const;

  std::vector<Node> nodes_;
  std::array<uint32_t, 2> root_ = {};
  std::array<bool, 2> has_ = {};
  std::vector<uint32_t> order_;  // the light in each slot
  std::vector<uint32_t> slot_;   // of each light
};

template <class Importance>
LightTree::Cut LightTree::cut(int kinds, const V3f& from, const Importance& importance) const {
  Cut cut;
  for (int k = 0; k < kinds; ++k)
    if (has_[k]) cut.node[cut.size++] = root_[k];
  for (uint32_t k = 0; k < cut.size;) {
    const Node& node = nodes_[cut.node[k]];
    const V3f away = from - node.center;
    if (!node.is_leaf() && cut.size < Cut::max_nodes && dot(away, away) < node.spread) {
      cut.node[cut.size++] = node.second;
      ++cut.node[k];
      continue;
    }
    cut.weight[k] = weight(cut.node[k], from, importance);
    if (cut.weight[k] > 0)
      cut.total += cut.weight[k++];
    else
      cut.node[k] = cut.node[--cut.size];
  }
  return cut;
}

template <class Importance, class First>
std::pair<uint32_t, float> LightTree::descend(uint32_t node, const V3f& from,
                                              const Importance& importance,
                                              const First& first) const {
  float probability = 1;
  while (!nodes_[node].is_leaf()) {
    const uint32_t second = nodes_[node].second;
    const float a = weight(node + 1, from, importance), b = weight(second, from, importance);
    if (!(a + b > 0)) return {0, 0.f};
    const float first_probability = a / (a + b);
    const bool by_first = first(node + 1, first_probability);
    probability *= by_first ? first_probability : 1 - first_probability;
    node = by_first ? node + 1 : second;
  }
  return {order_[nodes_[node].first], probability};
}

template <class Importance>
std::pair<uint32_t, float> LightTree::choose(const Cut& cut, const V3f& from, float target,
                                             const Importance& importance) const {
  uint32_t k = 0;
  while (k + 1 < cut.size && target >= cut.weight[k]) target -= cut.weight[k++];
  if (k >= cut.size) return {0, 0.f};
  float u = target / cut.weight[k];
  const auto [light, probability] = descend(cut.node[k], from, importance, [&](uint32_t, float p) {
    const bool first = u < p;
    u = first ? u / p : (u - p) / (1 - p);
    return first;
  });
  return {light, probability * cut.weight[k]};
}

template <class Importance>
float LightTree::part(const Cut& cut, const V3f& from, uint32_t light,
                      const Importance& importance) const {
  const uint32_t slot = slot_[light];
  for (uint32_t k = 0; k < cut.size; ++k)
    if (nodes_[cut.node[k]].holds(slot))
      return cut.weight[k] * descend(cut.node[k], from, importance, [&](uint32_t first, float) {
                               return nodes_[first].holds(slot);
                             }).second;
  return 0;
}

template <class Meet>
void LightTree::along(const V3f& origin, const V3f& direction, float reach,
                      const Meet& meet) const {
  if (!has_[0]) return;
  const BoxTest box(origin, direction);
  std::array<uint32_t, max_depth + 1> waiting;
  int left = 0;
  waiting[left++] = root_[0];
  while (left > 0) {
    const uint32_t k = waiting[--left];
    const Node& node = nodes_[k];
    if (!box.meets(node.bounds, reach)) continue;
    if (node.is_leaf()) {
      reach = meet(order_[node.first]);
    } else {
      waiting[left++] = node.second;
      waiting[left++] = k + 1;
    }
  }
}

}  // namespace drench::render

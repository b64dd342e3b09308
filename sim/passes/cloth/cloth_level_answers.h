#pragma once
// What the levels of cloth_levels.h make of a residual.

#include "sim/backend/team.h"
#include "sim/passes/cloth/cloth_levels.h"

namespace drench::sim::DRENCH_BACKEND {

/// Coefficients of an aggregate's functions, or what vertices have in them.
template <class T>
struct Coefficients {
  Vec3<T> of[functions];

  /// Of a child, whose centre is `off` from this one's, in this one's functions.
  DRENCH_HD void take_moments(const Coefficients& child, Vec3<T> off) {
    const Vec3<T> whole = child.of[0];
    for (int k = 0; k < functions; ++k) of[k] = of[k] + child.of[k];
    of[1] = of[1] + whole * off.x, of[2] = of[2] + whole * off.y, of[3] = of[3] + whole * off.z;
  }
  /// Of the parent, from whose centre this one's is `off`.
  DRENCH_HD void take_answer(const Coefficients& parent, Vec3<T> off) {
    for (int k = 0; k < functions; ++k) of[k] = of[k] + parent.of[k];
    of[0] = of[0] + parent.at(off) - parent.of[0];
  }
  DRENCH_HD Vec3<T> at(Vec3<T> x) const { return of[0] + of[1] * x.x + of[2] * x.y + of[3] * x.z; }
};

/// Columns of coefficients, by fields.
struct CoefficientFields {
  float* field;
  int stride;

  template <class Index>
  DRENCH_HD auto at(Index i) const {
    const auto entry = [&](int k) { return load(field + k * stride, i); };
    Coefficients<decltype(entry(0))> c;
    for (int f = 0; f < functions; ++f)
      c.of[f] = {entry(3 * f), entry(3 * f + 1), entry(3 * f + 2)};
    return c;
  }
  template <class Index, class T>
  DRENCH_HD void put(Index i, const Coefficients<T>& c) const {
    for (int f = 0; f < functions; ++f) {
      store(field + 3 * f * stride, i, c.of[f].x),
          store(field + (3 * f + 1) * stride, i, c.of[f].y);
      store(field + (3 * f + 2) * stride, i, c.of[f].z);
    }
  }
};

/// What levels make of a residual: moments of vertices and of children, B_l^-1 of these, and the
/// way back.
struct LevelAnswers {
  ClothLevels::Level level[ClothLevels::most];
  const float *inverse, *leaf_weight;
  ConstVecView centre, local, slot_local, residual;
  const int *leaf_vertex, *leaf;
  CoefficientFields moment, answer;
  VecView scaled;
  int levels, small, vertices;  // levels from `small` on are small ones
  bool on;

  template <class Index, class T>
  DRENCH_HD void solve(Index at, const Coefficients<T>& m) const {
    const T from[unknowns] = {m.of[0].x, m.of[0].y, m.of[0].z, m.of[1].x, m.of[1].y, m.of[1].z,
                              m.of[2].x, m.of[2].y, m.of[2].z, m.of[3].x, m.of[3].y, m.of[3].z};
    T to[unknowns];
    const float* entry = inverse;
    for (int k = 0; k < unknowns; ++k) {
      T sum(0.f);
      for (int j = 0; j < k; ++j, entry += moment.stride) {
        const T both = load(entry, at);
        sum = sum + both * from[j], to[j] = to[j] + both * from[k];
      }
      to[k] = sum + load(entry, at) * from[k], entry += moment.stride;
    }
    answer.put(at, Coefficients<T>{{{to[0], to[1], to[2]},
                                    {to[3], to[4], to[5]},
                                    {to[6], to[7], to[8]},
                                    {to[9], to[10], to[11]}}});
  }
  template <class Index>
  DRENCH_HD void restrict_to_leaf(Index a) const {
    using T = decltype(load(inverse, a));
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    Coefficients<T> m{{none, none, none, none}};
    for (int k = 0; k < most_vertices; ++k) {
      const auto at = ClothLevels::slot(a, k);
      const auto v = load(leaf_vertex, at);
      const Vec3<T> r = residual.at(v) * load(leaf_weight, at), x = slot_local.at(at);
      m.of[0] = m.of[0] + r, m.of[1] = m.of[1] + r * x.x, m.of[2] = m.of[2] + r * x.y,
      m.of[3] = m.of[3] + r * x.z;
    }
    moment.put(a, m);
    solve(a, m);
  }
  /// The children of aggregate a of a level end before.
  DRENCH_HD int children_end(int l, int a) const {
    const int count = level[l - 1].count;
    return level[l - 1].first + (count < 4 * a + 4 ? count : 4 * a + 4);
  }
  DRENCH_HD void gather_moments(int l, int a) const {
    const Vec3<float> none{0.f, 0.f, 0.f};
    Coefficients<float> m{{none, none, none, none}};
    const int at = level[l].first + a;
    for (int c = level[l - 1].first + 4 * a; c < children_end(l, a); ++c)
      m.take_moments(moment.at(c), centre[c] - centre[at]);
    moment.put(at, m);
  }
  DRENCH_HD void restrict_to(int l, int a) const {
    gather_moments(l, a);
    solve(level[l].first + a, moment.at(level[l].first + a));
  }
  DRENCH_HD void give_to_children(int l, int a) const {
    const int at = level[l].first + a;
    const Coefficients<float> parent = answer.at(at);
    for (int c = level[l - 1].first + 4 * a; c < children_end(l, a); ++c) {
      Coefficients<float> child = answer.at(c);
      child.take_answer(parent, centre[c] - centre[at]);
      answer.put(c, child);
    }
  }
  /// What the levels give to a vertex, m.
  template <class Index>
  DRENCH_HD auto at_vertex(Index i) const {
    return answer.at(load(leaf, i)).at(local.at(i));
  }
  /// Up and down the small levels.
  DRENCH_DEVICE void solve_small(const OneOfTeam& one) const {
    for (int l = small; l < levels; ++l) {
      one.for_each(level[l].count, [&](int a) { gather_moments(l, a); });
      one.for_each_lane_of(level[l].first, level[l].count, [&](auto a) { solve(a, moment.at(a)); });
    }
    for (int l = levels - 1; l >= small; --l)
      one.for_each(level[l].count, [&](int a) { give_to_children(l, a); });
  }
  /// Adds what the levels make of the residual.
  template <class Matrix>
  DRENCH_DEVICE void add(const Team& team, const Matrix& matrix) const {
    if (!on) return;
    team.for_each_lane(level[0].count, [&](auto a) { restrict_to_leaf(a); });
    for (int l = 1; l < small; ++l)
      team.for_each(level[l].count, [&](int a) { restrict_to(l, a); });
    team.alone([&](const OneOfTeam& one) { solve_small(one); });
    for (int l = small - 1; l > 0; --l)
      team.for_each(level[l].count, [&](int a) { give_to_children(l, a); });
    team.for_each_lane(
        vertices, [&](auto i) { scaled.put(i, scaled.at(i) + matrix.moving(i, at_vertex(i))); });
  }
};

/// Levels that are this small are one part: of a core, or of a block of a GPU, whose threads meet
/// sooner than all of it.
#if defined(__CUDACC__)
constexpr int small_level = team_block;
#else
constexpr int small_level = 256;
#endif

inline LevelAnswers level_answers_of(State& state) {
  ClothLevels& s = state.cloth_levels;
  int small = 1;
  while (small < s.levels && s.level[small].count > small_level) ++small;
  LevelAnswers all{.level = {},
                   .inverse = s.inverse.data(),
                   .leaf_weight = s.leaf_weight.data(),
                   .centre = s.centre.view(),
                   .local = s.local.view(),
                   .slot_local = s.slot_local.view(),
                   .residual = state.cloth_system.residual.view(),
                   .leaf_vertex = s.leaf_vertex.data(),
                   .leaf = s.leaf.data(),
                   .moment = {s.moment.data(), s.aggregates},
                   .answer = {s.answer.data(), s.aggregates},
                   .scaled = state.cloth_system.scaled.view(),
                   .levels = s.levels,
                   .small = small,
                   .vertices = state.cloth.vertices,
                   .on = s.on};
  std::copy(s.level, s.level + s.levels, all.level);
  return all;
}

}  // namespace drench::sim::DRENCH_BACKEND

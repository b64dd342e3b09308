#include "sim/passes/cloth/cloth_factor.h"

#include <algorithm>
#include <cmath>

#include "sim/passes/cloth/block_cholesky.h"
#include "sim/passes/cloth/cloth_implicit.h"

namespace drench::sim::cpu {

struct ClothFactor {
  BlockPattern pattern;
  BlockCholesky cholesky;
  std::vector<float> block;  // kg, by the pattern's columns
  bool on = false;           // it is of the matrix that there is
  // Whether an answer by it is right within a hundredth, and whether that is known.
  bool exact = false, tried = false;
};

namespace {

constexpr int most_vertices_factored = 20'000;

/// Seconds a step of one core, as measured: 12 Gflop/s, a nanosecond an entry of 25 solves, and 640
/// sweeps without a factor.
bool pays(const BlockCholesky& c, int vertices) {
  return c.flops() / 12e9 + 25e-9 * double(c.entries()) < 640 * 90e-9 * vertices;
}

struct Block {
  float entry[9];

  static Block of(float isotropic) {
    return {{isotropic, 0.f, 0.f, 0.f, isotropic, 0.f, 0.f, 0.f, isotropic}};
  }
  static Block of(Vec3<float> n) {
    return {{n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.x, n.y * n.y, n.y * n.z, n.z * n.x, n.z * n.y,
             n.z * n.z}};
  }
  friend Block operator+(Block a, const Block& b) {
    for (int k = 0; k < 9; ++k) a.entry[k] += b.entry[k];
    return a;
  }
  Vec3<float> row(int r) const { return {entry[3 * r], entry[3 * r + 1], entry[3 * r + 2]}; }
  Vec3<float> column(int c) const { return {entry[c], entry[3 + c], entry[6 + c]}; }
  void set_row(int r, Vec3<float> v) {
    entry[3 * r] = v.x, entry[3 * r + 1] = v.y, entry[3 * r + 2] = v.z;
  }
  void set_column(int c, Vec3<float> v) { entry[c] = v.x, entry[3 + c] = v.y, entry[6 + c] = v.z; }
};

Vec3<float> unit(int axis) {
  return {axis == 0 ? 1.f : 0.f, axis == 1 ? 1.f : 0.f, axis == 2 ? 1.f : 0.f};
}

/// What couples a vertex to others: A has K on the diagonal and -K beside it.
struct Couplings {
  ClothMatrix matrix;

  /// Calls f(j, K) for each vertex j that vertex i is coupled to.
  /// @param least  of a vertex's largest of bending, that is not left out
  template <class F>
  void of(int i, float least, const F& f) const {
    if (matrix.shell.any) of_shell(i, least, f);
    for (int s = 0; s < matrix.ends.slots; ++s) {
      const int at = s * matrix.ends.stride + i, j = matrix.ends.end[at];
      if (j != i) f(j, Block::of(matrix.tension[at]) + Block::of(matrix.axis[at]));
    }
  }
  template <class F>
  void of_shell(int i, float least, const F& f) const {
    const ShellMatrix& m = matrix.shell;
    const int slice = ShellRows::slice(i), ring = m.rows.ring_start[slice],
              begin = m.rows.row_start[slice], end = m.rows.row_start[slice + 1],
              inner = begin + m.rows.ring_start[slice + 1] - ring;
    for (int slot = begin; slot < inner; ++slot) {
      const float* b = m.block + ShellRows::entry(ring + slot - begin, i);
      Block k;
      for (int e = 0; e < 9; ++e) k.entry[e] = b[e * m.stride];
      const int j = m.rows.end[ShellRows::entry(slot, i)];
      if (j != i) f(j, k);
    }
    float largest = 0.f;
    for (int slot = inner; slot < end; ++slot)
      largest = std::max(largest, std::abs(m.bend[ShellRows::entry(slot, i)]));
    for (int slot = inner; slot < end; ++slot) {
      const int at = ShellRows::entry(slot, i), j = m.rows.end[at];
      if (j != i && std::abs(m.bend[at]) > least * largest)
        f(j, Block::of(m.bend[at] * m.bend_factor[i]));
    }
  }
};

/// Slopes that are averaged couple vertices three edges apart, by 1e-8 of what those near have:
/// these are left out.
BlockPattern pattern_of(const State& state) {
  const size_t n = size_t(state.cloth.vertices);
  std::vector<std::vector<int>> rows(n);
  const Couplings couplings{cloth_matrix(state)};
  for (int i = 0; i < int(n); ++i) {
    rows[size_t(i)].push_back(i);
    couplings.of(i, 1e-5f, [&](int j, const Block&) {
      rows[size_t(i)].push_back(j), rows[size_t(j)].push_back(i);
    });
  }
  BlockPattern p;
  for (std::vector<int>& row : rows) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    p.column.insert(p.column.end(), row.begin(), row.end());
    p.start.push_back(int(p.column.size()));
  }
  return p;
}

/// Writes the rows of A on free directions; directions that are not free have what the vertex has
/// on the diagonal.
struct Assembly {
  Couplings couplings;
  const BlockPattern& pattern;
  float* block;

  float* at(int i, int j) const {
    const auto begin = pattern.column.begin(), first = begin + pattern.start[size_t(i)],
               last = begin + pattern.start[size_t(i) + 1], it = std::lower_bound(first, last, j);
    return it != last && *it == j ? block + 9 * (it - begin) : nullptr;
  }
  Block own(int i) const {
    const ClothMatrix& m = couplings.matrix;
    Block k = Block::of(m.inertia[i] + (m.anchored ? m.anchor[i] : 0.f));
    for (int c = 0; c < 3; ++c) {
      Vec3<float> more{0.f, 0.f, 0.f};
      if (m.air.on) more = m.air.times(i, unit(c)) * m.dt;
      if (m.constraints.shells) more = more + m.constraints.clung(i, unit(c));
      k.set_column(c, k.column(c) + more);
    }
    return k;
  }
  void operator()(int i) const {
    const ConstraintProjection& may = couplings.matrix.constraints;
    const size_t first = size_t(pattern.start[size_t(i)]),
                 last = size_t(pattern.start[size_t(i) + 1]);
    std::fill(block + 9 * first, block + 9 * last, 0.f);
    Block diagonal = own(i);
    couplings.of(i, 0.f, [&](int j, const Block& k) {
      float* beside = at(i, j);
      if (!beside) return;
      diagonal = diagonal + k;
      for (int e = 0; e < 9; ++e) beside[e] -= k.entry[e];
    });
    std::copy_n(diagonal.entry, 9, at(i, i));
    const float fill = (diagonal.entry[0] + diagonal.entry[4] + diagonal.entry[8]) / 3.f;
    for (size_t e = first; e < last; ++e) {
      const int j = pattern.column[e];
      Block k;
      std::copy_n(block + 9 * e, 9, k.entry);
      for (int r = 0; r < 3; ++r) k.set_row(r, may.project(j, k.row(r)));
      for (int c = 0; c < 3; ++c) {
        const Vec3<float> held =
            j == i ? (unit(c) - may.project(i, unit(c))) * fill : Vec3<float>{0.f, 0.f, 0.f};
        k.set_column(c, may.project(i, k.column(c)) + held);
      }
      std::copy_n(k.entry, 9, block + 9 * e);
    }
  }
};

}  // namespace

void load_cloth_factor(State& state) {
  state.cloth_factor.reset();
  const Parameters& p = state.parameters;
  const int n = state.cloth.vertices;
  if (!p.factors_sheets || !state.shell.any || !p.fluid || !p.incompressible) return;
  if (n > most_vertices_factored) return;
  BlockPattern pattern = pattern_of(state);
  std::vector<float> place;
  const ConstVecView rest = state.cloth_levels.rest.view();
  for (int i = 0; i < n; ++i) place.insert(place.end(), {rest.x[i], rest.y[i], rest.z[i]});
  BlockCholesky cholesky(pattern, place);
  if (!pays(cholesky, n)) return;
  const size_t entries = 9 * pattern.column.size();
  state.cloth_factor = std::make_shared<ClothFactor>(
      ClothFactor{std::move(pattern), std::move(cholesky), std::vector<float>(entries)});
}

bool factor_cloth(State& state) {
  drop_cloth_factor(state);
  ClothFactor* f = state.cloth_factor.get();
  if (!f || anything_touches(state)) return false;
  const Assembly assembly{{cloth_matrix(state)}, f->pattern, f->block.data()};
  parallel_for(state.queue, "cloth: assemble", state.cloth.vertices, assembly);
  f->on = f->cholesky.factor(f->block), f->tried = false;
  if (f->on) state.cloth_levels.on = false;
  return f->on;
}

bool cloth_is_factored(const State& state) { return state.cloth_factor && state.cloth_factor->on; }

void drop_cloth_factor(State& state) {
  if (state.cloth_factor) state.cloth_factor->on = false;
}

bool apply_cloth_factor(State& state, const ScaledClothMatrix& matrix) {
  if (!cloth_is_factored(state)) return false;
  ClothSystem& s = state.cloth_system;
  const VecView to = s.scaled.view();
  const ConstVecView from = s.residual.view();
  for (int i = 0; i < state.cloth.vertices; ++i) to.set(i, from[i]);
  state.cloth_factor->cholesky.solve(to.x, to.y, to.z);
  for (int i = 0; i < state.cloth.vertices; ++i) to.set(i, matrix.moving(i, to[i]));
  return true;
}

namespace {

/// What w leaves of `right`, into ClothSystem::residual, and what the factor answers to it, into
/// ClothSystem::scaled. @return their product, kg m^2.
double residual_by_factor(State& state, const VecView& w, const ConstVecView& right) {
  const ScaledClothMatrix matrix = scaled_cloth_matrix(state);
  const VecView residual = state.cloth_system.residual.view();
  for_each_lane(state.queue, "cloth: residual", state.cloth.vertices, [&](auto i) {
    residual.put(i, matrix.moving(i, right.at(i)) - matrix.times(w, i));
  });
  apply_cloth_factor(state, matrix);
  const ConstVecView answer = state.cloth_system.scaled.view();
  double sum = 0;
  for (int i = 0; i < state.cloth.vertices; ++i) sum += dot_double(residual[i], answer[i]);
  return sum;
}

}  // namespace

bool answer_by_factor(State& state, const VecView& w, const ConstVecView& right, float tolerance) {
  ClothFactor* f = state.cloth_factor.get();
  if (!cloth_is_factored(state) || (f->tried && !f->exact)) return false;
  const ConstVecView answer = state.cloth_system.scaled.view();
  ClothControl& control = *state.cloth_system.control.data();
  const double before = residual_by_factor(state, w, right);
  if (!(before > double(tolerance) * tolerance * control.reference)) return true;
  for (int i = 0; i < state.cloth.vertices; ++i) w.set(i, w[i] + answer[i]);
  ++control.sweeps;
  if (!f->tried) f->exact = residual_by_factor(state, w, right) <= 1e-4 * before, f->tried = true;
  return true;
}

}  // namespace drench::sim::cpu

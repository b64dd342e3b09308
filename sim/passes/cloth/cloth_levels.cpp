#include "sim/passes/cloth/cloth_levels.h"

#include "sim/passes/cloth/cloth_implicit.h"
#include "sim/passes/cloth/cloth_level_answers.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Entries of a symmetric 3 x 3 block: xx xy xz yy yz zz.
struct Symmetric3 {
  float entry[6];

  static DRENCH_HD Symmetric3 of(float isotropic) {
    return {{isotropic, 0.f, 0.f, isotropic, 0.f, isotropic}};
  }
  static DRENCH_HD Symmetric3 of(Vec3<float> n, float along) {
    const Vec3<float> m = n * along;
    return {{m.x * n.x, m.x * n.y, m.x * n.z, m.y * n.y, m.y * n.z, m.z * n.z}};
  }
  friend DRENCH_HD Symmetric3 operator+(Symmetric3 a, const Symmetric3& b) {
    for (int k = 0; k < 6; ++k) a.entry[k] += b.entry[k];
    return a;
  }
  DRENCH_HD Symmetric3 scaled(float by) const {
    Symmetric3 k = *this;
    for (float& e : k.entry) e *= by;
    return k;
  }
  DRENCH_HD void add(const Symmetric3& k) { *this = *this + k; }
  DRENCH_HD void add(float k) { entry[0] += k, entry[3] += k, entry[5] += k; }
  DRENCH_HD float trace() const { return entry[0] + entry[3] + entry[5]; }
};

/// Sums of energies of pairs of `count` functions by entries of their blocks.
template <int count>
struct Energies {
  double block[count * (count + 1) / 2][6];

  /// Of a spring between where functions have these values and a place that stands still.
  DRENCH_HD void add(const float (&f)[count], const Symmetric3& k) {
    for (int a = 0, pair = 0; a < count; ++a) {
      for (int b = a; b < count; ++b, ++pair) {
        const double both = double(f[a]) * f[b];
        for (int e = 0; e < 6; ++e) block[pair][e] += both * k.entry[e];
      }
    }
  }
  DRENCH_HD void add(const float (&f)[count], float k) {
    for (int a = 0, pair = 0; a < count; ++a) {
      for (int b = a; b < count; ++b, ++pair) {
        const double both = double(f[a]) * f[b] * k;
        block[pair][0] += both, block[pair][3] += both, block[pair][5] += both;
      }
    }
  }
  DRENCH_HD void put(double* to) const {
    for (int k = 0; k < 3 * count * (count + 1); ++k) to[k] = block[k / 6][k % 6];
  }
};

struct LinkSums {
  Energies<functions> all;
  Energies<functions - 1> within;  // of differences, in which the first function has no part
  // of one vertex, what it is held by:
  Symmetric3 crossing;  // neighbours beyond the aggregate
  Symmetric3 held;      // neighbours that do not move
  float trace;          // all of them
};

/// What the vertices of one aggregate of the finest level give to its ancestor's energies at a
/// level: first in all, then what two vertices have that no finer level had in one aggregate.
struct LeafEnergies {
  ClothMatrix matrix;
  const int *leaf, *leaf_vertex, *reach;
  ConstVecView rest, centre;
  const float* leaf_weight;
  double* partial;
  float* held;
  int level, first;  // of the level's aggregates

  DRENCH_HD bool moves(int v) const {
    const Vec3<float> free = matrix.constraints.axis[v];
    return free.x + free.y + free.z > 0.f;
  }
  DRENCH_HD Vec3<float> from_centre(int a, int v) const {
    return rest[v] - centre[first + (a >> (2 * level))];
  }
  template <class Stiffness>
  DRENCH_HD void add_link(int a, int i, int j, const Stiffness& k, const Stiffness& half,
                          LinkSums& to) const {
    if (j == i) return;
    if (!moves(j)) return to.held.add(k);
    const int at = common_level(a, leaf[j]);
    if (at > level) return to.crossing.add(k);
    if (at < level) return;
    const Vec3<float> d = rest[i] - rest[j];
    to.within.add({d.x, d.y, d.z}, half);  // it comes from both
  }
  DRENCH_HD void add_shell(int a, int i, LinkSums& to) const {
    const ShellRows& rows = matrix.shell.rows;
    const int slice = ShellRows::slice(i), ring = rows.ring_start[slice];
    const int begin = rows.row_start[slice], end = rows.row_start[slice + 1];
    const int inner = begin + rows.ring_start[slice + 1] - ring;
    for (int slot = begin; slot < inner; ++slot) {
      const float* b = matrix.shell.block + ShellRows::entry(ring + slot - begin, i);
      const int s = matrix.shell.stride;
      const Symmetric3 k{{b[0], 0.5f * (b[s] + b[3 * s]), 0.5f * (b[2 * s] + b[6 * s]), b[4 * s],
                          0.5f * (b[5 * s] + b[7 * s]), b[8 * s]}};
      to.trace += k.trace();
      add_link(a, i, rows.end[ShellRows::entry(slot, i)], k, k.scaled(0.5f), to);
    }
    for (int slot = inner; slot < end; ++slot) {
      const int at = ShellRows::entry(slot, i);
      const float k = matrix.shell.bend[at] * matrix.shell.bend_factor[i];
      to.trace += 3.f * k;
      add_link(a, i, rows.end[at], k, 0.5f * k, to);
    }
  }
  DRENCH_HD void add_springs(int a, int i, LinkSums& to) const {
    for (int s = 0; s < matrix.ends.slots; ++s) {
      const int at = s * matrix.ends.stride + i;
      const Symmetric3 k =
          Symmetric3::of(matrix.tension[at]) + Symmetric3::of(matrix.axis[at], 1.f);
      to.trace += k.trace();
      add_link(a, i, matrix.ends.end[at], k, k.scaled(0.5f), to);
    }
  }
  /// What holds a vertex that moves, beside neighbours that do.
  /// @param neighbours  what all of them do
  DRENCH_HD Symmetric3 own(int i, float neighbours) const {
    const Vec3<float> free = matrix.constraints.axis[i];
    Symmetric3 k = Symmetric3::of(matrix.inertia[i]);
    if (free.x * free.y * free.z == 0.f) {
      const float stiff = 2.f * neighbours;
      k.entry[0] += (1.f - free.x) * stiff, k.entry[3] += (1.f - free.y) * stiff;
      k.entry[5] += (1.f - free.z) * stiff;
    }
    if (matrix.anchored) k.add(matrix.anchor[i]);
    if (!matrix.air.on) return k;
    const Vec3<float> d = matrix.air.diagonal[i] * matrix.dt, c = matrix.air.cross[i] * matrix.dt;
    return k + Symmetric3{{d.x, c.x, c.z, d.y, c.y, d.z}};
  }
  /// Beyond its reach a vertex has no neighbour in another aggregate.
  DRENCH_HD void add_vertex(int a, int i, LinkSums& to) const {
    float* kept = held + 6 * size_t(i);
    if (level <= reach[i]) {
      to.trace = 0.f, to.held = to.crossing = {};
      if (matrix.shell.any) add_shell(a, i, to);
      add_springs(a, i, to);
    }
    if (level == 0) {
      const Symmetric3 all = own(i, to.trace) + to.held;
      for (int e = 0; e < 6; ++e) kept[e] = all.entry[e];
    }
    Symmetric3 all{{kept[0], kept[1], kept[2], kept[3], kept[4], kept[5]}};
    if (level <= reach[i]) all.add(to.crossing);
    const Vec3<float> x = from_centre(a, i);
    to.all.add({1.f, x.x, x.y, x.z}, all);
  }
  DRENCH_HD void operator()(int a) const {
    LinkSums sum{};
    for (int k = 0; k < most_vertices; ++k) {
      const int at = ClothLevels::slot(a, k), i = leaf_vertex[at];
      if (leaf_weight[at] == 0.f || !moves(i)) continue;
      add_vertex(a, i, sum);
    }
    double* to = partial + size_t(sums) * a;
    sum.all.put(to), sum.within.put(to + sums_of_all);
  }
};

/// Inverse of a symmetric matrix by L D L^T, without the directions that have nothing.
struct BlockOfFunctions {
  double a[unknowns][unknowns];

  DRENCH_HD void set(const double* all, const double* within) {
    constexpr int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int f = 0, pair = 0; f < functions; ++f) {
      for (int g = f; g < functions; ++g, ++pair) {
        const int apart = 6 * (pair - functions);  // of differences: none of the first function
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c) {
            const double more = f > 0 ? within[apart + at[r][c]] : 0.,
                         value = all[6 * pair + at[r][c]] + more;
            a[3 * f + r][3 * g + c] = a[3 * g + c][3 * f + r] = value;
          }
        }
      }
    }
  }
  DRENCH_HD void factor(double (&inverse_pivot)[unknowns]) {
    for (int k = 0; k < unknowns; ++k) {
      const double whole = a[k][k];
      double pivot = whole;
      for (int j = 0; j < k; ++j) pivot -= a[k][j] * a[k][j] * inverse_pivot[j];
      inverse_pivot[k] = pivot > 1e-5 * whole && whole > 0. ? 1. / pivot : 0.;
      for (int i = k + 1; i < unknowns; ++i) {  // L D below the diagonal
        double sum = a[i][k];
        for (int j = 0; j < k; ++j) sum -= a[i][j] * a[k][j] * inverse_pivot[j];
        a[i][k] = sum;
      }
    }
  }
  /// The lower half by rows, from one entry to the next `stride`.
  DRENCH_HD void invert(float* to, int stride) {
    double d[unknowns];
    factor(d);
    for (int column = 0; column < unknowns; ++column) {
      double x[unknowns] = {};
      x[column] = 1.;
      for (int k = column; k < unknowns; ++k)
        for (int i = k + 1; i < unknowns; ++i) x[i] -= a[i][k] * d[k] * x[k];
      for (int k = unknowns - 1; k >= 0; --k) {
        x[k] *= d[k];
        for (int i = k + 1; i < unknowns; ++i) x[k] -= a[i][k] * d[k] * x[i];
      }
      for (int k = column; k < unknowns; ++k) to[(k * (k + 1) / 2 + column) * stride] = float(x[k]);
    }
  }
};

struct AddLevels {
  LevelAnswers levels;
  ScaledClothMatrix matrix;
  DRENCH_DEVICE void operator()(const Team& team) const { levels.add(team, matrix); }
};

}  // namespace

bool anything_touches(const State& state) {
  const SheetRows rows = sheet_rows_of(state);
  const bool obstacles = state.parameters.obstacles > 0;
  if (!rows.any && !obstacles) return false;
  const int* grip = state.cloth_system.grip.data();
  return parallel_reduce(
             state.queue, "cloth: touching", state.cloth.vertices, 0,
             DRENCH_LAMBDA(int i) {
               return int((obstacles && grip[i] >= 0) || (rows.any && rows.touches(i)));
             },
             Larger{}) > 0;
}

void build_cloth_levels(State& state) {
  ClothLevels& s = state.cloth_levels;
  s.on = s.levels > 0 && !anything_touches(state);
  if (!s.on) return;
  const int stride = s.aggregates;
  double *partial = s.partial.data(), *strain = s.strain.data();
  float* inverse = s.inverse.data();
  for (int l = 0; l < s.levels; ++l) {
    const LeafEnergies leaves{.matrix = cloth_matrix(state),
                              .leaf = s.leaf.data(),
                              .leaf_vertex = s.leaf_vertex.data(),
                              .reach = s.reach.data(),
                              .rest = s.rest.view(),
                              .centre = s.centre.view(),
                              .leaf_weight = s.leaf_weight.data(),
                              .partial = partial,
                              .held = s.held.data(),
                              .level = l,
                              .first = s.level[l].first};
    parallel_for(
        state.queue, "levels: leaves", s.level[0].count, DRENCH_LAMBDA(int a) { leaves(a); });
    for (int k = 1; k <= l; ++k) {
      const ClothLevels::Level from = s.level[k - 1], to = s.level[k];
      constexpr int part = 12;  // sums of one index: the coarse levels have few aggregates
      parallel_for(
          state.queue, "levels: sums", to.count * (sums / part), DRENCH_LAMBDA(int i) {
            const int a = i / (sums / part), first = i % (sums / part) * part;
            double* sum = partial + size_t(sums) * (to.first + a) + first;
            for (int e = 0; e < part; ++e) sum[e] = 0.;
            for (int c = 4 * a; c < 4 * a + 4 && c < from.count; ++c) {
              const double* of = partial + size_t(sums) * (from.first + c) + first;
              for (int e = 0; e < part; ++e) sum[e] += of[e];
            }
          });
    }
    const ClothLevels::Level now = s.level[l], below = s.level[l > 0 ? l - 1 : 0];
    parallel_for(
        state.queue, "levels: blocks", now.count, DRENCH_LAMBDA(int a) {
          const int at = now.first + a;
          const double *all = partial + size_t(sums) * at, *more = all + sums_of_all;
          double* within = strain + size_t(sums - sums_of_all) * at;
          for (int e = 0; e < sums - sums_of_all; ++e) within[e] = more[e];
          for (int c = 4 * a; l > 0 && c < 4 * a + 4 && c < below.count; ++c) {
            const double* of = strain + size_t(sums - sums_of_all) * (below.first + c);
            for (int e = 0; e < sums - sums_of_all; ++e) within[e] += of[e];
          }
          BlockOfFunctions block;
          block.set(all, within);
          block.invert(inverse + at, stride);
        });
  }
}

void add_cloth_levels(State& state, const ScaledClothMatrix& matrix) {
  if (state.cloth_levels.on)
    run_together(state.queue, "levels: add", state.cloth.vertices,
                 AddLevels{level_answers_of(state), matrix});
}

}  // namespace drench::sim::DRENCH_BACKEND

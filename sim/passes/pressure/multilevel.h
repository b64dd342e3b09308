#pragma once
// Coarse levels of the preconditioner of the pressure solve (Bramble, Pasciak, Xu 1990):
//   z = sum_l P_l D_l^-1 P_l^T g,
// P_l: trilinear interpolation from the nodes of a grid, the finest over the cells that particles
// are sorted by, every other one twice as wide; D_l: the stiffness of each node's own function.
// Sums only, nothing is solved. The diagonal alone lowers errors of wavelength L in about L / h
// iterations, and what it leaves is smooth: with 80 layers of water at rest the pressures came out
// from a tenth of to five times what they should, and threw the water up.
//
// For smooth pressures A is -rho^2 times Laplace's operator: a node's stiffness is the energy
// sum_i rho_i^2 |grad phi(x_i)|^2, taken as that of a function whose support particles fill evenly,
// times sum_i rho_i^2 phi(x_i). To it comes what A makes of pressures without any gradient, in
// packings out of order and at free surfaces, sum_i phi(x_i) |(D^T 1)_i|^2: without it the widest
// functions are corrected too far and solves diverge. Sums of phi restrict exactly from level to
// level. Particles on the bound neither give nor take: the metric of a projected step must not
// couple them with others (Bertsekas 1982).

#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

/// The finest nodes, at the corners of blocks of cells.
struct FinestNodes {
  GridShape grid;
  NodeLevel level;
  Vec3<int> shift;  // log2 of the cells to a block along each axis

  /// Where a particle stands within block (x, y, z), from 0 to 1.
  DRENCH_HD Vec3<float> within(Float4 p, int x, int y, int z) const {
    return {share((p.x - grid.origin.x) * grid.inverse_edge.x, shift.x, x),
            share((p.y - grid.origin.y) * grid.inverse_edge.y, shift.y, y),
            share((p.z - grid.origin.z) * grid.inverse_edge.z, shift.z, z)};
  }
  /// Of what stands on the nodes.
  DRENCH_HD float interpolate(Float4 p, const float* nodes) const {
    const int x = grid.cell_x(p.x) >> shift.x, y = grid.cell_y(p.y) >> shift.y,
              z = grid.cell_z(p.z) >> shift.z;
    const Vec3<float> f = within(p, x, y, z);
    const int x1 = beyond(x, level.x), y1 = beyond(y, level.y), z1 = beyond(z, level.z);
    const auto row = [&](int j, int k) {
      const float* v = nodes + level.index(0, j, k);
      return v[x] + f.x * (v[x1] - v[x]);
    };
    const float near = row(y, z), near_up = row(y1, z), far = row(y, z1), far_up = row(y1, z1);
    const float a = near + f.y * (near_up - near), b = far + f.y * (far_up - far);
    return a + f.z * (b - a);
  }
  /// What the nodes of a block get of its particles, from the sums of value times 1, x, y, xy, z,
  /// xz, yz and xyz: along each axis what is away from a node is not at the one before it.
  DRENCH_HD static void to_nodes(float sum[8]) {
    for (int axis = 1; axis < 8; axis *= 2)
      for (int n = 0; n < 8; ++n)
        if (!(n & axis)) sum[n] -= sum[n + axis];
  }

 private:
  DRENCH_HD static int beyond(int k, const NodeAxis& axis) { return k + 1 == axis.n ? 0 : k + 1; }
  DRENCH_HD static float share(float cells, int shift, int block) {
    return minimum(max0(cells / float(1 << shift) - float(block)), 1.f);
  }
};

/// The eight sums of weight times value(i) over the particles of every block, then of every node.
template <class Value>
void restrict_particles(State& state, float* nodes, const Value& value) {
  Hierarchy& h = state.pressure.hierarchy;
  const FinestNodes finest{state.fluid.grid, h.level[0], h.shift};
  const int* cell_start = state.fluid.cell_start.data();
  const Float4* place = state.pressure.place.data();
  float* partial = h.partial.data();
  const int blocks = h.blocks.x * h.blocks.y * h.blocks.z;
  const Vec3<int> nb = h.blocks;
  const int* awake = &state.pressure.control.data()->levels;
  parallel_for(
      "levels: blocks", blocks, DRENCH_LAMBDA(int b) {
        if (!*awake) return;
        const GridShape& g = finest.grid;
        const Vec3<int> size{1 << finest.shift.x, 1 << finest.shift.y, 1 << finest.shift.z};
        const Vec3<int> at{b % nb.x, b / nb.x % nb.y, b / (nb.x * nb.y)};
        const int x = at.x * size.x, y = at.y * size.y, z = at.z * size.z;
        const int end_x = x + size.x < g.nx ? x + size.x : g.nx;
        float sum[8] = {0.f, 0.f, 0.f, 0.f, 0.f, 0.f, 0.f, 0.f};
        for (int cz = z; cz < z + size.z && cz < g.nz; ++cz)
          for (int cy = y; cy < y + size.y && cy < g.ny; ++cy) {
            const int* row = cell_start + g.index(0, cy, cz);
            for (int i = row[x]; i < row[end_x]; ++i) {
              const float v = value(i);
              if (v == 0.f) continue;
              const Vec3<float> f = finest.within(place[i], at.x, at.y, at.z);
              const float vx = v * f.x, vy = v * f.y, vz = v * f.z, vxy = vx * f.y;
              sum[0] += v, sum[1] += vx, sum[2] += vy, sum[3] += vxy;
              sum[4] += vz, sum[5] += vx * f.z, sum[6] += vy * f.z, sum[7] += vxy * f.z;
            }
          }
        FinestNodes::to_nodes(sum);
        for (int k = 0; k < 8; ++k) partial[8 * b + k] = sum[k];
      });
  const NodeLevel level = h.level[0];
  parallel_for(
      "levels: nodes", level.count(), DRENCH_LAMBDA(int n) {
        if (!*awake) return;
        const Vec3<int> at = level.place(n);
        float sum = 0.f;
        for (int k = 0; k < 8; ++k) {
          int bx = at.x - (k & 1), by = at.y - (k >> 1 & 1), bz = at.z - (k >> 2);
          if (level.x.wraps && bx < 0) bx += nb.x;
          if (level.y.wraps && by < 0) by += nb.y;
          if (level.z.wraps && bz < 0) bz += nb.z;
          if (bx < 0 || by < 0 || bz < 0 || bx >= nb.x || by >= nb.y || bz >= nb.z) continue;
          sum += partial[8 * ((bz * nb.y + by) * nb.x + bx) + k];
        }
        nodes[n] = sum;
      });
}

/// Calls visit(place, weight) for the nodes of the finer axis that have part in node k.
template <class Visit>
DRENCH_HD void for_each_child(const NodeAxis& coarse, const NodeAxis& fine, int k,
                              const Visit& visit) {
  if (!coarse.halved) return visit(k, 1.f);
  const int middle = 2 * k;
  if (middle < fine.n) visit(middle, 1.f);
  if (coarse.n == 1 && !fine.wraps) return visit(1, 1.f);
  const int before = middle > 0 ? middle - 1 : fine.wraps ? fine.n - 1 : 0;
  if (before & 1) visit(before, 0.5f);
  if (middle + 1 < fine.n) visit(middle + 1, 0.5f);
}

/// Sums of a level from those of the finer one before it.
inline void restrict_nodes(State& state, int l, float* nodes) {
  const Hierarchy& h = state.pressure.hierarchy;
  const NodeLevel fine = h.level[l - 1], coarse = h.level[l];
  const int* awake = &state.pressure.control.data()->levels;
  parallel_for(
      "levels: down", coarse.count(), DRENCH_LAMBDA(int n) {
        if (!*awake) return;
        const Vec3<int> at = coarse.place(n);
        float sum = 0.f;
        for_each_child(coarse.z, fine.z, at.z, [&](int z, float wz) {
          for_each_child(coarse.y, fine.y, at.y, [&](int y, float wy) {
            for_each_child(coarse.x, fine.x, at.x, [&](int x, float wx) {
              sum += wx * wy * wz * nodes[fine.first + fine.index(x, y, z)];
            });
          });
        });
        nodes[coarse.first + n] = sum;
      });
}

/// Interpolated from a level to the finer one before it, and added.
inline void prolong_nodes(State& state, int l, float* nodes) {
  const Hierarchy& h = state.pressure.hierarchy;
  const NodeLevel fine = h.level[l - 1], coarse = h.level[l];
  const int* awake = &state.pressure.control.data()->levels;
  parallel_for(
      "levels: up", fine.count(), DRENCH_LAMBDA(int n) {
        if (!*awake) return;
        const Vec3<int> at = fine.place(n);
        const NodeAxis::Parents x = coarse.x.parents(at.x), y = coarse.y.parents(at.y),
                                z = coarse.z.parents(at.z);
        const float* v = nodes + coarse.first;
        const float sum = v[coarse.index(x.a, y.a, z.a)] + v[coarse.index(x.b, y.a, z.a)] +
                          v[coarse.index(x.a, y.b, z.a)] + v[coarse.index(x.b, y.b, z.a)] +
                          v[coarse.index(x.a, y.a, z.b)] + v[coarse.index(x.b, y.a, z.b)] +
                          v[coarse.index(x.a, y.b, z.b)] + v[coarse.index(x.b, y.b, z.b)];
        nodes[fine.first + n] += 0.125f * sum;
      });
}

/// Shapes of the levels over the grid that particles are sorted by.
inline void shape_levels(State& state) {
  Hierarchy& h = state.pressure.hierarchy;
  const GridShape& g = state.fluid.grid;
  const Vec3<int> wraps{g.period.x > 0.f, g.period.y > 0.f, g.period.z > 0.f};
  int shift = 1;  // as good as 0, for an eighth of the nodes
  const auto blocks = [&](int cells, int wrap) {
    return wrap ? cells : ((cells - 1) >> shift) + 1;
  };
  while (double(blocks(g.nx, wraps.x)) * blocks(g.ny, wraps.y) * blocks(g.nz, wraps.z) >
             state.fluid.count &&
         shift < 8)
    ++shift;
  h.shift = {wraps.x ? 0 : shift, wraps.y ? 0 : shift, wraps.z ? 0 : shift};
  h.blocks = {blocks(g.nx, wraps.x), blocks(g.ny, wraps.y), blocks(g.nz, wraps.z)};
  const auto axis = [](int blocks, int wraps, int shift, float inverse_edge) {
    return NodeAxis{wraps ? blocks : blocks + 1, wraps, 0, float(1 << shift) / inverse_edge};
  };
  const auto half = [](const NodeAxis& a) {
    if (a.n == 1) return NodeAxis{1, a.wraps, 0, a.edge};
    return NodeAxis{a.wraps ? (a.n + 1) / 2 : a.n == 2 ? 1 : a.n / 2 + 1, a.wraps, 1, 2 * a.edge};
  };
  NodeLevel level{axis(h.blocks.x, wraps.x, h.shift.x, g.inverse_edge.x),
                  axis(h.blocks.y, wraps.y, h.shift.y, g.inverse_edge.y),
                  axis(h.blocks.z, wraps.z, h.shift.z, g.inverse_edge.z), 0};
  h.levels = 0;
  for (;;) {
    h.level[h.levels++] = level;
    const int end = level.first + level.count();
    if (level.count() == 1 || h.levels == Hierarchy::most) {
      h.partial.resize(size_t(8) * h.blocks.x * h.blocks.y * h.blocks.z);
      h.answer.resize(end), h.inverse.resize(end);
      return;
    }
    level = {half(level.x), half(level.y), half(level.z), end};
  }
}

struct SquaredDensity {
  const float* density;
  DRENCH_HD float operator()(int i) const { return density[i] * density[i]; }
};
struct EvenEnergy {
  const float* even;
  DRENCH_HD float operator()(int i) const { return even[i]; }
};
/// The gradient of particles that are off the bound, and that their own step leaves off it.
struct FreeGradient {
  const Float4* place;
  const float *product, *source, *inverse_diagonal;
  const SolveControl* control;
  float least;

  DRENCH_HD bool free(int i, float gradient) const {
    return control->levels &&
           place[i].w - control->relaxation * inverse_diagonal[i] * gradient > least;
  }
  DRENCH_HD float operator()(int i) const {
    const float gradient = -product[i] - source[i];
    return inverse_diagonal[i] > 0.f && free(i, gradient) ? gradient : 0.f;
  }
};

/// Levels are for errors that are small and smooth. In fluid that an impact has crushed they are
/// neither, and what is free of the bound changes with every iteration: by levels particles were
/// thrown there at 53 km/s. Nor do they know sheets: with the bound of add_sheets_to_diagonal in
/// their stiffness pools on sheets are solved as well as without levels, but a sheet that folds
/// around water ended in pressures without end.
inline void choose_levels(State& state) {
  constexpr float small = 0.02f;  // of the rest density, in the mean
  SolveControl* control = state.pressure.control.data();
  const float* source = state.pressure.source.data();
  const bool sheets = state.contact.near > 0;
  const double most = double(small) * state.parameters.rest_density * state.fluid.count;
  reduce_then(
      "levels: error", state.fluid.count, 0.0,
      DRENCH_LAMBDA(int i) { return double(max0(source[i])); }, AddDoubles{},
      DRENCH_LAMBDA(double sum) { control->levels = !sheets && sum <= most; });
}

/// Is there nothing to do on the levels? The GPU's host does not ask: launches do nothing there.
inline bool no_levels(const State& state) {
#if defined(__CUDACC__)
  return state.contact.near > 0;
#else
  return !state.pressure.control.data()->levels;
#endif
}

/// Shapes and stiffnesses of all levels, these with what invert_diagonal left.
inline void prepare_levels(State& state) {
  shape_levels(state);
  choose_levels(state);
  if (no_levels(state)) return;
  Hierarchy& h = state.pressure.hierarchy;
  float *inverse = h.inverse.data(), *uneven = h.answer.data();
  restrict_particles(state, inverse, SquaredDensity{state.fluid.density.data()});
  restrict_particles(state, uneven, EvenEnergy{state.pressure.next.data()});
  for (int l = 1; l < h.levels; ++l) {
    restrict_nodes(state, l, inverse), restrict_nodes(state, l, uneven);
  }
  for (int l = 0; l < h.levels; ++l) {
    const NodeLevel level = h.level[l];
    // of hats, over the integral of the function: of the slope's square along an axis, and of the
    // function's own square
    const auto bend = [](const NodeAxis& a) { return a.n == 1 ? 0.f : 2.f / (a.edge * a.edge); };
    const auto mean = [](const NodeAxis& a) { return a.n == 1 ? 1.f : 2.f / 3.f; };
    const float smooth = bend(level.x) * mean(level.y) * mean(level.z) +
                         mean(level.x) * bend(level.y) * mean(level.z) +
                         mean(level.x) * mean(level.y) * bend(level.z);
    constexpr float part = 0.3f;  // of a node's own step; 0.15 to 0.5 tried: levels overlap
    parallel_for(
        "levels: stiffness", level.count(), DRENCH_LAMBDA(int n) {
          const int at = level.first + n;
          const float stiffness = smooth * inverse[at] + uneven[at];
          inverse[at] = stiffness > 0.f ? part / stiffness : 0.f;
        });
  }
}

/// z on the nodes of the finest level.
inline void correct_on_levels(State& state, const FreeGradient& gradient) {
  if (no_levels(state)) return;
  Hierarchy& h = state.pressure.hierarchy;
  float* answer = h.answer.data();
  const float* inverse = h.inverse.data();
  restrict_particles(state, answer, gradient);
  for (int l = 1; l < h.levels; ++l) restrict_nodes(state, l, answer);
  const int all = h.level[h.levels - 1].first + h.level[h.levels - 1].count();
  parallel_for(
      "levels: scale", all, DRENCH_LAMBDA(int n) { answer[n] *= inverse[n]; });
  for (int l = h.levels - 1; l > 0; --l) prolong_nodes(state, l, answer);
}

}  // namespace drench::sim::DRENCH_BACKEND

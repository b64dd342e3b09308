#pragma once
// Coarse levels of the preconditioner of the pressure solve (Bramble, Pasciak, Xu 1990):
//   z = sum_l P_l D_l^-1 P_l^T g,
// P_l: trilinear interpolation from the nodes of a grid, the finest over the cells that particles
// are sorted by, every other one twice as wide; D_l: the stiffness of each node's own function.
// Sums only, nothing is solved. The diagonal alone lowers errors of wavelength L in about L / h
// iterations, and what it leaves is smooth: without levels pressures of 80 layers of water at
// rest are up to five times what they should be, and throw the water up.
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
    return {fraction((p.x - grid.origin.x) * grid.inverse_edge.x, shift.x, x),
            fraction((p.y - grid.origin.y) * grid.inverse_edge.y, shift.y, y),
            fraction((p.z - grid.origin.z) * grid.inverse_edge.z, shift.z, z)};
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
  DRENCH_HD static float fraction(float cells, int shift, int block) {
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
      state.queue, "levels: blocks", blocks, DRENCH_LAMBDA(int b) {
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
      state.queue, "levels: nodes", level.count(), DRENCH_LAMBDA(int n) {
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
void restrict_nodes(State& state, int l, float* nodes);

/// Interpolated from a level to the finer one before it, and added.
void prolong_nodes(State& state, int l, float* nodes);

/// Shapes of the levels over the grid that particles are sorted by.
void shape_levels(State& state);

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

}  // namespace drench::sim::DRENCH_BACKEND

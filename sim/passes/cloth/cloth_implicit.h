#pragma once
// The implicit step of the sheets, linearised once about where they are, of springs implicit Euler
// (Baraff and Witkin 1998; shells: shell_system.h): with w = x_end - x - dt v, the displacement of a vertex off its straight path,
//   A w = dt^2 (f(x) + m g + f_owed - m c v) - (dt C + dt^2 K) dt v + loads,   A = m (1 + dt c) +
//   dt C + dt^2 K + dt B,
// K of a spring being k (n n^T + max(0, 1 - L/l) (1 - n n^T)): without the part that a compressed
// spring would push over sideways, so that A is positive definite. Loads are what the fluid's
// pressures give (contact_incompressible.h). Solved by conjugate gradients scaled by the 3 x 3
// blocks of the vertices, and of shells by coarse levels (cloth_levels.h). B is the drag of the air
// (wind_on_cloth.h), whose force joins f. Pinned vertices stay at w = 0, and vertices that a moving
// pin (cloth_pins.h), a wall of the domain or an obstacle (cloth_obstacles.h) holds have the w that
// takes them there.

#include "sim/passes/cloth/cloth_factor.h"
#include "sim/passes/cloth/cloth_levels.h"
#include "sim/passes/cloth/cloth_springs.h"
#include "sim/passes/cloth/self_contact.h"
#include "sim/passes/cloth/shell_system.h"

namespace drench::sim::DRENCH_BACKEND {

/// The components along free axes.
template <class T>
DRENCH_HD Vec3<T> along(Vec3<T> free, Vec3<T> v) {
  return {free.x * v.x, free.y * v.y, free.z * v.z};
}

/// Projection on the free directions of a vertex (the filter of Baraff and Witkin 1998): its free
/// axes, and of these not along the normal of an obstacle, nor across it where friction holds it.
struct ConstraintProjection {
  ConstVecView axis, normal;
  const float *slides, *cling;
  bool obstacles, shells;

  template <class Index, class T>
  DRENCH_HD Vec3<T> project(Index i, Vec3<T> v) const {
    const Vec3<T> free = along(axis.at(i), v);
    if (!obstacles) return free;
    const Vec3<T> n = normal.at(i);
    return (free - n * dot(n, free)) * load(slides, i);
  }
  /// What friction adds to A where it holds shells: a stiffness across the normal.
  template <class Index, class T>
  DRENCH_HD Vec3<T> clung(Index i, Vec3<T> x) const {
    const Vec3<T> n = normal.at(i);
    return (x - n * dot(n, x)) * load(cling, i);
  }
};

inline ConstraintProjection constraint_projection(const State& state) {
  const ClothSystem& s = state.cloth_system;
  const bool obstacles = state.parameters.obstacles > 0;
  return {.axis = s.free.view(),
          .normal = s.normal.view(),
          .slides = s.slides.data(),
          .cling = s.cling.data(),
          .obstacles = obstacles,
          .shells = obstacles && state.shell.any};
}

/// The matrix A, by slots of springs and rows of shells, on free directions alone.
struct ClothMatrix {
  SpringEnds ends;
  ShellMatrix shell;
  SheetRows contact;
  const float *tension, *inertia;
  ConstVecView axis;
  ConstraintProjection constraints;
  AirDrag air;
  const float* anchor;  // kg, of soft pins
  bool anchored;
  float dt;  // s

  template <class Index>
  DRENCH_HD auto times(const ConstVecView& view, Index i) const {
    auto y = whole(view, i);
    if (constraints.shells) y = y + constraints.clung(i, view.at(i));
    return constraints.project(i, y);
  }
  /// What does not act between vertices. The rest of the rows sums up to nothing.
  template <class Index>
  DRENCH_HD auto outer(const ConstVecView& view, Index i) const {
    using T = decltype(load(inertia, i));
    const Vec3<T> x = view.at(i);
    Vec3<T> y = x * load(inertia, i);
    if (air.on) y = y + air.times(i, x) * T(dt);
    if (anchored) y = y + x * load(anchor, i);
    return y;
  }
  /// On all axes: less the right side it is what holds a vertex.
  template <class Index>
  DRENCH_HD auto whole(const ConstVecView& view, Index i) const {
    using T = decltype(load(inertia, i));
    const Vec3<T> x = view.at(i);
    Vec3<T> y = outer(view, i);
    for (int s = 0; s < ends.slots; ++s) {
      const auto at = i + s * ends.stride;
      const Vec3<T> d = x - ends.at_end(view, i, s), e = axis.at(at);
      y = y + d * load(tension, at) + e * dot(e, d);
    }
    if (shell.any) y = y + shell.times(view, i);
    return contact.any ? y + contact.times(view, i) : y;
  }
};

inline ClothMatrix cloth_matrix(const State& state) {
  const ClothSystem& s = state.cloth_system;
  return {.ends = spring_ends_of(state.cloth),
          .shell = shell_matrix_of(state),
          .contact = sheet_rows_of(state),
          .tension = s.tension.data(),
          .inertia = s.inertia.data(),
          .axis = s.axis.view(),
          .constraints = constraint_projection(state),
          .air = air_drag_of(state),
          .anchor = s.anchor.data(),
          .anchored = state.pins.soft,
          .dt = float(state.dt)};
}

/// Inverses of the blocks on A's diagonal, as L D L^T.
struct BlockInverse {
  float* factor;
  int stride;

  DRENCH_HD float* field(int k) const { return factor + k * stride; }

  /// From the block's entries xx xy xz yy yz zz, none of whose pivots is below `least` but by
  /// rounding.
  template <class Index, class T>
  DRENCH_HD void put(Index i, const T (&b)[6], T least) const {
    const T d0 = T(1.f) / maximum(b[0], least), l10 = b[1] * d0, l20 = b[2] * d0;
    const T d1 = T(1.f) / maximum(b[3] - l10 * b[1], least), m21 = b[4] - l20 * b[1],
            l21 = m21 * d1;
    const T d2 = T(1.f) / maximum(b[5] - l20 * b[2] - l21 * m21, least);
    const T value[6] = {d0, d1, d2, l10, l20, l21};
    for (int k = 0; k < 6; ++k) store(field(k), i, value[k]);
  }
  /// The entries of a block, as `put` takes them.
  DRENCH_HD void entries(int i, float (&b)[6]) const {
    const float d0 = 1.f / field(0)[i], d1 = 1.f / field(1)[i], d2 = 1.f / field(2)[i],
                l10 = field(3)[i], l20 = field(4)[i], l21 = field(5)[i];
    b[0] = d0, b[1] = d0 * l10, b[2] = d0 * l20;
    b[3] = d0 * l10 * l10 + d1, b[4] = d0 * l10 * l20 + d1 * l21;
    b[5] = d0 * l20 * l20 + d1 * l21 * l21 + d2;
  }
  DRENCH_HD void add(int i, const float (&more)[6], float least) const {
    float b[6];
    entries(i, b);
    for (int k = 0; k < 6; ++k) b[k] += more[k];
    put(i, b, least);
  }
  /// The block of `from` on the directions that are perpendicular to `held` and along the axes
  /// `free`; the rest of it is any.
  DRENCH_HD void put_free(int i, const BlockInverse& from, Vec3<float> free, Vec3<float> held,
                          float least) const {
    const float d0 = 1.f / from.field(0)[i], d1 = 1.f / from.field(1)[i],
                d2 = 1.f / from.field(2)[i], l10 = from.field(3)[i], l20 = from.field(4)[i],
                l21 = from.field(5)[i];
    const auto whole = [=](Vec3<float> v) {  // L D L^T v
      const float a = d0 * (v.x + l10 * v.y + l20 * v.z), b = d1 * (v.y + l21 * v.z), c = d2 * v.z;
      return Vec3<float>{a, l10 * a + b, l20 * a + l21 * b + c};
    };
    const auto project = [=](Vec3<float> v) {
      const Vec3<float> m{free.x * v.x, free.y * v.y, free.z * v.z};
      return m - held * dot(held, m);
    };
    const float fill = d0 + d1 + d2;
    const auto column = [=](Vec3<float> e) {
      const Vec3<float> p = project(e);
      return project(whole(p)) + (e - p) * fill;
    };
    const Vec3<float> x = column({1.f, 0.f, 0.f}), y = column({0.f, 1.f, 0.f}),
                      z = column({0.f, 0.f, 1.f});
    const float b[6] = {x.x, x.y, x.z, y.y, y.z, z.z};
    put(i, b, least);
  }
  DRENCH_HD void copy(int i, const BlockInverse& from) const {
    for (int k = 0; k < 6; ++k) field(k)[i] = from.field(k)[i];
  }
  template <class Index, class T>
  DRENCH_HD Vec3<T> times(Index i, Vec3<T> r) const {
    const T l10 = load(field(3), i), l20 = load(field(4), i), l21 = load(field(5), i);
    const T y = r.y - l10 * r.x, z = r.z - l20 * r.x - l21 * y;
    const T c = z * load(field(2), i), b = y * load(field(1), i) - l21 * c;
    return {r.x * load(field(0), i) - l10 * b - l20 * c, b, c};
  }
};

inline BlockInverse block_inverse(State& state) {
  return {state.cloth_system.factor.data(), state.cloth.padded};
}
/// Of the blocks on free directions. With the whole blocks, soft across a sheet and stiff along it,
/// a surface askew to the sheet makes conjugate gradients diverge.
inline BlockInverse free_block_inverse(State& state) {
  if (state.parameters.obstacles == 0) return block_inverse(state);
  return {state.cloth_system.free_factor.data(), state.cloth.padded};
}

/// Of the blocks without rows of contact (self_contact.h), on all directions where a vertex has
/// any.
BlockInverse raw_block_inverse(State& state);
/// The blocks of the preconditioner from these.
void remake_blocks(State& state);

/// The matrix at the positions and the right side without loads; w = 0.
void linearise_cloth(State& state);

/// Vertices that forces would take through a wall end at it, and the forces on them act on it: a
/// sheet on the floor bears its water. Their blocks are those of what is left free: see
/// free_block_inverse (with whole ones a wrinkled sheet on a floor is thrown along it at 26 m/s).
void hold_at_walls(State& state);

DRENCH_HD double dot_double(Vec3<float> a, Vec3<float> b) {
  return double(a.x) * b.x + double(a.y) * b.y + double(a.z) * b.z;
}

/// A matrix, its preconditioner, and the directions that it acts on.
struct ScaledClothMatrix {
  ClothMatrix matrix;
  BlockInverse block;

  template <class Index, class T>
  DRENCH_HD Vec3<T> moving(Index i, Vec3<T> v) const {
    return matrix.constraints.project(i, v);
  }
  template <class Index>
  DRENCH_HD auto times(const ConstVecView& view, Index i) const {
    return matrix.times(view, i);
  }
  template <class Index, class T>
  DRENCH_HD Vec3<T> scaled(Index i, Vec3<T> r) const {
    return moving(i, block.times(i, r));
  }
};
inline ScaledClothMatrix scaled_cloth_matrix(State& state) {
  return {cloth_matrix(state), free_block_inverse(state)};
}

/// Conjugate gradients on A w = right (cloth_sweeps.h).
void solve_cloth(State& state, const VecView& w, const ConstVecView& right, int most_iterations,
                 float tolerance);

/// What a solve that ends early leaves of A w = right the fluid has given and the sheet not
/// received. Springs give no sheet momentum as a whole: where nothing holds it a shift by the sum
/// over its mass, on which they do not act, closes its momentum.
void balance_loose_cloth(State& state, const VecView& w, const ConstVecView& right);

}  // namespace drench::sim::DRENCH_BACKEND

#pragma once
// What bending of a shell's triangles adds to the sheets' system beside the constant matrix of
// shell_bending.h: viscosity, and curvature at rest.
//
// Viscosity (Kelvin and Voigt's): moments tau D kappa' by the rate at which kappa changes as seen
// by one who turns with the triangle, kappa' = d kappa/dt - omega x kappa, so that turning as a
// whole is free and momentum and angular momentum are kept. Over a step of displacements u it is of
//   J u = kappa(u) - theta(u) x kappa,
// theta the turn of the triangle, kappa halfway: of any rotation by a finite angle J u = 0. The
// forces are -tau/dt J^T D J u. Their matrix would couple all nodes of a patch by blocks; instead
//   S = tau/dt (K + 3 kappa^T D kappa |grad|^2),
// K that of bending and the second term of the corners alone, stands for it. What is left out is
// taken at a displacement u_0 where the step is expected to end, -tau/dt J^T D J u_0 + S (u_0 - u):
// of u_0 the unknown part is that of the last step's acceleration, later the solve's own. From step
// to step that is stable while J^T D J tau/dt is at most 2 S in steps of one length and 4/3 S where
// one is far longer than the last, as the polynomials of the modes tell by Jury's criterion. It is
// at most 4/3 S: |a - b|^2 <= 4/3 (|a|^2 + 3 |b|^2).
// K of all this is in the rows (ShellVertices), forces and matrix by the same numbers: by moments
// forces would round otherwise. Here is what turns.

#include "sim/passes/cloth/shell_bending.h"
#include "sim/passes/cloth/shell_elements.h"
#include "sim/shell_topology.h"

namespace drench::sim::DRENCH_BACKEND {

struct ShellPatches {
  ShellCorners start;  // where the step starts
  const int *slots, *node, *sheet, *of_start, *of, *of_triangle;
  const float *area, *weight, *rest, *law;
  ConstVecView shift;
  VecView moments;
  int sheets, entries;
  float dt;
  bool any, curved;
  bool anew;  // triangles are linearised about where the step ends

  /// What a patch does to the corners of its triangle.
  template <class T>
  struct OnCorners {
    Vec3<T> force[2];  // N, on corners 1 and 2; on 0 what is left to none
    T stiffness[3];    // N/m, minus the block of corners 0 1, 0 2, 1 2, times the unit matrix
  };

  /// Of places, of the displacements by straight paths, and of those beyond.
  template <class T>
  struct Curvatures {
    Curvature<Vec3<T>> place, way, beyond;
  };
  template <class Index, class T>
  DRENCH_HD Curvatures<T> curvatures(Index t, T) const {
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    Curvatures<T> sum{{none, none, none}, {none, none, none}, {none, none, none}};
    const int stride = start.stride;
    const auto first = start.vertex(t, 0);
    const int slice = ShellRows::slice(t);
    for (int slot = slots[slice]; slot < slots[slice + 1]; ++slot) {
      const auto at = ShellRows::entry(slot, t);
      const auto v = load(node, at);
      const auto field = [&](int c) { return load(weight + c * entries, at); };
      const Curvature<T> w{field(0), field(1), field(2)};
      add_node(sum.place, w, start.between(first, v));
      add_node(sum.way, w, (start.path.at(v) - start.path.at(first)) * T(dt));
      add_node(sum.beyond, w, start.change.at(v) - start.change.at(first));
    }
    if (start.joined) {
      sum.place.xx = sum.place.xx + shift.at(t);
      sum.place.yy = sum.place.yy + shift.at(t + stride);
      sum.place.xy = sum.place.xy + shift.at(t + 2 * stride);
    }
    return sum;
  }

  template <class T, class Index>
  DRENCH_HD Rigidity<T> rigidity_of(Index sheet_of) const {
    const auto field = [&](int k) { return load(law + (rigidity_field + k) * sheets, sheet_of); };
    return {field(0), field(1), field(2), field(3)};
  }

  template <class Index>
  DRENCH_HD auto operator()(Index t) const {
    using T = decltype(load(area, t));
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    return any ? on_corners<T>(t) : OnCorners<T>{{none, none}, {T(0.f), T(0.f), T(0.f)}};
  }

  /// Notes the moments of triangle t.
  template <class T, class Index>
  DRENCH_HD OnCorners<T> on_corners(Index t) const {
    const auto sheet_of = load(sheet, t);
    const Rigidity<T> d = rigidity_of<T>(sheet_of);
    const T rate = load(law + damping_field * sheets, sheet_of) * T(1.f / dt);
    const Curvatures<T> kappa = curvatures(t, T(0.f));
    const Curvature<Vec3<T>> by = kappa.way + kappa.beyond, halfway = kappa.place + by * T(0.5f);
    Vec3<T> edge[2], way[2], beyond[2];
    for (int c = 0; c < 2; ++c) {
      edge[c] = start.edge(t, c + 1), way[c] = start.opening(t, c + 1) * T(dt);
      beyond[c] = start.turning(start.change, t, c + 1);
    }
    const auto mid = [&](int c) { return edge[c] + (way[c] + beyond[c]) * T(0.5f); };
    const TriangleTurn<T> turn(mid(0), mid(1), load(area, t));
    const Vec3<T> theta = turn.of(way[0] + beyond[0], way[1] + beyond[1]);
    const Curvature<Vec3<T>> turning = turned(theta, halfway),
                             viscous = moment(d, by - turning) * rate;
    Curvature<Vec3<T>> all = moment(d, turning) * -rate;
    const Vec3<T> q = torque(halfway, viscous);
    const T s = rate * T(3.f) * contract(moment(d, halfway), halfway),
            g01 = dot(turn.dual[0], turn.dual[1]), g00 = length2(turn.dual[0]),
            g11 = length2(turn.dual[1]);
    OnCorners<T> on{{turn.derivative(1, q) + (beyond[0] * g00 + beyond[1] * g01) * s,
                     turn.derivative(2, q) + (beyond[0] * g01 + beyond[1] * g11) * s},
                    {(g00 + g01) * s, (g01 + g11) * s, g01 * -s}};
    if (curved) add_rest(t, d, kappa, edge, way, beyond, all, on);
    moment_at(0).put(t, all.xx), moment_at(1).put(t, all.yy), moment_at(2).put(t, all.xy);
    return on;
  }

  /// Curvature at rest: the energy's term -n . Q, Q = (D kappa_0) . kappa, has moments -D kappa_0 n
  /// and turns n.
  template <class Index, class T>
  DRENCH_HD void add_rest(Index t, const Rigidity<T>& d, const Curvatures<T>& kappa,
                          const Vec3<T>* edge, const Vec3<T>* way, const Vec3<T>* beyond,
                          Curvature<Vec3<T>>& all, OnCorners<T>& on) const {
    const int stride = start.stride;
    const auto field = [&](int c) { return load(rest + c * stride, t); };
    const Curvature<T> m = moment(d, Curvature<T>{field(0), field(1), field(2)});
    const T off(anew ? 1.f : 0.f);
    const auto end = [&](int c) { return edge[c] + way[c] + beyond[c] * off; };
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    const TurningNormal<T> n(none, end(0), end(1), maximum(load(area, t), T(1e-10f)));
    const Curvature<Vec3<T>> there = kappa.place + kappa.way + kappa.beyond * off;
    const Vec3<T> q = there.xx * m.xx + there.yy * m.yy + there.xy * m.xy;
    all = all - Curvature<Vec3<T>>{n.normal * m.xx, n.normal * m.yy, n.normal * m.xy};
    for (int c = 0; c < 2; ++c) on.force[c] = on.force[c] + n.derivative(c + 1, q);
  }

  /// N, on a vertex as a node.
  DRENCH_HD Vec3<float> force_on(int v) const {
    Vec3<float> sum{0.f, 0.f, 0.f};
    for (int e = of_start[v]; e < of_start[v + 1]; ++e) {
      for (int c = 0; c < 3; ++c)
        sum = sum - moment_at(c)[of_triangle[e]] * weight[c * entries + of[e]];
    }
    return sum;
  }
  DRENCH_HD VecView moment_at(int c) const {
    const int first = c * start.stride;
    return {moments.x + first, moments.y + first, moments.z + first};
  }
};

}  // namespace drench::sim::DRENCH_BACKEND

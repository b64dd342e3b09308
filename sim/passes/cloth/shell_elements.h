#pragma once
// The triangles of shells in the sheets' system (shell_system.h): where each is linearised, its
// forces and blocks there, and what a step does to it that these do not know of. The system is
// linear; a step that turns a triangle far, as an impact does, stretches it by the square of the
// turn. Where that matters the triangles are linearised anew about where the step ends: Newton's
// method on the energy that implicit Euler minimises (Gast and Schroeder 2014), by which a step is
// cut that would raise it (search_line). K stays positive definite, without what compression would
// take from it, so that every solve points down in energy.

#include "sim/passes/cloth/shell_membrane.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Fields of a triangle: minus the blocks of corners 0 1, 0 2 and 1 2 by rows, times dt^2 and what
/// of the new force counts; forces on corners 1 and 2 where straight paths end; tensions of the
/// sides 0 1, 0 2, 1 2.
enum ElementFields { blocks = 0, forces = 27, tensions = 33 };
static_assert(tensions + 3 == shell_element_fields);

/// What places the corners of triangles, where the step starts: positions with what they round off;
/// or so much later on straight paths, and off these.
struct ShellCorners {
  ConstVecView position, rounding, path, change, edge_shift;
  const int* corner;
  int stride;   // from one corner to the next, of triangles
  float later;  // s
  bool off;     // by `change`
  bool joined;

  template <class Index>
  DRENCH_HD auto vertex(Index t, int c) const {
    return load(corner + c * stride, t);
  }
  /// From one vertex to another, but for the shifts of seams.
  template <class Index>
  DRENCH_HD auto between(Index from, Index to) const {
    const auto way = (position.at(to) - position.at(from)) + (rounding.at(to) - rounding.at(from)),
               d = path.at(to) - path.at(from), there = way + d * decltype(d.x)(later);
    return off ? there + (change.at(to) - change.at(from)) : there;
  }
  /// From corner 0 to corner c.
  template <class Index>
  DRENCH_HD auto edge(Index t, int c) const {
    auto e = between(vertex(t, 0), vertex(t, c));
    if (joined) e = e + edge_shift.at(t + (c - 1) * stride);
    return e;
  }
  /// What the paths change it by, m/s.
  template <class Index>
  DRENCH_HD auto opening(Index t, int c) const {
    return path.at(vertex(t, c)) - path.at(vertex(t, 0));
  }
  /// What a displacement of the vertices changes it by, m.
  template <class Index>
  DRENCH_HD auto turning(const ConstVecView& by, Index t, int c) const {
    return by.at(vertex(t, c)) - by.at(vertex(t, 0));
  }
};

/// Where a triangle is linearised.
enum class About { path, end };

/// Along a line of displacements from where triangles are linearised, kg m^2: the slope and the
/// curvature of their energy as the matrix has them, and what it gains up to parts of the line.
struct LineEnergies {
  static constexpr int places = 8;
  static DRENCH_HD float part(int place) {
    return 1.f / float(1 << (place < 5 ? place : 2 * place - 4));
  }
  double slope = 0, curvature = 0, gain[places] = {};

  DRENCH_HD LineEnergies operator+(const LineEnergies& other) const {
    LineEnergies sum = *this;
    sum.slope += other.slope, sum.curvature += other.curvature;
    for (int k = 0; k < places; ++k) sum.gain[k] += other.gain[k];
    return sum;
  }
};

struct ShellElements {
  ShellCorners corners;  // at the start
  const float *area, *gradient, *law;
  const int* sheet;
  float* element;
  int sheets;
  float dt, dt2;  // s; s^2 times what of the new force counts
  About about;

  template <class T, class Index>
  DRENCH_HD MembraneLaw<T> law_of(Index sheet_of) const {
    const auto field = [&](int k) { return load(law + k * sheets, sheet_of); };
    return {.moduli = {field(0), field(1), field(2), field(3), T(0.f), T(0.f)},
            .limit = {field(4), field(5)},
            .damping_time = field(damping_field)};
  }

  /// How far along its straight path a triangle is linearised, by the strain of the whole path.
  /// What turns by a tenth has 0.005, which the step takes back; an impact has more.
  template <class T>
  DRENCH_HD static T followed_part(Symmetric2<T> strained) {
    return T(1.f) / (T(1.f) + contract(strained, strained) * T(4e4f));
  }

  template <class Index>
  DRENCH_HD auto rest_of(Index t) const {
    RestTriangle<decltype(load(area, t))> rest;
    rest.area = load(area, t);
    for (int k = 0; k < 2; ++k) {
      rest.gradient_x[k] = load(gradient + k * corners.stride, t);
      rest.gradient_y[k] = load(gradient + (2 + k) * corners.stride, t);
    }
    return rest;
  }
  template <class Index, class T>
  DRENCH_HD SurfaceGradient<T> gradient_of(const ConstVecView& displacement, Index t,
                                           const RestTriangle<T>& rest) const {
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    return surface_gradient(rest, none, corners.turning(displacement, t, 1),
                            corners.turning(displacement, t, 2));
  }
  /// Where triangle t starts, F; how far from there it is linearised, and from there to where its
  /// straight path ends, as gradients of displacements.
  template <class T>
  struct Ways {
    SurfaceGradient<T> start, to, ahead;
  };
  template <class Index, class T>
  DRENCH_HD Ways<T> ways(Index t, const RestTriangle<T>& rest) const {
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    const SurfaceGradient<T> start = surface_gradient(rest, none, corners.edge(t, 1),
                                                      corners.edge(t, 2)),
                             path = surface_gradient(rest, none, corners.opening(t, 1),
                                                     corners.opening(t, 2)) *
                                    T(dt);
    if (about == About::path) {
      const T part = followed_part(green_strain(start + path) + green_strain(start) * T(-1.f));
      return {start, path * part, path * (T(1.f) - part)};
    }
    const SurfaceGradient<T> off = gradient_of(corners.change, t, rest);
    return {start, path + off, off * T(-1.f)};
  }

  /// The forces of triangle t are linear in displacements from `f`, `ahead` of which its straight
  /// path ends: by the moduli, and by the stress `pull`, which is positive semidefinite.
  template <class T>
  struct Linear {
    Ways<T> way;
    SurfaceGradient<T> f;
    MembraneResponse<T> response;
    Symmetric2<T> pull;
  };
  template <class Index, class T>
  DRENCH_HD Linear<T> linear(Index t, const RestTriangle<T>& rest,
                             const MembraneLaw<T>& law_of_t) const {
    const Ways<T> way = ways(t, rest);
    const SurfaceGradient<T> f = way.start + way.to;
    const Symmetric2<T> still{T(0.f), T(0.f), T(0.f)};
    // Strain is quadratic along the way: its mean rate is that halfway.
    const Symmetric2<T> rate =
        green_strain_rate(way.start + way.to * T(0.5f), way.to) * T(1.f / dt);
    const auto response = law_of_t.at(green_strain(f), rate, T(dt));
    // What the path stretches is taken back: not at f.
    const Symmetric2<T> stress = about == About::path
                                     ? law_of_t.at(green_strain(way.start), still, T(dt)).stress
                                     : response.stress;
    return {way, f, response, positive_part(stress)};
  }

  /// @param patches  what bending adds: ShellPatches
  template <class Index, class Patches>
  DRENCH_HD void operator()(Index t, const Patches& patches) const {
    using T = decltype(load(area, t));
    const int stride = corners.stride;
    const auto bending = patches(t);
    const auto put = [&](int field, T value) { store(element + field * stride, t, value); };
    const RestTriangle<T> rest = rest_of(t);
    const Linear<T> at = linear(t, rest, law_of<T>(load(sheet, t)));
    const SurfaceGradient<T>&f = at.f, &ahead = at.way.ahead;
    const Symmetric2<T>& pull = at.pull;
    const Symmetric2<T> stress =
        at.response.stress + at.response.moduli.times(green_strain_rate(f, ahead));
    const T scale(-dt2);
    for (int pair = 0; pair < 3; ++pair) {
      const int a = pair == 2 ? 1 : 0, b = pair == 0 ? 1 : 2;
      const Block3<T> k = membrane_block(rest, f, pull, at.response.moduli, a, b);
      Vec3<T> row[3] = {k.x * scale, k.y * scale, k.z * scale};
      const T turn = bending.stiffness[pair] * T(dt2);
      row[0].x = row[0].x + turn, row[1].y = row[1].y + turn, row[2].z = row[2].z + turn;
      for (int r = 0; r < 3; ++r) {
        put(blocks + 9 * pair + 3 * r, row[r].x), put(blocks + 9 * pair + 3 * r + 1, row[r].y);
        put(blocks + 9 * pair + 3 * r + 2, row[r].z);
      }
    }
    for (int c = 1; c < 3; ++c) {
      const Vec3<T> force = membrane_force(rest, f, stress, c) +
                            membrane_force(rest, ahead, pull, c) + bending.force[c - 1];
      put(forces + 3 * c - 3, force.x), put(forces + 3 * c - 2, force.y);
      put(forces + 3 * c - 1, force.z);
    }
    put_tensions(rest, pull, put);
  }

  /// Of triangle t the energy by which the step strains it beyond what its linear forces know of:
  /// of d^T d / 2, d the displacement gradient beyond where it was linearised; and of the velocity
  /// that the step gives it. Both twice, times dt^2: kg m^2.
  template <class Index>
  DRENCH_HD auto unseen_strain(Index t, const ConstVecView& change, const float* mass,
                               float fall2) const {
    using T = decltype(load(area, t));
    const RestTriangle<T> rest = rest_of(t);
    const Ways<T> was = ways(t, rest);
    const SurfaceGradient<T> d = was.ahead + gradient_of(change, t, rest);
    const Symmetric2<T> unseen = mixed(d, d) * T(0.5f), still{T(0.f), T(0.f), T(0.f)};
    const auto at_end =
        law_of<T>(load(sheet, t)).at(green_strain(was.start + was.to + d), still, T(dt));
    T kinetic(0.f);  // some six triangles share a vertex
    for (int c = 0; c < 3; ++c) {
      const auto v = corners.vertex(t, c);
      kinetic = kinetic + load(mass, v) * (length2(change.at(v)) + T(fall2)) * T(1.f / 6);
    }
    return Two<T>{contract(at_end.moduli.times(unseen), unseen) * rest.area * T(dt2), kinetic};
  }

  /// What the energy of triangle t does along a line of displacements.
  DRENCH_HD LineEnergies along_line(int t, const ConstVecView& from, const ConstVecView& to) const {
    const RestTriangle<float> rest = rest_of(t);
    const MembraneLaw<float> law_of_t = law_of<float>(load(sheet, t));
    const Linear<float> at = linear(t, rest, law_of_t);
    const SurfaceGradient<float> off = at.way.ahead + gradient_of(from, t, rest),
                                 d = gradient_of(to, t, rest) + gradient_of(from, t, rest) * -1.f,
                                 begin = at.f + off;
    const float scale = rest.area * dt2;
    const Symmetric2<float> first = green_strain(at.way.start), rate = green_strain_rate(at.f, d);
    const auto energy = [&](Symmetric2<float> strain) {  // with what viscosity takes, its potential
      const Symmetric2<float> gain = strain + first * -1.f;
      const float lost = contract(law_of_t.moduli.times(gain), gain) * law_of_t.damping_time;
      return double(law_of_t.at(strain, gain, dt).energy + lost * (0.5f / dt)) * scale;
    };
    const Symmetric2<float> stress = at.response.stress +
                                     at.response.moduli.times(green_strain_rate(at.f, off)),
                            turn = mixed(d, d);
    LineEnergies sum;
    sum.slope = double(scale * (contract(stress, rate) + contract(at.pull, mixed(off, d))));
    sum.curvature =
        double(scale * (contract(at.response.moduli.times(rate), rate) + contract(at.pull, turn)));
    const double start = energy(green_strain(begin));
    for (int k = 0; k < LineEnergies::places; ++k)
      sum.gain[k] = energy(green_strain(begin + d * LineEnergies::part(k))) - start;
    return sum;
  }
  /// The symmetric part of a^T b.
  template <class T>
  static DRENCH_HD Symmetric2<T> mixed(const SurfaceGradient<T>& a, const SurfaceGradient<T>& b) {
    return {dot(a.warp, b.warp), dot(a.weft, b.weft),
            (dot(a.warp, b.weft) + dot(a.weft, b.warp)) * T(0.5f)};
  }

  /// Springs of no direction whose energy is nowhere above that of the stress in the triangle: its
  /// own three, w = -A grad L_a . S grad L_b, of which at most one is negative. The two others make
  /// up for that one, in the proportion of what they have.
  template <class T, class Put>
  DRENCH_HD void put_tensions(const RestTriangle<T>& rest, const Symmetric2<T>& pull,
                              const Put& put) const {
    T w[3];
    for (int pair = 0; pair < 3; ++pair) {
      const int a = pair == 2 ? 1 : 0, b = pair == 0 ? 1 : 2;
      const T ax = rest.along_warp(a), ay = rest.along_weft(a), bx = rest.along_warp(b),
              by = rest.along_weft(b);
      w[pair] = T(-dt2) * rest.area *
                (ax * (pull.xx * bx + pull.xy * by) + ay * (pull.xy * bx + pull.yy * by));
    }
    // c (a + b)^2 <= c (1 + s) a^2 + c (1 + 1/s) b^2 with s = sqrt(w_b / w_a) of the two others
    const T lack[3] = {max0(-w[0]), max0(-w[1]), max0(-w[2])};
    const T root[3] = {square_root(max0(w[0])), square_root(max0(w[1])), square_root(max0(w[2]))};
    for (int k = 0; k < 3; ++k) {
      const int p = (k + 1) % 3, q = (k + 2) % 3;
      const T small(1e-30f);
      const T by_q = lack[q] * (T(1.f) + root[p] / maximum(root[k], small)),
              by_p = lack[p] * (T(1.f) + root[q] / maximum(root[k], small));
      put(tensions + k, max0(max0(w[k]) - by_p - by_q));
    }
  }
};

}  // namespace drench::sim::DRENCH_BACKEND

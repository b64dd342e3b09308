#include "sim/passes/cloth/shell_system.h"

#include <algorithm>

#include "sim/passes/cloth/cloth_pins.h"
#include "sim/passes/cloth/self_contact.h"
#include "sim/passes/cloth/shell_bending.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Fields of a triangle: minus the blocks of corners 0 1, 0 2 and 1 2 by rows, times dt^2 and what
/// of the new force counts; forces on corners 1 and 2 where straight paths end; tensions of the
/// sides 0 1, 0 2, 1 2.
enum ElementFields { blocks = 0, forces = 27, tensions = 33 };
static_assert(tensions + 3 == shell_element_fields);

/// What places the corners of triangles, where the step starts: positions with what they round off;
/// or so much later on straight paths.
struct ShellCorners {
  ConstVecView position, rounding, path, edge_shift;
  const int* corner;
  int stride;   // from one corner to the next, of triangles
  float later;  // s
  bool joined;

  template <class Index>
  DRENCH_HD auto vertex(Index t, int c) const {
    return load(corner + c * stride, t);
  }
  /// From one vertex to another, but for the shifts of seams.
  template <class Index>
  DRENCH_HD auto between(Index from, Index to) const {
    const auto way = (position.at(to) - position.at(from)) + (rounding.at(to) - rounding.at(from)),
               d = path.at(to) - path.at(from);
    return way + d * decltype(d.x)(later);
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
};

struct ShellElements {
  ShellCorners corners;  // at the start
  const float *area, *gradient, *law;
  const int* sheet;
  float* element;
  int sheets;
  float dt, dt2;  // s; s^2 times what of the new force counts

  template <class T, class Index>
  DRENCH_HD MembraneLaw<T> law_of(Index sheet_of) const {
    const auto field = [&](int k) { return load(law + k * sheets, sheet_of); };
    return {.moduli = {field(0), field(1), field(2), field(3), T(0.f), T(0.f)},
            .limit = {field(4), field(5)},
            .damping_time = field(6)};
  }

  /// How far along its straight path a triangle is linearised, by the strain of the whole path.
  /// What turns by a tenth has 0.005, which the step takes back; an impact has more.
  template <class T>
  DRENCH_HD static T followed_part(Symmetric2<T> strained) {
    return T(1.f) / (T(1.f) + contract(strained, strained) * T(4e4f));
  }

  template <class Index>
  DRENCH_HD void operator()(Index t) const {
    using T = decltype(load(area, t));
    const int stride = corners.stride;
    const auto put = [&](int field, T value) { store(element + field * stride, t, value); };
    RestTriangle<T> rest;
    rest.area = load(area, t);
    for (int k = 0; k < 2; ++k) {
      rest.gradient_x[k] = load(gradient + k * stride, t);
      rest.gradient_y[k] = load(gradient + (2 + k) * stride, t);
    }
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    const MembraneLaw<T> of = law_of<T>(load(sheet, t));
    const SurfaceGradient<T> start =
        surface_gradient(rest, none, corners.edge(t, 1), corners.edge(t, 2));
    const SurfaceGradient<T> rate =
        surface_gradient(rest, none, corners.opening(t, 1), corners.opening(t, 2));
    const auto later = [&](T time) {
      return SurfaceGradient<T>{start.warp + rate.warp * time, start.weft + rate.weft * time};
    };
    const Symmetric2<T> still{T(0.f), T(0.f), T(0.f)}, first = green_strain(start);
    const T part = followed_part(green_strain(later(T(dt))) + first * T(-1.f)),
            left = (T(1.f) - part) * T(dt);
    const SurfaceGradient<T> f = later(part * T(dt)), ahead{rate.warp * left, rate.weft * left};
    // Strain is quadratic along the path: its mean rate is that halfway.
    auto response =
        of.at(green_strain(f), green_strain_rate(later(part * T(0.5f * dt)), rate) * part, T(dt));
    response.stress = response.stress + response.moduli.times(green_strain_rate(f, ahead));
    // Not at f: what the path stretches is taken back.
    const Symmetric2<T> pull = positive_part(of.at(first, still, T(dt)).stress);
    const T scale(-dt2);
    for (int pair = 0; pair < 3; ++pair) {
      const int a = pair == 2 ? 1 : 0, b = pair == 0 ? 1 : 2;
      const Block3<T> k = membrane_block(rest, f, pull, response.moduli, a, b);
      const Vec3<T> row[3] = {k.x * scale, k.y * scale, k.z * scale};
      for (int r = 0; r < 3; ++r) {
        put(blocks + 9 * pair + 3 * r, row[r].x), put(blocks + 9 * pair + 3 * r + 1, row[r].y);
        put(blocks + 9 * pair + 3 * r + 2, row[r].z);
      }
    }
    for (int c = 1; c < 3; ++c) {
      const Vec3<T> force =
          membrane_force(rest, f, response.stress, c) + membrane_force(rest, ahead, pull, c);
      put(forces + 3 * c - 3, force.x), put(forces + 3 * c - 2, force.y);
      put(forces + 3 * c - 1, force.z);
    }
    put_tensions(rest, pull, put);
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

/// The straight paths, where nothing has stopped a vertex since the last step.
void find_paths(State& state) {
  const ShellState& s = state.shell;
  const ConstVecView x = state.cloth.position.view(), v = state.cloth.velocity.view(),
                     landed = s.landed.view(), left = s.left.view();
  const VecView rounding = state.shell.rounding.view(), lost = state.shell.lost.view(),
                acceleration = state.shell.acceleration.view(), path = state.shell.path.view();
  const float half = 0.5f * float(std::min(state.dt, s.dt));
  parallel_for(
      state.queue, "shell: paths", state.cloth.padded, DRENCH_LAMBDA(int i) {
        const Vec3<float> none{0.f, 0.f, 0.f};
        const bool here = length2(x[i] - landed[i]) == 0.f, so = length2(v[i] - left[i]) == 0.f;
        if (!here) rounding.set(i, none);
        if (!so) lost.set(i, none);
        if (!here || !so) acceleration.set(i, none);
        path.set(i, v[i] - acceleration[i] * half);
      });
}

/// What a triangle that is curved at rest adds to the forces on its patch: its energy's term
/// -n . Q, Q = sum q x, pulls nodes by q n, and corners by what turns n.
struct RestCurvature {
  ShellCorners corners;
  const float* area;
  const int *start, *node, *of_start, *of;
  const float *pull, *of_pull;
  ConstVecView shift;
  VecView normal, turning;
  bool any;

  DRENCH_HD void prepare(int t) const {
    if (start[t] == start[t + 1]) return;
    const int first = corners.vertex(t, 0);
    Vec3<float> q{0.f, 0.f, 0.f};
    for (int e = start[t]; e < start[t + 1]; ++e) q = q + corners.between(first, node[e]) * pull[e];
    if (corners.joined) q = q + shift[t];
    normal.set(t, turning_normal(t).normal), turning.set(t, q);
  }
  DRENCH_HD TurningNormal<float> turning_normal(int t) const {
    return {{0.f, 0.f, 0.f}, corners.edge(t, 1), corners.edge(t, 2), area[t]};
  }
  DRENCH_HD Vec3<float> force_on_node(int v) const {
    Vec3<float> sum{0.f, 0.f, 0.f};
    for (int e = of_start[v]; e < of_start[v + 1]; ++e) sum = sum + normal[of[e]] * of_pull[e];
    return sum;
  }
  DRENCH_HD Vec3<float> force_on_corner(int t, int c) const {
    if (start[t] == start[t + 1]) return {0.f, 0.f, 0.f};
    return turning_normal(t).derivative(c, turning[t]);
  }
};

RestCurvature rest_curvature_of(State& state, const ShellCorners& corners) {
  ShellState& s = state.shell;
  return {.corners = corners,
          .area = s.area.data(),
          .start = s.curved_start.data(),
          .node = s.curved_node.data(),
          .of_start = s.curved_of_start.data(),
          .of = s.curved_of.data(),
          .pull = s.curved_pull.data(),
          .of_pull = s.curved_of_pull.data(),
          .shift = s.curved_shift.view(),
          .normal = s.normal.view(),
          .turning = s.turning.view(),
          .any = s.curved};
}

/// Gathers what triangles give to a vertex.
struct ShellVertices {
  RestCurvature rest;
  ShellMatrix matrix;
  ConstVecView position, rounding, path, push, internal;
  const int *fan_start, *fan_entry, *fan_slot;
  const float* element;
  int triangles, vertices;
  float *block, *tension, *diagonal;
  VecView base;
  float dt, before;  // s; what of the last step's force counts
  bool joined;

  DRENCH_HD float field(int k, int t) const { return element[k * triangles + t]; }

  /// Adds -dt^2 K_ab to the block of an entry, corners a and b.
  DRENCH_HD void add_block(int t, int a, int b, int at) const {
    const int low = a < b ? a : b, pair = low == 1 ? 2 : (a < b ? b : a) - 1;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        block[(3 * r + c) * matrix.stride + at] +=
            field(blocks + 9 * pair + (a < b ? 3 * r + c : 3 * c + r), t);
    tension[at] += field(tensions + pair, t);
  }
  DRENCH_HD Vec3<float> force_on(int t, int c) const {
    const auto on = [&](int k) {
      return Vec3<float>{field(forces + 3 * k, t), field(forces + 3 * k + 1, t),
                         field(forces + 3 * k + 2, t)};
    };
    const Vec3<float> f = c > 0 ? on(c - 1) : -(on(0) + on(1));
    return rest.any ? f + rest.force_on_corner(t, c) : f;
  }

  /// Blocks of the row, and the triangles' forces.
  DRENCH_HD Vec3<float> gather(int i) const {
    const int slice = ShellRows::slice(i);
    for (int s = matrix.rows.ring_start[slice]; s < matrix.rows.ring_start[slice + 1]; ++s) {
      const int at = ShellRows::entry(s, i);
      for (int k = 0; k < 9; ++k) block[k * matrix.stride + at] = 0.f;
      tension[at] = 0.f;
    }
    Vec3<float> sum{0.f, 0.f, 0.f};
    if (i >= vertices) return sum;
    for (int e = fan_start[i]; e < fan_start[i + 1]; ++e) {
      const int t = fan_entry[e] / 3, c = fan_entry[e] % 3;
      if (fan_slot[2 * e] < 0) continue;
      add_block(t, c, (c + 1) % 3, ShellRows::entry(fan_slot[2 * e], i));
      add_block(t, c, (c + 2) % 3, ShellRows::entry(fan_slot[2 * e + 1], i));
      sum = sum + force_on(t, c);
    }
    return rest.any ? sum + rest.force_on_node(i) : sum;
  }

  DRENCH_HD void operator()(int i) const {
    Vec3<float> sum = gather(i);
    float d[6] = {0.f, 0.f, 0.f, 0.f, 0.f, 0.f};
    const ShellRows& rows = matrix.rows;
    const int slice = ShellRows::slice(i), ring = rows.ring_start[slice];
    const int first = rows.row_start[slice], last = rows.row_start[slice + 1];
    const int inner = first + rows.ring_start[slice + 1] - ring;
    float stiff = 0.f;
    for (int slot = first; slot < last; ++slot) {
      const int at = ShellRows::entry(slot, i), j = rows.end[at];
      const float b = matrix.bend[at];
      const Vec3<float> away = (position[j] - position[i]) + (rounding[j] - rounding[i]);
      sum = sum + (away + (path[j] - path[i]) * dt) * b;
      stiff += b * matrix.dt2;
      if (slot >= inner) continue;
      const int to = ShellRows::entry(ring + slot - first, i), stride = matrix.stride;
      for (int k = 0; k < 9; k += 4) block[k * stride + to] += b * matrix.dt2;
      const auto entry = [&](int k) { return block[k * stride + to]; };
      stiff -= b * matrix.dt2;
      d[0] += entry(0), d[3] += entry(4), d[5] += entry(8);
      d[1] += 0.5f * (entry(1) + entry(3)), d[2] += 0.5f * (entry(2) + entry(6)),
          d[4] += 0.5f * (entry(5) + entry(7));
    }
    if (joined && i < vertices) sum = sum + push[i];
    d[0] += stiff, d[3] += stiff, d[5] += stiff;
    for (int k = 0; k < 6; ++k) diagonal[k * 8 * ((vertices + 7) / 8) + i] = d[k];
    base.set(i, sum * matrix.dt2 + internal[i] * (before * dt * dt));
  }
};

}  // namespace

void linearise_shell(State& state) {
  ShellState& s = state.shell;
  const ClothState& c = state.cloth;
  find_paths(state);
  if (state.pins.count > 0) find_pin_paths(state);
  const ShellCorners corners{.position = c.position.view(),
                             .rounding = s.rounding.view(),
                             .path = s.path.view(),
                             .edge_shift = s.edge_shift.view(),
                             .corner = s.corner.data(),
                             .stride = s.triangles,
                             .later = 0.f,
                             .joined = c.joined};
  const ShellElements elements{.corners = corners,
                               .area = s.area.data(),
                               .gradient = s.gradient.data(),
                               .law = s.law.data(),
                               .sheet = s.sheet.data(),
                               .element = s.element.data(),
                               .sheets = s.sheets,
                               .dt = float(state.dt),
                               .dt2 = shell_matrix_of(state).dt2};
  for_each_lane(
      state.queue, "shell: triangles", c.triangles, DRENCH_LAMBDA(auto t) { elements(t); });
  ShellCorners at_end = corners;
  at_end.later = float(state.dt);
  const RestCurvature rest = rest_curvature_of(state, at_end);
  if (rest.any)
    parallel_for(
        state.queue, "shell: rest curvature", c.triangles,
        DRENCH_LAMBDA(int t) { rest.prepare(t); });
  const ShellVertices vertices{.rest = rest,
                               .matrix = shell_matrix_of(state),
                               .position = c.position.view(),
                               .rounding = s.rounding.view(),
                               .path = s.path.view(),
                               .push = s.push.view(),
                               .internal = s.internal.view(),
                               .fan_start = c.fan_start.data(),
                               .fan_entry = c.fan_entry.data(),
                               .fan_slot = s.fan_slot.data(),
                               .element = s.element.data(),
                               .triangles = s.triangles,
                               .vertices = c.vertices,
                               .block = s.block.data(),
                               .tension = s.tension.data(),
                               .diagonal = s.diagonal.data(),
                               .base = s.base.view(),
                               .dt = float(state.dt),
                               .before = float(1 - new_force_share(state)),
                               .joined = c.joined};
  parallel_for(
      state.queue, "shell: rows", c.padded, DRENCH_LAMBDA(int i) { vertices(i); });
}

/// Whether no more than rounding of a vector is lost.
DRENCH_HD bool is_rounding(Vec3<float> lost, Vec3<float> of) {
  return fabsf(lost.x) + fabsf(lost.y) + fabsf(lost.z) <=
         1e-6f * (fabsf(of.x) + fabsf(of.y) + fabsf(of.z));
}

void keep_shell_step(State& state) {
  ShellState& s = state.shell;
  const ClothState& c = state.cloth;
  const ConstVecView x = c.position.view(), v = c.velocity.view(), next = c.next.view(),
                     next_velocity = c.next_velocity.view(), path = s.path.view(),
                     change = state.cloth_system.change.view(), base = s.base.view();
  const ShellMatrix matrix = shell_matrix_of(state);
  const VecView lacks = s.lost.view(), landed = s.landed.view(), left = s.left.view(),
                rounding = s.rounding.view(), acceleration = s.acceleration.view(),
                internal = s.internal.view();
  const int *fan_start = c.fan_start.data(), *fan_slot = s.fan_slot.data();
  const ConstVecView free = state.cloth_system.free.view(),
                     normal = state.cloth_system.normal.view();
  const bool obstacles = state.parameters.obstacles > 0, anchored = state.pins.soft;
  const ConstVecView anchor_pull = state.cloth_system.anchor_pull.view();
  const float* anchor = state.cloth_system.anchor.data();
  const SheetRows contact = sheet_rows_of(state);
  const VecView friction = s.friction.view();
  const ConstVecView rub = state.cloth_system.rub.view();
  const int* grip = state.cloth_system.grip.data();
  const float* cling = state.cloth_system.cling.data();
  const float dt = float(state.dt), inverse_dt = 1.f / dt;
  parallel_for(
      state.queue, "shell: keep", c.vertices, DRENCH_LAMBDA(int i) {
        landed.set(i, next[i]), left.set(i, next_velocity[i]);
        Vec3<float> inner = base[i] - matrix.times(change, i);
        if (anchored) inner = inner + anchor_pull[i] - change[i] * anchor[i];
        internal.set(i, inner * (inverse_dt * inverse_dt));
        const bool shell = fan_slot[2 * fan_start[i]] >= 0,
                   held = length2(free[i] - Vec3<float>{1.f, 1.f, 1.f}) > 0.f ||
                          (obstacles && length2(normal[i]) > 0.f) ||
                          (contact.any && contact.touches(i));
        acceleration.set(i, shell && !held ? (next_velocity[i] - v[i]) * inverse_dt
                                           : Vec3<float>{0.f, 0.f, 0.f});
        if (obstacles) {
          const bool slides = shell && grip[i] >= 0 && cling[i] == 0.f;
          friction.set(i, slides ? rub[i] * (inverse_dt * inverse_dt) : Vec3<float>{0.f, 0.f, 0.f});
        }
        // What x + way + rounding loses by being rounded, if that is where the vertex ends.
        const auto lost = [](float x, float way, float to) { return way - (to - x); };
        const Vec3<float> gain = change[i] * inverse_dt + lacks[i], to = next_velocity[i],
                          lack{lost(v.x[i], gain.x, to.x), lost(v.y[i], gain.y, to.y),
                               lost(v.z[i], gain.z, to.z)};
        lacks.set(i, shell && !held && is_rounding(lack, to) ? lack : Vec3<float>{0.f, 0.f, 0.f});
        const Vec3<float> way = path[i] * dt + change[i] + rounding[i];
        const Vec3<float> rest{lost(x.x[i], way.x, next.x[i]), lost(x.y[i], way.y, next.y[i]),
                               lost(x.z[i], way.z, next.z[i])};
        rounding.set(i, is_rounding(rest, next[i]) ? rest : Vec3<float>{0.f, 0.f, 0.f});
      });
  s.dt = state.dt;
}

}  // namespace drench::sim::DRENCH_BACKEND

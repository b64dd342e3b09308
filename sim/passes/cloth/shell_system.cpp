#include "sim/passes/cloth/shell_system.h"

#include <algorithm>
#include <limits>

#include "sim/passes/cloth/cloth_implicit.h"
#include "sim/passes/cloth/cloth_pins.h"
#include "sim/passes/cloth/self_contact.h"
#include "sim/passes/cloth/shell_patches.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// The straight paths, where nothing has stopped a vertex since the last step.
void find_paths(State& state) {
  const ShellState& s = state.shell;
  const ConstVecView x = state.cloth.position.view(), v = state.cloth.velocity.view(),
                     landed = s.landed.view(), left = s.left.view();
  const VecView rounding = state.shell.rounding.view(), lost = state.shell.lost.view(),
                acceleration = state.shell.acceleration.view(), path = state.shell.path.view(),
                about = state.shell.about.view();
  const float half = 0.5f * float(std::min(state.dt, s.dt)), dt = float(state.dt);
  const int *fan_start = state.cloth.fan_start.data(), *fan_entry = state.cloth.fan_entry.data(),
            *sheet = s.sheet.data();
  const float *damping_time = s.law.data() + damping_field * s.sheets,
              dt2 = shell_matrix_of(state).dt2;
  float* bend_factor = state.shell.bend_factor.data();
  const int vertices = state.cloth.vertices;
  parallel_for(
      state.queue, "shell: paths", state.cloth.padded, DRENCH_LAMBDA(int i) {
        const Vec3<float> none{0.f, 0.f, 0.f};
        const bool here = length2(x[i] - landed[i]) == 0.f, so = length2(v[i] - left[i]) == 0.f;
        if (!here) rounding.set(i, none);
        if (!so) lost.set(i, none);
        if (!here || !so) acceleration.set(i, none);
        path.set(i, v[i] - acceleration[i] * half);
        about.set(i, acceleration[i] * (dt * dt));
        const bool any = i < vertices && fan_start[i] < fan_start[i + 1];
        bend_factor[i] =
            any ? dt2 * (1.f + damping_time[sheet[fan_entry[fan_start[i]] / 3]] / dt) : dt2;
      });
}

/// Gathers what triangles give to a vertex.
struct ShellVertices {
  ShellPatches patches;
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
    return c > 0 ? on(c - 1) : -(on(0) + on(1));
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
    return patches.any ? sum + patches.force_on(i) : sum;
  }

  DRENCH_HD void operator()(int i) const {
    Vec3<float> sum = gather(i);
    float d[6] = {0.f, 0.f, 0.f, 0.f, 0.f, 0.f};
    const ShellRows& rows = matrix.rows;
    const int slice = ShellRows::slice(i), ring = rows.ring_start[slice];
    const int first = rows.row_start[slice], last = rows.row_start[slice + 1];
    const int inner = first + rows.ring_start[slice + 1] - ring;
    const float factor = matrix.bend_factor[i], way = dt * factor / matrix.dt2;
    float stiff = 0.f;
    for (int slot = first; slot < last; ++slot) {
      const int at = ShellRows::entry(slot, i), j = rows.end[at];
      const float b = matrix.bend[at];
      const Vec3<float> away = (position[j] - position[i]) + (rounding[j] - rounding[i]);
      sum = sum + (away + (path[j] - path[i]) * way) * b;
      stiff += b * factor;
      if (slot >= inner) continue;
      const int to = ShellRows::entry(ring + slot - first, i), stride = matrix.stride;
      for (int k = 0; k < 9; k += 4) block[k * stride + to] += b * factor;
      const auto entry = [&](int k) { return block[k * stride + to]; };
      stiff -= b * factor;
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

ShellCorners corners_of(const State& state) {
  const ShellState& s = state.shell;
  return {.position = state.cloth.position.view(),
          .rounding = s.rounding.view(),
          .path = s.path.view(),
          .change = s.about.view(),
          .edge_shift = s.edge_shift.view(),
          .corner = s.corner.data(),
          .stride = s.triangles,
          .later = 0.f,
          .off = false,
          .joined = state.cloth.joined};
}

ShellElements elements_of(State& state, About about) {
  ShellState& s = state.shell;
  return {.corners = corners_of(state),
          .area = s.area.data(),
          .gradient = s.gradient.data(),
          .law = s.law.data(),
          .sheet = s.sheet.data(),
          .element = s.element.data(),
          .sheets = s.sheets,
          .dt = float(state.dt),
          .dt2 = shell_matrix_of(state).dt2,
          .about = about};
}

ShellPatches patches_of(State& state, About about) {
  ShellState& s = state.shell;
  return {.start = elements_of(state, about).corners,
          .slots = s.patch_start.data(),
          .node = s.patch_node.data(),
          .sheet = s.sheet.data(),
          .of_start = s.patch_of_start.data(),
          .of = s.patch_of.data(),
          .of_triangle = s.patch_of_triangle.data(),
          .area = s.area.data(),
          .weight = s.patch_weight.data(),
          .rest = s.patch_rest.data(),
          .law = s.law.data(),
          .shift = s.patch_shift.view(),
          .moments = s.moment.view(),
          .sheets = s.sheets,
          .entries = s.patch_entries,
          .dt = float(state.dt),
          .any = s.patches,
          .curved = s.curved,
          .anew = about == About::end};
}

/// What triangles give to the rows.
ShellVertices linearise_triangles(State& state, About about) {
  ShellState& s = state.shell;
  const ClothState& c = state.cloth;
  const ShellElements elements = elements_of(state, about);
  const ShellPatches patches = patches_of(state, about);
  for_each_lane(
      state.queue, "shell: triangles", c.triangles,
      DRENCH_LAMBDA(auto t) { elements(t, patches); });
  return {.patches = patches,
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
}

/// m^2, of the way that a step makes of weight.
float fall2_of(const State& state) {
  const float *g = state.parameters.gravity, dt = float(state.dt);
  return (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * dt * dt * dt * dt;
}

About about_of(int linearised) { return linearised == 1 ? About::path : About::end; }

}  // namespace

void linearise_shell(State& state) {
  find_paths(state);
  if (state.pins.count > 0) find_pin_paths(state);
  const ShellVertices vertices = linearise_triangles(state, About::path);
  parallel_for(
      state.queue, "shell: rows", state.cloth.padded, DRENCH_LAMBDA(int i) { vertices(i); });
}

bool shell_strains_unseen(State& state, int linearised) {
  constexpr float most = 0.01f;
  const ShellElements elements = elements_of(state, about_of(linearised));
  const float* mass = state.cloth.mass.data();
  const ConstVecView change = state.cloth_system.change.view();
  const float fall2 = fall2_of(state);
  return any_lane(
      state.queue, "shell: strained", state.cloth.triangles, DRENCH_LAMBDA(auto t) {
        const auto energy = elements.unseen_strain(t, change, mass, fall2);
        return energy.a > energy.b * decltype(energy.b)(most);
      });
}

void search_line(State& state, const ConstVecView& right, int linearised) {
  const ShellElements elements = elements_of(state, about_of(linearised));
  const VecView change = state.cloth_system.change.view();
  const ConstVecView from = state.shell.from.view();
  const LineEnergies shells = parallel_reduce(
      state.queue, "shell: energies of a line", state.cloth.triangles, LineEnergies{},
      DRENCH_LAMBDA(int t) { return elements.along_line(t, from, change); }, Plus{});
  const ClothMatrix matrix = cloth_matrix(state);
  const Two<double> all = parallel_reduce(
      state.queue, "cloth: energies of a line", state.cloth.vertices, Two<double>{0., 0.},
      DRENCH_LAMBDA(int i) {
        const Vec3<float> d = change[i] - from[i], image = matrix.times(from, i),
                          lack = image - matrix.constraints.project(i, right[i]);
        return Two<double>{dot_double(d, lack), dot_double(d, matrix.times(change, i) - image)};
      },
      Plus{});
  // What is not of the membrane is quadratic.
  const double slope = all.a - shells.slope, curvature = all.b - shells.curvature;
  float best = 1.f;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < LineEnergies::places; ++k) {
    const double part = LineEnergies::part(k),
                 gain = part * slope + 0.5 * part * part * curvature + shells.gain[k];
    if (gain < least) least = gain, best = float(part);
  }
  if (best < 1.f) {
    for_each_lane(
        state.queue, "cloth: back on a line", state.cloth.padded, DRENCH_LAMBDA(auto i) {
          const auto start = from.at(i);
          change.put(i, start + (change.at(i) - start) * decltype(start.x)(best));
        });
  }
}

void relinearise_shell(State& state) {
  const VecView about = state.shell.about.view();
  const ConstVecView change = state.cloth_system.change.view();
  for_each_lane(
      state.queue, "shell: about", state.cloth.padded,
      DRENCH_LAMBDA(auto i) { about.put(i, change.at(i)); });
  const ShellVertices vertices = linearise_triangles(state, About::end);
  ClothSystem& s = state.cloth_system;
  const VecView base = s.base.view(), right = s.right.view(), answer = s.answer.view();
  const BlockInverse block = raw_block_inverse(state);
  const float* inertia = s.inertia.data();
  const int padded = state.cloth.padded;
  parallel_for(
      state.queue, "shell: rows anew", padded, DRENCH_LAMBDA(int i) {
        const Vec3<float> before = vertices.base[i];
        float more[6];
        for (int k = 0; k < 6; ++k) more[k] = -vertices.diagonal[k * padded + i];
        vertices(i);
        if (i >= vertices.vertices) return;
        const Vec3<float> gain = vertices.base[i] - before;
        base.set(i, base[i] + gain), right.set(i, right[i] + gain);
        answer.set(i, answer[i] + gain);
        for (int k = 0; k < 6; ++k) more[k] += vertices.diagonal[k * padded + i];
        block.add(i, more, inertia[i]);
      });
  remake_blocks(state);
  if (state.cloth_levels.on) build_cloth_levels(state);
}

int overstretched_vertex(const State& state) {
  constexpr float most = 10.f;
  const ShellCorners corners = corners_of(state);
  const ShellState& s = state.shell;
  const float *area = s.area.data(), *gradient = s.gradient.data();
  const int n = s.triangles, vertices = state.cloth.vertices;
  const int from_end = parallel_reduce(
      state.queue, "shell: overstretched", state.cloth.triangles, 0,
      DRENCH_LAMBDA(int t) {
        if (area[t] == 0.f) return 0;
        const RestTriangle<float> rest{
            area[t], {gradient[t], gradient[n + t]}, {gradient[2 * n + t], gradient[3 * n + t]}};
        const SurfaceGradient<float> f = surface_gradient(rest, Vec3<float>{0.f, 0.f, 0.f},
                                                          corners.edge(t, 1), corners.edge(t, 2));
        // NaN fails the comparison as well.
        return length2(f.warp) + length2(f.weft) < most * most ? 0
                                                               : vertices - corners.vertex(t, 0);
      },
      Larger{});
  return from_end > 0 ? vertices - from_end : -1;
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
  // The next step is implicit Euler's: forces this far off their lines are not to count in it.
  s.dt = s.linearised > 1 ? 0 : state.dt;
}

}  // namespace drench::sim::DRENCH_BACKEND

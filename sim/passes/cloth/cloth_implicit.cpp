#include "sim/passes/cloth/cloth_implicit.h"

#include "sim/passes/cloth/cloth_obstacles.h"
#include "sim/passes/cloth/cloth_pins.h"
#include "sim/passes/cloth/cloth_springs.h"
#include "sim/passes/cloth/cloth_sweeps.h"
#include "sim/passes/cloth/triangle_obstacles.h"

namespace drench::sim::DRENCH_BACKEND {

void cloth_verlet(State& state, const ClothBuffers& b, float dt) {
  const ClothState& c = state.cloth;
  const Parameters& p = state.parameters;
  const ClothSprings springs{.position = b.position,
                             .velocity = b.velocity,
                             .ends = spring_ends_of(c),
                             .rest_length = c.rest_length.data(),
                             .stiffness = c.stiffness.data(),
                             .damping = c.spring_damping.data()};
  const ConstVecView fluid_force = c.force.view();
  const float *inverse_mass = c.inverse_mass.data(), *damping_rate = c.damping_rate.data();
  const Vec3<float> g{p.gravity[0], p.gravity[1], p.gravity[2]};
  const ClothWalls walls = cloth_walls_of(p);
  const AirDrag air = air_drag_of(state);
  const ConstVecView air_push = c.air_push.view();
  if (air.on) blow_at_cloth(state, b.position, b.velocity);
  for_each_lane(
      state.queue, "cloth: damped Verlet", c.vertices, DRENCH_LAMBDA(auto i) {
        using T = decltype(load(inverse_mass, i));
        const T w = load(inverse_mass, i);
        const auto free = w > T(0.f);
        const Vec3<T> gravity{T(g.x), T(g.y), T(g.z)};
        const Vec3<T> a = (springs.force(i) + fluid_force.at(i)) * w + gravity;
        Vec3<T> v = b.velocity.at(i) * decay(load(damping_rate, i) * T(dt)) + a * T(dt);
        if (air.on) {  // implicit: v' = v + dt w (force - B (v' - v_start))
          const T s = w * T(dt);
          const Vec3<T> force = air_push.at(i) - air.times(i, v - b.velocity.at(i));
          v = v + air.settle(i, s, force * s);
        }
        Vec3<T> x = b.position.at(i) + v * T(dt);
        walls.stop(x, v);
        const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
        b.next.put(i, select(free, x, b.position.at(i)));
        b.next_velocity.put(i, select(free, v, none));
      });
}

void cloth_predict(State& state) {
  if (state.contact.near == 0) return;
  ClothState& c = state.cloth;
  const float dt = float(state.dt / state.substeps);
  ClothBuffers b = cloth_buffers(c);
  const VecView spare[2][2] = {{c.next.view(), c.next_velocity.view()},
                               {c.start.view(), c.predicted.view()}};
  for (int s = 0; s < state.substeps; ++s) {
    b.next = spare[s % 2][0], b.next_velocity = spare[s % 2][1];
    cloth_verlet(state, b, dt);
    b.position = b.next, b.velocity = b.next_velocity;
  }
  const ConstVecView from = c.position.view(), to = b.position;
  const VecView predicted = c.predicted.view();
  const float inverse_dt = 1.f / float(state.dt);
  parallel_for(
      state.queue, "cloth: mean velocity", c.vertices,
      DRENCH_LAMBDA(int i) { predicted.set(i, (to[i] - from[i]) * inverse_dt); });
}

namespace {

/// Springs where the step starts, by vertices.
struct LinearSprings {
  SpringEnds ends;
  ConstVecView position, path;
  const float *rest, *stiffness, *damping;
  float* tension;
  VecView axis;
  float dt;
  int seams;  // the first slot of theirs

  /// Adds the springs of a vertex to its block, its force, and what they have of the paths, and
  /// notes their part of A.
  template <class Index, class T>
  DRENCH_HD void add(Index i, Vec3<T> straight, Vec3<T>& force, Vec3<T>& held, T (&b)[6]) const {
    const Vec3<T> here = position.at(i);
    for (int k = 0; k < ends.slots; ++k) {
      const auto at = i + k * ends.stride;
      const Vec3<T> d = ends.to_end(position, here, i, k);
      const T l = square_root(length2(d)), inverse = T(1.f) / maximum(l, T(1e-12f));
      const T stiff = load(stiffness, at) * T(dt * dt), excess = l - load(rest, at);
      // A spring of no rest length pulls along all axes, wherever its ends are.
      const T t = stiff * select(load(rest, at) > T(0.f), max0(excess * inverse), T(1.f));
      const Vec3<T> n = d * inverse, e = n * square_root(stiff + load(damping, at) * T(dt) - t);
      const Vec3<T> away = straight - ends.at_end(path, i, k);
      force = force + n * (load(stiffness, at) * excess);
      held = held + away * t + e * dot(e, away);
      // A seam is shorter than a step's way, on which it may turn: off its path it holds its ends
      // together in all directions.
      const bool seam = k >= seams;
      const T side = seam ? maximum(stiff, t) : t;
      const Vec3<T> along = seam ? n * square_root(load(damping, at) * T(dt)) : e;
      store(tension, at, side), axis.put(at, along);
      b[0] = b[0] + side + along.x * along.x, b[1] = b[1] + along.x * along.y;
      b[2] = b[2] + along.x * along.z, b[3] = b[3] + side + along.y * along.y;
      b[4] = b[4] + along.y * along.z, b[5] = b[5] + side + along.z * along.z;
    }
  }
};

}  // namespace

void linearise_cloth(State& state) {
  const ClothState& c = state.cloth;
  ClothSystem& s = state.cloth_system;
  const Parameters& p = state.parameters;
  const float dt = float(state.dt);
  const bool anchored = state.pins.soft;
  if (anchored) find_anchors(state);
  const ConstVecView x = c.position.view(), v = c.velocity.view(), path = path_velocity_of(state);
  const VecView base = s.base.view(), free = s.free.view(), change = s.change.view();
  const ConstVecView owed = c.force.view();
  const LinearSprings springs{.ends = spring_ends_of(c),
                              .position = x,
                              .path = path,
                              .rest = c.rest_length.data(),
                              .stiffness = c.stiffness.data(),
                              .damping = c.spring_damping.data(),
                              .tension = s.tension.data(),
                              .axis = s.axis.view(),
                              .dt = dt,
                              .seams = c.first_seam_slot};
  const float *mass = c.mass.data(), *rate = c.damping_rate.data(),
              *inverse_mass = c.inverse_mass.data();
  float* inertia = s.inertia.data();
  const BlockInverse block = block_inverse(state);
  const Vec3<float> g{p.gravity[0], p.gravity[1], p.gravity[2]};
  const AirDrag air = air_drag_of(state);
  const ConstVecView air_push = c.air_push.view();
  const bool shells = state.shell.any;
  const ConstVecView shell_base = state.shell.base.view();
  const float* shell_diagonal = state.shell.diagonal.data();
  const float* anchor = s.anchor.data();
  const ConstVecView anchor_pull = s.anchor_pull.view();
  const int padded = c.padded;
  ClothControl* control = s.control.data();
  parallel_for(
      state.queue, "cloth: control", 1, DRENCH_LAMBDA(int) { *control = {}; });
  for_each_lane(
      state.queue, "cloth: linearise", c.vertices, DRENCH_LAMBDA(auto i) {
        using T = decltype(load(mass, i));
        const Vec3<T> speed = v.at(i), straight = path.at(i), none{T(0.f), T(0.f), T(0.f)};
        const T m = load(mass, i), heavy = m * (T(1.f) + T(dt) * load(rate, i));
        Vec3<T> force =
            Vec3<T>{T(g.x), T(g.y), T(g.z)} * m + owed.at(i) - speed * (m * load(rate, i));
        T b[6] = {heavy, T(0.f), T(0.f), heavy, T(0.f), heavy};
        Vec3<T> held = none;
        springs.add(i, straight, force, held, b);
        if (air.on) {
          const Vec3<T> d = air.diagonal.at(i) * T(dt), m = air.cross.at(i) * T(dt);
          force = force + air_push.at(i);
          b[0] = b[0] + d.x, b[1] = b[1] + m.x, b[2] = b[2] + m.z;
          b[3] = b[3] + d.y, b[4] = b[4] + m.y, b[5] = b[5] + d.z;
        }
        Vec3<T> inner = none;
        if (shells) {
          inner = shell_base.at(i);
          for (int k = 0; k < 6; ++k) b[k] = b[k] + load(shell_diagonal + k * padded, i);
        }
        if (anchored) {
          inner = inner + anchor_pull.at(i);
          const T more = load(anchor, i);
          b[0] = b[0] + more, b[3] = b[3] + more, b[5] = b[5] + more;
        }
        store(inertia, i, heavy);
        block.put(i, b, maximum(heavy, T(1e-20f)));
        const T moves = select(load(inverse_mass, i) > T(0.f), T(1.f), T(0.f));
        free.put(i, Vec3<T>{moves, moves, moves});
        base.put(i, force * T(dt * dt) - held * T(dt) + inner);
        change.put(i, none);
      });
  if (state.pins.count > 0) place_pins(state);
}

void hold_at_walls(State& state) {
  const ClothState& c = state.cloth;
  ClothSystem& s = state.cloth_system;
  const ConstVecView x = c.position.view(), v = path_velocity_of(state);
  const ConstVecView base = s.base.view(), right = s.right.view();
  const VecView free = s.free.view(), change = s.change.view();
  const float dt = float(state.dt);
  const BlockInverse block = block_inverse(state);
  const ClothWalls walls = cloth_walls_of(state.parameters);
  const float reach = state.parameters.spacing;  // a step is not to end farther off
  const float* inertia = s.inertia.data();
  parallel_for(
      state.queue, "cloth: hold at walls", c.vertices, DRENCH_LAMBDA(int i) {
        const Vec3<float> straight = x[i] + v[i] * dt,
                          to = straight + block.times(i, base[i] + right[i]);
        Vec3<float> stop = to, unused{0.f, 0.f, 0.f}, axes = free[i], w = change[i];
        walls.stop(stop, unused);
        const auto hold = [reach](float stop, float to, float from, float straight, float& axis,
                                  float& w) {
          if (stop == to || axis == 0.f || fabsf(stop - from) > reach) return;
          axis = 0.f, w = stop - straight;
        };
        hold(stop.x, to.x, x.x[i], straight.x, axes.x, w.x);
        hold(stop.y, to.y, x.y[i], straight.y, axes.y, w.y);
        hold(stop.z, to.z, x.z[i], straight.z, axes.z, w.z);
        const Vec3<float> before = free[i];
        if (axes.x == before.x && axes.y == before.y && axes.z == before.z) return;
        free.set(i, axes), change.set(i, w);
        block.put_free(i, block, axes, {0.f, 0.f, 0.f}, inertia[i]);
      });
}

void solve_cloth(State& state, const VecView& w, const ConstVecView& right, int most_iterations,
                 float tolerance) {
  solve_cloth_matrix(state, scaled_cloth_matrix(state), w, right, most_iterations, tolerance);
}

namespace {

/// What the displacement of a sheet leaves of its right side, kg m, its mass, and how many of its
/// axes are constrained.
struct Imbalance {
  double x = 0, y = 0, z = 0, inertia = 0, held = 0;
  DRENCH_HD Imbalance operator+(const Imbalance& other) const {
    return {x + other.x, y + other.y, z + other.z, inertia + other.inertia, held + other.held};
  }
};

struct Balance {
  ClothMatrix matrix;
  ClothSweepParts parts;
  VecView w;
  ConstVecView right;
  VecView left;  // what `w` leaves of `right`, kg m
  const VertexRange* sheet;
  int sheets, vertices;
  bool seams;

  DRENCH_DEVICE void operator()(const Team& team) const {
    parts.ask_rows(team, w);
    team.for_each_lane(vertices, [&](auto i) {
      left.put(i, right.at(i) - (seams ? matrix.outer(w, i) : matrix.times(w, i)));
    });
    team.for_each_alone(sheets, [&](const OneOfTeam& one, int k) { shift(one, sheet[k]); });
  }
  DRENCH_DEVICE void shift(const OneOfTeam& one, const VertexRange& of) const {
    const Imbalance lack =
        one.sum(of.count, Imbalance{}, [&](int k) { return lack_of(of.first + k, of); });
    if (lack.held > 0) return;
    const double inverse = 1 / lack.inertia;
    const Vec3<float> by{float(lack.x * inverse), float(lack.y * inverse), float(lack.z * inverse)};
    one.for_each(of.count, [&](int k) { w.set(of.first + k, w[of.first + k] + by); });
  }
  DRENCH_HD Imbalance lack_of(int i, const VertexRange& of) const {
    const ConstraintProjection& may = matrix.constraints;
    const Vec3<float> free = may.axis[i];
    const double gripped = may.obstacles && length2(may.normal[i]) > 0.f ? 1. : 0.,
                 met = matrix.contact.any && matrix.contact.touches_beyond(i, of) ? 1. : 0.;
    return {left.x[i], left.y[i], left.z[i], matrix.inertia[i],
            3. - free.x - free.y - free.z + gripped + met};
  }
};

}  // namespace

void balance_loose_cloth(State& state, const VecView& w, const ConstVecView& right) {
  const ClothState& c = state.cloth;
  if (c.loose == 0) return;
  ScaledClothMatrix matrix = scaled_cloth_matrix(state);
  const ClothSweepParts parts = sweep_parts_of(state, matrix);
  run_together(state.queue, "cloth: balance", c.vertices,
               Balance{.matrix = matrix.matrix,
                       .parts = parts,
                       .w = w,
                       .right = right,
                       .left = state.cloth_system.image.view(),
                       .sheet = c.loose_sheet.data(),
                       .sheets = c.loose,
                       .vertices = c.vertices,
                       // In single precision what seams of 1e6 N/m do to each other is 1e-4 of the
                       // momentum.
                       .seams = c.first_seam_slot < c.spring_slots});
}

void hold_at_obstacles(State& state) {
  const ClothState& c = state.cloth;
  ClothSystem& s = state.cloth_system;
  const ConstVecView x = c.position.view(), v = path_velocity_of(state);
  const ConstVecView base = s.base.view(), right = s.right.view();
  const VecView change = s.change.view();
  const float dt = float(state.dt), *inverse_mass = c.inverse_mass.data();
  float *slides = s.slides.data(), *cling = s.cling.data();
  const BlockInverse block = block_inverse(state);
  const ClothHold hold = cloth_hold_of(state);
  state.cloth_system.normal.clear(state.queue);
  // What is held in a later round would feel the last step's.
  state.cloth_system.rub.clear(state.queue);
  const VecView rub = s.rub.view();
  const ConstVecView friction = state.shell.friction.view();
  const bool shells = state.shell.any;
  parallel_for(
      state.queue, "cloth: hold at obstacles", c.vertices, DRENCH_LAMBDA(int i) {
        hold.grip[i] = -1, slides[i] = 1.f, cling[i] = 0.f;
        hold.free_block.copy(i, hold.block);
        if (inverse_mass[i] == 0.f) return;
        const Vec3<float> straight = x[i] + v[i] * dt;
        Vec3<float> w = change[i];
        const Vec3<float> to = straight + block.times(i, base[i] + right[i]);
        if (!hold.hold(i, x[i], straight, to, w)) return;
        change.set(i, w);
        if (shells) rub.set(i, HoldRevision::across(friction[i] * (dt * dt), hold.normal[i]));
      });
}

void finish_at_obstacles(State& state, const ConstVecView& given) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view(), v = c.velocity.view();
  const VecView next = c.next.view(), velocity = c.next_velocity.view(),
                predicted = c.predicted.view();
  const ConstVecView change = state.cloth_system.change.view();
  const float inverse_dt = 1.f / float(state.dt), *mass = c.mass.data(),
              *inverse_mass = c.inverse_mass.data();
  const ClothMatrix matrix = cloth_matrix(state);
  const ClothHold hold = cloth_hold_of(state);
  react_to_touch_rows(state);
  parallel_for(
      state.queue, "cloth: at obstacles", c.vertices, DRENCH_LAMBDA(int i) {
        if (inverse_mass[i] == 0.f) return;
        Vec3<float> to = next[i], u = velocity[i];
        const int k = hold.grip[i];
        if (k >= 0) {
          const Vec3<float> n = hold.normal[i], w = change[i];
          u = v[i] + w * inverse_dt;
          const ObstacleView& o = hold.obstacles.obstacle[k];
          const Vec3<float> solid = hold.surface_velocity(o, to + hold.home(x[i]), n);
          const Vec3<float> kick = n * dot(solid - u, n);
          const Vec3<float> reaction = along(hold.free[i], matrix.whole(change, i) - given[i]);
          hold.react(k, reaction * inverse_dt + kick * mass[i]);
          u = u + kick;
        }
        hold.guard(i, mass[i], x[i], to, u);
        next.set(i, to), velocity.set(i, u), predicted.set(i, u);
      });
}

void carry_held_vertices(State& state) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view();
  const VecView next = c.next.view(), velocity = c.next_velocity.view();
  const float *mass = c.mass.data(), *inverse_mass = c.inverse_mass.data();
  const int* held = c.held.data();
  const ClothHold hold = cloth_hold_of(state);
  parallel_for(
      state.queue, "collision: obstacles carry", c.vertices, DRENCH_LAMBDA(int i) {
        if (!held[i] || inverse_mass[i] == 0.f) return;
        Vec3<float> to = next[i], u = velocity[i];
        hold.guard(i, mass[i], x[i], to, u);
        next.set(i, to), velocity.set(i, u);
      });
}

}  // namespace drench::sim::DRENCH_BACKEND

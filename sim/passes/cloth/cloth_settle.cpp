// The sheets' solve with what they meet: rounds of solving, of who is held, who slides and which
// pairs bear, and of Newton's method where a step strains shells.

#include <utility>

#include "sim/passes/cloth/cloth_obstacles.h"
#include "sim/passes/cloth/triangle_obstacles.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// What a round makes of one vertex at the walls.
struct WallRevision {
  ClothWalls walls;
  ConstVecView position, path, reaction;
  VecView free, change;
  BlockInverse block;
  const float *inertia, *inverse_mass;
  float dt, reach;
  bool release;

  DRENCH_HD bool operator()(int i) const {
    if (inverse_mass[i] == 0.f) return false;
    const Vec3<float> from = position[i], straight = from + path[i] * dt, to = straight + change[i],
                      push = reaction[i];
    Vec3<float> axes = free[i], w = change[i];
    bool held = false, freed = false;
    const auto along = [&](float low, float high, float from, float straight, float to, float push,
                           float& axis, float& w) {
      if (axis == 0.f) {
        const bool pulls = 2.f * to < low + high ? push < 0.f : push > 0.f;
        if (release && pulls) axis = 1.f, freed = true;
        return;
      }
      const float stop = minimum(maximum(to, low), high);
      if (fabsf(stop - to) <= 1e-3f * reach || fabsf(stop - from) > reach) return;
      axis = 0.f, w = stop - straight, held = true;
    };
    along(walls.low.x, walls.high.x, from.x, straight.x, to.x, push.x, axes.x, w.x);
    along(walls.low.y, walls.high.y, from.y, straight.y, to.y, push.y, axes.y, w.y);
    along(walls.low.z, walls.high.z, from.z, straight.z, to.z, push.z, axes.z, w.z);
    if (!held && !freed) return false;
    free.set(i, axes), change.set(i, w);
    if (held) block.put_free(i, block, axes, {0.f, 0.f, 0.f}, inertia[i]);
    return true;
  }
};

/// What holds the vertices by the solve that was made, kg m, into ClothSystem::residual. The
/// springs of a vertex reach others, whose constraints must not change meanwhile.
void find_reactions(State& state, const ConstVecView& given) {
  ClothSystem& s = state.cloth_system;
  const ClothMatrix matrix = cloth_matrix(state);
  const ConstVecView change = s.change.view();
  const VecView reaction = s.residual.view();
  parallel_for(
      state.queue, "cloth: reactions", state.cloth.vertices,
      DRENCH_LAMBDA(int i) { reaction.set(i, matrix.whole(change, i) - given[i]); });
}

/// Lets go the axes along which a wall pulls, where sheets lie on sheets: alone each of them would
/// have gone to the wall. Holds what went through it. Whether anything changed.
bool revise_walls(State& state, int round) {
  const ClothState& c = state.cloth;
  ClothSystem& s = state.cloth_system;
  const WallRevision revise{.walls = cloth_walls_of(state.parameters),
                            .position = c.position.view(),
                            .path = path_velocity_of(state),
                            .reaction = s.residual.view(),
                            .free = s.free.view(),
                            .change = s.change.view(),
                            .block = block_inverse(state),
                            .inertia = s.inertia.data(),
                            .inverse_mass = c.inverse_mass.data(),
                            .dt = float(state.dt),
                            .reach = state.parameters.spacing,
                            .release = round < 3};
  return parallel_reduce(
             state.queue, "cloth: revise walls", c.vertices, 0,
             DRENCH_LAMBDA(int i) { return int(revise(i)); }, Larger{}) > 0;
}

/// Lets go what pulls off by the solve that was made, holds what comes too near, and finds who
/// sticks and who slides; whether anything changed. What was let go is not held again in the step:
/// the guard stops it.
bool revise_holds(State& state, const ConstVecView& given, int round) {
  ClothState& c = state.cloth;
  ClothSystem& s = state.cloth_system;
  const HoldRevision revise{.hold = cloth_hold_of(state),
                            .position = c.position.view(),
                            .velocity = c.velocity.view(),
                            .path = path_velocity_of(state),
                            .change = s.change.view(),
                            .given = given,
                            .right = s.answer.view(),
                            .reaction = s.residual.view(),
                            .rub = s.rub.view(),
                            .slides = s.slides.data(),
                            .cling = s.cling.data(),
                            .mass = c.mass.data(),
                            .inverse_mass = c.inverse_mass.data(),
                            .dt = float(state.dt),
                            .round = round};
  return parallel_reduce(
             state.queue, "cloth: revise", c.vertices, 0,
             DRENCH_LAMBDA(int i) { return int(revise(i)); }, Larger{}) > 0;
}

/// Whether who is held, who slides and which pairs of sheets meet change by the solve that was
/// made.
bool revise_contacts(State& state, const ConstVecView& given, int round) {
  const bool obstacles = state.parameters.obstacles > 0, sheets = state.self_contact.rows > 0;
  if (!obstacles && !sheets) return false;
  find_reactions(state, given);
  bool changed = obstacles && revise_holds(state, given, round);
  const bool at_walls = sheets && revise_walls(state, round);
  if (sheets) changed |= revise_sheet_rows(state, round);
  ClothLevels& levels = state.cloth_levels;
  if ((changed || at_walls) && levels.on) levels.on = !anything_touches(state);
  // Blocks that do not know what walls hold now would correct far too much.
  if (levels.on && at_walls) build_cloth_levels(state);
  return changed || at_walls;
}

/// Whether an obstacle, another piece of a sheet or a wall holds anything.
bool anything_is_met(const State& state) {
  if (anything_touches(state)) return true;
  const ConstVecView free = state.cloth_system.free.view();
  const float* inverse_mass = state.cloth.inverse_mass.data();
  return parallel_reduce(
             state.queue, "cloth: at walls", state.cloth.vertices, 0,
             DRENCH_LAMBDA(int i) {
               return int(inverse_mass[i] > 0.f && free.x[i] * free.y[i] * free.z[i] == 0.f);
             },
             Larger{}) > 0;
}

/// Newton's method for contacts as they are, from where the displacement is. Its solves are exact
/// once it is at its end. What nothing meets is linear: an impact strains, free motion hardly.
/// @param linearised  times in this step
void solve_to_the_end(State& state, const ConstVecView& right, int most_iterations,
                      float tolerance, int& linearised) {
  constexpr int most_solves = 8, most_linearisations = 24;
  constexpr float loose = 30.f;
  const VecView change = state.cloth_system.change.view(), from = state.shell.from.view();
  const auto sweeps = [&] { return value_at(state.cloth_system.control, 0).sweeps; };
  if (!state.shell.any || state.contact.near > 0 || !anything_is_met(state))
    return solve_cloth(state, change, right, most_iterations, tolerance);
  bool exact = linearised == 1;
  for (int solves = 1, before = sweeps();; ++solves) {
    for_each_lane(
        state.queue, "shell: from", state.cloth.padded,
        DRENCH_LAMBDA(auto i) { from.put(i, change.at(i)); });
    solve_cloth(state, change, right, most_iterations, exact ? tolerance : loose * tolerance);
    const bool moved = std::exchange(before, sweeps()) < before;
    if (!moved || !shell_strains_unseen(state, linearised)) {
      if (exact) return;
      exact = true;
      continue;
    }
    search_line(state, right, linearised);
    if (solves > most_solves || linearised == most_linearisations) return;
    relinearise_shell(state), ++linearised, exact = false;
  }
}

}  // namespace

void settle_contacts(State& state, const ConstVecView& given, int most_iterations,
                     const ContactTolerances& tolerance) {
  constexpr int most_rounds = 6;
  const bool obstacles = state.parameters.obstacles > 0,
             meets = obstacles || state.self_contact.rows > 0;
  const VecView right = state.cloth_system.answer.view();
  const ConstVecView rub = state.cloth_system.rub.view();
  parallel_for(
      state.queue, "cloth: given", state.cloth.padded,
      DRENCH_LAMBDA(int i) { right.set(i, obstacles ? given[i] + rub[i] : given[i]); });
  int& linearised = state.shell.linearised = 1;
  solve_to_the_end(state, right, most_iterations, tolerance.first, linearised);
  follow_sheet_rows(state);
  for (int round = 0; meets && round < most_rounds; ++round) {
    if (!revise_contacts(state, given, round)) return;
    solve_to_the_end(state, right, most_iterations, tolerance.between, linearised);
  }
}

}  // namespace drench::sim::DRENCH_BACKEND

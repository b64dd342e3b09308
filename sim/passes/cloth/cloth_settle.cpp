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
  BlockInverse block, free_block;
  ConstVecView normal;  // of what holds the vertex; only with obstacles
  bool obstacles;
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
    if (!held) return true;
    block.put_free(i, block, axes, {0.f, 0.f, 0.f}, inertia[i]);
    if (!obstacles) return true;
    if (length2(normal[i]) > 0.f)
      free_block.put_free(i, block, axes, normal[i], inertia[i]);
    else
      free_block.copy(i, block);
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
bool revise_walls(State& state, int round, const Settling& settling) {
  const ClothState& c = state.cloth;
  ClothSystem& s = state.cloth_system;
  const WallRevision revise{.walls = cloth_walls_of(state.parameters),
                            .position = c.position.view(),
                            .path = path_velocity_of(state),
                            .reaction = s.residual.view(),
                            .free = s.free.view(),
                            .change = s.change.view(),
                            .block = block_inverse(state),
                            .free_block = free_block_inverse(state),
                            .normal = s.normal.view(),
                            .obstacles = state.parameters.obstacles > 0,
                            .inertia = s.inertia.data(),
                            .inverse_mass = c.inverse_mass.data(),
                            .dt = float(state.dt),
                            .reach = state.parameters.spacing,
                            .release = round < 3 && settling.lets_go};
  return parallel_reduce(
             state.queue, "cloth: revise walls", c.vertices, 0,
             DRENCH_LAMBDA(int i) { return int(revise(i)); }, Larger{}) > 0;
}

/// Lets go what pulls off by the solve that was made, holds what comes too near, and finds who
/// sticks and who slides; whether anything changed. Springs that were let go are not held again in
/// the step: the guard stops them.
bool revise_holds(State& state, const ConstVecView& given, int round, const Settling& settling) {
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
                            .round = round,
                            .lets_go = settling.lets_go,
                            .finds_friction = settling.finds_friction};
  return parallel_reduce(
             state.queue, "cloth: revise", c.vertices, 0,
             DRENCH_LAMBDA(int i) { return int(revise(i)); }, Larger{}) > 0;
}

/// Whether who is held, who slides and which pairs of sheets meet change by the solve that was
/// made.
bool revise_contacts(State& state, const ConstVecView& given, int round, const Settling& settling) {
  const bool obstacles = state.parameters.obstacles > 0, sheets = state.self_contact.rows > 0,
             walls = sheets || state.shell.any;
  if (!obstacles && !walls) return false;
  find_reactions(state, given);
  bool changed = obstacles && revise_holds(state, given, round, settling);
  const bool at_walls = walls && revise_walls(state, round, settling);
  if (sheets) changed |= revise_sheet_rows(state, round, settling);
  if (changed || at_walls) drop_cloth_factor(state);
  ClothLevels& levels = state.cloth_levels;
  if ((changed || at_walls) && levels.on) levels.on = !anything_touches(state);
  // Blocks that do not know what walls hold now would correct far too much.
  if (levels.on && at_walls) build_cloth_levels(state);
  return changed || at_walls;
}

}  // namespace

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

namespace {

/// Whether triangles are to be linearised anew about where the solve that was made ends, of
/// Newton's method on the energy, which a step is cut short for that would raise it.
/// @param more  whether there may be another solve
bool relinearise(State& state, const ConstVecView& right, bool more) {
  int& linearised = state.shell.linearised;
  if (!shell_strains_unseen(state, linearised)) return false;
  search_line(state, right, linearised);
  if (!more) return false;
  relinearise_shell(state), ++linearised;
  return true;
}

/// What is given, and the friction of what obstacles hold, into ClothSystem::answer.
void start_right_side(State& state, const ConstVecView& given) {
  ClothSystem& s = state.cloth_system;
  const VecView right = s.answer.view();
  const bool obstacles = state.parameters.obstacles > 0;
  const ConstVecView rub = s.rub.view();
  const int *grip = s.grip.data(), vertices = state.cloth.vertices;
  parallel_for(
      state.queue, "cloth: given", state.cloth.padded, DRENCH_LAMBDA(int i) {
        const bool rubs = obstacles && i < vertices && grip[i] >= 0;
        right.set(i, rubs ? given[i] + rub[i] : given[i]);
      });
}

}  // namespace

bool settle_contacts(State& state, const ConstVecView& given, int most_iterations,
                     const ContactTolerances& tolerance, const Settling& settling) {
  // What nothing meets is nearly linear, and what fluid presses stays what the pressure solve saw.
  const bool newton = state.shell.any && state.contact.near == 0;
  constexpr float loose = 100.f;  // until contacts and triangles are the right ones
  const int most_rounds = newton ? 20 : 6;
  const ConstVecView right = state.cloth_system.answer.view();
  const VecView change = state.cloth_system.change.view(), from = state.shell.from.view();
  start_right_side(state, given);
  const auto all_sweeps = [&] { return value_at(state.cloth_system.control, 0).sweeps; };
  state.shell.linearised = 1;
  bool met = newton && anything_is_met(state), exact = !met, anew = false;
  for (int round = 0, before = all_sweeps();;) {
    if (met)
      for_each_lane(
          state.queue, "shell: from", state.cloth.padded,
          DRENCH_LAMBDA(auto i) { from.put(i, change.at(i)); });
    const bool first = round == 0 && !anew;
    solve_cloth(state, change, right, most_iterations,
                exact && first ? tolerance.first : (exact ? 1.f : loose) * tolerance.between);
    const int sweeps = all_sweeps() - std::exchange(before, all_sweeps());
    // One that was given up is no place to start from.
    const bool may = !anew && sweeps < most_iterations;
    if (met && sweeps > 0 && relinearise(state, right, may)) {
      anew = true, exact = false;
    } else if (round < most_rounds && revise_contacts(state, given, round, settling)) {
      ++round, anew = false, met = newton, exact = !newton;
    } else if (exact) {
      return round > 0;
    } else {
      exact = true;
    }
  }
}

}  // namespace drench::sim::DRENCH_BACKEND

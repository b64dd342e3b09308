#include "sim/passes/cloth/self_contact.h"

#include <algorithm>
#include <cmath>

#include "sim/backend/sort.h"
#include "sim/passes/cloth/triangle_obstacles.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

DRENCH_HD Vec3<float> off_normal(Vec3<float> v, Vec3<float> n) { return v - n * dot(v, n); }

/// Makes the row of a pair.
struct RowMaker {
  SheetPieces pieces;
  const int* owned;
  const float* inverse_mass;
  ConstVecView position, rounding, velocity, path;
  float dt, gravity;

  /// Where the pieces of a pair are nearest at the start.
  struct Nearest {
    PieceDistance<float> at;
    float distance, inverse;  // m; 1/kg, of the pair's reduced mass
  };
  DRENCH_HD Nearest nearest(const SheetPair& pair) const {
    Vec3<float> x[4];
    const Vec3<float> from = position[pair.vertex[0]], low = rounding[pair.vertex[0]];
    for (int k = 0; k < 4; ++k) {
      const int v = pair.vertex[k];
      x[k] = (position[v] - from) + (rounding[v] - low);
    }
    Nearest n{distance_of_pieces(pieces.edges(pair), x), 0.f, 0.f};
    n.distance = length(n.at.apart);
    for (int k = 0; k < 4; ++k)
      n.inverse += n.at.weight[k] * n.at.weight[k] * inverse_mass[pair.vertex[k]];
    return n;
  }
  /// Whether a pair has a row: of those that are near some nine in ten have none.
  DRENCH_HD bool counts(const SheetPair& pair) const {
    const Nearest n = nearest(pair);
    return n.inverse > 0.f && n.distance > 0.f && stands_for(pair, n.at);
  }
  DRENCH_HD SheetRow operator()(const SheetPair& pair) const {
    SheetRow r{};
    r.obstacle = -1;
    const auto [at, distance, inverse] = nearest(pair);
    for (int k = 0; k < 4; ++k) r.vertex[k] = pair.vertex[k], r.weight[k] = at.weight[k];
    r.mass = 1.f / inverse;
    r.normal = at.apart * (1.f / distance);
    r.thickness = pieces.thickness(pair);
    r.friction =
        pieces.vertex[pair.vertex[0]].root_friction * pieces.vertex[pair.vertex[3]].root_friction;
    Vec3<float> way{0.f, 0.f, 0.f}, speed = way;
    for (int k = 0; k < 4; ++k) {
      way = way + path[pair.vertex[k]] * (dt * r.weight[k]);
      speed = speed + velocity[pair.vertex[k]] * r.weight[k];
    }
    r.gap = distance + dot(r.normal, way);
    r.slip = off_normal(way, r.normal), r.speed = off_normal(speed, r.normal);
    // What starts too near comes apart no faster than it would fall through its thickness: a step
    // that is shorter is to throw it no faster.
    const float apart = dt * maximum(square_root(gravity * r.thickness), 20.f * r.thickness);
    r.target = minimum(r.thickness, distance + minimum(apart, 0.25f * r.thickness));
    if (r.gap > r.target + gravity * dt * dt) return r;
    r.stiffness = row_stiffness * r.mass;
    if (length(r.speed) < r.friction * gravity * dt) r.grip = row_grip * r.mass;
    return r;
  }
  /// Whether the closest points lie inside of two edges, or on what the triangle owns.
  DRENCH_HD bool stands_for(const SheetPair& pair, const PieceDistance<float>& at) const {
    constexpr float none = 1e-5f;
    if (pieces.edges(pair)) {
      return at.weight[0] > none && at.weight[1] > none && at.weight[2] < -none &&
             at.weight[3] < -none;
    }
    const bool a = at.weight[1] < -none, b = at.weight[2] < -none, c = at.weight[3] < -none;
    if (a && b && c) return true;
    const int bits = owned[pair.triangle];
    const int piece = a && b ? 8 : b && c ? 16 : c && a ? 32 : a ? 1 : b ? 2 : 4;
    return (bits & piece) != 0;
  }
};

/// Lists in SelfContact::entry which of n have key 0. @return how many.
int list_chosen(State& state, int n) {
  SelfContact& s = state.self_contact;
  stable_sort_keys(state.queue, s.key, n, 1, s.entry, s.start);
  return value_at(s.start, 1);
}

/// Lists the pairs that have rows in SelfContact::entry. @return how many.
int list_pairs_with_rows(State& state, const RowMaker& make) {
  SelfContact& s = state.self_contact;
  if (s.pairs == 0) return 0;
  s.key.resize(s.pairs);
  const SheetPair* pair = s.pair.data();
  int* key = s.key.data();
  parallel_for(
      state.queue, "self: pairs with rows", s.pairs,
      DRENCH_LAMBDA(int k) { key[k] = make.counts(pair[k]) ? 0 : 1; });
  return list_chosen(state, s.pairs);
}

/// The rows that bear, and their entries by vertices.
void sort_rows(State& state) {
  SelfContact& s = state.self_contact;
  const SheetRow* row = s.row.data();
  s.key.resize(s.rows);
  int* chooses = s.key.data();
  parallel_for(
      state.queue, "self: which bear", s.rows,
      DRENCH_LAMBDA(int k) { chooses[k] = row[k].stiffness > 0.f ? 0 : 1; });
  s.bearing = list_chosen(state, s.rows);
  const int entries = 4 * s.bearing, padded = state.cloth.padded;
  s.bears.resize(s.bearing), s.pull.resize(s.bearing), s.key.resize(entries);
  const int* chosen = s.entry.data();
  BearingRow* bears = s.bears.data();
  int* key = s.key.data();
  parallel_for(
      state.queue, "self: rows that bear", s.bearing, DRENCH_LAMBDA(int k) {
        const SheetRow& r = row[chosen[k]];
        BearingRow b{.vertex = {},
                     .weight = {},
                     .normal = r.normal,
                     .along = r.stiffness - r.grip,
                     .across = r.grip,
                     .row = chosen[k]};
        for (int c = 0; c < 4; ++c) {
          b.vertex[c] = r.vertex[c], b.weight[c] = r.weight[c];
          key[4 * k + c] = r.obstacle < 0 || c < 3 ? r.vertex[c] : padded;
        }
        bears[k] = b;
      });
  stable_sort_keys(state.queue, s.key, entries, padded, s.entry, s.start);
  s.entry_weight.resize(entries);
  const int* entry = s.entry.data();
  float* weight = s.entry_weight.data();
  parallel_for(
      state.queue, "self: weights", entries,
      DRENCH_LAMBDA(int e) { weight[e] = bears[entry[e] >> 2].weight[entry[e] & 3]; });
}

/// Whose right sides follow the rows.
enum class Sides { base, all };

/// Puts what the rows give now on the right sides in place of what they gave.
void load_by_rows(State& state, Sides sides) {
  SelfContact& s = state.self_contact;
  ClothSystem& system = state.cloth_system;
  const SheetRows rows = sheet_rows_of(state);
  const VecView load = s.load.view(), base = system.base.view(), right = system.right.view(),
                answer = system.answer.view();
  const bool all = sides == Sides::all;
  parallel_for(
      state.queue, "self: loads", state.cloth.vertices, DRENCH_LAMBDA(int i) {
        Vec3<float> sum{0.f, 0.f, 0.f};
        for (int e = rows.start[i]; e < rows.start[i + 1]; ++e) {
          sum = sum + push_of(rows.row_of(e)) * rows.weight[e];
        }
        const Vec3<float> more = sum - load[i];
        load.set(i, sum);
        base.set(i, base[i] + more);
        if (all) right.set(i, right[i] + more), answer.set(i, answer[i] + more);
      });
}

/// Makes the blocks of the preconditioner anew from those without rows: with the rows as they are,
/// on the directions that a vertex may go.
struct BlockMaker {
  SheetRows rows;
  ConstraintProjection may;
  BlockInverse block, free_block, without;
  const float* inertia;

  DRENCH_HD void operator()(int i) const {
    block.copy(i, without);
    if (rows.any && rows.touches(i)) add_rows(i);
    const Vec3<float> axes = may.axis[i];
    if (axes.x * axes.y * axes.z == 0.f)
      block.put_free(i, block, axes, {0.f, 0.f, 0.f}, inertia[i]);
    if (!may.obstacles) return;
    const Vec3<float> held = may.normal[i];
    free_block.copy(i, block);
    if (length2(held) == 0.f) return;
    const float cling = may.cling[i], clung[6] = {cling, 0.f, 0.f, cling, 0.f, cling};
    if (cling > 0.f) free_block.add(i, clung, inertia[i]);
    free_block.put_free(i, free_block, axes, held, inertia[i]);
  }
  DRENCH_HD void add_rows(int i) const {
    float more[6] = {0.f, 0.f, 0.f, 0.f, 0.f, 0.f};
    for (int e = rows.start[i]; e < rows.start[i + 1]; ++e) {
      const BearingRow& r = rows.bears[rows.entry[e] >> 2];
      const float w = rows.weight[e], across = r.across * w * w, along = r.along * w * w;
      const Vec3<float> n = r.normal, m = n * along;
      more[0] += m.x * n.x + across, more[1] += m.x * n.y, more[2] += m.x * n.z;
      more[3] += m.y * n.y + across, more[4] += m.y * n.z, more[5] += m.z * n.z + across;
    }
    block.add(i, more, inertia[i]);
  }
};

BlockMaker block_maker_of(State& state) {
  return {.rows = sheet_rows_of(state),
          .may = constraint_projection(state),
          .block = block_inverse(state),
          .free_block = free_block_inverse(state),
          .without = raw_block_inverse(state),
          .inertia = state.cloth_system.inertia.data()};
}

/// Before anything is held: of the vertices that have rows.
void put_rows_in_blocks(State& state) {
  BlockMaker make = block_maker_of(state);
  make.may.obstacles = false;  // normals are of the last step
  const float* inverse_mass = state.cloth.inverse_mass.data();
  parallel_for(
      state.queue, "self: blocks", state.cloth.vertices, DRENCH_LAMBDA(int i) {
        if (make.rows.touches(i) && inverse_mass[i] > 0.f) make(i);
      });
}

/// What a round makes of one row.
struct RowRevision {
  ConstVecView change;
  float inverse_dt, dt;
  int round;
  bool lets_go, finds_friction;

  /// Whether anything is to change.
  DRENCH_HD bool operator()(SheetRow& r) const {
    if (r.mass == 0.f) return false;
    Vec3<float> s{0.f, 0.f, 0.f};
    for (int k = 0; k < 4; ++k) s = s + change[r.vertex[k]] * r.weight[k];
    const float along = dot(r.normal, s), gap = r.gap + along;
    if (r.stiffness == 0.f) {
      // What two obstacles press is thrown to and fro if all of it is held.
      if (gap >= r.target - 0.02f * r.thickness || (r.pressed && r.released > 1)) return false;
      r.stiffness = row_stiffness * r.mass;
      return true;
    }
    const float force = r.stiffness * (r.target - gap);
    const bool at_obstacle = r.obstacle >= 0;
    if (gap < r.target - (at_obstacle ? 0.05f : 0.25f) * r.thickness &&
        r.stiffness < (at_obstacle ? 99.f : 9.f) * row_stiffness * r.mass) {
      r.stiffness *= 10.f;
      return true;
    }
    if (force < 0.f) {
      if (!lets_go || r.released > 1) return false;  // it would come too near once more
      r.stiffness = r.grip = 0.f, r.rub = {0.f, 0.f, 0.f};
      ++r.released;
      return true;
    }
    return finds_friction && r.friction > 0.f &&
           rubs(r, off_normal(s, r.normal), r.friction * force);
  }
  /// @param s  m, across the normal. @param most  kg m
  DRENCH_HD bool rubs(SheetRow& r, Vec3<float> s, float most) const {
    const float now = length(r.rub);
    if (r.grip > 0.f) {
      const Vec3<float> pull = (r.slip + s) * -r.grip;
      const float size = length(pull);
      return size > most && slide(r, pull * (most / size));
    }
    if (now == 0.f) {  // holds what is slow enough for friction to stop it
      if (most == 0.f) return false;
      const float size = length(r.speed);
      if (size * r.mass * dt <= most) return stick(r);
      return slide(r, r.speed * (-most / size));
    }
    const Vec3<float> slip = r.speed + s * inverse_dt;
    if (round < 3 && dot(slip, r.rub) > 0.f) return stick(r);
    return fabsf(now - most) > 0.02f * most && slide(r, r.rub * (most / now));
  }
  static DRENCH_HD bool stick(SheetRow& r) {
    r.grip = row_grip * r.mass, r.rub = {0.f, 0.f, 0.f};
    return true;
  }
  static DRENCH_HD bool slide(SheetRow& r, Vec3<float> rub) {
    r.grip = 0.f, r.rub = rub;
    return true;
  }
};

/// How far off the straight paths vertices may end before pairs have to be found anew: what gravity
/// and a little of what pushes take, or what they did in the step before, up to a tenth of an edge.
float slack_of(const State& state, float gravity) {
  const SelfContact& s = state.self_contact;
  const float dt = float(state.dt);
  const ConstVecView acceleration = state.shell.acceleration.view();
  const float fastest2 = parallel_reduce(
      state.queue, "self: accelerations", state.cloth.vertices, 0.f,
      DRENCH_LAMBDA(int i) { return length2(acceleration[i]); }, Larger{});
  const float least = 2.f * gravity * dt * dt + 0.1f * s.thickness;
  return std::max(least, std::min(1.5f * dt * dt * std::sqrt(fastest2), 0.1f * s.edge));
}

/// Rows with a stiffness, of pairs of sheets and at obstacles.
struct BearingRows {
  int sheets = 0, obstacles = 0;
  DRENCH_HD BearingRows operator+(const BearingRows& other) const {
    return {sheets + other.sheets, obstacles + other.obstacles};
  }
};

}  // namespace

void start_sheet_rows(State& state) {
  SelfContact& s = state.self_contact;
  const ClothState& c = state.cloth;
  s.pairs = s.rows = s.bearing = 0;
  if (!s.any) return;
  const float* g = state.parameters.gravity;
  const float dt = float(state.dt), gravity = std::hypot(g[0], g[1], g[2]);
  const ConstVecView x = c.position.view(), path = path_velocity_of(state);
  const VecView to = s.to.view();
  parallel_for(
      state.queue, "self: paths", c.vertices,
      DRENCH_LAMBDA(int i) { to.set(i, x[i] + path[i] * dt); });
  find_sheet_pairs(state, slack_of(state, gravity));
  find_triangles_at_obstacles(state);
  if (s.pairs + state.triangle_obstacles.touches == 0) return;
  const RowMaker make{.pieces = sheet_pieces_of(state),
                      .owned = s.owned.data(),
                      .inverse_mass = c.inverse_mass.data(),
                      .position = x,
                      .rounding = state.shell.rounding.view(),
                      .velocity = c.velocity.view(),
                      .path = path,
                      .dt = dt,
                      .gravity = gravity};
  const int of_pairs = list_pairs_with_rows(state, make);
  s.rows = of_pairs + state.triangle_obstacles.touches;
  if (s.rows == 0) return;
  s.row.resize(s.rows);
  const SheetPair* pair = s.pair.data();
  const int* chosen = s.entry.data();
  SheetRow* row = s.row.data();
  parallel_for(
      state.queue, "self: rows", of_pairs,
      DRENCH_LAMBDA(int k) { row[k] = make(pair[chosen[k]]); });
  put_touch_rows(state, of_pairs);
  sort_rows(state);
  s.load.clear(state.queue);
  load_by_rows(state, Sides::base);
  const BlockInverse block = block_inverse(state), without = raw_block_inverse(state);
  parallel_for(
      state.queue, "self: blocks without rows", c.vertices,
      DRENCH_LAMBDA(int i) { without.copy(i, block); });
  put_rows_in_blocks(state);
}

bool revise_sheet_rows(State& state, int round, const Settling& settling) {
  SelfContact& s = state.self_contact;
  if (s.rows == 0) return false;
  const float dt = float(state.dt);
  const RowRevision revise{.change = state.cloth_system.change.view(),
                           .inverse_dt = 1.f / dt,
                           .dt = dt,
                           .round = round,
                           .lets_go = settling.lets_go,
                           .finds_friction = settling.finds_friction};
  SheetRow* row = s.row.data();
  const bool changed = parallel_reduce(
                           state.queue, "self: revise", s.rows, 0,
                           DRENCH_LAMBDA(int k) { return int(revise(row[k])); }, Larger{}) > 0;
  if (!changed) return false;
  sort_rows(state);
  load_by_rows(state, Sides::all);
  remake_blocks(state);
  return true;
}

BlockInverse raw_block_inverse(State& state) {
  if (state.self_contact.rows == 0) return block_inverse(state);
  return {state.self_contact.block.data(), state.cloth.padded};
}

void remake_blocks(State& state) {
  const BlockMaker make = block_maker_of(state);
  const float* inverse_mass = state.cloth.inverse_mass.data();
  parallel_for(
      state.queue, "self: all blocks", state.cloth.vertices, DRENCH_LAMBDA(int i) {
        if (inverse_mass[i] > 0.f) make(i);
      });
}

ClothContacts count_cloth_contacts(const State& state) {
  const SelfContact& s = state.self_contact;
  const SheetRow* row = s.row.data();
  const BearingRows rows = parallel_reduce(
      state.queue, "self: count", s.rows, BearingRows{},
      DRENCH_LAMBDA(int k) {
        if (row[k].stiffness == 0.f) return BearingRows{0, 0};
        return row[k].obstacle < 0 ? BearingRows{1, 0} : BearingRows{0, 1};
      },
      Plus{});
  ClothContacts count{uint64_t(rows.sheets), uint64_t(rows.obstacles)};
  if (state.parameters.obstacles == 0) return count;
  const int* grip = state.cloth_system.grip.data();
  count.obstacles += uint64_t(parallel_reduce(
      state.queue, "cloth: count held", state.cloth.vertices, 0,
      DRENCH_LAMBDA(int i) { return int(grip[i] >= 0); }, Plus{}));
  return count;
}

}  // namespace drench::sim::DRENCH_BACKEND

#pragma once
// Contact of shells with themselves and each other, in the sheets' one system A w = b
// (cloth_implicit.h). A pair of pieces that the step would bring nearer than their thickness is a
// row: with s = sum_j w_j x_j, from one piece to the other, and n its direction at the start it
// adds to A
//   (k n n^T + g (1 - n n^T)) w_i w_j,
// a stiffness of many times the pair's reduced mass, g only while friction holds the pair. A row
// never pulls: after the solve those that do are let go, and those that came too near are taken in,
// in a few rounds (revise_sheet_rows); the same rounds find who sticks and who slides by Coulomb's
// law. Within a pressure solve the rows stay as they are. Where a pair's closest points lie on a
// side or a corner of a triangle, the one that owns these has the row, so that contact is not
// counted by how many triangles meet there (the blocks of Chen et al. 2025). Triangles at obstacles
// have rows of the same kind (triangle_obstacles.h).
//
// What the solve leaves is no proof: guard_sheets, last of all, stops vertices short of crossing.

#include "sim/cloth_contacts.h"
#include "sim/passes/cloth/self_contact_pairs.h"

namespace drench::sim::DRENCH_BACKEND {

/// Of a row, over the pair's reduced mass, and ten times that where it yields by a quarter of its
/// thickness (docs/decisions/0038-what-was-tried-on-jammed-contact.md): 50 layers of cotton at rest
/// stay 0.88 thicknesses apart, and what friction holds on a slope of 1 in 2 creeps by 0.04 mm/s.
constexpr float row_stiffness = 100.f, row_grip = 100.f;

/// What a row gives beside its part of A: kg m.
DRENCH_HD Vec3<float> push_of(const SheetRow& r) {
  if (r.stiffness == 0.f) return {0.f, 0.f, 0.f};
  return r.normal * (r.stiffness * (r.target - r.gap)) + r.rub - r.slip * r.grip;
}

/// The rows' part of A, of those that bear.
struct SheetRows {
  const SheetRow* row;
  const BearingRow* bears;
  const int *start, *entry;
  const float* weight;        // of an entry
  const Vec3<float>* pulled;  // by rows, of the vector that `times` is asked for; null: not known
  bool any;

  /// What a row gives at a displacement, kg m.
  static DRENCH_HD Vec3<float> pull(const BearingRow& r, const ConstVecView& x) {
    Vec3<float> s{0.f, 0.f, 0.f};
    for (int k = 0; k < 4; ++k) s = s + x[r.vertex[k]] * r.weight[k];
    return s * r.across + r.normal * (r.along * dot(r.normal, s));
  }
  DRENCH_HD const SheetRow& row_of(int entry_at) const {
    return row[bears[entry[entry_at] >> 2].row];
  }
  DRENCH_HD Vec3<float> times(const ConstVecView& x, int i) const {
    Vec3<float> y{0.f, 0.f, 0.f};
    for (int e = start[i]; e < start[i + 1]; ++e) {
      const int k = entry[e] >> 2;
      y = y + (pulled ? pulled[k] : pull(bears[k], x)) * weight[e];
    }
    return y;
  }
#if !defined(__CUDACC__)
  DRENCH_HD_CALL Vec3<Pack> times(const ConstVecView& x, Lanes i) const {
    if (start[i.base] == start[i.base + 8]) return {Pack(0.f), Pack(0.f), Pack(0.f)};
    alignas(32) float lane[3][8] = {};
    for (int k = 0; k < 8; ++k) {
      const Vec3<float> y = times(x, i.base + k);
      lane[0][k] = y.x, lane[1][k] = y.y, lane[2][k] = y.z;
    }
    return {Pack::load(lane[0]), Pack::load(lane[1]), Pack::load(lane[2])};
  }
#endif
  DRENCH_HD bool touches(int i) const { return start[i] < start[i + 1]; }
  /// Whether an obstacle or a vertex beyond a range does: a shift of all of it meets resistance.
  DRENCH_HD bool touches_beyond(int i, VertexRange range) const {
    for (int e = start[i]; e < start[i + 1]; ++e) {
      const SheetRow& r = row_of(e);
      if (r.obstacle >= 0 || !range.contains(r.vertex[0]) || !range.contains(r.vertex[3]))
        return true;
    }
    return false;
  }
};

inline SheetRows sheet_rows_of(const State& state) {
  const SelfContact& s = state.self_contact;
  return {s.row.data(),          s.bears.data(), s.start.data(), s.entry.data(),
          s.entry_weight.data(), nullptr,        s.rows > 0};
}

/// Finds the pairs and makes their rows; those that the straight paths bring too near are in the
/// system from the start. After linearise_cloth.
void start_sheet_rows(State& state);

/// What rounds of the sheets' solve may change beside what they take in. With fluid near, sheets
/// are settled under the last step's pressures, to find what is let go, before the new ones are
/// found, and under these with all of it held: pressures that were found against what holds a sheet
/// do work without end on one that is let go (docs/decisions/0037-settled-before-pressures.md).
struct Settling {
  bool lets_go = true;         // what pulls
  bool finds_friction = true;  // which the pressure solve does not know of
};

/// Lets go the rows that pull by the solve that was made, takes in what came too near, and finds
/// who sticks and who slides; the right sides follow. Whether anything changed.
bool revise_sheet_rows(State& state, int round, const Settling& settling);

/// Rows that bear, and vertices that obstacles hold.
ClothContacts count_cloth_contacts(const State& state);

/// Stops the vertices on their way to ClothState::next where they would take sheets through each
/// other. What stops has the velocity of the way that is left to it.
void guard_sheets(State& state);

}  // namespace drench::sim::DRENCH_BACKEND

#pragma once
// Which pieces of sheets may meet in a step: pairs of a vertex and a triangle, and of two edges,
// that share no vertex. Triangles whose paths come within reach are found on a grid; each stands
// for the corners and sides that it owns, so that no pair comes twice (Curtis et al. 2008). The
// list holds all that could come nearer than their contact distance on paths within
// SelfContact::slack of those that it is found for.

#include "sim/passes/cloth/self_contact_ccd.h"

namespace drench::sim {
struct ClothTopology;
}

namespace drench::sim::DRENCH_BACKEND {

/// What a pair needs of its vertices.
struct SheetPieces {
  const SheetVertex* vertex;

  DRENCH_HD bool edges(const SheetPair& pair) const { return pair.triangle < 0; }
  /// The vertices of a view.
  DRENCH_HD void gather(const SheetPair& pair, const ConstVecView& from,
                        Vec3<float> (&to)[4]) const {
    for (int k = 0; k < 4; ++k) to[k] = from[pair.vertex[k]];
  }
  /// Whether a seam joins the pieces: they are neighbours, as pieces that share a vertex are.
  DRENCH_HD bool sewn(const SheetPair& pair) const {
    const int first = edges(pair) ? 2 : 1;
    for (int a = 0; a < first; ++a)
      for (int b = first; b < 4; ++b)
        if (vertex[pair.vertex[a]].point == vertex[pair.vertex[b]].point) return true;
    return false;
  }
  /// m, that two pieces keep apart: half the thickness of either, and at rest there is a tenth of
  /// their distance to spare, or a fine mesh of thick cloth would push itself apart.
  DRENCH_HD float thickness(const SheetPair& pair) const {
    const SheetVertex &a = vertex[pair.vertex[0]], &b = vertex[pair.vertex[3]];
    const float whole = a.half_thickness + b.half_thickness;
    if (a.sheet != b.sheet) return whole;
    const Vec3<float> rest[4] = {a.rest, vertex[pair.vertex[1]].rest, vertex[pair.vertex[2]].rest,
                                 b.rest};
    const float apart = length(distance_of_pieces(edges(pair), rest).apart);
    return minimum(whole, 0.9f * apart);
  }
};
inline SheetPieces sheet_pieces_of(const State& state) {
  return {state.self_contact.vertex.data()};
}

/// Where each of n runs of these lengths begins; the sum of all.
int starts_of(const Column<int>& counts, int n, Column<int>& first);

/// What never changes about contact among sheets.
void load_self_contact(State& state, const ClothTopology& cloth);

/// Fills SelfContact::pair for paths from the positions to SelfContact::to.
void find_sheet_pairs(State& state, float slack);

/// Whether the pairs still hold all that could meet on the way to `next`.
bool sheet_pairs_hold(const State& state, const ConstVecView& next);

}  // namespace drench::sim::DRENCH_BACKEND

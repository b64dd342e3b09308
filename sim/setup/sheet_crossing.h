#pragma once
// Pairs of triangles of sheets that pass through each other or touch, on the host.

#include <optional>

#include "sim/solver.h"

namespace drench::sim {

/// Two triangles of the sheets, all in one, that share no corner where they meet.
struct SheetCrossing {
  int triangle, other;
  enum class Kind { crosses, touches } kind;
};

/// The first pair, by triangle, of which an edge of one passes through the other, exactly but for
/// rounding in double, or whose vertex is nearer to the other than a thousandth of the thickness
/// they keep. Only of what meets sheets.
std::optional<SheetCrossing> find_sheet_crossing(const ClothTopology& cloth,
                                                 const HostVec& position);

}  // namespace drench::sim

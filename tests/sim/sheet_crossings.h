#pragma once
// Sheets that pass through each other and how near they come, from stored states alone, in double,
// by an algorithm of its own.

#include "tests/sim/support.h"

namespace drench::sim_tests {

/// How many pairs of an edge and a triangle that share no vertex pass through each other: both ends
/// lie on different sides of the triangle's plane, and the edge passes all three sides of the
/// triangle the same way round.
int count_sheet_crossings(const sim::ClothTopology& cloth, const sim::HostVec& position);

/// The least distance of a vertex from a triangle of another sheet, m; `most` where none is nearer.
double least_distance_of_sheets(const sim::ClothTopology& cloth, const sim::HostVec& position,
                                double most);

}  // namespace drench::sim_tests

#pragma once
// What never changes about sheets that are shells (sim/setup/shell_rest.h), all in one: host
// arrays, from which a backend makes its columns. Empty where every sheet is a net of springs.

#include <vector>

namespace drench::sim {

/// The law of a sheet's plane, sim/passes/cloth/shell_membrane.h.
struct ShellLaw {
  float c11, c22, c12, c66;            // N/m
  float limit_start, limit_stiffness;  // Green strain; N/m
  float damping_time;                  // s
};

struct ShellTopology {  // NOLINT(bugprone-reserved-identifier): clang-tidy 14, of its copy
  // of a triangle; of springs: zeros
  std::vector<float> area;         // m^2
  std::vector<float> gradient[4];  // 1/m: RestTriangle's gradient_x[0], [1], gradient_y[0], [1]
  std::vector<ShellLaw> law;       // of a sheet; of springs: zeros
  // Rows of vertices, entries by rising vertex, without the diagonal: first those that share a
  // triangle with the row's, `ring` of them, then those that bending alone couples.
  std::vector<int> row_start, ring, column;
  std::vector<float> bend;  // N/m of an entry: what pulls the row's vertex to the entry's
  // N of a vertex: bending across the seams of sheets that are joined to themselves; or empty
  std::vector<float> push_x, push_y, push_z;

  // Of triangles that are curved at rest, else empty: their energy has the term -n . sum q x over
  // the nodes of their patches (shell_bending.h), n the unit normal.
  std::vector<int> curved_start, curved_node;                         // rows by triangle
  std::vector<float> curved_pull;                                     // N, q
  std::vector<float> curved_shift_x, curved_shift_y, curved_shift_z;  // J: sum q shift; or empty

  bool any() const { return !row_start.empty(); }
};

}  // namespace drench::sim

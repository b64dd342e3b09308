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
  float d11, d22, d12, d66;            // N m, of bending
};

/// Bending patches (sim/setup/shell_rest.h) of triangles, times the roots of the areas that they
/// stand for: of sheets that are curved at rest, or whose bending is damped. Rows by triangle.
struct PatchTopology {  // NOLINT(bugprone-reserved-identifier): clang-tidy 14, of its copy
  std::vector<int> start, node;
  std::vector<float> weight[3];                  // 1/m, xx, yy and xy of a node
  std::vector<float> rest[3];                    // 1, of a triangle: its curvature at rest
  std::vector<float> shift_x, shift_y, shift_z;  // 3 a triangle, 1: sums weight shift; or empty
  bool used = false, curved = false;             // of any sheet
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
  PatchTopology patch;  // of no triangle where no sheet needs them

  bool any() const { return !row_start.empty(); }
};

}  // namespace drench::sim

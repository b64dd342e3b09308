#pragma once
// The closed shells of a mesh and what they bound.
//
// A shell is what hangs together across edges. Shells that cross each other, or coincide, are one
// body: its inside is the union of theirs. Bodies do not cross, so that of two one lies wholly in
// the other or neither does; a point is inside if an odd number of bodies hold it: what lies in an
// odd number of others is a cavity, whichever side its triangles are turned, and what floats in a
// cavity is solid again. A shell holds the points that it winds around; shells may touch.

#include <cstdint>
#include <vector>

#include "pipeline/contract/frames.h"

namespace drench {

struct Shells {
  std::vector<int> shell;  // of a triangle
  std::vector<int> body;   // of a shell
  std::vector<int> depth;  // of a body: how many others it lies in; odd: a cavity

  int count() const { return int(body.size()); }
  int bodies() const { return int(depth.size()); }
  bool is_cavity(int of_shell) const { return depth[size_t(body[size_t(of_shell)])] % 2 == 1; }
};

/// @param mesh  closed: every edge has as many triangles in one direction as in the other, where
/// vertices at one point are one; any orientation, m or any unit. Shells lie in another body if all
/// but a thousandth of their volume does by rays along each axis, and cross if neither lies in the
/// other so.
Shells find_shells(const TriangleMesh& mesh);

/// Whether a part of space is held more than once: by shells that cross, or by one that winds twice
/// around it. The mesh's triangles then do not tell what its solid takes up.
bool holds_twice(const TriangleMesh& mesh);

/// Whether shells cross, or lie face to face. Then they do not bound their solid one by one.
bool shells_meet(const TriangleMesh& mesh);

/// Turns triangles so that they face away from the solid: each shell outward by itself, cavities
/// inward. Normals stay as they are.
void orient_shells(TriangleMesh& mesh);

/// Where rays along an axis meet the shells of a mesh. Rays go through the points (j, k) of a grid
/// in the next two axes; corners and edges that lie on a ray count for one side of it throughout,
/// so that sums of turns are exact.
class ShellRays {
 public:
  struct Grid {
    double low[2] = {0, 0};   // m, of ray (0, 0) along the next axes
    double step[2] = {1, 1};  // m
    int count[2] = {0, 0};
    int axis = 0;  // x
  };
  struct Crossing {
    double x = 0;  // m, along the axis
    int shell = 0;
    int turn = 0;  // what the shell's winding number changes by in the direction of the axis
  };
  /// @param triangles  those that may be met.
  ShellRays(const TriangleMesh& mesh, const std::vector<int>& shell,
            const std::vector<uint32_t>& triangles, const Grid& grid);

  /// Of ray (j, k), from low to high.
  const Crossing* begin(int j, int k) const { return crossing_.data() + start_[ray(j, k)]; }
  const Crossing* end(int j, int k) const { return crossing_.data() + start_[ray(j, k) + 1]; }

 private:
  size_t ray(int j, int k) const { return size_t(k) * size_t(grid_.count[0]) + size_t(j); }

  Grid grid_;
  std::vector<size_t> start_;
  std::vector<Crossing> crossing_;
};

/// Counts along a ray how many bodies hold a point.
class BodyCount {
 public:
  explicit BodyCount(const Shells& shells)
      : shells_(shells),
        winding_(size_t(shells.count()), 0),
        holders_(size_t(shells.bodies()), 0) {}
  void pass(const ShellRays::Crossing& crossing);
  bool inside() const { return holding_ % 2 == 1; }
  bool in_shell(int shell) const { return winding(shell) != 0; }
  int winding(int shell) const { return winding_[size_t(shell)]; }

 private:
  const Shells& shells_;
  std::vector<int> winding_, holders_;  // of shells; shells of a body that hold the point
  int holding_ = 0;                     // bodies
};

}  // namespace drench

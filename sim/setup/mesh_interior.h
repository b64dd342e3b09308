#pragma once
// Lattice places in closed meshes.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/contract/frames.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/shot.h"

namespace drench::sim {

/// A cell of the lattice that begins at domain.min, and the place of its particle, m world.
using Cell = std::array<int64_t, 3>;
V3d place_of(const Shot& shot, const Cell& cell);

/// Cells from `first` up to less than `last`.
struct CellRange {
  Cell first{-unbounded, -unbounded, -unbounded}, last{unbounded, unbounded, unbounded};
  static constexpr int64_t unbounded = int64_t(1) << 52;
};

/// The inside of a closed mesh, wherever it stands: a level set in the mesh's own frame.
class MeshInterior {
 public:
  /// @param mesh  closed, own coordinates, m. @param inset  spacings that places are inside it at
  /// least. @param name  of the source, for errors. @throws Error if it would hold more particles
  /// than a shot may have.
  MeshInterior(const Shot& shot, const TriangleMesh& mesh, double inset, const std::string& name,
               const LevelSetMaker& make_level_set);

  /// Cells whose places are inside, x fastest.
  std::vector<Cell> cells(const Shot& shot, const Pose& pose, const CellRange& within = {}) const;
  /// Of its bounds, 0 to 7, own coordinates, m.
  V3d corner(int which) const;
  /// m^3 inside the surface, cavities left out; 0 where shells cross or wind twice: it is not
  /// known.
  double volume() const { return volume_; }

 private:
  double depth_;  // m
  double volume_;
  V3d low_{1e30}, high_{-1e30};
  LevelSet set_;
};

}  // namespace drench::sim

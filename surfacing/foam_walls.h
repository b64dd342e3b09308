#pragma once
// What foam cannot go through: walls of the domain and obstacles.

#include <vector>

#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/shot.h"

namespace drench::surfacing {

using Imath::V3f;

/// Walls, obstacles and open sides from one frame to the next.
class FoamWalls {
 public:
  /// @param frame      film frame at the end of the motion
  /// @param level_set  makes level sets of obstacles' meshes; needed if there are meshes
  /// @throws Error if a mesh cannot be read.
  FoamWalls(const Shot& shot, int frame, const LevelSetMaker& level_set);

  struct Touch {
    bool met = false;
    V3f normal{0, 0, 0};    // away from the last solid met
    V3f velocity{0, 0, 0};  // m/s, of the solid there
  };
  /// Stops a particle of that radius on its path where it meets a solid, moves it out of all solids
  /// at fraction s between the frames, and home along periodic axes. A path of at most four
  /// spacings does not pass solids two spacings thick.
  Touch keep_out(const V3f& from, V3f& position, float radius, float s) const;
  /// Whether a position lies beyond an open side.
  bool lost(const V3f& position) const;

 private:
  struct Solid {
    const Obstacle* obstacle;
    Pose before, after;  // at the ends of the motion
    LevelSet level_set;  // of a mesh
  };
  struct Distance {
    float value;  // m, negative inside
    V3f normal;   // unit
  };
  void stop_at(const Solid& solid, const Pose& pose, const V3f& from, V3f& position,
               float radius) const;
  Distance distance(const Solid& solid, const Pose& pose, const V3f& position) const;

  const Shot& shot_;
  std::vector<Solid> solids_;
};

}  // namespace drench::surfacing

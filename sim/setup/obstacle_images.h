#pragma once
// Obstacles across the seams of periodic axes. Particles are wrapped into the domain, so that an
// obstacle is placed once for every image of it that comes within two supports of the domain.
// Images are bodies of their own to all passes; one that reaches all the way around an axis has no
// ends there and is a single body: a box becomes endless, a mesh is the union of its images, whose
// distance is the least of theirs (ObstacleView::distance).

#include <vector>

#include <Imath/ImathVec.h>

#include "sim/obstacle_placement.h"

namespace drench::sim {

struct Parameters;

class ObstacleImages {
 public:
  /// Without periodic axes: an obstacle is its own only image, as it is given.
  ObstacleImages() = default;
  explicit ObstacleImages(const Parameters& p);

  bool any() const { return period_ != Imath::V3d(0); }
  /// The image of a point in [low, high) of periodic axes. Local, m.
  Imath::V3d wrapped(Imath::V3d point) const;

  struct Image {
    ObstaclePlacement placement;
    Imath::V3d shift;  // m, from where the obstacle stands
  };
  /// @param extent  of the bounds of the obstacle's shape at the end of the step, m; bounds over
  /// the step are those of the placement.
  std::vector<Image> of(const ObstaclePlacement& placement, const Imath::V3d& extent) const;

 private:
  struct Range {
    int first, last;
  };
  Range reach(const ObstaclePlacement& placement, int axis) const;
  Image shifted(const ObstaclePlacement& placement, const Imath::V3d& shift) const;

  Imath::V3d low_{0}, period_{0};  // m; 0 where an axis is not periodic
  double margin_ = 0;              // m
};

}  // namespace drench::sim

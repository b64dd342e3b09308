#include "pipeline/contract/shot/seam_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/obstacle.h"

namespace drench {

namespace {

constexpr double along = 1 - 1e-6;  // of a cosine, and of a length: the same but for rounding
constexpr int combinations = 5 * 5 * 5;

struct Seam {
  const Shot& shot;
  V3d period{0};  // m; 0 where an axis is not periodic

  explicit Seam(const Shot& s) : shot(s) {
    for (int k = 0; k < 3; ++k) {
      if (s.domain.axis[size_t(k)] == Axis::periodic) period[k] = s.domain.max[k] - s.domain.min[k];
    }
  }

  /// The periodic axis that a plane's normal has a part along; -1 if none.
  int cuts_plane(const Pose& pose) const {
    for (int k = 0; k < 3; ++k)
      if (period[k] > 0 && std::abs(pose.axis[1][k]) > 1e-6) return k;
    return -1;
  }

  /// Whether a box overlaps its image at `shift`: a box of twice its size holds that point. Edges
  /// that go around an axis which they lie along have no end: images along them are the box itself.
  bool overlaps(const Pose& pose, const V3d& size, V3d shift) const {
    const double length = shift.length();
    for (int own = 0; own < 3; ++own) {
      for (int k = 0; k < 3; ++k) {
        const bool lies_along = period[k] > 0 && std::abs(pose.axis[own][k]) > along;
        if (lies_along && size[own] >= period[k] * along) shift[k] = 0;
      }
    }
    bool overlap = shift.length() > 1e-6 * length;
    for (int own = 0; own < 3; ++own)
      overlap &= std::abs(pose.axis[own].dot(shift)) < size[own] * along;
    return overlap;
  }

  /// An axis along which an image overlaps the box; -1 if none does.
  int cuts_box(const Pose& pose, const V3d& size) const {
    for (int n = 0; n < combinations; ++n) {
      const V3d steps(n % 5 - 2, n / 5 % 5 - 2, n / 25 - 2), shift = steps * period;
      if (shift.length2() == 0 || !overlaps(pose, size, shift)) continue;
      for (int k = 0; k < 3; ++k)
        if (shift[k] != 0) return k;
    }
    return -1;
  }
};

}  // namespace

void check_obstacles_at_seams(const Shot& shot, const ShotSources& sources) {
  const Seam seam(shot);
  for (size_t i = 0; i < shot.obstacle.size(); ++i) {
    const Obstacle& o = shot.obstacle[i];
    const bool plane = o.type == ObstacleType::plane;
    if (seam.period == V3d(0) || !(plane || o.type == ObstacleType::box)) continue;
    const int last = o.rotation_deg.keys.size() > 1 ? shot.timeline.last : shot.timeline.first;
    for (int frame = shot.timeline.first; frame <= last; ++frame) {
      const Pose pose = obstacle_pose(o, frame);
      const int axis = plane ? seam.cuts_plane(pose) : seam.cuts_box(pose, o.size);
      if (axis < 0) continue;
      const std::string path = fmt::format("obstacle[{}]", i);
      const char name = "xyz"[axis];
      if (plane) {
        throw Error(fmt::format(
            "{}: {}.normal points along {} by {:.3g} at frame {}, but domain.{} is \"periodic\": a "
            "plane without bounds would meet images of itself. Turn it so that {} lies in it, or "
            "use a box",
            sources.at(path + ".normal"), path, name, pose.axis[1][axis], frame, name, name));
      }
      throw Error(fmt::format(
          "{}: {}.size is [{}, {}, {}] m: at frame {} the box overlaps its own image across the "
          "periodic {} axis, {:.6g} m on. Lay an edge along {}, so that it goes around as one "
          "body, or make it shorter",
          sources.at(path + ".size"), path, o.size.x, o.size.y, o.size.z, frame, name,
          seam.period[axis], name));
    }
  }
}

}  // namespace drench

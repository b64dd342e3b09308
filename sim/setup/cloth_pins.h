#pragma once
// Pins of sheets that move, let go or are soft, over time.

#include <array>

#include "sim/setup/obstacles.h"

namespace drench::sim {

struct Scene;

/// The vertices of such pins are functions of time alone. Places are local, m; times in s since the
/// first frame.
class ClothPins {
 public:
  /// Where a vertex stands at a triangle of an obstacle that deforms: by weights of its corners 1
  /// and 2, and off there along its first side, across that, and along its normal, m.
  struct OnTriangle {
    size_t triangle = 0;
    double weight[2] = {0, 0}, off[3] = {0, 0, 0};
  };
  /// A pin.
  struct Group {
    int cloth = 0, pin = 0;  // in the shot
    Obstacle carrier;        // whose pose the group has, with the origin where it starts
    int obstacle = -1;       // that carries it
    bool moves = false;
    double release = 0;           // s
    double stiffness = 0;         // N/m
    V3d pivot{0};                 // m, the origin's place at the start
    std::vector<int> vertex;      // of the sheets, all in one
    std::vector<V3d> start, own;  // m, at the start; against the origin, along the axes of the pose
    std::vector<OnTriangle> on;   // where the obstacle deforms
    V3d low{0}, high{0};          // m, bounds of `own`
  };

  ClothPins() = default;
  /// Fills ClothTopology::pin_vertex, and the velocities that pinned vertices start with.
  /// @param scene  with its sheets and obstacles.
  ClothPins(const Shot& shot, Scene& scene);

  bool any() const { return !group_.empty(); }
  const std::vector<Group>& groups() const { return group_; }
  /// Where the k-th vertex of a group is, as long as it is held.
  V3d place(const Group& group, size_t k, ObstacleSet& obstacles, double time) const;
  /// What the solver is told of a step.
  PinsNow over(ObstacleSet& obstacles, double start, double end) const;
  /// The first time after `time` that a step has to land on, at most `end`: where a pin lets go.
  double stop(double time, double end) const;
  /// The longest step from `time` on in which no pin moves farther than 0.4 spacings, at most dt.
  double limit(double time, double dt) const;
  /// The largest speed of a pin by its keys, m/s.
  double fastest() const;

 private:
  double moment_length() const { return 1e-3 / timeline_.fps; }  // s, to tell velocities by
  Group group_of(const Shot& shot, Scene& scene, size_t sheet, size_t index) const;
  double film_frame(double time) const { return timeline_.first + time * timeline_.fps; }
  /// As obstacles stand, so that their keys' places far from the origin tell no other bits.
  double snapped(double x) const;
  double travel(const Group& group, double begin, double end) const;
  /// A group's pose at a time.
  struct Moment {
    double frame;
    Pose pose;
  };
  Moment moment(const Group& group, double time) const;
  V3d place(const Group& group, size_t k, ObstacleSet& obstacles, const Moment& at) const;
  /// A moment, and one and two of `h` s later or, below 0, before it.
  struct Moments {
    Moment at[3];
    double h;
  };
  Moments moments(const Group& group, double time, double h) const;
  /// m/s, at the first of three moments, to the second order.
  V3d velocity(const Group& group, size_t k, ObstacleSet& obstacles, const Moments& now) const;

  Timeline timeline_;
  double spacing_ = 1, begin_ = 0;  // m; s, of the simulation
  std::vector<Group> group_;
};

}  // namespace drench::sim

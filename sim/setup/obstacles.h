#pragma once
// The obstacles or sinks of a shot over time, for the solver: placements of a step, level sets of
// meshes.

#include <array>
#include <optional>
#include <vector>

#include "pipeline/contract/geometry/obstacle.h"
#include "sim/setup/obstacle_images.h"
#include "sim/solver.h"

namespace drench::sim {

struct LocalFrame;

/// Bounds over a step, and how near its obstacle lets anything come, m local.
struct PlacedBox {
  float low[3], high[3], clearance;
};

class ObstacleSet {
 public:
  ObstacleSet() = default;
  /// @param make_level_set  of drench_vdb; needed only if there are meshes.
  /// @throws Error if a mesh cannot be read, is not closed, or is too fine.
  ObstacleSet(const Shot& shot, const LocalFrame& frame, LevelSetMaker make_level_set);

  /// Sinks are there within their times alone.
  /// @param solids  as obstacles; window[k] is the time of solids[k], s since the first frame.
  struct Window {
    double start = -1e30, stop = 1e30;
  };
  ObstacleSet(Solids role, const Shot& shot, const std::vector<Obstacle>& solids,
              std::vector<Window> window, const LocalFrame& frame, LevelSetMaker make_level_set);

  int count() const { return int(obstacle_.size()); }
  /// From now on obstacles reach across seams. Sinks do not: they end where they end.
  void set_images(const ObstacleImages& images) { images_ = images; }
  /// Tells the solver where the obstacles are from `start` to `end`, s since the first frame, and
  /// gives it the level sets that it does not have yet. A step must not cross a stop.
  void place(Solver& solver, double start, double end);
  /// Of those of the last `place` that move in its time.
  const std::vector<PlacedBox>& moving() const { return moving_; }
  /// The first time after `time` that a step has to land on, at most `end`, s: where a deforming
  /// mesh changes its level sets.
  double stop(double time, double end);
  /// The longest step from `time` on in which no surface moves farther than 0.4 spacings, at most
  /// dt, s.
  double limit(double time, double dt);
  /// The nearest obstacle at `time` and the signed distance to it, m; 1e30 and -1 where none is
  /// near. World.
  struct Nearest {
    double distance = 1e30;
    int obstacle = -1;
  };
  Nearest nearest(const V3d& point, double time);
  double distance(const V3d& point, double time) { return nearest(point, time).distance; }
  double distance_to(int obstacle, const V3d& point, double time);
  /// Whether an obstacle moves by keys or deforms, and whether any does.
  bool moves(int obstacle) const;
  bool deforms(int obstacle) const { return obstacle_[size_t(obstacle)].deforms; }
  /// Corners of a triangle of a mesh at a film frame, own coordinates, m.
  std::array<V3d, 3> triangle_at(int obstacle, size_t triangle, double frame);
  bool any_moves() const;
  const Obstacle& obstacle(int k) const { return obstacle_[size_t(k)].obstacle; }
  /// Bounds of an obstacle in its own coordinates, m; of a sequence as of the first frame.
  const V3d& low(int k) const { return obstacle_[size_t(k)].low; }
  const V3d& high(int k) const { return obstacle_[size_t(k)].high; }
  /// Of meshes: triangles, and the bytes of the level sets that have been made.
  size_t triangles() const;
  size_t triangles(int obstacle) const {
    return obstacle_[size_t(obstacle)].before.triangle.size();
  }
  size_t level_set_bytes() const;
  /// The largest speed of a surface by its keys, m/s: what a shot is to be ready for.
  double fastest() const;

 private:
  /// Level sets of a deforming mesh at two times between which its vertices move by less than a
  /// spacing, both in its own frame; of a rigid one there is the first only.
  struct Bracket {
    double begin = 0, end = 0;  // film frames
    LevelSet set[2];
    double travel = 0;  // m, farthest vertex
    bool loaded = false;
  };
  struct Entry {
    Obstacle obstacle;
    bool deforms = false;
    V3d low{0}, high{0};         // own coordinates; of a sequence as of the bracket
    TriangleMesh before, after;  // of a sequence: frame mesh_frame and the next
    std::optional<int> mesh_frame;
    std::optional<Bracket> bracket;
    SequenceShape shape;
  };

  double film_frame(double time) const { return shot_.timeline.first + time * shot_.timeline.fps; }
  void read_meshes(Entry& entry, int frame);
  const Bracket& bracket_at(Entry& entry, double frame);
  LevelSet level_set(const Entry& entry, const TriangleMesh& mesh) const;
  double travel(Entry& entry, double begin, double end);
  ObstaclePlacement placement(Entry& entry, double begin, double end);
  /// A box that stands on a wall, or before it by less than half a spacing, goes on behind it: with
  /// an edge there it would leave some of the corner to the wall, and push along it.
  void extend_behind_walls(const Obstacle& box, double begin, double end,
                           ObstaclePlacement& placement) const;
  V3d extent(const Entry& entry, const ObstaclePlacement& placement) const;

  Solids role_ = Solids::obstacles;
  std::vector<Window> window_;  // of sinks
  Shot shot_;
  V3d origin_{0};
  double snap_ = 1;  // m
  LevelSetMaker make_level_set_;
  std::vector<Entry> obstacle_;
  std::vector<PlacedBox> moving_;
  ObstacleImages images_;
};

/// The sinks of a shot. @throws Error as ObstacleSet.
ObstacleSet sinks_of(const Shot& shot, const LocalFrame& frame, LevelSetMaker make_level_set);

}  // namespace drench::sim

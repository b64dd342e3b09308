#pragma once
// Closed meshes that are kept full of fluid.

#include <string>
#include <vector>

#include "sim/setup/mesh_interior.h"
#include "sim/solver.h"

namespace drench::sim {

struct Scene;

/// A place that an emitter may fill, m world, and the velocity of its particle, m/s.
struct NewParticle {
  V3d position, velocity;
};

/// An emitter of type mesh, standing or moving as its keys say: places of the lattice that begins
/// at domain.min, within the mesh and the domain, are filled as soon as they are free.
class MeshEmitter {
 public:
  /// @param index  of shot.fluid.emitter. @throws Error if the mesh cannot be read, is not closed,
  /// would hold more particles than a shot may have, or has no place within the domain at any film
  /// frame of its time.
  MeshEmitter(const Shot& shot, size_t index, const LevelSetMaker& make_level_set);

  size_t index() const { return index_; }
  /// @param time  s since the first frame.
  bool active(double time) const { return time >= start_ && time < stop_; }
  /// Places from which the nearest particle is farther than 0.9 spacings.
  /// @param position  of the particles, m local.
  std::vector<NewParticle> missing(const Scene& scene, const HostVec& position, double time);
  /// By its keys: the largest speed of new fluid, m/s, and the corners of the mesh's bounds, m.
  double fastest() const;
  std::vector<V3d> corners() const;
  /// Places within the mesh and the domain at a time, m world, whatever is there.
  std::vector<V3d> places(double time);
  bool moves() const;

 private:
  double film_frame(double time) const { return shot_.timeline.first + time * shot_.timeline.fps; }
  void add_corners(double frame, std::vector<V3d>& all) const;
  const std::vector<Cell>& cells_at(double frame);
  V3d carried(const V3d& place, double frame) const;

  Shot shot_;
  size_t index_;
  double start_, stop_;  // s since the first frame
  Obstacle frame_;       // where the mesh is
  MeshInterior interior_;
  std::vector<Cell> cells_;  // of the pose that was asked for last
  double cells_frame_ = 0;   // film frame of it
  bool known_ = false;
};

std::vector<MeshEmitter> mesh_emitters(const Shot& shot, const LevelSetMaker& make_level_set);

}  // namespace drench::sim

#pragma once
// From a shot to the initial state: parameters, particles, sheets.

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "pipeline/contract/frames.h"
#include "pipeline/contract/shot/shot.h"
#include "sim/setup/births.h"
#include "sim/setup/cloth_pins.h"
#include "sim/setup/frame_motion.h"
#include "sim/setup/mesh_emitter.h"
#include "sim/setup/obstacles.h"
#include "sim/setup/scene_report.h"
#include "sim/setup/sewing.h"
#include "sim/setup/sheet_rest.h"
#include "sim/setup/wind.h"
#include "sim/solver.h"

namespace drench::sim {

/// Local coordinates of the simulation: origin on the particle lattice, points snapped to 2^-16
/// spacings, so that a shot moved by whole lattice steps gives the same bits.
struct LocalFrame {
  double origin[3];
  double spacing;

  /// Not inlined: within differences g++ 12 may leave the rounding to float out, and a sheet would
  /// have other rest lengths than the distances of its vertices.
  [[gnu::noinline]] float to_local(int axis, double world) const;
  double to_world(int axis, float local) const { return origin[axis] + double(local); }
};

/// Periodic axes as sheets meet them, m.
struct Seams {
  V3d period{0, 0, 0};   // 0 where an axis is not periodic
  double tolerance = 0;  // within which two vertices are images of one another
  double least_gap = 0;  // of edges that are not
};
Seams seams_of(const Shot& shot);

/// One sheet as its builder leaves it, world coordinates. Vertices are those that are drawn; the
/// mass points of the simulation are the nodes: the same, but that vertices which are split at a
/// seam of the texture share one, and that a sheet which spans a periodic axis has one line of
/// nodes for its two edges there.
struct Sheet {
  std::string name;
  std::vector<V3d> position, rest;
  std::vector<Imath::V2f> uv;
  std::vector<Imath::Vec3<uint32_t>> triangle;
  std::vector<uint32_t> welded;   // of a vertex: the first one at its point of the sheet
  std::vector<int> of_file;       // of a vertex of its mesh file: the vertex here, -1: left out
  std::vector<int> node;          // of a vertex
  std::vector<Imath::V3i> image;  // periods from its node to a vertex
  std::vector<uint32_t> point;    // of a node: the vertex that stands where it does
  V3d period{0, 0, 0};            // m
  std::vector<double> mass;       // kg, of a node
  std::vector<bool> pinned;       // nodes that do not move freely from the start
  std::vector<bool> held;         // of these, that no pin ever lets go
  std::vector<std::vector<int>> group;  // nodes of each pin, rising
  struct Spring {
    int a, b;          // nodes
    Imath::V3i image;  // periods from b to the end that a sees
    double stiffness;  // N/m
  };
  std::vector<Spring> spring;

  /// Whether it is joined to itself across a periodic axis.
  bool joined() const {
    return std::any_of(image.begin(), image.end(),
                       [](const Imath::V3i& i) { return i != Imath::V3i(0); });
  }
  /// Whether several vertices of its mesh file are one point of it.
  bool is_sewn() const {
    for (uint32_t v = 0; v < welded.size(); ++v)
      if (welded[v] != v) return true;
    return false;
  }
  V3d along(const Spring& s) const {  // m, from a to b
    return position[point[size_t(s.b)]] + V3d(s.image) * period - position[point[size_t(s.a)]];
  }
};

/// Finds the nodes of a sheet of vertices and triangles: vertices that are welded share one, and so
/// do vertices on free edges that are images of one another across a seam. @throws Error if edges
/// nearly meet at a seam, or meet with fewer than three cells around.
void join_at_seams(Sheet& sheet, const Seams& seams);

/// Grid or mesh file, checked. Vertices of a file that no triangle uses are left out with a
/// warning, and those on free edges within cloth.weld are joined, with another.
/// @throws Error for a degenerate or non-manifold triangle, a pin that holds nothing, or as
///         join_at_seams.
Sheet build_sheet(const Cloth& cloth, const Seams& seams = {});

/// Nodes of an edge of a grid, or of a list of vertices as the shot numbers them.
/// @param key  "seam 1", for errors. @throws Error if a vertex of the list is not there.
std::vector<int> nodes_of_seam(const Cloth& cloth, const Sheet& sheet, const std::string& key,
                               GridEdge edge, const std::vector<uint32_t>& list);

/// What leaves a disc or rectangle at once, again and again. A layer holds the volume that passes
/// the inlet in one interval, so that the flow is area times speed. Its places are a spacing apart
/// and cover the inlet or a little more; layers are a spacing apart or more by as much: never
/// denser than at rest, which would push the next layers back into the inlet.
struct EmitterLayer {
  std::vector<std::array<double, 2>> place;  // m, in the plane of the inlet, about its centre
  double interval;                           // s from layer to layer
};
EmitterLayer emitter_layer(const FluidEmitter& emitter, double spacing);

/// An inlet at a film frame: the axes of its plane, and the velocity of what leaves it, m/s.
struct Inlet {
  V3d center, axis[2], velocity;

  /// A place of its layer, world.
  V3d at(const std::array<double, 2>& place) const {
    return center + axis[0] * place[0] + axis[1] * place[1];
  }
  /// Unit, the way of what leaves; 0 if it does not move.
  V3d along() const {
    const double speed = velocity.length();
    return speed > 0 ? velocity / speed : V3d(0);
  }
};
Inlet inlet_at(const FluidEmitter& emitter, const Timeline& time, double frame);

struct FilledVolume {
  std::vector<V3d> place;  // m, world
  double volume = 0;       // m^3, of the mesh; 0: not known (MeshInterior::volume)
};
/// Places in a closed mesh on the lattice that begins at domain.min.
/// @param name  of the volume, for errors. @throws Error if the mesh cannot be read, is not closed,
/// holds no particle or more than a shot may have, or reaches beyond the domain's walls.
FilledVolume fill_volume(const Shot& shot, const FluidVolume& volume, const std::string& name,
                         const LevelSetMaker& make_level_set);

/// Particles of the sources that are there at the start: boxes, spheres, drops, then volumes, each
/// in the order of the shot. A later source loses those closer than 0.9 spacings to an earlier one,
/// across the seams of periodic axes too: no place within a lattice is farther than 0.866 spacings
/// from it, so that nothing is filled twice.
struct InitialFluid {
  std::vector<V3d> position, velocity;
  std::vector<int> source;           // as in Birth
  size_t overlapping = 0;            // particles that later sources lost
  std::vector<SourceReport> report;  // of each source; what obstacles take is not known yet
};
/// @param make_level_set  needed for volumes. @throws Error as fill_volume, or if a source loses
/// all.
InitialFluid initial_fluid(const Shot& shot, const LevelSetMaker& make_level_set = {});

/// Everything a Simulator starts from.
struct Scene {
  LocalFrame frame;
  Parameters parameters;
  std::vector<Sheet> sheet;
  std::vector<int> first_vertex, first_triangle;  // of each sheet, and one past the end
  ClothTopology cloth;
  ObstacleSet obstacles, sinks;
  std::vector<MeshEmitter> mesh_emitter;
  ClothPins pins;
  Sewing sewing;
  Wind wind;
  FrameMotion motion;
  SheetRest rest;
  HostState start;
  Births births;                                 // of the start
  size_t inside_obstacles = 0, overlapping = 0;  // particles of sources that were left out
  SceneReport report;

  /// Gravity and what is carried at a time, s, for stable_step.
  void set_drive(double time);
  /// One coordinate of a particle, m local, inside the domain where an axis is periodic.
  float place(int axis, double world) const;
};

/// The obstacle because of which no fluid may start at a point: within it or nearer to it than half
/// a spacing, which is what a lattice has to a wall; -1: none.
int obstacle_in_the_way(ObstacleSet& obstacles, const V3d& point, double time, double spacing);
inline bool clear_of_obstacles(ObstacleSet& obstacles, const V3d& point, double time,
                               double spacing) {
  return obstacle_in_the_way(obstacles, point, time, spacing) < 0;
}

/// @param make_level_set  see ObstacleSet.
/// @throws Error as build_sheet, ObstacleSet and MeshEmitter, if nothing is to be simulated, if
/// fluid starts inside cloth, if all of a source is lost, or if an emitter can never send a
/// particle.
Scene build_scene(const Shot& shot, const LevelSetMaker& make_level_set = {});

}  // namespace drench::sim

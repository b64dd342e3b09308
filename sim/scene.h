#pragma once
// From a shot to the initial state: parameters, particles, sheets.

#include <random>
#include <string>
#include <vector>

#include "pipeline/contract/frames.h"
#include "pipeline/contract/shot.h"
#include "sim/obstacles.h"
#include "sim/solver.h"

namespace drench::sim {

/// Local coordinates of the simulation: origin on the particle lattice, points snapped to 2^-16
/// spacings, so that a shot moved by whole lattice steps gives the same bits.
struct LocalFrame {
  double origin[3];
  double spacing;

  float to_local(int axis, double world) const;
  double to_world(int axis, float local) const { return origin[axis] + double(local); }
};

/// One sheet as its builder leaves it, world coordinates.
struct Sheet {
  std::string name;
  std::vector<V3d> position, rest;
  std::vector<Imath::V2f> uv;
  std::vector<Imath::Vec3<uint32_t>> triangle;
  std::vector<double> mass;  // kg
  std::vector<bool> pinned;
  struct Spring {
    int a, b;
    double stiffness;  // N/m
  };
  std::vector<Spring> spring;
};

/// Grid or mesh file, checked. @throws Error for a degenerate or non-manifold triangle, an unused
/// vertex, or a pin that holds nothing.
Sheet build_sheet(const Cloth& cloth);

/// A disc of particles that leaves an emitter every spacing / speed seconds.
struct EmitterLayer {
  std::vector<V3d> offset;  // from the centre, m
};
EmitterLayer emitter_layer(const FluidEmitter& emitter, double spacing);

/// Particles of the sources that are there at the start; later sources lose those closer than half
/// a spacing to earlier ones, across the seams of periodic axes too.
struct InitialFluid {
  std::vector<V3d> position, velocity;
};
InitialFluid initial_fluid(const Shot& shot);

/// Everything a Simulator starts from.
struct Scene {
  LocalFrame frame;
  Parameters parameters;
  std::vector<Sheet> sheet;
  std::vector<int> first_vertex, first_triangle;  // of each sheet, and one past the end
  ClothTopology cloth;
  ObstacleSet obstacles;
  HostState start;
  size_t inside_obstacles = 0;  // particles of sources that were left out

  /// One coordinate of a particle, m local, inside the domain where an axis is periodic.
  float place(int axis, double world) const;
};

/// Whether fluid may start at a point: not within an obstacle or nearer to one than half a spacing,
/// which is what a lattice has to a wall.
bool clear_of_obstacles(ObstacleSet& obstacles, const V3d& point, double time, double spacing);

/// @param make_level_set  see ObstacleSet.
/// @throws Error as build_sheet and ObstacleSet, if nothing is to be simulated, or if fluid starts
/// inside cloth.
Scene build_scene(const Shot& shot, const LevelSetMaker& make_level_set = {});

}  // namespace drench::sim

#pragma once
// Scenes with obstacles and what is measured in them, outside the solver and in double.

#include <filesystem>
#include <functional>

#include "pipeline/contract/geometry/level_set.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {

Obstacle& add_obstacle(Shot& shot, ObstacleType type, V3d position);
void add_plane(Shot& shot, V3d point, V3d normal);
void add_sphere(Shot& shot, V3d centre, double radius);

/// Water 8 x `layers` x 8 particles that fills a walled tank of 8 x 2 layers x 8 from below.
Shot tank_shot(int layers);

/// Signed distance by the shape's definition, m; negative inside.
double exact_distance(const Obstacle& obstacle, double frame, const V3d& world);
/// Particles inside any obstacle or beyond a wall at `time`.
int particles_inside(const Shot& shot, Stepper& run);

struct Settled {
  V3d centre{0};             // of mass, in the tank's frame, spacings
  double kinetic = 0;        // energy over rho g h volume
  double density_error = 0;  // mean |rho / rho_0 - 1| a support below the surface
  int outside = 0;
};
Settled settle_in_tilted_gravity(double degrees, double seconds);
Settled settle_in_tilted_tank(double degrees, double seconds);

struct Lift {
  double error = 0;     // of the mean vertical force over the displaced weight
  double sideways = 0;  // of the mean horizontal one over it
};
/// A body of this radius or half edge, in spacings, held in the middle of a pool.
Lift lift_of(ObstacleType type, double spacings);

/// A bar along the periodic z axis, 6 cm across, held in a pool between walls 12 cm apart.
struct BarForce {
  double error = 0;     // of the mean vertical force over the displaced weight
  double sideways = 0;  // of the mean force along x over it
  double along = 0;     // the same along z
};
/// @param bar  its position is set here. @param section  m^2. @param across  spacings in 6 cm; the
/// period is six spacings.
BarForce lift_of_bar(Obstacle bar, double section, int across,
                     const LevelSetMaker& make_level_set = {});

/// Distances of a cylinder along z that has no ends, by its definition.
LevelSet cylinder(double radius, double voxel, double band);
/// A box around a part of it: what the file of a mesh is read for where these stand for it.
std::filesystem::path bounding_mesh(double radius, double half_width);

}  // namespace drench::sim_tests

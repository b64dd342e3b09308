#pragma once
// Shapes with a closed form, filled with relaxed particles: what a surface is measured against.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/contract/frames.h"

namespace drench::surfacing_scenes {

/// A body in spacings, about the origin.
struct Shape {
  std::string name;
  double volume = 0;                           // exact, and so the number of particles
  Imath::V3d half;                             // it lies within
  std::function<double(Imath::V3d)> distance;  // to the surface, positive outside
  std::function<bool(Imath::V3d)> counts;      // no edge or crease within three spacings

  size_t particles() const { return static_cast<size_t>(volume + 0.5); }
};

Shape ball(double n);
Shape torus(double n);  // its tube has 0.4 of its radius
Shape touching_balls(double n);
Shape jet(double n);        // a cylinder with round ends, eight radii long between them
Shape wavy_slab(double n);  // a box with waves on top, 1.5 spacings high and 30 long
std::vector<Shape> all_shapes(double n);

/// shape.particles() particles: the lattice points deepest inside, shaken by a quarter of a spacing
/// and pushed apart by `steps` of short-range repulsion inside a wall that, as the walls of a shot,
/// stands half a spacing outside the outermost centres. Velocity: one turn of 1 rad/s about Y.
ParticleFrame relaxed(const Shape& shape, double spacing, int steps, uint32_t seed);

/// Radius of the ball that n particles fill, m: n spacing^3 = 4/3 pi R^3.
double ball_radius(size_t n, double spacing);
ParticleFrame relaxed_ball(size_t n, double spacing, int steps, uint32_t seed);

/// Of a mesh's vertices against a shape, where it counts; lengths in spacings, angles in degrees.
struct ShapeError {
  double bias = 0, scatter = 0, max = 0;  // of the signed distance
  double volume = 0;                      // relative
  double normal_mean = 0, normal_max = 0;
};
ShapeError shape_error(const TriangleMesh& mesh, const Shape& shape, double spacing);

}  // namespace drench::surfacing_scenes

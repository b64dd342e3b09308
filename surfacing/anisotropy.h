#pragma once
// Kernels of particles in thin films and threads: ellipsoids that follow them.
//
// After Yu and Turk 2013: axes from the weighted covariance of the neighbours, centres moved
// towards their mean, kernels normalised by the determinant, none squeezed to less than a quarter.
// Widths and weights are not the paper's. They are those at which a plane and a line of particles
// have the surface that their volume asks for (squeeze_film, squeeze_thread), so that nothing is
// fitted to a scene.
//
// Only what misses neighbours on two sides is squeezed: at the surface of a body round kernels
// scatter less (docs/decisions/0200-round-kernels-at-bodies.md).

#include <vector>

#include "surfacing/field.h"
#include "surfacing/marching_cubes.h"

namespace drench::surfacing {

/// Thickness of a film whose particles see the unweighted colour c, spacings, at most 1.
///
/// A plane of particles with the volume T a unit area has c = T s support^2 P(0), where P(t) is the
/// integral of W over a plane at t supports: P(0) = 7 pi / 40, c = 7 T / (5 support).
float film_thickness(float c, float support);

/// Radius of a thread likewise, at most that of a lattice's row: pi R^2 the volume a unit length,
/// c = pi R^2 s support Q(0), Q(t) the integral of W over a line at t supports: Q(0) = 3 / 4,
/// c = 6 R^2 / support^2.
float thread_radius(float c, float support);

/// A squeezed kernel: its short half axis and the weight of its particles.
struct Squeeze {
  float half_axis;  // spacings
  float weight;
  float size;  // spacings: half the thickness or the radius that the field shows
};

/// For a film of thickness T. Squeezed to a half axis b, a plane of particles has
///   c(z) = weight T 8 / pi P(z / b) / b.
/// Of the b and weights that put the iso value at z = T / 2 the one taken has there the inflection
/// of P, t = 0.3065 (18 t^2 - 24 t^3 = 1): the field is straight where the surface crosses it, and
/// its position on the edges of the lattice right to second order. So b = T / (2 t), and
/// weight = pi / (16 t P(t)) iso.
///
/// The field shows no less than 2.2 voxels, and the mesh is drawn in by the difference
/// (`draw_in`): |n|_1 <= sqrt(3) voxels are what lattice points of a plane with any normal n need
/// to hang together by their edges; the rest is for unevenness.
/// Shown thicker, the weight grows in proportion.
Squeeze squeeze_film(float thickness, float voxel, const ColourKernel& kernel);

/// For a thread of radius R likewise: c(r) = 8 weight R^2 Q(r / b) / b^2, inflection of Q at
/// t = 0.3181, b = R / t, weight = iso / (8 t^2 Q(t)); no thinner than a radius of 1.2 voxels.
Squeeze squeeze_thread(float radius, float voxel, const ColourKernel& kernel);

/// How much a particle is in a film and in a thread, from 0 to 1, together at most 1.
struct Thinness {
  float film = 0, thread = 0;
};

/// @param variance  of the positions of the neighbours and the particle itself, weighted by 1 -
/// q^2,
///                  supports^2, falling: a plane has 1/6, 1/6, 0, its rim 1/6, 0.05, 0, a line 1/5,
///                  0, 0, the surface of a body 1/7, 1/7, 0.05 and more.
/// @param count     sum of these weights. A line stretched to 1.5 spacings has 2.3, a plane 4.7, a
///                  pair less than 2; it decides when a film has torn into drops.
Thinness thinness(const V3f& variance, float count);

struct FoundEllipsoid {
  uint32_t particle;
  Ellipsoid shape;
};

/// Adds the ellipsoids of those of the `wanted` particles of one block whose neighbours form a
/// film or a thread. Those halfway have an ellipsoid and a weight between.
/// @param weight  of the particles with round kernels
/// @param near    what lies in reach of the block
void add_ellipsoids(const BinnedParticles& particles, const std::vector<float>& weight,
                    const ColourKernel& kernel, const NearParticles& near,
                    const std::vector<uint32_t>& wanted, std::vector<FoundEllipsoid>& found);

/// Those of all blocks, by particle.
Ellipsoids collected(const std::vector<std::vector<FoundEllipsoid>>& by_block, size_t particles);

/// Adds an ellipsoid to every row of the block that it reaches. p, the particle, in supports from
/// lattice point 0; step, a voxel in supports.
void splat_ellipsoid(V3f p, const Ellipsoid& shape, float scale, float step, BlockValues& value);

/// Draws the surface in from the thickness that the field shows to that of the fluid. A vertex v
/// moves by the mean of -pull (A A - 1) (v - centre) over the particles within two spacings,
/// weighted by (1 - q^2)^2, those with round kernels among them: towards the middle of its film or
/// thread in proportion to the distance from it, so that sides do not meet and rims stay.
void draw_in(LatticeMesh& mesh, const BinnedParticles& particles);

}  // namespace drench::surfacing

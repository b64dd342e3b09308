#pragma once
// Lamps seen through calm water: the path from a diffuse surface through one smooth interface to a
// point of a lamp is found by walking there. A ray is aimed, the interface bends it, and Newton's
// method mends its direction by how its point on the lamp moves (Hanika, Droske and
// Fascione 2015, "Manifold Next Event Estimation"; the derivatives are those of a ray's
// differentials, Igehy 1999).
//
// A walk ends on one path of several, or on none. It says nothing of the others, so photons leave
// out those that a walk from where they lie would find, one by one, and bring all else.

#include <optional>

#include "render/scene/scene.h"

namespace drench::render {

/// A path from a surface through an interface to a point of a lamp.
struct RefractedPath {
  V3f direction;       // unit, from the surface to the interface
  V3f transmittance;   // of the lamp's radiance that comes along it
  float density = 0;   // sr per m^2 of the lamp's plane, or per sr of a sun
  Ray beyond;          // from the interface on,
  float distance = 0;  // m, to the lamp; infinity for a sun
  // How the point on the lamp's plane moves with the direction, m or, of a sun, the direction that
  // is seen: of each of its two components the gradient, to be taken across the direction.
  V3f slope[2];
};

/// The path that a walk ends on, if there is one. What stands between interface and lamp is not
/// looked for.
/// @param in    bodies on the side of the surface that the lamp is on
/// @param rays  counts rays traced
std::optional<RefractedPath> manifold_walk(const Scene& scene, const Surface& surface, float time,
                                           Bodies in, const LampPoint& lamp, uint64_t& rays);

struct ManifoldSample {
  V3f direction;  // unit, that it comes from
  V3f radiance;   // W/(sr m^2), over the density with which the walk finds it, per sr
};

/// Light of a lamp that is drawn, if a walk finds a path to it and nothing stands in it.
/// @param ray      on which the surface is looked at
/// @param in       bodies that it comes through
/// @param u_light  draws the lamp, `u` its point
std::optional<ManifoldSample> sample_manifold(const Scene& scene, const Surface& surface,
                                              const Ray& ray, Bodies in, float u_light,
                                              const V2f& u, uint64_t& rays);

/// Whether a walk finds the path by which a photon of the lamp came through one interface.
bool manifold_walk_finds(const Scene& scene, const Surface& surface, float time, Bodies in,
                         const LampPoint& lamp, const V3f& flight, uint64_t& rays);

}  // namespace drench::render

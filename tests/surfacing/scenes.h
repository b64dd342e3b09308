#pragma once
// Particle scenes with a known surface, for the tests and the bench of surfacing.

#include <cstdint>

#include "tests/surfacing/shapes.h"

namespace drench::surfacing_scenes {

/// Two balls of n particles each whose walls stand `gap` spacings apart along X.
ParticleFrame two_balls(size_t n, double spacing, int steps, double gap);

/// A lattice of cells.x * cells.y * cells.z particles, the lowest at half a spacing from `corner`,
/// each shaken evenly by up to `shake` spacings along each axis.
ParticleFrame shaken_box(Imath::V3f corner, Imath::V3i cells, double spacing, double shake,
                         uint32_t seed);

/// n particles drawn evenly in a cube with `per_cell` of them per spacing^3 on average.
ParticleFrame random_cloud(size_t n, double per_cell, double spacing, uint32_t seed);

/// count single particles on a lattice of 6 spacings, each off its point by up to half a spacing.
ParticleFrame lone_particles(size_t count, double spacing, uint32_t seed);

/// cells.x * cells.y particles in the plane Z = 0, `stretch` spacings apart, off it by up to
/// `shake`.
ParticleFrame sheet(Imath::V2i cells, double stretch, double spacing, double shake, uint32_t seed);

/// The frame turned about an axis askew to the lattice, positions alone; angle in rad.
ParticleFrame askew(ParticleFrame frame, double angle);

/// About n particles: a pool with waves, a crown one particle thick and drops of 1 to 30 particles.
/// Velocities differ from particle to particle.
ParticleFrame splash(size_t n, double spacing, uint32_t seed);

/// Puts the particles in another order, drawn from the seed.
void shuffle(ParticleFrame& frame, uint32_t seed);

/// Appends the particles of one frame to another of the same spacing.
void append(ParticleFrame& frame, const ParticleFrame& more);

}  // namespace drench::surfacing_scenes

#pragma once
// The fluid between two cached frames, sorted so that foam finds what is around it.

#include "pipeline/contract/frames.h"
#include "pipeline/contract/shot/shot.h"
#include "surfacing/particle_bins.h"

namespace drench::surfacing {

/// How far foam and fluid see the fluid, in spacings: a neighbourhood deep inside has 33 particles.
inline constexpr float foam_support = 2;
inline constexpr float foam_voxels_per_spacing = 2;
inline constexpr float foam_reach = foam_support * foam_voxels_per_spacing;  // voxels

/// Paths of the particles of a frame since the frame before: cubics through both positions with
/// both velocities. Who is not in the frame before comes in a straight line.
class FluidMotion {
 public:
  /// @param dt  s between the frames. Particles are told apart by their ids.
  FluidMotion(const ParticleFrame& before, const ParticleFrame& after, const Domain& domain,
              float dt);

  size_t size() const { return position_.size(); }
  /// At fraction s of the time between the frames, 0 to 1; m, not wrapped, and m/s.
  V3f position(size_t i, float s) const;
  V3f velocity(size_t i, float s) const;
  float largest_speed() const { return largest_speed_; }

 private:
  std::vector<V3f> position_, displacement_;    // m: at the end, and from the frame before to it
  std::vector<V3f> start_velocity_, velocity_;  // m/s
  float dt_ = 0, largest_speed_ = 0;
};

/// The fluid at one moment with its images beyond the domain: mirrored at walls, as the simulator
/// has them, and repeated along periodic axes.
struct FluidMoment {
  BinnedParticles bins;       // `source` is an index of the columns below
  std::vector<V3f> velocity;  // m/s; first all particles, then the images
  size_t real = 0;            // particles that are no images
};

/// @param points  where the fluid will be asked for, m; they may lie anywhere.
/// @throws Error if fluid and points are spread too far to be sorted.
FluidMoment fluid_at(const FluidMotion& motion, float s, const Domain& domain, float spacing,
                     const std::vector<V3f>& points);

/// What is around a point.
struct Around {
  uint32_t count = 0;     // particles nearer than foam_support
  V3f velocity{0, 0, 0};  // m/s, their mean; 0 if there are none
};
std::vector<Around> fluid_around(const FluidMoment& fluid, const std::vector<V3f>& points);

/// Columns of a block's neighbourhood: NearParticles and, relative to `base`, velocities.
struct NearFluid {
  NearParticles near;
  std::vector<float> u, v, w;  // m/s, padded with zeros
  V3f base{0, 0, 0};

  void gather(const FluidMoment& fluid, V3i block);
};

/// Where the periodic axes of a domain bring a position back to.
V3f wrapped(V3f position, const Domain& domain);

}  // namespace drench::surfacing

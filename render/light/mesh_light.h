#pragma once
// An object that shines: all its faces as one light.

#include <cstdint>
#include <span>
#include <vector>

#include "render/light/environment.h"
#include "render/light/light_sample.h"
#include "render/light/light_tree.h"

namespace drench::render {

/// Faces that shine from their outer side. Points of them are drawn by area; as the radiance is
/// one, by power too.
class MeshLight {
 public:
  struct Faces {
    std::span<const Imath::Vec3<uint32_t>> triangle;
    std::vector<const V3f*> position;  // m, at even times of the shutter; one if it stands still
  };

  /// @param faces  outlives the light
  MeshLight(const Faces& faces, const V3f& radiance);

  const V3f& radiance() const { return radiance_; }  // W/(sr m^2)
  /// A sphere around it over the shutter, m.
  const V3f& center() const { return center_; }
  float radius() const { return radius_; }

  /// @param time  of the shutter, 0..1
  LightSample sample(const V3f& from, float time, const V2f& u) const;
  /// Density of `sample` for a direction that meets the outer side of a triangle at `distance`;
  /// `facing` is the cosine there.
  float pdf(uint32_t triangle, float time, float distance, float facing) const;
  /// Irradiance it could cause at `from`, roughly: its weight in the draw. Never 0.
  float importance(const V3f& from) const;
  LightTree::Light extent() const;

 private:
  struct Corners {
    V3f a, b, c;
  };
  Corners corners(uint32_t triangle, float time) const;

  Faces faces_;
  V3f radiance_, center_;
  float radius_ = 0;
  float power_ = 0;  // luminance x area / 4, the mean over directions of what a convex one shows
  AliasTable by_area_;
};

}  // namespace drench::render

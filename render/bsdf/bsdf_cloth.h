#pragma once
// Thin two-sided cloth: Lambertian reflection and Lambertian transmission. Without transmission it
// is the diffuse ground.

#include "render/bsdf/bsdf.h"
#include "render/packed.h"
#include "render/sampling.h"

namespace drench::render {

/// Of photons, on the side that is looked at and on the other, W/m^2.
struct Irradiance {
  V3f front{0, 0, 0}, back{0, 0, 0};

  void add(const Irradiance& other, float factor) {
    front += other.front * factor;
    back += other.back * factor;
  }
};

class ClothBsdf {
 public:
  enum class Sides { real, smooth };  // which normal light must be in front of

  /// @param outgoing  unit, away from the surface towards where the path came from
  /// Normals are unit and of the same hemisphere.
  ClothBsdf(const V3f& outgoing, const V3f& geometric, const V3f& shading, const V3f& reflectance,
            const V3f& transmittance, Sides sides = Sides::real)
      : reflectance_(reflectance), transmittance_(transmittance) {
    // A sheet has nothing within that light must be kept from: its sides are those of the smooth
    // normal, or flat triangles would show as a chequer where light grazes them.
    const V3f& real = is_black(transmittance) ? geometric : shading;
    const float side = dot(outgoing, real) < 0 ? -1.f : 1.f;
    geometric_ = (Packed::load(sides == Sides::smooth ? shading : real) * side).unpacked();
    shading_ = (Packed::load(shading) * side).unpacked();
    const float r = largest(reflectance), t = largest(transmittance);
    reflect_probability_ = r + t > 0 ? r / (r + t) : 1;
  }

  V3f albedo() const { return reflectance_ + transmittance_; }
  bool black() const { return is_black(reflectance_) && is_black(transmittance_); }

  /// Value x |cos| for an incoming direction, and the density of `sample` for it.
  V3f value(const V3f& incoming, float& pdf) const {
    const float side = dot(incoming, geometric_) > 0 ? 1.f : -1.f;
    const float cos = dot(incoming, shading_) * side;
    pdf = 0;
    if (!(cos > 0)) return V3f(0);
    const float density = cos / pi;
    pdf = density * (side > 0 ? reflect_probability_ : 1 - reflect_probability_);
    return (side > 0 ? reflectance_ : transmittance_) * density;
  }

  /// Unit, to the side that `Irradiance::front` is on.
  const V3f& front() const { return geometric_; }
  /// Adds light on the real surface from the direction `incoming`.
  void receive(Irradiance& light, const V3f& incoming, const V3f& power) const {
    (dot(incoming, geometric_) > 0 ? light.front : light.back) += power;
  }
  /// Radiance that leaves for it.
  V3f radiance(const Irradiance& light) const {
    return (reflectance_ * light.front + transmittance_ * light.back) * (1 / pi);
  }

  /// One number says both the side and a direction on it: a number of its own for the side would
  /// leave either side a random part of a pixel's even set of directions.
  Scatter sample(const V2f& u) const {
    Scatter out;
    const bool reflect = u.x < reflect_probability_;
    const float side = reflect ? 1.f : -1.f;
    const float probability = reflect ? reflect_probability_ : 1 - reflect_probability_;
    const float x = (u.x - (reflect ? 0 : reflect_probability_)) / probability;
    out.direction =
        Basis(shading_ * side).world(sample_cosine({std::min(x, one_minus_epsilon), u.y}));
    const float cos = dot(out.direction, shading_) * side;
    // The smooth hemisphere reaches a little through the real surface: nothing comes from there.
    if (!(cos > 0) || !(dot(out.direction, geometric_) * side > 0)) return out;
    out.pdf = cos / pi * probability;
    const V3f& albedo = reflect ? reflectance_ : transmittance_;
    out.weight = albedo * (1 / probability);
    return out;
  }

 private:
  V3f geometric_;  // of the normal that divides the sides
  V3f shading_, reflectance_, transmittance_;
  float reflect_probability_ = 1;
};

}  // namespace drench::render

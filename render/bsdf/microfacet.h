#pragma once
// Rough surfaces as mirrors too small to see: normals of the GGX distribution (Walter et al. 2007)
// with Smith's masking, of both directions together (Heitz 2014, "Understanding the
// Masking-Shadowing Function"). Directions are in a frame whose z is the surface's normal; o is the
// one light leaves by, with z > 0. Terms are grouped so that none is divided by a cosine.

#include <limits>

#include "render/bsdf/bsdf.h"
#include "render/sampling.h"

namespace drench::render {

struct Ggx {
  float alpha = 0;  // root mean square slope, roughly; 0: a plane, with one normal

  /// Length of a direction with its horizontal part shrunk by alpha: 1 + 2 Lambda = this / |z|.
  float stretch(const V3f& w) const {
    return std::sqrt(alpha * alpha * (w.x * w.x + w.y * w.y) + w.z * w.z);
  }

  /// Normals per steradian and area.
  float density(const V3f& h) const {
    const float a2 = alpha * alpha, r = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    return 1 / (pi * a2 * r * r);
  }

  /// G / (|o.z| |i.z|), G = 1 / (1 + Lambda(o) + Lambda(i)); i on either side. For refraction too,
  /// where Smith's model has a beta function with the same slope at no masking: what the two differ
  /// by is made up for, as all loss to further facets is (`AlbedoTable`).
  float masking(const V3f& o, const V3f& i) const {
    return 2 / (stretch(o) * std::abs(i.z) + stretch(i) * o.z);
  }

  /// A normal seen from o. Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
  /// Caps". @param bound  1: any; `reflection_bound`: hardly any that mirrors o below the horizon
  V3f sample_normal(const V3f& o, const V2f& u, float bound) const {
    const V3f towards = normalized(V3f(alpha * o.x, alpha * o.y, o.z));
    const float lowest = -bound * towards.z;
    const float z = 1 - u.y * (1 - lowest);
    const float sin = std::sqrt(std::max(0.f, 1 - z * z)), phi = 2 * pi * u.x;
    const V3f h = V3f(sin * std::cos(phi), sin * std::sin(phi), z) + towards;
    return normalized(V3f(alpha * h.x, alpha * h.y, std::max(h.z, 1e-7f)));
  }

  /// Eto and Tokuyoshi 2023, "Bounded VNDF Sampling for Smith-GGX Reflections", eq. 5.
  float reflection_bound(const V3f& o) const {
    const float s = 1 + std::sqrt(o.x * o.x + o.y * o.y), s2 = s * s;
    const float a2 = std::min(alpha * alpha, 1.f);
    return (1 - a2) * s2 / (s2 + a2 * o.z * o.z);
  }

  /// Of the normals that `sample_normal` draws, without bound: per steradian.
  float visible_density(const V3f& o, const V3f& h, float o_dot_h) const {
    return 2 * o_dot_h * density(h) / (o.z + stretch(o));
  }
};

/// One reflection off the facets, with Fresnel's factor left to the caller.
class GgxReflection {
 public:
  GgxReflection(const V3f& outgoing, const V3f& geometric, const V3f& shading, float alpha)
      : frame_(outgoing, geometric, shading),
        ggx_{alpha},
        o_(frame_.local(outgoing)),
        bound_(ggx_.reflection_bound(o_)) {}

  float cos() const { return o_.z; }
  const V3f& normal() const { return frame_.basis.normal; }

  struct Facet {
    V3f direction;        // unit, incoming
    float value = 0;      // x |cos|; of a sample over the density
    float pdf = 0;        // 0: no reflection
    float cos_facet = 0;  // between either direction and the facet's normal
  };

  Facet value(const V3f& incoming) const {
    const V3f i = frame_.local(incoming);
    Facet out;
    if (ggx_.alpha == 0 || !(i.z > 0) || !frame_.agrees(incoming, i.z)) return out;
    const V3f h = normalized(o_ + i);
    const float density = ggx_.density(h);
    out.direction = incoming;
    out.cos_facet = std::min(dot(o_, h), 1.f);
    out.value = density * ggx_.masking(o_, i) * i.z / 4;
    out.pdf = density / (2 * (bound_ * o_.z + ggx_.stretch(o_)));
    return out;
  }

  Facet sample(const V2f& u) const {
    const V3f h = ggx_.sample_normal(o_, u, bound_);
    Facet out;
    out.cos_facet = std::min(dot(o_, h), 1.f);
    const V3f i = h * (2 * out.cos_facet) - o_;
    out.direction = normalized(frame_.basis.world(i));
    if (!(i.z > 0) || !frame_.agrees(out.direction, i.z)) return out;
    const float visible = bound_ * o_.z + ggx_.stretch(o_);
    out.value = ggx_.masking(o_, i) * i.z * visible / 2;
    out.pdf =
        ggx_.alpha == 0 ? std::numeric_limits<float>::infinity() : ggx_.density(h) / (2 * visible);
    return out;
  }

 private:
  FacingFrame frame_;
  Ggx ggx_;
  V3f o_;
  float bound_;
};

}  // namespace drench::render

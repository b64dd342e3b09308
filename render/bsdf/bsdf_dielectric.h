#pragma once
// A smooth interface between two dielectrics: Fresnel's equations and Snell's law.

#include "render/vector.h"

namespace drench::render {

/// Where light goes at an interface, for radiance divided by the squared index ("basic radiance"),
/// which refraction leaves unchanged: so no factor for the change of solid angle appears here.
struct InterfaceSplit {
  V3f reflected, refracted;  // unit directions
  float reflectance = 1;     // Fresnel's, unpolarised; 1 is total reflection, without `refracted`
};

/// Fresnel's reflectance for unpolarised light, of the cosines on both sides.
inline float fresnel_reflectance(float cos_in, float cos_out, float eta) {
  const float parallel = (eta * cos_in - cos_out) / (eta * cos_in + cos_out);
  const float perpendicular = (cos_in - eta * cos_out) / (cos_in + eta * cos_out);
  return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

/// The same; 1 beyond the critical angle. @param eta  index beyond over index before
inline float fresnel_reflectance(float cos_in, float eta) {
  const float sin2_out = (1 - cos_in * cos_in) / (eta * eta);
  return sin2_out < 1 ? fresnel_reflectance(cos_in, std::sqrt(1 - sin2_out), eta) : 1.f;
}

/// Where light that leaves along `outgoing` came from through a surface of normal `h`, below the
/// critical angle; unit to rounding. @param cos  dot(outgoing, h) > 0
inline V3f refract_about(const V3f& outgoing, const V3f& h, float cos, float eta) {
  const float cos_beyond = std::sqrt(std::max(0.f, 1 - (1 - cos * cos) / (eta * eta)));
  return h * (cos / eta - cos_beyond) - outgoing * (1 / eta);
}

/// @param direction  unit, towards the surface
/// @param normal     unit, dot(direction, normal) < 0
/// @param eta        index beyond the surface over index before it
inline InterfaceSplit split_at_interface(const V3f& direction, const V3f& normal, float eta) {
  InterfaceSplit out;
  const float cos_in = std::min(-dot(direction, normal), 1.f);
  out.reflected = normalized(direction + normal * (2 * cos_in));
  const float sin2_out = (1 - cos_in * cos_in) / (eta * eta);
  if (sin2_out >= 1) return out;
  const float cos_out = std::sqrt(1 - sin2_out);
  out.reflectance = fresnel_reflectance(cos_in, cos_out, eta);
  out.refracted = normalized(direction * (1 / eta) + normal * (cos_in / eta - cos_out));
  return out;
}

/// Normal to shade with, on the side of `direction`'s origin. A smooth normal is used only if both
/// outgoing directions then lie on the side of the real surface where they belong.
template <class Vector>
Vector interface_normal(const Vector& direction, const Vector& geometric, const Vector& smooth) {
  const float side = dot(direction, geometric) < 0 ? 1.f : -1.f;
  const Vector n = smooth * side, g = geometric * side;
  const float cos_in = -dot(direction, n);
  if (!(cos_in > 0)) return g;
  const Vector reflected = direction + n * (2 * cos_in);
  return dot(reflected, g) > 0 ? n : g;
}

}  // namespace drench::render

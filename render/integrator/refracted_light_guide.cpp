#include "render/integrator/refracted_light_guide.h"

namespace drench::render {

namespace {

/// Half angle, in air, that waves add to a lamp's own. A slope s turns a ray by about (n - 1) s.
constexpr float wave_angle = 0.08f;
/// Aimed directions fall off as (core + h)^-2 in h = 1 - cos, out to a right angle: steep waves
/// send a lamp's light far off the level course, and a lobe that ends would leave it to chance.
constexpr float lobe_extent = 1;
/// Fraction aimed where lamps give all the light. The rest finds what the lobes miss.
constexpr float max_guided = 0.8f;

float lobe_density(float core, float h) {
  const float all = lobe_extent / (core + lobe_extent);
  return h < lobe_extent ? core / ((core + h) * (core + h) * all * 2 * pi) : 0;
}

V3f sample_lobe(float core, const V2f& u) {
  const float t = u.x * lobe_extent / (core + lobe_extent), h = core * t / (1 - t);
  const float sin = std::sqrt(std::max(0.f, h * (2 - h))), phi = 2 * pi * u.y;
  return {sin * std::cos(phi), sin * std::sin(phi), 1 - h};
}

}  // namespace

/// Aimed at a ball of the given radius; none at what is not above.
RefractedLightGuide::Lobe RefractedLightGuide::lobe_at(const V3f& to, float reach) const {
  Lobe out;
  const float cos_wave = std::cos(wave_angle), sin_wave = std::sin(wave_angle);
  const float distance = std::sqrt(dot(to, to));
  if (!(to.y > 0) || !(distance > 0)) return out;
  const float sin = std::min(reach / distance, 0.95f), cos = std::sqrt(1 - sin * sin);
  out.axis = to * (1 / distance);
  out.core = 1 - (cos * cos_wave - sin * sin_wave);
  out.importance = 1;
  return out;
}

RefractedLightGuide::Lobe RefractedLightGuide::lobe(size_t light, const V3f& point) const {
  Lobe out;
  if (light >= lights_.lamps()) {
    const MeshLight& mesh = lights_.meshes()[light - lights_.lamps()];
    out = lobe_at(mesh.center() - point, mesh.radius());
    out.importance *= mesh.importance(point);
    return out;
  }
  const float cos_wave = std::cos(wave_angle), sin_wave = std::sin(wave_angle);
  if (light >= lights_.shapes().size()) {
    const SunLight& sun = lights_.suns()[light - lights_.shapes().size()];
    if (sun.toward.y <= 0) return out;
    const float sin = std::sqrt(sun.sin2);
    out.axis = sun.toward;
    out.core = 1 - ((1 - sun.one_minus_cos) * cos_wave - sin * sin_wave);
    out.importance = sun.importance;
    return out;
  }
  const ShapeLight& shape = lights_.shapes()[light];
  const V3f to = shape.center - point;
  const float distance = std::sqrt(dot(to, to));
  // A rectangle counts as the disc of its apparent area.
  const float facing = shape.type == LightType::sphere ? 1 : -dot(to, shape.normal) / distance;
  if (!(facing > 0)) return out;
  const float reach = shape.type == LightType::sphere
                          ? shape.radius
                          : std::sqrt(shape.area * std::max(facing, 0.1f) / pi);
  out = lobe_at(to, reach);
  out.importance *= shape.importance(point);
  return out;
}

float RefractedLightGuide::total_importance(const V3f& point) const {
  float total = 0;
  for (size_t k = first_; k < count(); ++k) total += lobe(k, point).importance;
  return total;
}

float RefractedLightGuide::probability(const V3f& point) const {
  const float lamps = total_importance(point);
  return lamps > 0 ? max_guided * lamps / (lamps + lights_.environment_importance()) : 0;
}

DirectionSample RefractedLightGuide::sample(const V3f& point, float u_light, const V2f& u) const {
  const float total = total_importance(point);
  if (!(total > 0)) return {};
  float target = u_light * total;
  size_t chosen = first_;
  Lobe aimed = lobe(first_, point);
  while (target >= aimed.importance && chosen + 1 < count()) {
    target -= aimed.importance;
    aimed = lobe(++chosen, point);
  }
  if (!(aimed.importance > 0)) return {};
  const V3f air = Basis(aimed.axis).world(sample_lobe(aimed.core, u));
  if (!(air.y > 0)) return {};
  // Snell: the horizontal part of a unit direction shrinks by the index.
  const float x = air.x / ior_, z = air.z / ior_;
  const V3f water(x, std::sqrt(std::max(0.f, 1 - x * x - z * z)), z);
  return {water, pdf(point, water)};
}

float RefractedLightGuide::pdf(const V3f& point, const V3f& direction) const {
  const float x = direction.x * ior_, z = direction.z * ior_;
  const float cos2 = 1 - x * x - z * z;
  if (!(direction.y > 0) || !(cos2 > 0)) return 0;
  const V3f air(x, std::sqrt(cos2), z);
  float total = 0, density = 0;
  for (size_t k = first_; k < count(); ++k) {
    const Lobe c = lobe(k, point);
    total += c.importance;
    if (c.importance > 0) density += c.importance * lobe_density(c.core, 1 - dot(air, c.axis));
  }
  // d(air) / d(water) = n^2 cos(water) / cos(air)
  return density > 0 ? density / total * ior_ * ior_ * direction.y / air.y : 0;
}

}  // namespace drench::render

#include "render/mesh_light.h"

#include <Imath/ImathBox.h>

#include "render/color.h"

namespace drench {

namespace {

float length(const V3f& a) { return std::sqrt(dot(a, a)); }

}  // namespace

MeshLight::MeshLight(const Faces& faces, const V3f& radiance) : faces_(faces), radiance_(radiance) {
  std::vector<float> area(faces.triangle.size());
  double sum = 0;
  Imath::Box3f bounds;
  for (uint32_t t = 0; t < area.size(); ++t) {
    const Corners open = corners(t, 0), close = corners(t, 1);
    area[t] = length(cross(open.b - open.a, open.c - open.a)) / 2;
    sum += double(area[t]);
    for (const Corners& k : {open, close})
      for (const V3f& p : {k.a, k.b, k.c}) bounds.extendBy(p);
  }
  by_area_ = AliasTable(area);
  center_ = bounds.center();
  radius_ = bounds.size().length() / 2;
  power_ = luminance(radiance) * float(sum) / 4;
}

MeshLight::Corners MeshLight::corners(uint32_t triangle, float time) const {
  const auto& t = faces_.triangle[triangle];
  const auto at = [&](uint32_t v) {
    const V3f& p = faces_.position[v];
    return faces_.position_close ? p + (faces_.position_close[v] - p) * time : p;
  };
  return {at(t.x), at(t.y), at(t.z)};
}

LightSample MeshLight::sample(const V3f& from, float time, const V2f& u) const {
  LightSample out;
  out.radiance = radiance_;
  float fresh = u.x;
  const uint32_t triangle = by_area_.sample(fresh);
  const auto [a, b, c] = corners(triangle, time);
  const float root = std::sqrt(fresh);  // uniform on the triangle
  const V3f to = a + (b - a) * (root * (1 - u.y)) + (c - a) * (root * u.y) - from;
  out.distance = length(to);
  if (!(out.distance > 0)) return out;
  out.direction = to * (1 / out.distance);
  const V3f normal = cross(b - a, c - a);
  const float facing = -dot(out.direction, normal);  // times twice the area
  if (facing > 0)
    out.pdf = by_area_.probability(triangle) * 2 * out.distance * out.distance / facing;
  return out;
}

float MeshLight::pdf(uint32_t triangle, float time, float distance, float facing) const {
  const auto [a, b, c] = corners(triangle, time);
  const float area = length(cross(b - a, c - a)) / 2;
  return by_area_.probability(triangle) * distance * distance / (area * facing);
}

float MeshLight::importance(const V3f& from) const {
  const V3f away = from - center_;
  return power_ / std::max(dot(away, away), radius_ * radius_);
}

}  // namespace drench

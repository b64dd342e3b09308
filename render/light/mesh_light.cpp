#include "render/light/mesh_light.h"

#include <Imath/ImathBox.h>

#include "render/color/color.h"

namespace drench::render {

namespace {

float length(const V3f& a) { return std::sqrt(dot(a, a)); }

}  // namespace

MeshLight::MeshLight(const Faces& faces, const V3f& radiance) : faces_(faces), radiance_(radiance) {
  std::vector<float> area(faces.triangle.size());
  double sum = 0;
  Imath::Box3f bounds;
  for (uint32_t t = 0; t < area.size(); ++t) {
    const auto [a, b, c] = corners(t, 0);
    area[t] = length(cross(b - a, c - a)) / 2;
    sum += double(area[t]);
    for (const V3f* position : faces.position)
      for (const uint32_t v : {faces.triangle[t].x, faces.triangle[t].y, faces.triangle[t].z})
        bounds.extendBy(position[v]);
  }
  by_area_ = AliasTable(area);
  center_ = bounds.center();
  radius_ = bounds.size().length() / 2;
  power_ = luminance(radiance) * float(sum) / 4;
}

MeshLight::Corners MeshLight::corners(uint32_t triangle, float time) const {
  const auto& t = faces_.triangle[triangle];
  const size_t segments = faces_.position.size() - 1;
  const float segment = time * float(segments);
  const size_t k = segments == 0 ? 0 : std::min(size_t(segment), segments - 1);
  const auto at = [&](uint32_t v) {
    const V3f& p = faces_.position[k][v];
    return segments == 0 ? p : p + (faces_.position[k + 1][v] - p) * (segment - float(k));
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

LightTree::Light MeshLight::extent() const {
  return {{center_ - V3f(radius_), center_ + V3f(radius_)}, {0, 0, 0}, power_};
}

}  // namespace drench::render

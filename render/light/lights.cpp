#include "render/light/lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "pipeline/contract/error.h"
#include "render/color/color.h"
#include "render/sampling.h"

namespace drench::render {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
/// From so many on a tree of them is worth its steps.
constexpr size_t many_lights = 16;

[[noreturn]] void fail(const Light& light, const std::string& what) {
  throw Error(fmt::format("light '{}': {}", light.name, what));
}

void check_radiance(const Light& light) {
  for (int c = 0; c < 3; ++c)
    if (!(light.radiance[c] >= 0) || !std::isfinite(light.radiance[c]))
      fail(light, fmt::format("radiance is {}, {}, {} but no part may be negative",
                              light.radiance.x, light.radiance.y, light.radiance.z));
}

ShapeLight make_rectangle(const Light& light) {
  const V3d normal = light.u % light.v;
  const double area = 4 * normal.length();
  if (!(area > 0) || !std::isfinite(area))
    fail(light, "half edges u and v span no area; make them two different directions");
  ShapeLight out;
  out.type = LightType::rectangle;
  out.radiance = light.radiance;
  out.center = V3f(light.center);
  out.u = V3f(light.u);
  out.v = V3f(light.v);
  out.normal = V3f(normal / normal.length());
  const V3d across_u = light.v % normal, across_v = normal % light.u;
  out.dual_u = V3f(across_u / (light.u ^ across_u));
  out.dual_v = V3f(across_v / (light.v ^ across_v));
  out.area = float(area);
  return out;
}

void check_radius(const Light& light) {
  if (!(light.radius > 0) || !std::isfinite(light.radius))
    fail(light, fmt::format("radius is {} m; it must be positive", light.radius));
}

ShapeLight make_sphere(const Light& light) {
  check_radius(light);
  ShapeLight out;
  out.type = LightType::sphere;
  out.radiance = light.radiance;
  out.center = V3f(light.center);
  out.radius = float(light.radius);
  out.area = 4 * pi * out.radius * out.radius;
  return out;
}

ShapeLight make_disk(const Light& light) {
  check_radius(light);
  if (!(light.direction.length() > 0)) fail(light, "direction has no length");
  ShapeLight out;
  out.type = LightType::disk;
  out.radiance = light.radiance;
  out.center = V3f(light.center);
  out.radius = float(light.radius);
  out.normal = V3f(light.direction.normalized());
  const Basis basis(out.normal);
  out.u = basis.tangent * out.radius;
  out.v = basis.bitangent * out.radius;
  out.area = pi * out.radius * out.radius;
  return out;
}

SunLight make_sun(const Light& light) {
  if (!(light.angle_deg > 0 && light.angle_deg <= 180))
    fail(light, fmt::format("angle_deg is {}; it must lie in (0, 180]", light.angle_deg));
  if (!(light.direction.length() > 0)) fail(light, "direction has no length");
  const double half = light.angle_deg * std::numbers::pi / 360;
  SunLight out;
  out.toward = V3f(-light.direction.normalized());
  out.one_minus_cos = float(2 * std::pow(std::sin(half / 2), 2));
  out.sin2 = float(std::pow(std::sin(half), 2));
  out.radiance = light.radiance / float(std::numbers::pi * std::pow(std::sin(half), 2));
  out.importance = luminance(light.radiance);
  return out;
}

SunLight make_sun(const ExtractedSun& sun) {
  SunLight out;
  out.toward = sun.toward;
  out.one_minus_cos = sun.solid_angle / (2 * pi);
  out.sin2 = out.one_minus_cos * (2 - out.one_minus_cos);
  out.radiance = sun.irradiance / (pi * out.sin2);
  out.importance = luminance(sun.irradiance);
  return out;
}

}  // namespace

float ShapeLight::intersect(const V3f& origin, const V3f& direction, float reach) const {
  if (type != LightType::sphere) {
    const float facing = dot(direction, normal);
    if (!(facing < 0)) return infinity;  // it shines along its normal only
    const V3f to_center = center - origin;
    const float height = dot(to_center, normal);
    if (!(height < 0)) return infinity;
    const float t = height / facing;
    if (!(t > 0 && t < reach)) return infinity;
    const V3f p = direction * t - to_center;
    if (type == LightType::disk) return dot(p, p) <= radius * radius ? t : infinity;
    return std::abs(dot(p, dual_u)) <= 1 && std::abs(dot(p, dual_v)) <= 1 ? t : infinity;
  }
  const V3f to_center = center - origin;
  const float along = dot(to_center, direction);
  const V3f nearest = to_center - direction * along;  // stays exact for far, small spheres
  const float inside2 = radius * radius - dot(nearest, nearest);
  if (!(inside2 >= 0) || dot(to_center, to_center) <= radius * radius) return infinity;
  const float t = along - std::sqrt(inside2);
  return t > 0 && t < reach ? t : infinity;
}

LightSample ShapeLight::sample(const V3f& from, const V2f& u2) const {
  LightSample out;
  out.radiance = radiance;
  out.group = group;
  if (type != LightType::sphere) {
    const V2f square(2 * u2.x - 1, 2 * u2.y - 1);
    const V2f p = type == LightType::disk ? sample_disc(u2) : square;
    const V3f to = center + u * p.x + v * p.y - from;
    const float distance2 = dot(to, to);
    out.distance = std::sqrt(distance2);
    out.direction = to * (1 / out.distance);
    const float facing = -dot(out.direction, normal);
    if (facing > 0) out.pdf = distance2 / (area * facing);
    return out;
  }
  const V3f to = center - from;
  const float distance2 = dot(to, to), sin2 = radius * radius / distance2;
  if (!(sin2 < 1)) return out;
  const float one_minus_cos = sin2 / (1 + std::sqrt(1 - sin2));
  const V3f local = sample_cone(u2, one_minus_cos);
  const float distance = std::sqrt(distance2);
  out.direction = Basis(to * (1 / distance)).world(local);
  const float off_axis2 = distance2 * (local.x * local.x + local.y * local.y);
  out.distance = distance * local.z - std::sqrt(std::max(0.f, radius * radius - off_axis2));
  out.pdf = 1 / (2 * pi * one_minus_cos);
  return out;
}

float ShapeLight::pdf(const V3f& from, const V3f& direction, float distance) const {
  if (type != LightType::sphere) {
    const float facing = -dot(direction, normal);
    return facing > 0 ? distance * distance / (area * facing) : 0;
  }
  const V3f to = center - from;
  const float sin2 = radius * radius / dot(to, to);
  return sin2 < 1 ? (1 + std::sqrt(1 - sin2)) / (2 * pi * sin2) : 0;
}

float ShapeLight::importance(const V3f& from) const {
  const V3f away = from - center;
  const float distance2 = dot(away, away);
  if (type == LightType::sphere)
    return distance2 > radius * radius ? luminance(radiance) * pi * radius * radius / distance2 : 0;
  const float height = dot(away, normal);
  return height > 0
             ? luminance(radiance) * area * height / (std::sqrt(distance2) * (distance2 + area))
             : 0;
}

LightTree::Light ShapeLight::extent() const {
  const float intensity = luminance(radiance);
  if (type == LightType::sphere) {
    const V3f reach(radius);
    return {{center - reach, center + reach}, V3f(0), intensity * pi * radius * radius};
  }
  const V3f reach = absolute(u) + absolute(v);
  return {{center - reach, center + reach}, normal, intensity * area};
}

bool SunLight::covers(const V3f& direction) const {
  const V3f off = cross(direction, toward);  // 1 - cos would lose the sun's digits
  return dot(direction, toward) > 0 && dot(off, off) <= sin2;
}

Lights::Lights(const std::vector<Light>& lights, SampleEnvironment sample_environment,
               EnvironmentSource& environments) {
  for (const Light& light : lights) {
    check_radiance(light);
    switch (light.type) {
      case LightType::rectangle:
        shapes_.push_back(make_rectangle(light));
        shapes_.back().group = group_of(light);
        break;
      case LightType::disk:
        shapes_.push_back(make_disk(light));
        shapes_.back().group = group_of(light);
        break;
      case LightType::sphere:
        shapes_.push_back(make_sphere(light));
        shapes_.back().group = group_of(light);
        break;
      case LightType::sun:
        suns_.push_back(make_sun(light));
        suns_.back().group = group_of(light);
        break;
      case LightType::environment:
        if (environment_) fail(light, "a shot has one environment at most; remove one");
        sample_environment_ =
            sample_environment == SampleEnvironment::always ||
            (sample_environment == SampleEnvironment::automatic && !light.map.empty());
        environment_ = environments.environment(
            light, sample_environment_ ? Environment::Sampling::on : Environment::Sampling::off);
        environment_group_ = group_of(light);
        for (const ExtractedSun& sun : environment_->suns()) {
          suns_.push_back(make_sun(sun));
          suns_.back().group = environment_group_;
        }
        environment_importance_ = pi * luminance(environment_->mean());
        break;
    }
  }
  count_ = environment_index() + (sample_environment_ ? 1 : 0);
}

uint32_t Lights::group_of(const Light& light) {
  return group_named(light.group.empty() ? light.name : light.group);
}

uint32_t Lights::group_named(const std::string& name) {
  const auto found = std::find(groups_.begin(), groups_.end(), name);
  const uint32_t group = uint32_t(found - groups_.begin());
  if (found == groups_.end()) groups_.push_back(name);
  return group;
}

void Lights::finish() {
  if (shapes_.size() + meshes_.size() < many_lights) return;
  std::array<std::vector<LightTree::Light>, 2> kinds;
  for (const ShapeLight& shape : shapes_) kinds[0].push_back(shape.extent());
  for (const MeshLight& mesh : meshes_) kinds[1].push_back(mesh.extent());
  tree_ = LightTree(kinds);
}

Lights::Hit Lights::intersect(const V3f& origin, const V3f& direction, float distance,
                              int except) const {
  Hit hit{-1, distance};
  const auto meet = [&](int k, const ShapeLight& shape) {
    if (k == except) return;
    const float t = shape.intersect(origin, direction, hit.distance);
    if (t < hit.distance) hit = {k, t};
  };
  int k = 0;
  if (tree_.empty())
    for (const ShapeLight& shape : shapes_) meet(k++, shape);
  else
    tree_.along(origin, direction, distance, [&](uint32_t light) {
      meet(int(light), shapes_[light]);
      return hit.distance;
    });
  return hit;
}

float Lights::importance(size_t index, const V3f& from) const {
  if (index < shapes_.size()) return shapes_[index].importance(from);
  if (index < lamps()) return suns_[index - shapes_.size()].importance;
  if (index < environment_index()) return meshes_[index - lamps()].importance(from);
  return environment_importance_;
}

template <class Visit>
void Lights::for_each_alone(size_t count, const Visit& visit) const {
  if (tree_.empty()) {
    for (size_t k = 0; k < count; ++k) visit(k);
    return;
  }
  for (size_t k = shapes_.size(); k < lamps(); ++k) visit(k);
  for (size_t k = environment_index(); k < count; ++k) visit(k);
}

LightTree::Cut Lights::cut(size_t count, const V3f& from) const {
  if (tree_.empty()) return {};
  return tree_.cut(count > lamps() ? 2 : 1, from, tree_importance(from));
}

float Lights::choice_probability(size_t index, const V3f& from) const {
  if (count_ == 1) return 1;
  const LightTree::Cut cut = this->cut(count_, from);
  float total = cut.total;
  for_each_alone(count_, [&](size_t k) { total += importance(k, from); });
  if (!(total > 0)) return 0;
  const bool alone =
      tree_.empty() || index >= environment_index() || (index >= shapes_.size() && index < lamps());
  if (alone) return importance(index, from) / total;
  const size_t number = index < shapes_.size() ? index : index - suns_.size();
  return tree_.part(cut, from, uint32_t(number), tree_importance(from)) / total;
}

float Lights::shape_pdf(int light, const V3f& from, const V3f& direction, float distance) const {
  return shapes_[light].pdf(from, direction, distance) * choice_probability(size_t(light), from);
}

Lights::Choice Lights::choose_of_many(size_t count, const V3f& from, float u_light) const {
  const LightTree::Cut cut = this->cut(count, from);
  float total = cut.total;
  for_each_alone(count, [&](size_t k) { total += importance(k, from); });
  if (!(total > 0)) return {0, 0.f};
  float target = u_light * total;
  if (target < cut.total) {
    const auto [number, part] = tree_.choose(cut, from, target, tree_importance(from));
    return {number < shapes_.size() ? number : number + suns_.size(), part / total};
  }
  target -= cut.total;
  size_t chosen = 0;
  float weight = 0;
  bool found = false;
  for_each_alone(count, [&](size_t k) {
    if (found) return;
    chosen = k;
    weight = importance(k, from);
    found = target < weight;
    target -= weight;
  });
  return {chosen, weight / total};
}

LampPoint Lights::aim_at(size_t lamp, const V3f& from) const {
  if (lamp >= shapes_.size()) {
    const SunLight& sun = suns_[lamp - shapes_.size()];
    const float density = 1 / (2 * pi * sun.one_minus_cos);
    return {.at = sun.toward,
            .normal = -sun.toward,
            .radiance = sun.radiance,
            .density = density,
            .extent = std::sqrt(sun.sin2),
            .sun = true,
            .lamp = lamp};
  }
  const ShapeLight& shape = shapes_[lamp];
  LampPoint out{.at = shape.center,
                .normal = shape.normal,
                .radiance = shape.radiance,
                .density = 1 / shape.area,
                .extent = shape.radius,
                .lamp = lamp};
  if (shape.type == LightType::sphere) {
    out.normal = normalized(from - shape.center);
    out.density = 1 / (pi * shape.radius * shape.radius);
  } else if (shape.type == LightType::rectangle) {
    out.extent = std::sqrt(std::max(dot(shape.u, shape.u), dot(shape.v, shape.v)));
  }
  return out;
}

LampPoint Lights::sample_lamp_point(const V3f& from, float u_light, const V2f& u) const {
  const auto [lamp, probability] = choose_first(lamps(), from, u_light);
  if (!(probability > 0 && importance(lamp, from) > 0)) return {};
  LampPoint out = aim_at(lamp, from);
  out.density *= probability;
  if (lamp >= shapes_.size()) {
    out.at = Basis(out.at).world(sample_cone(u, suns_[lamp - shapes_.size()].one_minus_cos));
    out.normal = -out.at;
    return out;
  }
  const ShapeLight& shape = shapes_[lamp];
  if (shape.type == LightType::rectangle) {
    out.at += shape.u * (2 * u.x - 1) + shape.v * (2 * u.y - 1);
  } else {
    const Basis plane(out.normal);
    const V2f d = sample_disc(u) * shape.radius;
    out.at += plane.tangent * d.x + plane.bitangent * d.y;
  }
  return out;
}

LampPoint Lights::lamp_point_of(size_t lamp, const V3f& from, const V3f& origin,
                                const V3f& direction) const {
  if (!(importance(lamp, from) > 0)) return {};
  LampPoint out = aim_at(lamp, from);
  if (out.sun) {
    out.at = direction, out.normal = -direction;
    return out;
  }
  const float facing = dot(direction, out.normal);
  if (!(facing < 0)) return {};
  const V3f at = origin + direction * (dot(out.at - origin, out.normal) / facing);
  const V3f off = at - out.at;
  if (shapes_[lamp].type == LightType::sphere && dot(off, off) > out.extent * out.extent) return {};
  out.at = at;
  return out;
}

LightSample Lights::sample_shape(const Choice& choice, const V3f& from, const V2f& u) const {
  LightSample out = shapes_[choice.light].sample(from, u);
  out.pdf *= choice.probability;
  out.lamp = int(choice.light);
  return out;
}

LightSample Lights::sample_sun(const Choice& choice, const V2f& u) const {
  const SunLight& sun = suns_[choice.light - shapes_.size()];
  const V3f direction = Basis(sun.toward).world(sample_cone(u, sun.one_minus_cos));
  const float pdf = 1 / (2 * pi * sun.one_minus_cos) * choice.probability;
  return {.direction = direction,
          .distance = infinity,
          .radiance = sun.radiance,
          .pdf = pdf,
          .group = sun.group,
          .lamp = int(choice.light)};
}

LightSample Lights::sample_mesh(const Choice& choice, const V3f& from, float time,
                                const V2f& u) const {
  const size_t mesh = choice.light - lamps();
  LightSample out = meshes_[mesh].sample(from, time, u);
  out.pdf *= choice.probability;
  out.group = mesh_group_[mesh];
  out.mesh = int(mesh);
  return out;
}

LightSample Lights::sample_chosen(const Choice& choice, const V3f& from, float time,
                                  const V2f& u) const {
  if (!(choice.probability > 0)) return {};
  if (choice.light < shapes_.size()) return sample_shape(choice, from, u);
  if (choice.light < lamps()) return sample_sun(choice, u);
  if (choice.light < environment_index()) return sample_mesh(choice, from, time, u);
  const DirectionSample d = environment_->sample(u);
  return {.direction = d.direction,
          .distance = infinity,
          .radiance = environment_->radiance(d.direction),
          .pdf = d.pdf * choice.probability,
          .group = environment_group_};
}

}  // namespace drench::render

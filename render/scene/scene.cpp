#include "render/scene/scene.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "pipeline/contract/error.h"
#include "render/box_test.h"
#include "render/scene/features.h"
#include "render/scene/rotation.h"
#include "render/scene/scene_cache.h"

namespace drench::render {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
/// Rounding of an interpolated point, in units of its coordinates: a few operations in float.
constexpr float relative_position_error = 16 * 0x1p-24f;
constexpr float shared_position_error = 2 * 0x1p-24f;
constexpr float near_edge = 0.01f;  // of a barycentric coordinate
/// Indices whose ratio is so near 1 have no facets that bend light.
constexpr float same_index = 1e-3f;

/// Written by fours, as Embree reads it at once: a read of what narrower writes left waits for
/// them.
void set_ray(RTCRay& to, const Ray& ray, float reach) {
  const __m128 d = Packed::load(ray.direction).lanes;
  _mm_store_ps(&to.org_x, Packed::load(ray.origin).lanes);  // and 0 for the nearest distance
  _mm_store_ps(&to.dir_x, _mm_insert_ps(d, _mm_load_ss(&ray.time), 0x30));
  to.tfar = reach;
  to.mask = 0xffffffffu;
  to.id = to.flags = 0;
}

/// Moves a point of a body's triangle at its edge inwards, in the triangle, by its rounding error:
/// else it may lie beyond the face that meets this one there, and a ray from it is lost.
void keep_off_edges(const Corners& corner, const Hit& hit, const Packed& error, Surface& s) {
  const auto& [a, b, c] = corner.position;
  const Packed side[] = {b - a, c - a, c - b}, across = cross(side[0], side[1]);
  float longest2 = 0;
  for (const Packed& along : side) longest2 = std::max(longest2, dot(along, along));
  const float least = std::min(largest(error) * std::sqrt(longest2 / dot(across, across)), 1.f / 3);
  if (!(least > 0)) return;
  const float w = std::max(1 - hit.u - hit.v, least), u = std::max(hit.u, least),
              v = std::max(hit.v, least);
  ((a * w + b * u + c * v) * (1 / (w + u + v))).store(s.position);
}

}  // namespace

Scene::Scene(const Shot& shot, int frame, const FrameGeometry& geometry,
             const RenderOptions& options)
    : open_(shot.render.motion_blur ? shot.camera.shutter_open : 0),
      close_(shot.render.motion_blur ? ShutterCurve::end(shot.camera) : 0),
      fps_(shot.timeline.fps),
      keeps_velocities_(shot.layers.motion || shot.render.denoise),
      camera_(shot.camera, frame + open_, frame + close_, shot.render.width, shot.render.height),
      cache_(options.cache ? options.cache : std::make_shared<SceneCache>()),
      lights_(shot.light,
              options.environment == EnvironmentSampling::always ? Lights::SampleEnvironment::always
              : options.environment == EnvironmentSampling::never
                  ? Lights::SampleEnvironment::never
                  : Lights::SampleEnvironment::automatic,
              *cache_) {
  if (!(close_ >= open_)) throw Error("camera: shutter_close lies before shutter_open; swap them");
  if (shot.ground.present) {
    has_ground_ = true;
    ground_center_ =
        V3f(float(shot.ground.center.x), float(shot.ground.height), float(shot.ground.center.z));
    ground_half_size_ = float(shot.ground.half_size);
    ground_matte_ = shot.ground.matte;
    ground_material_ = add_material(shot, shot.ground.material);
    if (materials_[ground_material_].type == MaterialType::dielectric)
      throw Error(
          fmt::format("ground: material '{}' is a dielectric, which needs a closed surface; "
                      "use a diffuse, metal or coated one",
                      shot.ground.material));
  }
  const bool has_fluid = !geometry.fluid.triangle.empty();
  if (has_fluid)
    add_object(geometry.fluid, "fluid", "fluid surface", add_material(shot, shot.fluid.material),
               Matte::none);
  if (!geometry.foam.position.empty()) add_foam(geometry.foam);
  for (const ObstacleFrame& obstacle : geometry.obstacle) add_obstacle(shot, frame, obstacle);
  for (const ClothFrame& cloth : geometry.cloth) {
    if (cloth.mesh.triangle.empty()) continue;
    std::string material = "cotton";
    Matte matte = Matte::none;
    for (const Cloth& c : shot.cloth)
      if (c.name == cloth.name) material = c.material, matte = c.matte;
    const uint32_t index = add_material(shot, material);
    if (materials_[index].type == MaterialType::dielectric)
      throw Error(
          fmt::format("cloth '{}': material '{}' is a dielectric, which needs a closed "
                      "surface; use a cloth, diffuse, metal or coated one",
                      cloth.name, material));
    const std::string what = fmt::format("cloth '{}'", cloth.name);
    add_object(cloth.mesh, cloth.name, what, index, matte);
    check_yarns(objects_.back(), what);
    add_wetness(objects_.back(), cloth.mesh, what);
  }
  for (SceneObject& object : objects_) build(object);
  find_mesh_lights();
  find_bodies(has_fluid ? FirstObject::fluid : FirstObject::other);
  find_albedos();
  find_fabrics();
  find_features(shot.render.background);
}

Scene::~Scene() {
  for (SceneObject& object : objects_)
    if (object.contents != Digest{}) cache_->give_back(std::move(object));
}

uint32_t Scene::add_material(const Shot& shot, const std::string& name) {
  materials_.push_back(cache_->material(shot, name));
  material_names_.push_back(name);
  return uint32_t(materials_.size() - 1);
}

void Scene::add_obstacle(const Shot& shot, int frame, const ObstacleFrame& obstacle) {
  std::string material = "ground";
  Matte matte = Matte::none;
  std::optional<RotationalMotion> motion;
  for (const Obstacle& o : shot.obstacle)
    if (o.name == obstacle.name) {
      material = o.material, matte = o.matte;
      if (o.position.keys.size() > 1 || o.rotation_deg.keys.size() > 1) motion.emplace(o, frame);
    }
  const std::string what = fmt::format("obstacle '{}'", obstacle.name);
  add_object(obstacle.mesh, obstacle.name, what, add_material(shot, material), matte,
             motion ? &*motion : nullptr);
  check_yarns(objects_.back(), what);
  add_wetness(objects_.back(), obstacle.mesh, what);
}

/// Numbers the dielectric objects from the lowest priority up; of equals the fluid, which comes
/// first, is the lowest.
void Scene::find_bodies(FirstObject first) {
  for (uint32_t k = 0; k < objects_.size(); ++k)
    if (materials_[objects_[k].material].type == MaterialType::dielectric) bodies_.push_back(k);
  constexpr size_t most = std::numeric_limits<Bodies>::digits;
  if (bodies_.size() > most)
    throw Error(
        fmt::format("there are {} obstacles and fluids of dielectric materials, at most {} "
                    "can be rendered; make one mesh of some",
                    bodies_.size(), most));
  std::stable_sort(bodies_.begin(), bodies_.end(), [&](uint32_t a, uint32_t b) {
    return materials_[objects_[a].material].priority < materials_[objects_[b].material].priority;
  });
  for (size_t bit = 0; bit < bodies_.size(); ++bit) {
    SceneObject& object = objects_[bodies_[bit]];
    object.body = Bodies{1} << bit;
    medium_.push_back({materials_[object.material].absorption, materials_[object.material].ior});
    if (first == FirstObject::fluid && bodies_[bit] == 0) fluid_ = object.body;
    find_lights_in(bodies_[bit]);
  }
}

void Scene::find_lights_in(uint32_t body) {
  for (const ShapeLight& light : lights_.shapes()) {
    V3f reach = absolute(light.u) + absolute(light.v) + V3f(light.radius);
    if (light.type == LightType::sphere) reach = V3f(light.radius);
    lamps_in_bodies_ |= holds(body, {light.center - reach, light.center + reach});
  }
  lights_in_bodies_ |= lamps_in_bodies_;
  for (const SceneObject& object : objects_)
    lights_in_bodies_ |= object.light >= 0 && holds(body, object.bounds);
}

bool Scene::holds(uint32_t body, const Imath::Box3f& part) const {
  const SceneObject& object = objects_[body];
  if (!object.bounds.intersects(part)) return false;
  const std::vector<const V3f*> keys = object.keys();
  for (const auto& t : object.triangle) {
    Imath::Box3f swept;
    for (const V3f* position : keys)
      for (const uint32_t v : {t.x, t.y, t.z}) swept.extendBy(position[v]);
    if (swept.intersects(part)) return true;
  }
  return is_inside(body, part.center(), 0);
}

void Scene::find_mesh_lights() {
  for (SceneObject& object : objects_) {
    const V3f& emission = materials_[object.material].emission;
    if (is_black(emission) || object.triangle.empty()) continue;
    object.light = lights_.add_mesh({object.triangle, object.keys()}, emission, object.name);
  }
  lights_.finish();
}

/// One table for each pair of roughness and index that facets of the frame have.
void Scene::find_albedos() {
  const auto table = [&](float alpha, float eta) { return cache_->albedo(alpha, eta); };
  for (ShadingMaterial& m : materials_) {
    if (!m.has_facets()) continue;
    if (m.type == MaterialType::metal) {
      m.albedo_outside = {table(m.alpha, 0)};
      continue;
    }
    m.albedo_outside.resize(medium_.size());
    m.albedo_inside.resize(medium_.size());
    for (size_t k = 0; k < medium_.size(); ++k) {
      const float eta = m.ior / medium_[k].ior;
      const bool coat = m.type == MaterialType::coated || m.type == MaterialType::cloth;
      if (coat) m.albedo_outside[k] = table(m.alpha, eta);
      if (coat || std::abs(eta - 1) < same_index) continue;
      m.albedo_outside[k] = table(m.alpha, eta);
      m.albedo_inside[k] = table(m.alpha, 1 / eta);
    }
  }
}

const AlbedoTable* Scene::interface_albedo(const Surface& surface, Bodies in) const {
  const size_t outside = size_t(std::bit_width(in & ~surface.body));
  const ShadingMaterial& m = *surface.material;
  return (in & surface.body ? m.albedo_inside : m.albedo_outside)[outside].get();
}

void Scene::find_features(Background background) {
  bool moving = camera_.moves();
  for (const SceneObject& object : objects_) moving |= object.moves();
  const bool facets =
      std::any_of(materials_.begin(), materials_.end(),
                  [](const ShadingMaterial& m) { return m.has_facets() || m.is_fabric(); });
  has_gaps_ = std::any_of(materials_.begin(), materials_.end(),
                          [](const ShadingMaterial& m) { return m.gap > 0; });
  features_ = (moving ? Feature::motion_blur : 0u) | (bodies_.empty() ? 0u : Feature::dielectric) |
              (lights_.can_sample() ? Feature::sampled_lights : 0u) |
              (camera_.has_lens() ? Feature::thin_lens : 0u) |
              (facets || has_gaps_ ? Feature::glossy : 0u) |
              (background == Background::clear || has_mattes() ? Feature::mattes : 0u);
}

float Scene::ground_distance(const V3f& origin, const V3f& direction) const {
  const float t = (ground_center_.y - origin.y) / direction.y;
  if (!(t > 0)) return infinity;  // also the ray that starts on it, at 0, and the parallel one
  const V3f p = origin + direction * t - ground_center_;
  return std::max(std::abs(p.x), std::abs(p.z)) <= ground_half_size_ ? t : infinity;
}

void Scene::meet(uint32_t object, const Ray& ray, Coherence coherence, Hit& nearest) const {
  RTCRayHit query;
  set_ray(query.ray, ray, nearest.distance);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  embree_intersect(objects_[object].scene.get(), query, coherence);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return;
  nearest.kind = Hit::Kind::object;
  nearest.distance = query.ray.tfar;
  nearest.index = object;
  nearest.triangle = query.hit.primID;
  nearest.u = query.hit.u;
  nearest.v = query.hit.v;
}

Hit Scene::meet(uint32_t object, const Ray& ray, float reach) const {
  Hit hit;
  hit.distance = reach;
  meet(object, ray, Coherence::incoherent, hit);
  return hit;
}

Hit Scene::intersect(const Ray& ray, Coherence coherence, World world) const {
  Hit hit;
  hit.distance = infinity;
  if (has_ground_ && (world == World::whole || ground_matte_ != Matte::none)) {
    hit.distance = ground_distance(ray.origin, ray.direction);
    if (hit.distance < infinity) hit.kind = Hit::Kind::ground;
  }
  const Lights::Hit light = lights_.intersect(ray.origin, ray.direction, hit.distance);
  if (light.light >= 0)
    hit = {.kind = Hit::Kind::light, .distance = light.distance, .index = uint32_t(light.light)};
  if (objects_.empty()) return hit;
  const BoxTest box(ray.origin, ray.direction);
  for (size_t k = 0; k < objects_.size(); ++k) {
    if (!box.meets(objects_[k].bounds, hit.distance)) continue;
    if (world == World::plate && objects_[k].matte == Matte::none) continue;
    meet(uint32_t(k), ray, coherence, hit);
  }
  return hit;
}

bool Scene::occluded(const Ray& ray, const Target& target, World world, Gaps gaps) const {
  const float reach = target.distance * (1 - 1e-4f);
  const bool ground = has_ground_ && (world == World::whole || ground_matte_ != Matte::none);
  if (ground && ground_distance(ray.origin, ray.direction) < reach) return true;
  if (lights_.intersect(ray.origin, ray.direction, reach, target.lamp).light >= 0) return true;
  if (objects_.empty()) return false;
  const BoxTest box(ray.origin, ray.direction);
  for (const SceneObject& object : objects_) {
    if (!box.meets(object.bounds, reach)) continue;
    if (world == World::plate && object.matte == Matte::none) continue;
    if (gaps == Gaps::open && materials_[object.material].gap > 0) continue;
    RTCRay query;
    set_ray(query, ray, reach);
    embree_occluded(object.scene.get(), query);
    if (query.tfar < 0) return true;
  }
  return false;
}

namespace {

/// Where a ray met a sphere, on it to rounding.
void meet_sphere(const SceneObject& object, const Ray& ray, const Hit& hit, Surface& s) {
  Imath::V4f sphere = object.sphere[hit.triangle], displacement(0);
  if (object.moves()) {
    displacement = object.sphere_close[hit.triangle] - sphere;
    sphere += displacement * ray.time;
  }
  const V3f center(sphere.x, sphere.y, sphere.z);
  s.geometric_normal = s.shading_normal =
      normalized(ray.origin + ray.direction * hit.distance - center);
  s.position = center + s.geometric_normal * sphere.w;
  s.uv = V2f(0);
  s.small = true;
  const V3f size = absolute(center) +
                   absolute(V3f(displacement.x, displacement.y, displacement.z)) + V3f(sphere.w);
  const V3f error = size * relative_position_error + V3f(largest(size) * shared_position_error);
  s.reach = dot(absolute(s.geometric_normal), error);
}

/// Surface::lift. Normals of corners that lean farther than 45 degrees are those of edges; what is
/// no more than rounding is that of a flat or hollow surface.
V3f lift_to_patch(const Corners& corner, const float (&weight)[3], const V3f& from,
                  const Packed& position, const Packed& flat, float reach) {
  const float side = dot(Packed::load(from), flat) > 0 ? -1.f : 1.f;
  Packed lift(V3f(0));
  for (int k = 0; k < 3; ++k) {
    const Packed n = corner.normal[k] * side;
    const float along = dot(corner.normal[k], flat), length2 = dot(n, n);
    if (!(along > 0 && along * along > 0.5f * length2)) return V3f(0);
    lift = lift - n * (weight[k] * std::min(dot(position - corner.position[k], n), 0.f) / length2);
  }
  return dot(lift, flat) * side > reach ? lift.unpacked() : V3f(0);
}

/// Turns the shading normal as the material's map says, unless that is out of the real surface.
void map_normal(Surface& s, const V3f& along_u, const V3f& along_v) {
  const V3f mapped = s.material->normal_at(s.uv, s.shading_normal, along_u, along_v);
  if (dot(mapped, s.geometric_normal) > 0.01f) s.shading_normal = mapped;
}

}  // namespace

Corners SceneObject::moved(uint32_t of, float time) const {
  const auto& t = triangle[of];
  const auto a = moved_vertex(t.x, time), b = moved_vertex(t.y, time), c = moved_vertex(t.z, time);
  return {{a.first, b.first, c.first}, {a.second, b.second, c.second}};
}

std::pair<Packed, Packed> SceneObject::moved_vertex(uint32_t vertex, float time) const {
  const auto between = [&](const std::vector<V3f>& from, const std::vector<V3f>& to, float at) {
    const Packed a = Packed::load(from[vertex]);
    return a + (Packed::load(to[vertex]) - a) * at;
  };
  if (key.empty()) return {between(position, position_close, time), Packed::load(normal[vertex])};
  const size_t first = segment(time);
  const float at = time * float(key.size() - 1) - float(first);
  return {between(key[first].position, key[first + 1].position, at),
          between(key[first].normal, key[first + 1].normal, at)};
}

V3f SceneObject::displacement(const Hit& hit, float time) const {
  const size_t first = key.empty() ? 0 : segment(time);
  const auto& open = key.empty() ? position : key[first].position;
  const auto& close = key.empty() ? position_close : key[first + 1].position;
  const auto& t = triangle[hit.triangle];
  const auto of = [&](uint32_t vertex) { return absolute(close[vertex] - open[vertex]); };
  return of(t.x) * (1 - hit.u - hit.v) + of(t.y) * hit.u + of(t.z) * hit.v;
}

Surface Scene::surface(const Ray& ray, const Hit& hit) const {
  Surface s;
  if (hit.kind == Hit::Kind::ground) {
    s.position = ray.origin + ray.direction * hit.distance;
    s.position.y = ground_center_.y;  // exactly: rays leave it without an offset
    s.geometric_normal = s.shading_normal = V3f(0, 1, 0);
    s.uv = {s.position.x, s.position.z};
    s.material = &materials_[ground_material_];
    if (s.material->normal_map) map_normal(s, V3f(1, 0, 0), V3f(0, 0, 1));
    return s;
  }
  const SceneObject& object = objects_[hit.index];
  s.material = &materials_[object.material];
  s.body = object.body;
  if (!object.sphere.empty()) {
    meet_sphere(object, ray, hit, s);
    return s;
  }
  const Corners corner = object.corners(hit.triangle, ray.time);
  const auto& [a, b, c] = corner.position;
  const float w = 1 - hit.u - hit.v;
  const Packed position = a * w + b * hit.u + c * hit.v;
  Packed size = absolute(a) * w + absolute(b) * hit.u + absolute(c) * hit.v;
  if (object.moves()) size = size + Packed(object.displacement(hit, ray.time));
  const Packed error =
      size * relative_position_error + Packed(_mm_set1_ps(largest(size) * shared_position_error));
  position.store(s.position);
  if (s.body && std::min({w, hit.u, hit.v}) < near_edge) keep_off_edges(corner, hit, error, s);
  const Packed flat = normalized(corner.across());
  s.reach = dot(absolute(flat), error);
  const Packed smooth =
      normalized(corner.normal[0] * w + corner.normal[1] * hit.u + corner.normal[2] * hit.v);
  flat.store(s.geometric_normal);
  (dot(smooth, flat) > 0.01f ? smooth : flat).store(s.shading_normal);
  if (s.material->ends_light_smoothly())
    s.lift = lift_to_patch(corner, {w, hit.u, hit.v}, ray.direction, position, flat, s.reach);
  const auto& t = object.triangle[hit.triangle];
  if (!object.uv.empty())
    s.uv = object.uv[t.x] * w + object.uv[t.y] * hit.u + object.uv[t.z] * hit.v;
  s.light = object.light;
  s.triangle = hit.triangle;
  if (s.material->normal_map && !object.uv.empty()) {
    const V2f p = object.uv[t.y] - object.uv[t.x], q = object.uv[t.z] - object.uv[t.x];
    const float side = p.x * q.y - p.y * q.x > 0 ? 1.f : -1.f;
    const V3f e = (b - a).unpacked() * side, f = (c - a).unpacked() * side;
    map_normal(s, e * q.y - f * p.y, f * p.x - e * q.x);
  }
  s.contact = !object.contact.empty() && object.contact[hit.triangle];
  return s;
}

V3f Scene::velocity(const Hit& hit) const {
  if (hit.kind != Hit::Kind::object) return V3f(0);
  const SceneObject& object = objects_[hit.index];
  if (object.velocity.empty()) return V3f(0);
  if (!object.sphere.empty()) return object.velocity[hit.triangle];
  const auto& t = object.triangle[hit.triangle];
  return object.velocity[t.x] * (1 - hit.u - hit.v) + object.velocity[t.y] * hit.u +
         object.velocity[t.z] * hit.v;
}

Bodies Scene::bodies_at(const V3f& point, float time) const {
  Bodies in = 0;
  for (const uint32_t k : bodies_)
    if (is_inside(k, point, time)) in |= objects_[k].body;
  return in;
}

bool Scene::is_inside(uint32_t object, const V3f& point, float time) const {
  const Ray up{point, V3f(0, 1, 0), time};
  // The mesh is closed and outward: a point is inside if the first side met is an inner one.
  const Hit hit = meet(object, up, infinity);
  return hit.kind != Hit::Kind::nothing && surface(up, hit).geometric_normal.y > 0;
}

}  // namespace drench::render

// Objects of a frame: from meshes and foam to what Embree traces.

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "render/scene/scene.h"
#include "render/scene/scene_cache.h"

namespace drench::render {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
/// Of foam: froth scatters light many times and absorbs next to none.
constexpr float foam_reflectance = 0.9f;

void check_embree(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_OUT_OF_MEMORY)
    throw Error(
        "the scene's ray-tracing structure does not fit into memory; use a coarser surface");
  if (error != RTC_ERROR_NONE)
    throw std::runtime_error(fmt::format("Embree reports error {}", int(error)));
}

void check_mesh(const TriangleMesh& mesh, const std::string& what) {
  const auto fail = [&](const std::string& why) {
    throw Error(fmt::format("{}: {}; make the mesh anew", what, why));
  };
  const size_t n = mesh.position.size();
  if (!mesh.velocity.empty() && mesh.velocity.size() != n)
    fail(fmt::format("{} velocities for {} vertices", mesh.velocity.size(), n));
  if (!mesh.normal.empty() && mesh.normal.size() != n)
    fail(fmt::format("{} normals for {} vertices", mesh.normal.size(), n));
  if (!mesh.uv.empty() && mesh.uv.size() != n)
    fail(fmt::format("{} texture coordinates for {} vertices", mesh.uv.size(), n));
  if (!mesh.point.empty() &&
      (mesh.point.size() != n || *std::max_element(mesh.point.begin(), mesh.point.end()) >= n))
    fail(fmt::format("{} points for {} vertices", mesh.point.size(), n));
  if (!mesh.contact.empty() && mesh.contact.size() != mesh.triangle.size())
    fail(fmt::format("{} contacts for {} triangles", mesh.contact.size(), mesh.triangle.size()));
  for (size_t k = 0; k < n; ++k)
    if (!finite(mesh.position[k]) || (!mesh.velocity.empty() && !finite(mesh.velocity[k])))
      fail(fmt::format("vertex {} is not finite", k));
  for (size_t k = 0; k < mesh.triangle.size(); ++k)
    if (std::max({mesh.triangle[k].x, mesh.triangle[k].y, mesh.triangle[k].z}) >= n)
      fail(fmt::format("triangle {} names a vertex beyond the {} there are", k, n));
}

void check_foam(const FoamFrame& foam) {
  const size_t n = foam.position.size();
  if (foam.velocity.size() != n || foam.radius.size() != n)
    throw Error(fmt::format("foam: {} positions, {} velocities and {} radii; make the foam anew", n,
                            foam.velocity.size(), foam.radius.size()));
  for (size_t k = 0; k < n; ++k)
    if (!finite(foam.position[k]) || !finite(foam.velocity[k]) || !(foam.radius[k] > 0) ||
        !(foam.radius[k] < infinity))
      throw Error(
          fmt::format("foam: particle {} is not finite or has no radius; make the foam anew", k));
}

/// Vertex normals weighted by area; vertices at one point of the surface have one.
std::vector<V3f> smooth_normals(const TriangleMesh& mesh) {
  std::vector<V3f> normal(mesh.position.size(), V3f(0));
  const auto point = [&](uint32_t v) { return mesh.point.empty() ? v : mesh.point[v]; };
  for (const auto& t : mesh.triangle) {
    const V3f& a = mesh.position[t.x];
    const V3f n = cross(mesh.position[t.y] - a, mesh.position[t.z] - a);
    for (uint32_t v : {t.x, t.y, t.z}) normal[point(v)] += n;
  }
  for (V3f& n : normal) n = dot(n, n) > 0 ? normalized(n) : V3f(0, 1, 0);
  for (uint32_t v = 0; v < normal.size(); ++v) normal[v] = normal[point(v)];
  return normal;
}

/// Of the vertices over the shutter; the last entry is padding.
Imath::Box3f bounds_of(const SceneObject& object) {
  Imath::Box3f box;
  for (const V3f* positions : object.keys())
    for (size_t k = 0; k + 1 < object.position.size(); ++k) box.extendBy(positions[k]);
  for (const std::vector<Imath::V4f>* spheres : {&object.sphere, &object.sphere_close})
    for (const Imath::V4f& s : *spheres) {
      box.extendBy(V3f(s.x, s.y, s.z) - V3f(s.w));
      box.extendBy(V3f(s.x, s.y, s.z) + V3f(s.w));
    }
  return box;
}

}  // namespace

bool Scene::moves_visibly(const TriangleMesh& mesh) const {
  if (mesh.velocity.empty() || close_ == open_) return false;
  const float shutter = float((close_ - open_) / fps_);  // s
  const float limit = visible_motion / (shutter * camera_.pixels_per_radian());
  for (const auto& t : mesh.triangle) {
    const V3f &a = mesh.position[t.x], &b = mesh.position[t.y], &c = mesh.position[t.z];
    const V3f middle = (a + b + c) / 3;
    const float reach2 =
        std::max({(a - middle).length2(), (b - middle).length2(), (c - middle).length2()});
    const float distance =
        std::max(0.f, (middle - camera_.open().position).length() - std::sqrt(reach2));
    const float speed2 = std::max(
        {mesh.velocity[t.x].length2(), mesh.velocity[t.y].length2(), mesh.velocity[t.z].length2()});
    if (std::sqrt(speed2) > limit * distance) return true;
  }
  return false;
}

/// Of all that a standing object is built from.
Digest Scene::contents_of(const TriangleMesh& mesh, const std::string& name,
                          uint32_t material) const {
  Hasher hasher;
  const auto add = [&](const auto& column) {
    hasher.value(column.size()).bytes(column.data(), column.size() * sizeof(column[0]));
  };
  hasher.text(name).text(material_names_[material]);
  add(mesh.triangle), add(mesh.position), add(mesh.normal), add(mesh.uv), add(mesh.point);
  add(mesh.contact);
  if (keeps_velocities_) add(mesh.velocity);
  return hasher.finish();
}

void Scene::add_object(const TriangleMesh& mesh, const std::string& name, const std::string& what,
                       uint32_t material, Matte matte, const RotationalMotion* motion) {
  check_mesh(mesh, what);
  if (const ShadingMaterial& m = materials_[material];
      mesh.uv.empty() && !mesh.triangle.empty() && (m.texture || m.normal_map))
    log_warning(
        "render",
        fmt::format("\"{}\" has no texture coordinates (uv), so that one point of the pictures "
                    "of material \"{}\" covers all of it. Unwrap its mesh, or leave "
                    "texture and normal_map out",
                    name, material_names_[material]));
  const int segments = motion ? segments_of(mesh, *motion) : 0;
  const bool moves = segments > 0 || moves_visibly(mesh);
  const Digest contents = moves ? Digest{} : contents_of(mesh, name, material);
  if (std::optional<SceneObject> kept = moves ? std::nullopt : cache_->take(contents)) {
    kept->material = material;
    kept->light = -1;
    kept->matte = matte;
    kept->body = 0;
    objects_.push_back(std::move(*kept));
    return;
  }
  SceneObject object;
  object.contents = contents;
  object.name = name;
  object.material_name = material_names_[material];
  if (keeps_velocities_) object.velocity = mesh.velocity;
  object.triangle = mesh.triangle;
  object.normal = mesh.normal.empty() ? smooth_normals(mesh) : mesh.normal;
  object.uv = mesh.uv;
  object.contact = mesh.contact;
  object.material = material;
  object.matte = matte;
  const auto at = [&](double frames) {
    std::vector<V3f> moved = mesh.position;
    const float dt = float(frames / fps_);
    if (dt != 0 && !mesh.velocity.empty())
      for (size_t k = 0; k < moved.size(); ++k) moved[k] += mesh.velocity[k] * dt;
    moved.push_back(V3f(0));
    return moved;
  };
  if (segments > 0) {
    add_motion_keys(object, mesh, *motion, segments);
  } else if (moves) {
    object.position = at(open_);
    object.position_close = at(close_);
  } else {
    object.position = at(0);
  }
  objects_.push_back(std::move(object));
}

bool Scene::moves_visibly(const FoamFrame& foam) const {
  const float shutter = float((close_ - open_) / fps_);  // s
  if (shutter == 0) return false;
  const float limit = visible_motion / (shutter * camera_.pixels_per_radian());
  for (size_t k = 0; k < foam.position.size(); ++k) {
    const float distance = (foam.position[k] - camera_.open().position).length();
    if (foam.velocity[k].length() > limit * std::max(0.f, distance - foam.radius[k])) return true;
  }
  return false;
}

void Scene::add_foam(const FoamFrame& foam) {
  check_foam(foam);
  ShadingMaterial white;
  white.reflectance = V3f(foam_reflectance);
  white.transmittance = white.absorption = V3f(0);
  materials_.push_back(white);
  material_names_.push_back("foam");
  SceneObject object;
  object.name = object.material_name = "foam";
  if (keeps_velocities_) object.velocity = foam.velocity;
  object.material = uint32_t(materials_.size() - 1);
  const auto at = [&](double frames) {
    std::vector<Imath::V4f> spheres;
    spheres.reserve(foam.position.size());
    for (size_t k = 0; k < foam.position.size(); ++k) {
      const V3f p = foam.position[k] + foam.velocity[k] * float(frames / fps_);
      spheres.emplace_back(p.x, p.y, p.z, foam.radius[k]);
    }
    return spheres;
  };
  if (moves_visibly(foam)) {
    object.sphere = at(open_);
    object.sphere_close = at(close_);
  } else {
    object.sphere = at(0);
  }
  objects_.push_back(std::move(object));
}

EmbreeGeometry Scene::triangles_of(const SceneObject& object) const {
  EmbreeGeometry geometry(rtcNewGeometry(cache_->device().get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  const size_t vertices = object.position.size() - 1;
  const std::vector<const V3f*> keys = object.keys();
  rtcSetGeometryTimeStepCount(geometry.get(), unsigned(keys.size()));
  for (unsigned k = 0; k < keys.size(); ++k)
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, k, RTC_FORMAT_FLOAT3,
                               keys[k], 0, sizeof(V3f), vertices);
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             object.triangle.data(), 0, 3 * sizeof(uint32_t),
                             object.triangle.size());
  return geometry;
}

EmbreeGeometry Scene::spheres_of(const SceneObject& object) const {
  EmbreeGeometry geometry(rtcNewGeometry(cache_->device().get(), RTC_GEOMETRY_TYPE_SPHERE_POINT));
  rtcSetGeometryTimeStepCount(geometry.get(), object.moves() ? 2 : 1);
  unsigned step = 0;
  for (const std::vector<Imath::V4f>* spheres : {&object.sphere, &object.sphere_close})
    if (!spheres->empty())
      rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, step++, RTC_FORMAT_FLOAT4,
                                 spheres->data(), 0, sizeof(Imath::V4f), spheres->size());
  return geometry;
}

void Scene::build(SceneObject& object) {
  if (object.scene) return;  // from the cache
  object.bounds = bounds_of(object);
  const EmbreeGeometry geometry = object.sphere.empty() ? triangles_of(object) : spheres_of(object);
  rtcSetGeometryMask(geometry.get(), 0xffffffffu);
  rtcCommitGeometry(geometry.get());
  object.scene.reset(rtcNewScene(cache_->device().get()));
  if (materials_[object.material].type == MaterialType::dielectric)
    rtcSetSceneFlags(object.scene.get(), RTC_SCENE_FLAG_ROBUST);
  // High quality would split triangles differently for different thread counts.
  rtcSetSceneBuildQuality(object.scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  rtcAttachGeometry(object.scene.get(), geometry.get());
  rtcJoinCommitScene(object.scene.get());
  check_embree(cache_->device().get());
}

}  // namespace drench::render

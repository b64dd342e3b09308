// What the scene knows of cloth at a point of it: its fuzz, its yarns, its gaps, how wet it is.

#include "render/scene/fabric.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "pipeline/contract/error.h"

namespace drench::render {

FabricPoint fabric_at(const Scene& scene, const Surface& surface, const Hit& hit, float time,
                      float wetness, Bodies in) {
  const ShadingMaterial& material = *surface.material;
  FabricPoint out;
  out.dry = {material.reflectance_at(surface.uv), material.transmittance};
  out.wetness = wetness;
  out.sheen = material.sheen;
  out.fuzz = material.fuzz.get();
  if (material.yarns) {
    out.yarn = material.yarn;
    out.yarns = material.yarns.get();
    std::tie(out.along_u, out.along_v) = scene.yarns_along(hit, time);
  }
  if (wetness > 0) {
    out.wet = wet_colours(out.dry, material.fibres);
    out.film_alpha = material.alpha;
    out.film_eta = material.ior / scene.medium(in).ior;
    out.film = &scene.coat_albedo(material, in);
  }
  return out;
}

/// One table for each roughness of fuzz and of yarns.
void Scene::find_fabrics() {
  std::map<float, std::shared_ptr<const SheenTable>> fuzz;
  std::map<float, std::shared_ptr<const YarnTable>> yarns;
  for (ShadingMaterial& m : materials_) {
    if (!is_black(m.sheen)) {
      auto& table = fuzz[m.sheen_roughness];
      if (!table) table = std::make_shared<const SheenTable>(m.sheen_roughness);
      m.fuzz = table;
    }
    if (!is_black(m.yarn)) {
      auto& table = yarns[m.yarn_alpha];
      if (!table) table = std::make_shared<const YarnTable>(m.yarn_alpha);
      m.yarns = table;
    }
  }
}

void Scene::check_yarns(const SceneObject& object, const std::string& what) const {
  if (is_black(materials_[object.material].yarn) || !object.uv.empty() || object.triangle.empty())
    return;
  throw Error(
      fmt::format("{}: its material '{}' has a yarn_specular, but the mesh has no texture "
                  "coordinates, along which yarns run; give it u and v or take yarn_specular out",
                  what, object.material_name));
}

std::pair<V3f, V3f> Scene::yarns_along(const Hit& hit, float time) const {
  if (hit.kind == Hit::Kind::ground) return {V3f(1, 0, 0), V3f(0, 0, 1)};
  const SceneObject& object = objects_[hit.index];
  if (object.uv.empty()) return {V3f(0), V3f(0)};
  const auto& t = object.triangle[hit.triangle];
  const Corners at = object.corners(hit.triangle, time);
  const V3f e = (at.position[1] - at.position[0]).unpacked(),
            f = (at.position[2] - at.position[0]).unpacked();
  const V2f p = object.uv[t.y] - object.uv[t.x], q = object.uv[t.z] - object.uv[t.x];
  return {e * q.y - f * p.y, f * p.x - e * q.x};  // either may run in the opposite direction
}

void Scene::add_wetness(SceneObject& object, const TriangleMesh& mesh, const std::string& what) {
  ShadingMaterial& material = materials_[object.material];
  object.wetness.clear();
  if (mesh.wetness.empty() || material.type != MaterialType::cloth) return;
  if (mesh.wetness.size() != mesh.position.size())
    throw Error(fmt::format("{}: {} values of wetness for {} vertices; make the mesh anew", what,
                            mesh.wetness.size(), mesh.position.size()));
  for (size_t k = 0; k < mesh.wetness.size(); ++k)
    if (!(mesh.wetness[k] >= 0 && mesh.wetness[k] <= 1))
      throw Error(
          fmt::format("{}: wetness of vertex {} is {}, but it is the share of the cloth that is "
                      "wet; write values from 0 to 1, or leave the column out",
                      what, k, mesh.wetness[k]));
  const auto is_dry = [](float w) { return w == 0; };
  if (std::all_of(mesh.wetness.begin(), mesh.wetness.end(), is_dry)) return;
  object.wetness = mesh.wetness;
  material.alpha = material.film_alpha;
  material.fibres = WetFibres(double(material.ior));
}

float Scene::transmitted(const Ray& ray, const Target& target, World world) const {
  if (!has_gaps_) return occluded(ray, target, world) ? 0.f : 1.f;
  if (occluded(ray, target, world, Gaps::open)) return 0;
  float transmittance = 1;
  for (uint32_t k = 0; k < objects_.size(); ++k) {
    const float gap = materials_[objects_[k].material].gap;
    if (!(gap > 0) || (world == World::plate && objects_[k].matte == Matte::none)) continue;
    // Layer by layer, as paths go through them.
    Ray rest = ray;
    float reach = target.distance * (1 - 1e-4f);
    for (Hit hit = meet(k, rest, reach); hit.kind != Hit::Kind::nothing && transmittance > 0;
         hit = meet(k, rest, reach)) {
      transmittance *= gap;
      reach -= hit.distance;
      rest.origin = surface(rest, hit).leave(ray.direction);
    }
  }
  return transmittance;
}

bool Scene::fluid_beyond(const Ray& ray) const {
  const Hit hit = intersect(ray, Coherence::incoherent);
  if (hit.kind == Hit::Kind::object && objects_[hit.index].body == fluid_) {
    const Surface s = surface(ray, hit);
    return s.contact || dot(ray.direction, s.geometric_normal) > 0;
  }
  return bodies_at(ray.origin, ray.time) & fluid_;
}

float Scene::wetness(const Hit& hit) const {
  if (hit.kind != Hit::Kind::object) return 0;
  const SceneObject& object = objects_[hit.index];
  if (object.wetness.empty()) return 0;
  const auto& t = object.triangle[hit.triangle];
  const float w = object.wetness[t.x] * (1 - hit.u - hit.v) + object.wetness[t.y] * hit.u +
                  object.wetness[t.z] * hit.v;
  return std::clamp(w, 0.f, 1.f);  // rounding
}

}  // namespace drench::render

// What the scene knows of cloth at a point of it: how wet it is.

#include "render/fabric.h"

#include <fmt/format.h>

#include "pipeline/contract/error.h"

namespace drench {

FabricPoint fabric_at(const Scene& scene, const Surface& surface, float wetness, Bodies in) {
  const ShadingMaterial& material = *surface.material;
  FabricPoint out;
  out.dry = {material.reflectance_at(surface.uv), material.transmittance};
  out.wetness = wetness;
  if (wetness > 0) {
    out.wet = wet_colours(out.dry, material.fibres);
    out.film_alpha = material.alpha;
    out.film_eta = material.ior / scene.medium(in).ior;
    out.film = &scene.coat_albedo(material, in);
  }
  return out;
}

void Scene::add_wetness(SceneObject& object, const TriangleMesh& mesh, const std::string& what) {
  ShadingMaterial& material = materials_[object.material];
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
  object.wetness = mesh.wetness;
  material.alpha = material.film_alpha;
  material.fibres = WetFibres(double(material.ior));
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

}  // namespace drench

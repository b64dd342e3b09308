#include "render/bsdf/material.h"

#include <fmt/format.h>

#include <set>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/shot_table.h"

namespace drench::render {

namespace {

/// The dark squares of the built-in checker, as a fraction of the reflectance.
constexpr float dark_square = 0.45f;
/// Below it facets would be narrower than float directions resolve: smooth.
constexpr double min_roughness = 0.01;

const Material* named(const std::vector<Material>& materials, const std::string& name) {
  for (const Material& m : materials)
    if (m.name == name) return &m;
  return nullptr;
}

template <class Fail>
void check_fabric(const Material& m, const Fail& fail) {
  for (int c = 0; c < 3; ++c)
    if (!(m.sheen[c] >= 0 && m.yarn_specular[c] >= 0 &&
          m.sheen[c] + m.yarn_specular[c] <= 1 + 1e-6f))
      fail("sheen and yarn_specular must not be negative and their sum must not exceed 1");
  const auto within = [&](const char* key, double value, double lowest) {
    if (!(value >= lowest && value <= 1))
      fail(fmt::format("{} is {}; it must lie between {} and 1", key, value, lowest));
  };
  within("sheen_roughness", m.sheen_roughness, 0.1);
  within("yarn_roughness", m.yarn_roughness, 0.1);
  if (!(m.gap >= 0 && m.gap < 1))
    fail(fmt::format("gap is {}; it must be at least 0 and below 1", m.gap));
  within("film_roughness", m.film_roughness, 0.05);
}

void check(const Material& m) {
  const auto fail = [&](const std::string& what) {
    throw Error(fmt::format("material '{}': {}", m.name, what));
  };
  for (int c = 0; c < 3; ++c) {
    if (!(m.reflectance[c] >= 0 && m.transmittance[c] >= 0 &&
          m.reflectance[c] + m.transmittance[c] <= 1 + 1e-6f))
      fail("reflectance and transmittance must not be negative and their sum must not exceed 1");
    if (!(m.absorption[c] >= 0) || !std::isfinite(m.absorption[c]))
      fail("absorption must not be negative");
  }
  for (int c = 0; c < 3; ++c)
    if (!(m.emission[c] >= 0) || !std::isfinite(m.emission[c]))
      fail("emission must not be negative");
  const bool refracts = m.type == MaterialType::dielectric || m.type == MaterialType::coated ||
                        m.type == MaterialType::cloth;
  if (refracts && !(m.ior >= 1 && m.ior <= 10))
    fail(fmt::format("ior is {}; it must lie between 1 and 10", m.ior));
  if (!(m.roughness >= 0 && m.roughness <= 1))
    fail(fmt::format("roughness is {}; it must lie between 0 and 1", m.roughness));
  if (!(m.checker_size > 0)) fail("checker_size must be positive");
  if (!(m.texture_size > 0)) fail("texture_size must be positive");
  if (m.type == MaterialType::cloth) check_fabric(m, fail);
}

}  // namespace

V3f ShadingMaterial::pictured_reflectance(const V2f& uv) const {
  V3f out = reflectance;
  if (checker) {
    const float squares =
        std::floor(uv.x * inverse_checker_size) + std::floor(uv.y * inverse_checker_size);
    if (squares - 2 * std::floor(squares / 2) == 1) out *= dark_square;  // not of infinite ones
  }
  if (texture) {
    const V3f color = texture->at(picture_uv(uv));
    for (int c = 0; c < 3; ++c) out[c] = std::clamp(out[c] * color[c], 0.f, 1 - transmittance[c]);
  }
  return out;
}

V3f ShadingMaterial::normal_at(const V2f& uv, const V3f& shading, const V3f& along_u,
                               const V3f& along_v) const {
  const V3f across = along_u - shading * dot(along_u, shading);
  const float square = dot(across, across);
  if (!(square > 0)) return shading;
  const V3f tangent = across * (1 / std::sqrt(square));
  V3f bitangent = cross(shading, tangent);
  if (dot(bitangent, along_v) < 0) bitangent = -bitangent;  // a mirrored picture
  const V3f n = normal_map->at(picture_uv(uv));
  const V3f mapped = tangent * n.x + bitangent * n.y + shading * n.z;
  return dot(mapped, mapped) > 0 ? normalized(mapped) : shading;
}

ShadingMaterial find_material(const Shot& shot, const std::string& name, PictureMemory& memory) {
  const Material* found = named(shot.material, name);
  if (!found) found = named(shot_table::built_in_materials(), name);
  if (!found)
    throw Error(
        fmt::format("material '{}' is used but the shot has no such material; add a "
                    "[[material]] with this name or use water, cotton or ground",
                    name));
  check(*found);
  ShadingMaterial out;
  out.type = found->type;
  out.reflectance = found->reflectance;
  if (found->type == MaterialType::cloth) {
    out.transmittance = found->transmittance;
    out.sheen = found->sheen;
    out.sheen_roughness = float(found->sheen_roughness);
    out.yarn = found->yarn_specular;
    out.yarn_alpha = float(found->yarn_roughness * found->yarn_roughness);
    out.gap = float(found->gap);
    out.film_alpha = float(found->film_roughness * found->film_roughness);
  } else {
    out.transmittance = V3f(0);
  }
  if (found->type == MaterialType::diffuse) out.emission = found->emission;
  const bool facets = found->type == MaterialType::dielectric ||
                      found->type == MaterialType::metal || found->type == MaterialType::coated;
  if (facets && found->roughness >= min_roughness)
    out.alpha = float(found->roughness * found->roughness);
  out.edge = found->edge;
  out.ior = float(found->ior);
  out.priority = found->priority;
  out.absorption = found->absorption;
  if (!found->texture.empty())
    out.texture = std::make_shared<const Texture>(read_texture(found->texture, memory));
  if (!found->normal_map.empty())
    out.normal_map = std::make_shared<const Texture>(read_normal_map(found->normal_map, memory));
  out.checker = found->checker;
  out.inverse_checker_size = float(1 / found->checker_size);
  out.inverse_texture_size = float(1 / found->texture_size);
  return out;
}

void check_pictures(const Shot& shot, PictureMemory memory) {
  std::set<std::string> used;
  if (shot.fluid.present()) used.insert(shot.fluid.material);
  if (shot.ground.present) used.insert(shot.ground.material);
  for (const Obstacle& obstacle : shot.obstacle)
    if (obstacle.visible) used.insert(obstacle.material);
  for (const Cloth& cloth : shot.cloth) used.insert(cloth.material);
  for (const std::string& name : used) find_material(shot, name, memory);
  for (const Light& light : shot.light)
    if (!light.map.empty()) read_sky(light.map, memory);
}

}  // namespace drench::render

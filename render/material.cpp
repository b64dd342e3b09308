#include "render/material.h"

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot_table.h"

namespace drench {

namespace {

/// The dark squares of the built-in checker, as a share of the reflectance.
constexpr float kDarkSquare = 0.45f;

const Material* named(const std::vector<Material>& materials, const std::string& name) {
  for (const Material& m : materials)
    if (m.name == name) return &m;
  return nullptr;
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
  if (m.type == MaterialType::dielectric && !(m.ior >= 1 && m.ior <= 10))
    fail(fmt::format("ior is {}; it must lie between 1 and 10", m.ior));
  if (m.checker && !(m.checker_size > 0)) fail("checker_size must be positive");
}

}  // namespace

V3f ShadingMaterial::reflectance_at(const V2f& uv) const {
  V3f out = reflectance;
  if (checker) {
    const int squares =
        int(std::floor(uv.x * inverse_checker_size)) + int(std::floor(uv.y * inverse_checker_size));
    if (squares & 1) out *= kDarkSquare;
  }
  if (texture) {
    const V3f color = texture->at(checker ? uv * inverse_checker_size : uv);
    for (int c = 0; c < 3; ++c) out[c] = std::clamp(out[c] * color[c], 0.f, 1 - transmittance[c]);
  }
  return out;
}

ShadingMaterial find_material(const Shot& shot, const std::string& name) {
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
  if (found->type == MaterialType::cloth)
    out.transmittance = found->transmittance;
  else
    out.transmittance = V3f(0);
  if (found->type == MaterialType::diffuse) out.emission = found->emission;
  out.ior = float(found->ior);
  out.priority = found->priority;
  out.absorption = found->absorption;
  if (!found->texture.empty())
    out.texture = std::make_shared<const Texture>(read_texture(found->texture));
  out.checker = found->checker;
  out.inverse_checker_size = float(1 / found->checker_size);
  return out;
}

}  // namespace drench

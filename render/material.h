#pragma once
// Materials as the path loop reads them.

#include <memory>

#include "pipeline/contract/shot.h"
#include "render/texture.h"

namespace drench {

struct ShadingMaterial {
  MaterialType type = MaterialType::diffuse;
  V3f reflectance, transmittance;
  V3f emission{0, 0, 0};  // W/(sr m^2)
  float ior = 1;
  int priority = 0;
  V3f absorption;  // 1/m
  std::shared_ptr<const Texture> texture;
  bool checker = false;
  float inverse_checker_size = 1;  // 1/m

  /// Diffuse reflectance at a surface point; with the transmittance never above 1.
  V3f reflectance_at(const V2f& uv) const;
};

/// The shot's material of that name, or the built-in "water", "cotton" or "ground".
/// @throws Error for an unknown name, impossible values, or a texture that cannot be read.
ShadingMaterial find_material(const Shot& shot, const std::string& name);

}  // namespace drench

#pragma once
// Materials as the path loop reads them.

#include <memory>

#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "render/bsdf/albedo_table.h"
#include "render/bsdf/sheen.h"
#include "render/bsdf/wet_cloth.h"
#include "render/bsdf/yarn.h"
#include "render/texture/texture.h"

namespace drench::render {

struct ShadingMaterial {
  MaterialType type = MaterialType::diffuse;
  V3f reflectance, transmittance, edge{1, 1, 1};
  float alpha = 0;                    // of GGX facets, of a film on cloth; 0: smooth, dry cloth
  V3f sheen{0, 0, 0}, yarn{0, 0, 0};  // of cloth
  float sheen_roughness = 0.3f;
  float yarn_alpha = 0.16f;  // slope of fibres along yarns
  float gap = 0;             // of cloth: fraction that is open
  float film_alpha = 0;      // of cloth where it is wet; Scene makes it alpha of sheets that may be
  WetFibres fibres;          // of such sheets
  V3f emission{0, 0, 0};     // W/(sr m^2)
  float ior = 1;
  int priority = 0;
  V3f absorption;  // 1/m
  std::shared_ptr<const Texture> texture, normal_map;
  bool checker = false;
  float inverse_checker_size = 1;  // 1/m
  float inverse_texture_size = 1;

  /// Scene fills them in, for cloth that has fuzz or yarns.
  std::shared_ptr<const SheenTable> fuzz;
  std::shared_ptr<const YarnTable> yarns;

  /// By the medium outside: seen from there, and for a rough dielectric from within; of metal one.
  /// None where the indices are the same. Scene fills them in, for what has facets.
  std::vector<std::shared_ptr<const AlbedoTable>> albedo_outside, albedo_inside;

  bool has_facets() const {
    return type == MaterialType::metal || type == MaterialType::coated || alpha > 0;
  }
  /// Whether it ends light where its smooth normals say (Surface::lift). Mapped ones say other
  /// things.
  bool ends_light_smoothly() const {
    const bool diffuse = type == MaterialType::diffuse || type == MaterialType::cloth ||
                         type == MaterialType::coated;
    return diffuse && is_black(transmittance) && !normal_map;
  }
  /// Whether light meets more than a diffuse sheet where it is dry.
  bool is_fabric() const { return !is_black(sheen) || !is_black(yarn); }
  /// Diffuse reflectance at a surface point; with the transmittance never above 1.
  V3f reflectance_at(const V2f& uv) const {
    return checker || texture ? pictured_reflectance(uv) : reflectance;
  }
  /// The mapped normal. @param shading  unit  @param along_u, along_v  of growing u and v, any
  /// length
  V3f normal_at(const V2f& uv, const V3f& shading, const V3f& along_u, const V3f& along_v) const;

 private:
  V3f pictured_reflectance(const V2f& uv) const;
  V2f picture_uv(const V2f& uv) const { return uv * inverse_texture_size; }
};

/// The shot's material of that name, or the built-in "water", "cotton" or "ground".
/// @throws Error for an unknown name, impossible values, or a texture that cannot be read.
ShadingMaterial find_material(const Shot& shot, const std::string& name,
                              PictureMemory& memory = PictureMemory::without_limit());

/// Reads the pictures of all materials and lights that a shot uses, for their warnings.
/// @param memory  what they may take together
/// @throws Error as find_material and read_sky.
void check_pictures(const Shot& shot, PictureMemory memory);

}  // namespace drench::render

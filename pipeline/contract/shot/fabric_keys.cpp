#include "pipeline/contract/shot/fabric_keys.h"

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/fabrics.h"

namespace drench {

namespace {

struct Constant {
  const char* key;
  double Cloth::*to;
  double Fabric::*from;
};

constexpr Constant constants[] = {
    {"areal_density", &Cloth::areal_density, &Fabric::areal_density},
    {"thickness", &Cloth::thickness, &Fabric::thickness},
    {"young_warp", &Cloth::young_warp, &Fabric::young_warp},
    {"young_weft", &Cloth::young_weft, &Fabric::young_weft},
    {"shear_modulus", &Cloth::shear_modulus, &Fabric::shear},
    {"poisson", &Cloth::poisson, &Fabric::poisson},
    {"bend_warp", &Cloth::bend_warp, &Fabric::bend_warp},
    {"bend_weft", &Cloth::bend_weft, &Fabric::bend_weft},
    {"bend_bias", &Cloth::bend_bias, &Fabric::bend_bias},
    {"stretch_limit", &Cloth::stretch_limit, &Fabric::stretch_limit},
    {"damping_time", &Cloth::damping_time, &Fabric::damping_time},
    {"friction", &Cloth::friction, &Fabric::friction},
    {"water_capacity", &Cloth::water_capacity, &Fabric::water_capacity},
    {"soak_time", &Cloth::soak_time, &Fabric::soak_time},
    {"wet_modulus_ratio", &Cloth::wet_modulus_ratio, &Fabric::wet_modulus_ratio},
    {"wet_friction", &Cloth::wet_friction, &Fabric::wet_friction},
};

constexpr const char* spring_keys[] = {"adjacent_stiffness", "diagonal_stiffness", "spring_damping",
                                       "retardation_time"};
constexpr const char* shell_keys[] = {
    "fabric",      "young_warp",     "young_weft",   "shear_modulus", "poisson",
    "bend_warp",   "bend_weft",      "bend_bias",    "stretch_limit", "damping_time",
    "friction",    "self_collision", "write_strain", "sleep_speed",   "soaks",
    "wetness",     "water_capacity", "soak_time",    "dry_time",      "wet_modulus_ratio",
    "wet_friction"};

/// The first of these keys that the shot gives, or null.
template <size_t N>
const char* first_given(const char* const (&keys)[N], const ShotSources& sources,
                        const std::string& path) {
  for (const char* key : keys)
    if (sources.where.contains(path + key)) return key;
  return nullptr;
}

/// A shell wherever the solver can take one along, unless a key of springs is given.
/// @throws Error where keys of both models are given.
ClothModel model_of(const Shot& shot, const ShotSources& sources, const std::string& path) {
  const char* const spring = first_given(spring_keys, sources, path);
  const char* const shell = first_given(shell_keys, sources, path);
  if (spring != nullptr && shell != nullptr) {
    throw Error(
        fmt::format("{0}: {1}{2} is of a shell, but {1}{3} of a net of springs. Remove one, "
                    "or say which with {1}model",
                    sources.at(path + shell), path, shell, spring));
  }
  if (spring != nullptr) return ClothModel::springs;
  return shell != nullptr || is_incompressible(shot) ? ClothModel::shell : ClothModel::springs;
}

}  // namespace

void take_fabrics(Shot& shot, const ShotSources& sources) {
  for (size_t i = 0; i < shot.cloth.size(); ++i) {
    Cloth& cloth = shot.cloth[i];
    const std::string path = fmt::format("cloth[{}].", i);
    if (cloth.model == ClothModel::automatic) cloth.model = model_of(shot, sources, path);
    if (cloth.model != ClothModel::shell) continue;
    const Fabric* const fabric = find_fabric(cloth.fabric);
    if (fabric == nullptr) {
      std::string names;
      for (const Fabric& one : fabrics)
        names += (names.empty() ? "" : ", ") + std::string(one.name);
      throw Error(
          fmt::format("{}: {}fabric is \"{}\", which there is no table of. Use one of {}, "
                      "and give what differs by keys",
                      sources.at(path + "fabric"), path, cloth.fabric, names));
    }
    for (const Constant& c : constants)
      if (!sources.where.contains(path + c.key)) cloth.*c.to = fabric->*c.from;
  }
}

}  // namespace drench

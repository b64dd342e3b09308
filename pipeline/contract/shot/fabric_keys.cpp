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
};

}  // namespace

void take_fabrics(Shot& shot, const ShotSources& sources) {
  for (size_t i = 0; i < shot.cloth.size(); ++i) {
    Cloth& cloth = shot.cloth[i];
    if (cloth.model != ClothModel::shell) continue;
    const std::string path = fmt::format("cloth[{}].", i);
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

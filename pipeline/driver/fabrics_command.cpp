#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "pipeline/contract/shot/fabrics.h"
#include "pipeline/driver/commands.h"
#include "pipeline/driver/standard_output.h"

namespace drench {

namespace {

struct Constant {
  const char* name;
  const char* unit;
  double Fabric::*value;
};

constexpr Constant constants[] = {
    {"areal_density", "kg/m2", &Fabric::areal_density},
    {"thickness", "m", &Fabric::thickness},
    {"young_warp", "N/m", &Fabric::young_warp},
    {"young_weft", "N/m", &Fabric::young_weft},
    {"shear", "N/m", &Fabric::shear},
    {"poisson", "1", &Fabric::poisson},
    {"bend_warp", "N m", &Fabric::bend_warp},
    {"bend_weft", "N m", &Fabric::bend_weft},
    {"bend_bias", "N m", &Fabric::bend_bias},
    {"friction", "1", &Fabric::friction},
    {"stretch_limit", "1", &Fabric::stretch_limit},
    {"damping_time", "s", &Fabric::damping_time},
    {"water_capacity", "kg/m2", &Fabric::water_capacity},
    {"soak_time", "s", &Fabric::soak_time},
    {"wet_modulus_ratio", "1", &Fabric::wet_modulus_ratio},
    {"wet_friction", "1", &Fabric::wet_friction},
    {"contact_angle_deg", "deg", &Fabric::contact_angle_deg},
};

std::string as_text() {
  std::string text = "fabric";
  for (const Constant& c : constants) text += fmt::format("\t{} [{}]", c.name, c.unit);
  text += "\tsource\n";
  for (const Fabric& fabric : fabrics) {
    text += fabric.name;
    for (const Constant& c : constants) text += fmt::format("\t{:.4g}", fabric.*c.value);
    text += fmt::format("\t{}\n", fabric.source);
  }
  return text;
}

std::string as_json() {
  nlohmann::json all = nlohmann::json::object();
  for (const Fabric& fabric : fabrics) {
    nlohmann::json& one = all[std::string(fabric.name)];
    for (const Constant& c : constants) one[c.name] = fabric.*c.value;
    one["source"] = fabric.source;
  }
  return json_line({{"fabrics", all}});
}

}  // namespace

void fabrics_command(OutputFormat format) {
  print(format == OutputFormat::json ? as_json() : as_text());
}

}  // namespace drench

// What is written of a shot: the lock file, the digests of the stages, the reference, a first shot.
#include <fmt/format.h>

#include <functional>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/contract/shot/shot_table.h"
#include "pipeline/contract/shot/shot_text.h"

namespace drench {

using shot_table::Kind;
using shot_table::Parameter;
using shot_table::Section;

namespace {

std::string header_of(const Section& section) {
  return section.repeated ? fmt::format("[[{}]]", section.name) : fmt::format("[{}]", section.name);
}

std::string stages_text(unsigned stages) {
  std::string text;
  const auto add = [&](unsigned bit, const char* name) {
    if (stages & bit) text += (text.empty() ? "" : ", ") + std::string(name);
  };
  add(shot_table::simulate, "simulate");
  add(shot_table::mesh, "mesh");
  add(shot_table::foam, "foam");
  add(shot_table::render, "render");
  add(shot_table::denoise, "denoise");
  return text.empty() ? "-" : text;
}

/// Default of a row as TOML, from a freshly made object.
std::string default_text(const Parameter& parameter) {
  if (parameter.required) return "*required*";
  static Shot shot = [] {
    Shot fresh;
    fresh.fluid.box.resize(1);
    fresh.fluid.sphere.resize(1);
    fresh.fluid.emitter.resize(1);
    fresh.fluid.drops.resize(1);
    fresh.fluid.volume.resize(1);
    fresh.sink.resize(1);
    fresh.cloth.resize(1);
    fresh.cloth[0].pin.resize(1), fresh.cloth[0].seam.resize(1);
    fresh.obstacle.resize(1);
    fresh.probe.resize(1);
    fresh.light.resize(1);
    fresh.material.resize(1);
    return fresh;
  }();
  std::string text;
  shot_table::for_each_object(shot, [&](const Section& section, void* object, const std::string&) {
    if (section.name == parameter.section && parameter.field != nullptr &&
        parameter.key != "name") {
      text = shot_table::value_text(parameter, parameter.field(object));
    }
  });
  return text;
}

std::string types_text(const Parameter& parameter) {
  if (parameter.types == ~0u) return "";
  const std::string_view key = shot_table::find_section(parameter.section)->type_key;
  const Parameter& type = *shot_table::find_parameter(parameter.section, key);
  std::vector<std::string_view> names;
  for (size_t i = 0; i < type.choices.size(); ++i) {
    if (parameter.types >> i & 1u) names.push_back(type.choices[i]);
  }
  return fmt::format("; {} {} only", key, fmt::join(names, ", "));
}

bool has_limits(const Parameter& parameter) {
  return parameter.limits.lowest < parameter.limits.highest;
}

std::string value_column(const Parameter& p) {
  std::string text = shot_table::kind_text(p);
  if (text.ends_with(',')) text.pop_back();
  if (has_limits(p))
    text += ", " + shot_table::limits_text(p).substr(std::string("it must lie ").size());
  return text;
}

}  // namespace

std::string shot_lock(const Shot& shot) {
  std::string text = "# The resolved shot: every key with the value that was used.\n";
  Shot copy = shot;  // the table hands out fields to write to
  shot_table::for_each_object(copy, [&](const Section& section, void* object, const std::string&) {
    text += fmt::format("\n{}\n", header_of(section));
    for (const Parameter* p : shot_table::parameters_of(section.name)) {
      if (p->field == nullptr || !shot_table::applies(*p, section, object)) continue;
      const std::string value = shot_table::value_text(*p, p->field(object));
      if (!value.empty()) text += fmt::format("{} = {}\n", p->key, value);
    }
  });
  return text;
}

Digest stage_settings_digest(const Shot& shot, Stage stage) {
  const unsigned bit = stage == Stage::simulate ? shot_table::simulate
                       : stage == Stage::mesh   ? shot_table::mesh
                       : stage == Stage::foam   ? shot_table::foam
                       : stage == Stage::render ? shot_table::render
                                                : shot_table::denoise;
  Hasher hasher;
  hasher.text("drench shot settings").value(uint32_t(bit));
  Shot copy = shot;
  shot_table::for_each_object(
      copy, [&](const Section& section, void* object, const std::string& path) {
        for (const Parameter* p : shot_table::parameters_of(section.name)) {
          if (!(p->stages & bit) || p->field == nullptr) continue;
          hasher.text(path).text(p->key);
          if (p->kind == Kind::frames) {
            hasher.value(int32_t(copy.timeline.first));  // a longer shot is the same simulation
          } else if (p->kind == Kind::path) {
            const auto& file = *static_cast<const std::filesystem::path*>(p->field(object));
            if (!file.empty()) hasher.digest(hash_file(file));  // content, wherever it stands
          } else if (p->kind == Kind::mesh_files) {
            const auto& file = *static_cast<const std::filesystem::path*>(p->field(object));
            // The files of a sequence belong to the keys of their frames.
            if (is_sequence(file))
              hasher.text(file.filename().string());
            else if (!file.empty())
              hasher.digest(hash_file(file));
          } else {
            hasher.text(shot_table::value_text(*p, p->field(object)));
          }
        }
      });
  return hasher.finish();
}

std::string shot_reference_markdown() {
  std::string text =
      "# Shot files\n\n"
      "A shot is one TOML file. An unknown key, a wrong type or an impossible value is an error "
      "that "
      "names file, line, key, value and limits. SI units; a key that is not SI says so in its "
      "name. "
      "Paths are relative to the shot's folder. Right-handed axes, Y up.\n\n"
      "`drench init NAME` writes a commented shot to start from, with `--reference` one of every "
      "key. "
      "`--set section.key=value` changes "
      "one "
      "value from the command line, with the same checks; of things that may stand more than once "
      "it "
      "names which one, by name or by number from 0: `--set cloth.sheet.cells=[32,32]`. "
      "`[quality.NAME.section]` tables hold overrides for `--quality NAME`, in the same way: "
      "`[quality.preview.render]`, `[quality.preview.cloth.sheet]`. `final` is the shot as "
      "written.\n\n"
      "A colour is `[r, g, b]` in linear ACEScg, or `\"srgb(r, g, b)\"` with 0 to 255, or "
      "`\"#rrggbb\"`. A value that may be animated is a constant or `[[frame, value], ...]` with "
      "rising frames.\n\n"
      "*Read by* names the stages whose results depend on the value: changing it makes these, and "
      "what follows from changed results, be computed again.\n\n"
      "This page is generated from the table that parses shots; a test keeps it equal.\n";
  for (const Section& section : shot_table::sections()) {
    text += fmt::format("\n## `{}`\n\n{}\n\n", header_of(section), section.description);
    text += "| key | value | default | read by | meaning |\n| --- | --- | --- | --- | --- |\n";
    for (const Parameter* p : shot_table::parameters_of(section.name)) {
      const std::string fallback = default_text(*p);
      const bool marked = fallback.empty() || fallback.starts_with('*');
      text += fmt::format("| `{}` | {} | {} | {} | {}{} |\n", p->key, value_column(*p),
                          marked ? fallback : "`" + fallback + "`", stages_text(p->stages),
                          p->description, types_text(*p));
    }
  }
  return text;
}

namespace {

/// A ball of water over a sheet held at its corners: small, and every section in use.
Shot first_shot(const std::string& name) {
  Shot shot;
  shot.name = name;
  shot.timeline = {1001, 1048, 24};
  shot.domain.min = {-0.5, 0, -0.5};
  shot.domain.max = {0.5, 1.2, 0.5};
  shot.fluid.spacing = 0.015;
  shot.fluid.sphere.push_back({.center = {0, 0.85, 0}, .radius = 0.15});
  Cloth sheet;
  sheet.name = "sheet";
  sheet.corner = {-0.4, 0.5, -0.4};
  sheet.u = {0.8, 0, 0};
  sheet.v = {0, 0, 0.8};
  sheet.cells = {40, 40};
  shot.cloth.push_back(sheet);
  shot.camera.position = V3d(0.9, 1.1, 1.6);
  shot.camera.target = V3d(0, 0.45, 0);
  Light key, sky;
  key.name = "key";
  key.radiance = {12, 12, 12};
  key.center = {0.8, 2, 0.8};
  sky.type = LightType::environment;
  sky.name = "sky";
  sky.radiance = {0.5f, 0.55f, 0.65f};
  shot.light = {key, sky};
  shot.ground.present = true;
  shot.render.width = 640;
  shot.render.height = 360;
  shot.render.samples = 32;
  return shot;
}

/// One of everything that may stand more than once, and one of each type: what must be given is,
/// the rest is left at its default.
Shot one_of_everything(const std::string& name) {
  Shot shot;
  shot.name = name;
  shot.fluid.box.push_back({.min = {-0.5, 0, -0.5}, .max = {0.5, 0.1, 0.5}});
  shot.fluid.sphere.push_back({.center = {0, 0.5, 0}, .radius = 0.1});
  FluidEmitter inlet;
  inlet.center = V3d(0.6, 0.6, 0), inlet.speed = 1;
  shot.fluid.emitter.push_back(inlet);
  inlet.type = EmitterType::rectangle, inlet.center = V3d(-0.6, 0.6, 0);
  shot.fluid.emitter.push_back(inlet);
  shot.fluid.drops.push_back(
      {.min = {-0.5, 0.7, -0.5}, .max = {0.5, 0.9, 0.5}, .radius = 0.03, .count = 4});
  Cloth sheet;
  sheet.pin.resize(2);
  sheet.pin[0].vertices = {0, 64};
  sheet.pin[1].box = {V3d(-0.5, 0.9, 0.4), V3d(0.5, 1.1, 0.6)};
  for (const ClothModel model : {ClothModel::shell, ClothModel::springs}) {
    sheet.model = model;
    shot.cloth.push_back(sheet);
    sheet.name = "cloth2";
  }
  for (const ProbeType type :
       {ProbeType::height, ProbeType::pressure, ProbeType::force, ProbeType::tip, ProbeType::energy,
        ProbeType::volume, ProbeType::velocity, ProbeType::front}) {
    Probe probe;
    probe.type = type;
    probe.name += std::to_string(shot.probe.size() + 1);
    if (type == ProbeType::tip) probe.position = sheet.corner;
    shot.probe.push_back(probe);
  }
  for (const LightType type : {LightType::rectangle, LightType::sphere, LightType::sun,
                               LightType::environment, LightType::disk}) {
    Light light;
    light.type = type;
    light.name += std::to_string(shot.light.size() + 1);
    shot.light.push_back(light);
  }
  for (const MaterialType type :
       {MaterialType::dielectric, MaterialType::cloth, MaterialType::diffuse, MaterialType::metal,
        MaterialType::coated}) {
    Material material;
    material.type = type;
    material.name = "material" + std::to_string(shot.material.size() + 1);
    shot.material.push_back(material);
  }
  return shot;
}

void check_name(const std::string& name) {
  const char* const why = shot_table::file_name_problem(name);
  if (why) throw Error(fmt::format("the name \"{}\" cannot be used: {}", name, why));
}

/// The field as TOML; empty if it has no value to show.
std::string shown_value(const Parameter& parameter, void* object) {
  if (parameter.kind == Kind::grid_pins) return "\"corners\"";
  return shot_table::value_text(parameter, parameter.field(object));
}

constexpr const char* quality_text =
    "\n# Overrides for --quality preview.\n"
    "[quality.preview.fluid]\nspacing = 0.02\n\n"
    "[quality.preview.render]\nwidth = 320\nheight = 180\nsamples = 8\n";

/// A shot with its descriptions: `about` it, then a line for every key that applies.
std::string described_shot(
    Shot shot, const char* about,
    const std::function<std::string(const Parameter&, const std::string& value)>& line) {
  check_name(shot.name);
  std::string text = fmt::format(
      "# {}: {}\n"
      "# Units are SI, Y is up, colours are linear ACEScg, \"srgb(r, g, b)\" or \"#rrggbb\".\n",
      shot.name, about);
  shot_table::for_each_object(shot, [&](const Section& section, void* object, const std::string&) {
    std::string lines;
    for (const Parameter* p : shot_table::parameters_of(section.name))
      if (shot_table::applies(*p, section, object)) lines += line(*p, shown_value(*p, object));
    if (lines.empty()) return;
    text += fmt::format("\n# {}\n{}\n{}", section.description, header_of(section), lines);
  });
  return text + quality_text;
}

/// Every key of a section, or of one of its objects, as a comment: for what the reference cannot
/// have, and why.
std::string commented(const char* name, const char* why, void* object = nullptr) {
  const Section& section = *shot_table::find_section(name);
  std::string text = fmt::format("\n# {} {}\n# {}\n", section.description, why, header_of(section));
  for (const Parameter* p : shot_table::parameters_of(section.name)) {
    if (object && !shot_table::applies(*p, section, object)) continue;
    const bool own = object && (p->fixed || p->key == section.type_key);
    const std::string value = own ? shown_value(*p, object) : default_text(*p);
    text += fmt::format("# {} = {}  # {}{}: {}\n", p->key,
                        value.empty() || value[0] == '*' ? "..." : value,
                        p->required ? "required; " : "", value_column(*p), p->description);
  }
  return text;
}

}  // namespace

std::string reference_shot(const std::string& name) {
  const std::string text = described_shot(
      one_of_everything(name),
      "every key that a shot may have, at its default where it has one.\n"
      "# Delete what the shot does not need; [[...]] may stand any number of times or not at all.",
      [](const Parameter& p, const std::string& value) {
        const std::string line =
            value.empty() ? fmt::format("# {} = ...", p.key) : fmt::format("{} = {}", p.key, value);
        return fmt::format("{}  # {}{}: {}\n", line, p.required ? "required; " : "",
                           value_column(p), p.description);
      });
  FluidEmitter mesh;
  mesh.type = EmitterType::mesh;
  Cloth shell;
  shell.model = ClothModel::shell;
  return text + commented("fluid.emitter", "A mesh not without its file.", &mesh) +
         commented("fluid.volume", "Not without its file.") +
         commented("cloth", "As a shell in place of springs.", &shell) +
         commented("cloth.seam", "Not without two edges.") +
         commented("obstacle", "At its defaults it would stand in the fluid above.") +
         commented("sink", "At its defaults it would take the fluid above.");
}

std::string starting_shot(const std::string& name) {
  return described_shot(
      first_shot(name),
      "a ball of water falls on a sheet held at its corners.\n"
      "# Keys behind '#' show their defaults. `drench init NAME --reference` writes every one.",
      [](const Parameter& p, const std::string& value) {
        // Their headers alone would be air and foam.
        if (p.section == "wind" || p.section == "foam") return std::string();
        const bool standard = value.empty() || (p.field && value == default_text(p));
        const std::string unit = p.unit.empty() ? "" : fmt::format("{}: ", p.unit);
        return fmt::format("{}{} = {}  # {}{}\n", standard ? "# " : "", p.key,
                           value.empty() ? "\"\"" : value, unit, p.description);
      });
}

}  // namespace drench

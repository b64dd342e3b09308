#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/contract/shot/fabric_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/geometry/period_fit.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_check.h"
#include "pipeline/contract/shot/shot_table.h"
#include "pipeline/contract/shot/shot_text.h"
#include "pipeline/contract/shot/shot_value.h"
#include "pipeline/contract/shot/toml.h"
#include "pipeline/contract/shot/toml_text.h"

namespace drench {

namespace fs = std::filesystem;
using shot_table::GridPins;
using shot_table::Kind;
using shot_table::Parameter;
using shot_table::Section;

namespace {

/// A shot while it is read: names of pinned edges wait until the grids are known.
struct Draft {
  Shot shot;
  ShotSources sources;
  std::map<std::string, std::vector<GridPins>> grid_pins;  // by path of the cloth
  std::set<std::string> overridden;                        // keys that an override changed
};

enum class Mode { write, override_values };

/// Puts one TOML document, or one override, into a draft.
class Reader {
 public:
  Reader(Draft& draft, Mode mode, std::string label, fs::path folder)
      : draft_(draft), mode_(mode), label_(std::move(label)), folder_(std::move(folder)) {}

  void read_top(const toml::table& top) {
    for (auto&& [key, node] : top) {
      const std::string name(key.str());
      if (name == "quality" && mode_ == Mode::write) continue;  // read when the rest is known
      const Section* const section = shot_table::find_section(name);
      if (section == nullptr || !section->parent.empty())
        unknown_section(name, location(key.source()));
      read_child(*section, &draft_.shot, name, node);
    }
  }

  [[noreturn]] void fail(const std::string& where, const std::string& text) const {
    throw Error(shot_table::printable(fmt::format("{}: {}", where, text)));
  }

  /// "shots/dam.toml:14"; an override is one line and named whole.
  std::string location(const toml::source_region& source) const {
    return source.begin && !label_is_whole_ ? fmt::format("{}:{}", label_, source.begin.line)
                                            : label_;
  }
  void label_is_whole() { label_is_whole_ = true; }

 private:
  [[noreturn]] void unknown_section(const std::string& name, const std::string& where) const {
    if (name == "quality")
      fail(where,
           "a quality is not set from outside: --quality NAME chooses one of the file, and "
           "--set changes what is chosen, as in --set render.samples=64");
    std::vector<std::string_view> words{"quality"};
    for (const Section& section : shot_table::sections()) {
      if (section.parent.empty()) words.push_back(section.name);
    }
    const std::string_view near = shot_table::nearest_word(name, words);
    for (const Section& section : shot_table::sections()) {
      if (near.empty() && shot_table::find_parameter(section.name, name)) {
        fail(where,
             fmt::format("{} is not a section; it is a key of [{}]: write it below that line", name,
                         section.name));
      }
    }
    fail(where, near.empty() ? fmt::format("{} is not a section; the sections are {}", name,
                                           fmt::join(words, ", "))
                             : fmt::format("{} is not a section; did you mean {}?", name, near));
  }

  [[noreturn]] void unknown_key(const Section& section, const std::string& path,
                                const std::string& name, const std::string& where) const {
    std::vector<std::string_view> words;
    for (const Parameter* p : shot_table::parameters_of(section.name)) words.push_back(p->key);
    for (const Section& child : shot_table::sections()) {
      if (child.parent == section.name) words.push_back(child.name.substr(section.name.size() + 1));
    }
    const std::string_view near = shot_table::nearest_word(name, words);
    if (!near.empty()) {
      fail(where, fmt::format("{0}.{1} is not a key; did you mean {0}.{2}?", path, name, near));
    }
    for (const Section& other : shot_table::sections()) {
      if (shot_table::find_parameter(other.name, name)) {
        fail(where, fmt::format("{}.{} is not a key; there is one of this name in [{}]", path, name,
                                other.name));
      }
    }
    fail(where, fmt::format("{}.{} is not a key; those of [{}] are {}", path, name, section.name,
                            fmt::join(words, ", ")));
  }

  void read_child(const Section& section, void* owner, const std::string& path,
                  const toml::node& node) {
    const std::string where = location(node.source());
    if (!section.repeated) {
      const auto* table = node.as_table();
      if (table == nullptr) {
        fail(where, fmt::format("{} must be a table; write [{}] on a line of its own", path,
                                section.name));
      }
      draft_.sources.where.emplace(path, where);
      if (section.name == "ground" && mode_ == Mode::write) draft_.shot.ground.present = true;
      if (section.name == "wind" && mode_ == Mode::write) draft_.shot.wind.present = true;
      if (section.name == "foam" && mode_ == Mode::write) draft_.shot.foam.present = true;
      read_table(section, section.at(owner, 0), path, *table);
    } else if (mode_ == Mode::override_values) {
      override_some(section, owner, path, node);
    } else {
      append_all(section, owner, path, node);
    }
  }

  void append_all(const Section& section, void* owner, const std::string& path,
                  const toml::node& node) {
    const auto* array = node.as_array();
    if (array == nullptr || (!array->empty() && !array->is_array_of_tables())) {
      fail(location(node.source()),
           fmt::format("{} may stand more than once; write [[{}]] with two "
                       "brackets a side",
                       path, section.name));
    }
    constexpr size_t most = 4096;
    if (array->size() > most) {
      fail(location(node.source()),
           fmt::format("{} stands {} times; at most {} are allowed", path, array->size(), most));
    }
    for (const toml::node& item : *array) {
      const size_t index = index_for(section, owner, *item.as_table());
      const std::string own = fmt::format("{}[{}]", path, index);
      const std::string where = location(item.source());
      if (!draft_.sources.where.emplace(own, where).second) {
        fail(where,
             fmt::format("material \"{}\" is defined twice; the first time at {}. Remove one",
                         draft_.shot.material[index].name, draft_.sources.where[own]));
      }
      void* const object = section.at(owner, index);
      read_table(section, object, own, *item.as_table());
      check_required(section, object, own, *item.as_table(), where);
      if (section.name_of && !item.as_table()->contains("name"))
        name_by_number(section, object, index);
    }
  }

  /// Where the next object goes: at the end, or for a material that exists already where it is.
  size_t index_for(const Section& section, void* owner, const toml::table& table) {
    if (section.name == "material") {
      const auto* name = table.get_as<std::string>("name");
      for (size_t i = 0; name && i < draft_.shot.material.size(); ++i) {
        Material& known = draft_.shot.material[i];
        if (known.name != name->get()) continue;
        const auto* type = table.get_as<std::string>("type");
        const std::string own_type =
            shot_table::value_text(*shot_table::find_parameter("material", "type"), &known.type);
        // Another type is another material: nothing of the built-in one is kept.
        if (type && own_type != fmt::format("\"{}\"", type->get())) {
          known = Material{};
          known.name = name->get();
        }
        return i;
      }
    }
    section.append(owner);
    return section.count(owner) - 1;
  }

  void name_by_number(const Section& section, void* object, size_t index) const {
    if (section.name == "material") return;  // its name is required
    std::string& name = *const_cast<std::string*>(section.name_of(object));
    if (index > 0) name = fmt::format("{}{}", section.name, index + 1);
  }

  void check_required(const Section& section, void* object, const std::string& path,
                      const toml::table& table, const std::string& where) const {
    for (const Parameter* p : shot_table::parameters_of(section.name)) {
      if (!p->required || table.contains(p->key)) continue;
      if (!shot_table::applies(*p, section, object)) continue;
      fail(where, fmt::format("{} has no {}; add {} = ... ({}; {})", path, p->key, p->key,
                              shot_table::kind_text(*p), p->description));
    }
  }

  /// [quality.preview.cloth.NAME] or --set cloth.0.cells=...: by name or by number from 0.
  void override_some(const Section& section, void* owner, const std::string& path,
                     const toml::node& node) {
    const auto* table = node.as_table();
    if (table == nullptr) {
      fail(location(node.source()),
           fmt::format("an override of {} says which one, by name or by number from 0: {}.0.key",
                       path, path));
    }
    for (auto&& [key, item] : *table) {
      const std::string which(key.str());
      const size_t index = find_object(section, owner, path, which, location(key.source()));
      const auto* values = item.as_table();
      if (values == nullptr) {
        fail(location(item.source()), fmt::format("{}.{} is not a value; override one of its keys: "
                                                  "{}.{}.key",
                                                  path, which, path, which));
      }
      read_table(section, section.at(owner, index), fmt::format("{}[{}]", path, index), *values);
    }
  }

  size_t find_object(const Section& section, void* owner, const std::string& path,
                     const std::string& which, const std::string& where) const {
    const size_t n = section.count(owner);
    for (size_t i = 0; section.name_of && i < n; ++i) {
      if (*section.name_of(section.at(owner, i)) == which) return i;
    }
    size_t index = n;
    const auto [end, code] = std::from_chars(which.data(), which.data() + which.size(), index);
    if (code == std::errc() && end == which.data() + which.size() && index < n) return index;
    fail(where, fmt::format("there is no {}.{}; the shot has {} of them, numbered from 0{}", path,
                            which, n, section.name_of ? " or called by name" : ""));
  }

  void read_table(const Section& section, void* object, const std::string& path,
                  const toml::table& table) {
    // The type first: it says which other keys belong to the object.
    for (const bool types : {true, false}) {
      for (auto&& [key, node] : table) {
        const std::string name(key.str());
        if ((name == section.type_key) != types) continue;
        const Section* const child =
            shot_table::find_section(fmt::format("{}.{}", section.name, name));
        if (const Parameter* p = shot_table::find_parameter(section.name, name)) {
          read_key(section, *p, object, path, node);
        } else if (child != nullptr) {
          read_child(*child, object, path + "." + name, node);
        } else {
          unknown_key(section, path, name, location(key.source()));
        }
      }
    }
    if (section.name == "camera") {
      Camera& camera = draft_.shot.camera;
      const Interpolation mode = camera.position.interpolation;
      camera.target.interpolation = camera.fov_deg.interpolation = mode;
      camera.focus_distance.interpolation = camera.lens_radius.interpolation = mode;
    }
    if (section.name == "obstacle") {
      Obstacle& obstacle = *static_cast<Obstacle*>(object);
      obstacle.rotation_deg.interpolation = obstacle.position.interpolation;
    }
    if (section.name == "cloth.pin") {
      ClothPin& pin = *static_cast<ClothPin*>(object);
      pin.rotation_deg.interpolation = pin.position.interpolation;
    }
    if (section.name == "sink") {
      Obstacle& shape = static_cast<Sink*>(object)->shape;
      shape.rotation_deg.interpolation = shape.position.interpolation;
    }
    if (section.name == "fluid.emitter") {
      FluidEmitter& emitter = *static_cast<FluidEmitter*>(object);
      emitter.direction.interpolation = emitter.center.interpolation;
      emitter.rotation_deg.interpolation = emitter.center.interpolation;
    }
  }

  void read_key(const Section& section, const Parameter& p, void* object, const std::string& path,
                const toml::node& node) {
    const shot_table::Site site{location(node.source()), fmt::format("{}.{}", path, p.key),
                                folder_};
    if (mode_ == Mode::override_values && p.fixed) {
      fail(site.where,
           fmt::format("{} says which thing this is and cannot be overridden; change it "
                       "in the shot",
                       site.key));
    }
    if (!shot_table::applies(p, section, object)) {
      const Parameter& type = *shot_table::find_parameter(section.name, section.type_key);
      std::vector<std::string_view> owners;
      for (size_t i = 0; i < type.choices.size(); ++i) {
        if (p.types >> i & 1u) owners.push_back(type.choices[i]);
      }
      fail(site.where,
           fmt::format("{} belongs to a {} of {} {}; this one is a {}. Remove it", site.key,
                       section.name, section.type_key, fmt::join(owners, " or "),
                       type.choices[size_t(section.type_of(object))]));
    }
    draft_.sources.where[site.key] = site.where;
    if (mode_ == Mode::override_values) draft_.overridden.insert(site.key);
    if (p.kind == Kind::grid_pins) {
      draft_.grid_pins[path] = shot_table::read_grid_pins(p, node, site);
      return;
    }
    shot_table::read_value(p, p.field(object), node, site);
  }

  Draft& draft_;
  Mode mode_;
  std::string label_;
  fs::path folder_;
  bool label_is_whole_ = false;
};

toml::table parse_toml(std::string_view text, const std::string& label) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw Error(fmt::format("{}: is UTF-16, and TOML is UTF-8; save it as that", label));
  const size_t stray = find_stray_character(text);
  if (stray != no_stray_character) {
    throw Error(
        fmt::format("{}:{}: holds a character beyond ASCII outside quotes; put text into "
                    "quotes (docs/shots.md lists the keys)",
                    label, 1 + std::count(text.begin(), text.begin() + ptrdiff_t(stray), '\n')));
  }
  try {
    return toml::parse(text, label);
  } catch (const toml::parse_error& problem) {
    const bool quotient = problem.description().find("saw '/'") != std::string_view::npos;
    throw Error(shot_table::printable(fmt::format(
        "{}:{}: is not valid TOML: {}{}", label, problem.source().begin.line, problem.description(),
        quotient ? "; give a quotient as a number, 24000/1001 as 23.976" : "")));
  }
}

/// Applies [quality.NAME], and tries every other one on a copy: a mistake in a quality that is not
/// asked for today is still one.
void apply_quality(Draft& draft, const toml::table& top, const std::string& label,
                   const fs::path& folder, const std::string& wanted) {
  std::vector<std::string> names;
  const auto* qualities = top.get_as<toml::table>("quality");
  if (top.contains("quality") && qualities == nullptr) {
    throw Error(
        fmt::format("{}:{}: quality must be a table of tables; write [quality.preview.render]",
                    label, top.get("quality")->source().begin.line));
  }
  std::optional<Draft> chosen;
  static const toml::table none;
  for (auto&& [key, node] : qualities ? *qualities : none) {  // a copy would forget its lines
    const std::string name(key.str());
    const std::string where = fmt::format("{}:{}", label, key.source().begin.line);
    if (name == "final") {
      throw Error(
          fmt::format("{}: quality.final is the shot as written and cannot be changed; put "
                      "its values into the sections themselves",
                      where));
    }
    if (!node.is_table()) {
      throw Error(fmt::format("{}: quality.{} must be a table; write [quality.{}.render]", where,
                              name, name));
    }
    names.push_back(name);
    Draft changed = draft;
    Reader(changed, Mode::override_values, label, folder).read_top(*node.as_table());
    if (name == wanted) chosen = std::move(changed);
  }
  if (wanted == "final") return;
  if (!chosen) {
    names.insert(names.begin(), "final");
    throw Error(
        fmt::format("{}: has no quality \"{}\"; it has {}. Add [quality.{}.render] or choose "
                    "one of them",
                    label, wanted, fmt::join(names, ", "), wanted));
  }
  draft = std::move(*chosen);
}

/// "section.key=value", the value in TOML; a bare word stands for a string.
void apply_override(Draft& draft, const std::string& text, const fs::path& folder) {
  const std::string label = shot_table::printable("--set " + text.substr(0, 200));
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || text.find('.') > equals) {
    throw Error(
        fmt::format("{}: section.key=value is expected, for example "
                    "--set fluid.spacing=0.02",
                    label));
  }
  if (text.find_first_of("\r\n") != std::string::npos) {
    throw Error(fmt::format("{}: holds a line break; give one value", label));
  }
  std::string value = text.substr(equals + 1);
  const auto word = [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-' || c == '/' || c == '.' || c == '#';
  };
  const bool bare = !value.empty() &&
                    (std::isalpha(static_cast<unsigned char>(value[0])) || value[0] == '/' ||
                     value[0] == '#' || value[0] == '_') &&
                    std::all_of(value.begin(), value.end(), word);
  if (bare && value != "true" && value != "false" && value != "inf" && value != "nan") {
    value = "\"" + value + "\"";
  }
  if (find_stray_character(text) != no_stray_character) {
    throw Error(
        fmt::format("{}: holds a character beyond ASCII outside quotes; text needs quotes: "
                    "--set 'section.key=\"text\"'",
                    label));
  }
  toml::table table;
  try {
    table = toml::parse(text.substr(0, equals) + "=" + value);
  } catch (const toml::parse_error& problem) {
    throw Error(
        fmt::format("{}: is not section.key=value in TOML: {}. Text needs quotes: "
                    "--set 'section.key=\"text\"'",
                    label, problem.description()));
  }
  Reader reader(draft, Mode::override_values, label, folder);
  reader.label_is_whole();
  reader.read_top(table);
}

/// Whether vertex (i, j) of (0, 0) to (u, v) is one of them.
bool is_held(GridPins pins, uint32_t i, uint32_t j, uint32_t u, uint32_t v) {
  const bool end_u = i == 0 || i == u, end_v = j == 0 || j == v;
  switch (pins) {
    case GridPins::corners:
      return end_u && end_v;
    case GridPins::edge_u0:
      return i == 0;
    case GridPins::edge_u1:
      return i == u;
    case GridPins::edge_v0:
      return j == 0;
    case GridPins::edge_v1:
      return j == v;
    case GridPins::rim:
      return end_u || end_v;
  }
  return false;
}

/// Vertex j (nu + 1) + i stands at i along u and j along v.
std::vector<uint32_t> pinned_vertices(const std::vector<GridPins>& all, const V2i& cells) {
  const auto u = uint32_t(cells.x), v = uint32_t(cells.y);
  std::set<uint32_t> held;
  for (const GridPins pins : all)
    for (uint32_t j = 0; j <= v; ++j)
      for (uint32_t i = 0; i <= u; ++i)
        if (is_held(pins, i, j, u, v)) held.insert(j * (u + 1) + i);
  return {held.begin(), held.end()};
}

void resolve_pins(Draft& draft) {
  for (size_t i = 0; i < draft.shot.cloth.size(); ++i) {
    Cloth& cloth = draft.shot.cloth[i];
    const std::string path = fmt::format("cloth[{}]", i);
    const std::string cells = path + ".cells";
    for (size_t k = 0; k < cloth.pin.size(); ++k) {
      if (!cloth.pin[k].vertices.empty() && draft.overridden.contains(cells)) {
        throw Error(
            fmt::format("{}: {} is overridden, but {}.pin[{}] names vertices by number, which "
                        "another grid numbers differently. Use pins = \"corners\" or a pin "
                        "box",
                        draft.sources.at(cells), cells, path, k));
      }
    }
    for (size_t k = 0; k < cloth.seam.size(); ++k) {
      const ClothSeam& seam = cloth.seam[k];
      if (draft.overridden.contains(cells) &&
          !(seam.vertices.empty() && seam.to_vertices.empty())) {
        throw Error(
            fmt::format("{}: {} is overridden, but {}.seam[{}] names vertices by number, which "
                        "another grid numbers differently. Use edge and to_edge",
                        draft.sources.at(cells), cells, path, k));
      }
    }
    const auto pins = draft.grid_pins.find(path);
    if (pins == draft.grid_pins.end() || pins->second.empty()) continue;
    if (!cloth.mesh_file.empty()) {
      throw Error(
          fmt::format("{}: {}.pins names edges of a grid, but this cloth is a mesh. Use "
                      "[[cloth.pin]] with vertices or box",
                      draft.sources.at(path + ".pins"), path));
    }
    ClothPin pin;
    pin.vertices = pinned_vertices(pins->second, cloth.cells);
    cloth.pin.push_back(pin);
    draft.sources.where[fmt::format("{}.pin[{}]", path, cloth.pin.size() - 1)] =
        draft.sources.at(path + ".pins");
  }
}

/// What a shot makes goes to out/NAME/QUALITY and is named after it.
void check_file_names(const Shot& shot, const std::string& label, const std::string& quality) {
  if (const char* const why = shot_table::file_name_problem(shot.name)) {
    throw Error(
        fmt::format("{}: the shot is named '{}' after its file: {}. Rename the file or set "
                    "shot.name",
                    label, shot.name, why));
  }
  if (const char* const why = shot_table::file_name_problem(quality)) {
    throw Error(fmt::format("{}: the quality '{}' cannot be made: {}. Rename [quality.{}]", label,
                            quality, why, quality));
  }
}

}  // namespace

Shot parse_shot(const std::string& text, const fs::path& file, const ShotOptions& options) {
  const std::string label = file.string();
  const fs::path folder = file.parent_path();
  const toml::table top = parse_toml(text, label);
  Draft draft;
  draft.sources.file = label;
  draft.shot.file = file;
  draft.shot.name = file.stem().string();
  draft.shot.material = shot_table::built_in_materials();
  Reader(draft, Mode::write, label, folder).read_top(top);
  const double spacing = draft.shot.fluid.spacing;
  apply_quality(draft, top, label, folder, options.quality);
  for (const std::string& change : options.set) apply_override(draft, change, fs::current_path());
  if (draft.shot.fluid.spacing != spacing && draft.shot.fluid.spacing > 0) {
    for (const std::string& text : fit_periods(draft.shot))
      log_warning("shot", label + ": " + text);
  }
  resolve_pins(draft);
  take_fabrics(draft.shot, draft.sources);
  check_file_names(draft.shot, label, options.quality);
  check_shot(draft.shot, draft.sources);
  return draft.shot;
}

Shot read_shot(const fs::path& file, const ShotOptions& options) {
  return parse_shot(read_text(file), file, options);
}

}  // namespace drench

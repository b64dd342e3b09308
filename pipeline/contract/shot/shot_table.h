#pragma once
// The one list of sections and keys of a shot file. Reading, checking, the lock file, the digests
// and the reference are made of it.

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/shot/shot.h"

namespace drench::shot_table {

/// How a value is written in TOML and which type of field holds it.
enum class Kind {
  boolean,       // bool
  integer,       // int
  natural,       // uint32_t
  number,        // double
  text,          // std::string that can be part of a file name
  label,         // std::string, any text
  name,          // std::string of letters, digits, '_' and '-'
  path,          // std::filesystem::path, empty: none
  mesh_files,    // the same, or with one %04d in its name: a file for every frame
  choice,        // enum whose enumerators are `choices`
  vector,        // V3d
  colour,        // V3f, linear ACEScg, or a string srgb(r, g, b) or #rrggbb
  spectrum,      // V3f, linear ACEScg
  cells,         // V2i
  frames,        // Timeline::first and last
  number_track,  // Animated<double>
  vector_track,  // Animated<V3d>
  track_mode,    // the interpolation of all tracks of a camera or obstacle
  vertices,      // std::vector<uint32_t>
  box,           // std::optional<std::pair<V3d, V3d>>
  place,         // std::optional<V3d>
  grid_pins,     // no field: becomes ClothPin::vertices once the grid is known
};

/// Vertices of a grid that grid_pins holds; u0 is the edge where u starts.
enum class GridPins { corners, edge_u0, edge_u1, edge_v0, edge_v1, rim };

/// Stages that read a value; a stage's digest covers exactly the rows that name it.
enum : unsigned { no_stage = 0, simulate = 1, mesh = 2, render = 4, foam = 8, denoise = 16 };

struct Limits {
  double lowest = 0, highest = 0;  // inclusive, of every component
};

struct Parameter {
  std::string_view section, key;
  Kind kind = Kind::number;
  std::string_view unit;
  Limits limits;
  unsigned stages = no_stage;
  std::string_view description;
  void* (*field)(void* owner) = nullptr;
  std::vector<std::string_view> choices = {};
  void (*choose)(void* field, std::string_view name) = nullptr;  // choices of an enum
  std::string_view (*chosen)(const void* field) = nullptr;
  bool required = false;  // when the section stands in the file
  bool fixed = false;     // cannot be overridden: it says which object this is
  unsigned types = ~0u;   // bit i: the key belongs to objects whose type is choice i
};

/// A table or an array of tables. `owner` is the parent section's object, the Shot at the top.
struct Section {
  std::string_view name;    // "fluid.box"
  std::string_view parent;  // "fluid", or empty
  std::string_view description;
  bool repeated = false;
  size_t (*count)(void* owner) = nullptr;
  void* (*at)(void* owner, size_t index) = nullptr;
  void (*append)(void* owner) = nullptr;                  // repeated only
  const std::string* (*name_of)(void* object) = nullptr;  // objects with names
  int (*type_of)(void* object) = nullptr;                 // objects with a type
  std::string_view type_key = "type";                     // the key of it
};

const std::vector<Section>& sections();  // a parent stands before its children
const std::vector<Parameter>& parameters();

const Section* find_section(std::string_view name);
const Parameter* find_parameter(std::string_view section, std::string_view key);

/// Calls f(section, object, path) for every section of the shot and everything repeated in it,
/// parents first; path is "fluid", "cloth[0]", "cloth[0].pin[1]".
template <class F>
void for_each_object(Shot& shot, F&& f);
/// Rows of one section, in the table's order.
std::vector<const Parameter*> parameters_of(std::string_view section);
/// Whether the row belongs to this object (a light's type rules out other types' keys).
bool applies(const Parameter& parameter, const Section& section, void* object);

/// Built-in water, cotton and ground.
const std::vector<Material>& built_in_materials();

// ---- implementation

template <class F>
void visit_children(std::string_view parent, void* owner, const std::string& path, F& f) {
  for (const Section& section : sections()) {
    if (section.parent != parent) continue;
    const size_t dot = section.name.rfind('.');
    const std::string own(dot == std::string_view::npos ? section.name
                                                        : section.name.substr(dot + 1));
    const std::string prefix = path.empty() ? own : path + "." + own;
    const size_t n = section.repeated ? section.count(owner) : 1;
    for (size_t i = 0; i < n; ++i) {
      void* const object = section.at(owner, i);
      const std::string own_path =
          section.repeated ? prefix + "[" + std::to_string(i) + "]" : prefix;
      f(section, object, own_path);
      visit_children(section.name, object, own_path, f);
    }
  }
}

template <class F>
void for_each_object(Shot& shot, F&& f) {
  visit_children("", &shot, "", f);
}

}  // namespace drench::shot_table

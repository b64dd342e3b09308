#pragma once
// How rows of the parameter table are written down. Only for the files that hold rows.

#include <initializer_list>
#include <type_traits>

#include "pipeline/contract/shot/enum_names.h"
#include "pipeline/contract/shot/shot_table.h"

namespace drench::shot_table {

template <class T>
struct Member;
template <class Owner_, class Value_>
struct Member<Value_ Owner_::*> {
  using Owner = Owner_;
  using Value = Value_;
};

template <auto First, auto... Rest>
void* field_of(void* owner) {
  auto& value = static_cast<typename Member<decltype(First)>::Owner*>(owner)->*First;
  if constexpr (sizeof...(Rest) > 0) {
    return field_of<Rest...>(&value);
  } else {
    return &value;
  }
}

template <auto First, auto... Rest>
struct LastMember : LastMember<Rest...> {};
template <auto Only>
struct LastMember<Only> : Member<decltype(Only)> {};

template <class T>
constexpr Kind kind_of() {
  if constexpr (std::is_same_v<T, bool>) return Kind::boolean;
  if constexpr (std::is_same_v<T, int>) return Kind::integer;
  if constexpr (std::is_same_v<T, uint32_t>) return Kind::natural;
  if constexpr (std::is_same_v<T, double>) return Kind::number;
  if constexpr (std::is_same_v<T, std::string>) return Kind::name;
  if constexpr (std::is_same_v<T, std::filesystem::path>) return Kind::path;
  if constexpr (std::is_same_v<T, V3d>) return Kind::vector;
  if constexpr (std::is_same_v<T, V3f>) return Kind::colour;
  if constexpr (std::is_same_v<T, V2i>) return Kind::cells;
  if constexpr (std::is_same_v<T, Timeline>) return Kind::frames;
  if constexpr (std::is_same_v<T, Animated<double>>) return Kind::number_track;
  if constexpr (std::is_same_v<T, Animated<V3d>>) return Kind::vector_track;
  if constexpr (std::is_same_v<T, std::vector<uint32_t>>) return Kind::vertices;
  if constexpr (std::is_same_v<T, std::optional<std::pair<V3d, V3d>>>) return Kind::box;
  if constexpr (std::is_same_v<T, std::optional<V3d>>) return Kind::place;
  return Kind::choice;
}

struct Row : Parameter {
  Row needed() const {
    Row row = *this;
    row.required = true;
    return row;
  }
  /// The names of an enum; the field holds it.
  template <class Enum>
  Row choice() const {
    Row row = *this;
    row.choices.assign(enum_names<Enum>.begin(), enum_names<Enum>.end());
    row.choose = [](void* field, std::string_view name) {
      *static_cast<Enum*>(field) = enum_of<Enum>(name);
    };
    row.chosen = [](const void* field) {
      return enum_names<Enum>[size_t(*static_cast<const Enum*>(field))];
    };
    return row;
  }
  /// The field is a track, whose interpolation is one of these.
  Row interpolation(std::initializer_list<Interpolation> modes) const {
    Row row = *this;
    row.kind = Kind::track_mode;
    for (const Interpolation mode : modes)
      row.choices.push_back(enum_names<Interpolation>[size_t(mode)]);
    row.choose = [](void* field, std::string_view name) {
      static_cast<Animated<V3d>*>(field)->interpolation = enum_of<Interpolation>(name);
    };
    row.chosen = [](const void* field) {
      return enum_names<Interpolation>[size_t(
          static_cast<const Animated<V3d>*>(field)->interpolation)];
    };
    return row;
  }
  Row identity() const {
    Row row = *this;
    row.fixed = true;
    return row;
  }
  /// @param types  of objects that have it.
  template <class... Types>
  Row only(Types... types) const {
    Row row = *this;
    row.types = ((1u << unsigned(types)) | ...);
    return row;
  }
  Row as(Kind other) const {
    Row row = *this;
    row.kind = other;
    return row;
  }
};

template <auto... Members>
Row row(std::string_view section, std::string_view key, std::string_view unit, Limits limits,
        unsigned stages, std::string_view description) {
  using Value = typename LastMember<Members...>::Value;
  Row row;
  if constexpr (std::is_enum_v<Value>) row = row.template choice<Value>();
  row.section = section;
  row.key = key;
  row.kind = kind_of<Value>();
  row.unit = unit;
  row.limits = limits;
  row.stages = stages;
  row.description = description;
  row.field = field_of<Members...>;
  return row;
}

inline constexpr Limits none{};
inline constexpr Limits fraction{0, 1};
inline constexpr Limits coordinate{-1e5,
                                   1e5};     // m: beyond, float steps are wider than a millimetre
inline constexpr Limits speed{-1000, 1000};  // m/s
inline constexpr Limits turns{-360000, 360000};  // deg
inline constexpr Limits seeds{0, 4294967295};    // uint32_t

inline constexpr std::string_view matte_text =
    "how the camera sees it directly, for a render that goes over a plate it is in: as a holdout, "
    "a "
    "hole with alpha 0, or as a shadow_catcher, nothing but what the other objects do to its light";

inline constexpr std::string_view contact_angle_text =
    "at which the fluid's surface meets it, measured within the fluid, where there is "
    "fluid.surface_tension: below 90 it wets, above it beads";

/// Rows of the whole shot and of the domain.
std::vector<Parameter> shot_rows();
/// Rows of the fluid and of what it starts as.
std::vector<Parameter> fluid_rows();
/// Rows of cloth and of its coupling with fluid.
std::vector<Parameter> cloth_rows();
/// Rows of obstacles.
std::vector<Parameter> obstacle_rows();
/// Rows of probes.
std::vector<Parameter> probe_rows();
/// Rows of emitters, volumes, sinks and wind: where fluid comes from and goes to, and what drives
/// it.
std::vector<Parameter> source_rows();
/// Rows of the surface.
std::vector<Parameter> surface_rows();
/// Rows of foam.
std::vector<Parameter> foam_rows();
/// Rows of the camera, lights, materials, the ground and the film.
std::vector<Parameter> picture_rows();

}  // namespace drench::shot_table

#pragma once
// Groups of columns: what passes say they read and write. Only those that a pass of the shot's plan
// names are allocated. Which column is in which group: sim/columns.h.

#include <array>
#include <cstdint>
#include <string_view>

namespace drench::sim {

enum class ColumnGroup : int {
  position,  // of particles, with their ids
  velocity,
  cells,  // cells, orders and starts
  acceleration,
  density,
  pressure,  // p / rho^2
  inverse_density,
  near_cloth,  // nearest triangle, foot, side, distance
  memory,      // remembered side; impulses that cloth has not received yet
  start,       // positions at the start of the step
  path,        // continuous collision: ends, who is tested, held or stopped
  drift,
  impulse,
  contact,
  rows,   // of the near list: particle, vertices, weights
  loads,  // what rows give, and its sums by triangle
  exact,
  cloth_rows,
  cloth_drag,
  cloth,  // positions and velocities of vertices
  cloth_fixed,
  cloth_substep,
  cloth_load,  // forces and weights by vertex
  cloth_air,
  polygons,
  cloth_system,
  cloth_obstacles,  // which vertices obstacles hold
  shell_history,    // what the next step needs of the last
  shell_system,
  wet_cloth,  // how wet vertices are
  pins,
  self_contact,
  lists,
  projection,  // walls, corrections, diagonal
  solve,
  scratch,  // of passes over the lists
  mean_displacement,
  tension,
  wetting,
  drag,
  viscosity,
  obstacles,
  sinks,
  sorting,  // what sorting works in
  stopped,
};

/// In the order of ColumnGroup, as figures of memory name them.
inline constexpr std::array column_group_names{
    std::string_view("position, id"),
    std::string_view("velocity"),
    std::string_view("cells and sorting"),
    std::string_view("acceleration"),
    std::string_view("density"),
    std::string_view("pressure"),
    std::string_view("inverse density"),
    std::string_view("nearest triangles"),
    std::string_view("remembered sides"),
    std::string_view("starts of paths"),
    std::string_view("paths"),
    std::string_view("drift of paths"),
    std::string_view("impulses of the published coupling"),
    std::string_view("near list of cloth"),
    std::string_view("rows of cloth"),
    std::string_view("loads of cloth"),
    std::string_view("exact contacts"),
    std::string_view("rows of cloth in the pressure solve"),
    std::string_view("drag of cloth"),
    std::string_view("cloth"),
    std::string_view("topology of cloth"),
    std::string_view("substeps of cloth"),
    std::string_view("forces on cloth"),
    std::string_view("air on cloth"),
    std::string_view("polygon grid"),
    std::string_view("implicit step of cloth"),
    std::string_view("cloth at obstacles"),
    std::string_view("last step of shells"),
    std::string_view("implicit step of shells"),
    std::string_view("wet cloth"),
    std::string_view("pins that move"),
    std::string_view("contact among sheets"),
    std::string_view("neighbour lists"),
    std::string_view("rows of the pressure solve"),
    std::string_view("unknowns of the pressure solve"),
    std::string_view("scratch of the solves"),
    std::string_view("mean displacement"),
    std::string_view("surface tension"),
    std::string_view("contact angles"),
    std::string_view("drag of obstacles and cloth"),
    std::string_view("implicit viscosity"),
    std::string_view("obstacles"),
    std::string_view("sinks"),
    std::string_view("scratch of sorting"),
    std::string_view("momentum that obstacles stop"),
};
static_assert(column_group_names.size() == size_t(ColumnGroup::stopped) + 1);

constexpr std::string_view name_of(ColumnGroup group) { return column_group_names[size_t(group)]; }

class ColumnSet {
 public:
  constexpr ColumnSet() = default;
  constexpr ColumnSet(ColumnGroup group) : bits_(uint64_t(1) << int(group)) {}
  constexpr bool contains(ColumnGroup group) const { return (*this & group).any(); }
  constexpr bool any() const { return bits_ != 0; }
  constexpr ColumnSet operator|(ColumnSet o) const { return ColumnSet(bits_ | o.bits_); }
  constexpr ColumnSet operator&(ColumnSet o) const { return ColumnSet(bits_ & o.bits_); }
  constexpr ColumnSet without(ColumnSet o) const { return ColumnSet(bits_ & ~o.bits_); }
  constexpr ColumnSet& operator|=(ColumnSet o) { return *this = *this | o; }
  constexpr bool operator==(const ColumnSet&) const = default;

 private:
  constexpr explicit ColumnSet(uint64_t bits) : bits_(bits) {}
  uint64_t bits_ = 0;
};
constexpr ColumnSet operator|(ColumnGroup a, ColumnSet b) { return ColumnSet(a) | b; }
constexpr ColumnSet operator|(ColumnGroup a, ColumnGroup b) { return ColumnSet(a) | b; }

}  // namespace drench::sim

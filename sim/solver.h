#pragma once
// The boundary between host code, compiled once, and the two backends: plain host arrays in and
// out.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/contract/geometry/level_set.h"
#include "sim/cloth_contacts.h"
#include "sim/column_groups.h"
#include "sim/frame_now.h"
#include "sim/obstacle_placement.h"
#include "sim/parameters.h"
#include "sim/pins_now.h"
#include "sim/probe_query.h"
#include "sim/shell_topology.h"
#include "sim/vertex_range.h"
#include "sim/wet_law.h"
#include "sim/wind_now.h"

namespace drench::sim {

/// Everything the next step reads: what a checkpoint holds.
struct HostState {
  HostVec position, velocity;  // m local, m/s
  std::vector<int> id, memory_triangle, memory_side;
  HostVec owed;                      // kg m/s
  std::vector<float> pressure_term;  // m^5/(kg s^2), of the incompressible solver's last step
  HostVec cloth_position, cloth_velocity;
  // of shells, else empty: see ShellState
  HostVec shell_landed, shell_rounding, shell_left, shell_lost, shell_acceleration, shell_friction,
      shell_internal;
  double shell_dt = 0;               // s, of the step that left these
  std::vector<float> cloth_wetness;  // 0 to 1; empty where no sheet is ever wet
  Limits limits;                     // of the step before
  uint64_t guard_hits = 0, guard_holds = 0;
  std::vector<uint64_t> removed;  // particles since the start: by each sink; last: left the domain
};

/// A spring that sews two vertices together.
struct SeamSpring {
  int a, b;
  float rest_length, stiffness;  // m, once it is drawn; N/m
};

/// Triangles that close seams to the fluid, numbered after those of the sheets
/// (sim/setup/seam_strips.h). They weigh nothing and have no stiffness.
struct SeamStrips {
  std::vector<int> corner;                // 3 a strip
  std::vector<int> pair;                  // 4 a strip: two pairs of vertices that are sewn together
  std::vector<float> reach;               // m, of a strip: open while one is farther apart
  std::vector<int> beside;                // a strip's triangle of a sheet
  HostVec shift;                          // m, of a corner; where ClothTopology has corner_shift
  std::vector<int> neighbour;             // as ClothTopology's, of all triangles
  std::vector<int> fan_start, fan_entry;  // as ClothTopology's, of all triangles
};

/// What never changes about the sheets, all in one.
struct ClothTopology {
  std::vector<float> mass, inverse_mass, damping_rate;  // kg, dry; 0 where pinned; 1/s
  std::vector<int> spring_start, spring_end;            // rows by vertex
  std::vector<float> rest_length, stiffness, spring_damping;
  std::vector<int> corner, neighbour, sheet;  // 3, 3, 1 a triangle
  std::vector<float> half_thickness;
  std::vector<float> no_slip;    // of a triangle: 1 where it holds the fluid beside it, else 0
  std::vector<float> wetting;    // of a triangle: cosine of its contact angle
  std::vector<float> air_share;  // of a vertex: area its mass stands for / a third of its triangles
  HostVec rest_centroid;
  // Of a vertex: its place at rest, m; whether contact with sheets concerns it, and Coulomb's
  // coefficient there.
  HostVec rest;
  std::vector<char> meets_sheets;
  std::vector<WetLaw> wet;  // of a sheet; empty where none is ever wet
  std::vector<float> friction;
  std::vector<int> fan_start, fan_entry, rim;
  // Where a sheet is joined to itself across the seam of a periodic axis, else empty: how far from
  // its vertex a corner of a triangle, the other end of a spring stands, m; of each sheet the
  // periods it spans.
  HostVec corner_shift, spring_shift, rest_period;
  ShellTopology shell;
  std::vector<int> pin_vertex;  // of pins that do more than hold where the vertex starts
  std::vector<SeamSpring> seam;
  SeamStrips strips;  // none without fluid
  int sheet_of(int vertex) const {
    return sheet[size_t(fan_entry[size_t(fan_start[size_t(vertex)])]) / 3];
  }
  int vertices() const { return int(mass.size()); }
  int triangles() const { return int(sheet.size()); }
};

/// The vertices of every sheet.
inline std::vector<VertexRange> sheet_ranges(const ClothTopology& cloth) {
  std::map<int, std::pair<int, int>> ends;
  for (size_t k = 0; k < cloth.corner.size(); ++k) {
    const int v = cloth.corner[k];
    auto& [first, last] = ends.try_emplace(cloth.sheet[k / 3], v, v).first->second;
    first = std::min(first, v), last = std::max(last, v);
  }
  std::vector<VertexRange> all;
  for (const auto& sheet : ends)
    all.push_back({sheet.second.first, sheet.second.second - sheet.second.first + 1});
  return all;
}

/// kg, of the water that a vertex holds.
inline double water_at(const ClothTopology& cloth, const HostState& state, int vertex) {
  if (state.cloth_wetness.empty()) return 0;
  return double(cloth.mass[size_t(vertex)]) * cloth.wet[size_t(cloth.sheet_of(vertex))].uptake *
         state.cloth_wetness[size_t(vertex)];
}

/// Of every vertex the first of those that seams join it to, of chains of seams, too.
inline std::vector<int> sewn_points(const ClothTopology& cloth) {
  std::vector<int> first(size_t(cloth.vertices()));
  for (int v = 0; v < cloth.vertices(); ++v) first[size_t(v)] = v;
  const auto root = [&](int v) {
    while (first[size_t(v)] != v) v = first[size_t(v)];
    return v;
  };
  for (const SeamSpring& s : cloth.seam) {
    const auto [low, high] = std::minmax({root(s.a), root(s.b)});
    first[size_t(high)] = low;
  }
  for (int v = 0; v < cloth.vertices(); ++v) first[size_t(v)] = root(v);
  return first;
}

/// What an obstacle received from fluid and sheets in one step.
struct ObstacleImpulse {
  double impulse[3] = {0, 0, 0};  // kg m/s, by pressure, by stopped particles and by sheets
  int64_t stopped = 0;            // particles that pressure did not stop
};

/// What bodies in space are for: fluid flows around obstacles and vanishes in sinks.
enum class Solids { obstacles, sinks };

struct PassInfo {
  std::string name;
  ColumnSet reads, writes;
};

/// What a group of columns takes in the memory of the backend, room to grow included.
struct ColumnMemory {
  std::string name;
  size_t bytes;
};

class Solver {
 public:
  virtual ~Solver() = default;
  virtual void load(const HostState& state) = 0;
  virtual HostState save() const = 0;
  virtual HostVec positions() const = 0;        // of the particles, m local
  virtual HostVec cloth_positions() const = 0;  // of the vertices, m local
  /// Fluid density of every particle, kg/m^3, and nearest triangles (-1 none), as of refresh() or
  /// step().
  virtual std::vector<float> density() const = 0;
  virtual std::vector<int> near_triangles() const = 0;
  /// Of every sheet whether any particle was within the support radius of it in the last step.
  virtual std::vector<char> sheets_near_fluid() const = 0;
  /// p / rho^2 of every particle in the last step, m^5/(kg s^2).
  virtual std::vector<float> pressure_term() const = 0;
  /// Adds particles with ids at the end of the columns.
  virtual void append(const HostVec& position, const HostVec& velocity,
                      const std::vector<int>& id) = 0;
  /// One fluid step with `substeps` cloth steps in it.
  virtual Limits step(double dt, int substeps) = 0;
  /// Calls `observer` with the state after each cloth step of the exact coupling, from the next
  /// step on; without one (the default) nothing is done for it. Each call reads the whole state
  /// back to the host.
  virtual void observe_substeps(std::function<void(const HostState&)> observer) = 0;
  /// Calls `observer` after each launch of a pass with the groups of columns that it changed, from
  /// the next step on. Digests every column before and after: for tests.
  virtual void observe_passes(
      std::function<void(const PassInfo& pass, ColumnSet changed)> observer) = 0;
  /// Density and nearest triangles of the current positions, without a step. Sorts the particles,
  /// which the next step would do in the same way: its result is the same bits with or without
  /// this.
  virtual void refresh() = 0;
  /// Limits of a state that no step has made yet.
  virtual Limits measure() = 0;
  /// Level set 0 or 1 of an obstacle or sink. To be called before it is placed.
  virtual void load_level_set(Solids of, int index, int which, const LevelSet& set) = 0;
  /// Where the obstacles of Parameters::obstacles, or its sinks, are during the next step, and at
  /// its end for refresh().
  virtual void place(Solids which, const std::vector<ObstaclePlacement>& placement) = 0;
  /// The wind of the next step, where Parameters::air_density is above 0.
  virtual void blow(const WindNow& wind) = 0;
  /// Gravity and the turning frame of the next step; without a call Parameters::gravity.
  virtual void drive(const FrameNow& frame) = 0;
  /// The pins of ClothTopology::pin_vertex during the next step.
  virtual void hold(const PinsNow& pins) = 0;
  /// Which sheets are held where they are from the next step on, as if all of each were pinned; by
  /// sheets. Where all are and no fluid is near them a step does nothing about sheets.
  virtual void sleep(const std::vector<char>& asleep) = 0;
  /// Rest lengths of ClothTopology::seam from the next step on, m; those of the topology at first.
  virtual void draw_seams(const std::vector<float>& rest_length) = 0;
  /// Of the last step, one an obstacle. Over dt it is the mean force.
  virtual std::vector<ObstacleImpulse> obstacle_impulses() const = 0;
  /// Of the last step.
  virtual ClothContacts cloth_contacts() const = 0;
  /// Answers to probes, in their order, of the state as step() has just left it; of a state that no
  /// step has made yet only those that ask for no pressure or force. Changes no bit of a later
  /// step. What the numbers are: sim/probe_query.h.
  virtual std::vector<std::vector<double>> probe(const std::vector<ProbeQuery>& queries) = 0;
  virtual std::vector<PassInfo> plan() const = 0;
  virtual ColumnSet allocated() const = 0;               // groups whose columns are in memory
  virtual std::vector<ColumnMemory> memory() const = 0;  // of the groups that take anything
  virtual int particles() const = 0;
};

namespace cpu {
std::unique_ptr<Solver> make_solver(const Parameters& parameters, const ClothTopology& cloth);
}
namespace cuda {  // defined when built with CUDA
std::unique_ptr<Solver> make_solver(const Parameters& parameters, const ClothTopology& cloth);
/// Name of the device, or why there is none.
bool device_available(std::string& name_or_reason);
}  // namespace cuda

}  // namespace drench::sim

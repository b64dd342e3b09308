#pragma once
// What a shot starts with and what of it comes to nothing, known before the first step. Filled by
// build_scene (sim/setup/scene.h); `drench plan` shows it.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/shot/shot.h"

namespace drench::sim {

class ObstacleSet;
struct Scene;
struct Sheet;

/// Particles that one obstacle keeps a source from having.
struct ObstacleLoss {
  std::string obstacle;  // its name
  size_t particles = 0;
};

/// A box, sphere, volume or set of drops: particles it has at the start and those that it lost.
struct SourceReport {
  std::string name;                // "fluid.box[0]", as in messages about the shot
  double volume = 0;               // m^3 that the shot asks for; 0: not known, or particles
  size_t asked = 0;                // particles of its lattice
  size_t kept = 0;                 // particles in the first state
  size_t overlapping = 0;          // lost to sources before it
  size_t outside = 0;              // beyond a side of the domain that is open
  size_t drained = 0;              // of those kept, what stands in a sink that takes it at once
  std::vector<ObstacleLoss> lost;  // in the order of the shot, those that took any

  size_t in_obstacles() const;
  /// Particles that obstacles, sinks and open sides take.
  size_t gone() const;
  /// Share of the volume that rounding to the lattice adds, below 0 if it takes; 0: not known.
  /// @param spacing  m.
  double rounding(double spacing) const;
};

/// An emitter over the frames of the shot.
struct InletReport {
  std::string name;     // "fluid.emitter[0]"
  double emitted = 0;   // particles that places free of obstacles would have sent by the end
  double blocked = 0;   // share of its places, 0 .. 1, from which nothing can go
  std::string where;    // most of these are: "inside obstacle \"hull\" ..."
  bool in_time = true;  // false: its first layer leaves after the last frame or its stop
  bool fixed = true;    // neither it nor what blocks it moves: what is seen once is certain
  bool never() const { return !in_time || blocked >= 1; }
};

/// A sheet of the first state.
struct SheetReport {
  std::string name;
  std::string fabric;  // of a shell; empty: a net of springs
  size_t triangles = 0;
};

/// All of a scene. What is certain to make nothing has been refused before.
struct SceneReport {
  double spacing = 0;  // m
  std::vector<SourceReport> source;
  std::vector<InletReport> inlet;
  std::vector<SheetReport> sheet;
  size_t particles = 0;           // of the first state
  double particles_at_end = 0;    // estimate, emitters included; sinks and open sides are not known
  size_t cloth_triangles = 0;     // of the sheets
  size_t obstacle_triangles = 0;  // of meshes, obstacles and sinks
  double memory = 0;              // bytes, estimate, of the simulation at its end
  double steps_a_frame = 0;       // estimate; impacts and stiff pressure ask for more
  double preroll = 0;             // s, and in steps
  double preroll_steps = 0;
  std::vector<std::string> notes;  // of other parts of the scene: whole warnings
};

/// "the mesh is 24 m wide in a domain of 0.65 m: are these centimetres? Set scale = 0.01"; empty
/// where the size may be meant. @param low, high  of the mesh, m. @param remedy  before the number.
std::string guess_of_unit(const Domain& domain, const V3d& low, const V3d& high,
                          std::string_view remedy = "Set scale =");
/// The same of a sheet from a file, which has no scale of its own; empty for grids.
std::string guess_of_unit(const Domain& domain, const Cloth& cloth, const Sheet& sheet);

/// What is likely to be wrong: sentences with counts, litres and what to do. Empty for most shots.
std::vector<std::string> warnings_of(const SceneReport& report);

/// Notes meshes that no fluid can meet, or whose unit may be another. Before the fluid is placed.
void note_meshes(const Shot& shot, Scene& scene);

/// Whether the bounds of a solid that stands, or the solid side of a plane, miss the domain.
bool lies_beyond(const Domain& domain, double spacing, const ObstacleSet& solids, int k);

/// Names the sheets and notes those whose unit may be another.
void note_cloth(const Shot& shot, Scene& scene);

/// Notes sinks that take nothing, beyond the domain or after the last frame, or whose unit may be
/// another.
void note_sinks(const Shot& shot, Scene& scene);

/// Looks at emitters and estimates what the simulation costs, once the rest of the scene stands.
/// @throws Error if an emitter can never send a particle, whatever happens.
void complete_report(const Shot& shot, Scene& scene);

/// @throws Error if all fluid of a source is lost to obstacles or beyond the domain.
void check_sources_start(const Shot& shot, const SceneReport& report);

}  // namespace drench::sim

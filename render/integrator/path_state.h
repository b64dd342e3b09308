#pragma once
// The state of a path, for path.cpp.

#include <array>

#include "render/scene/scene.h"

namespace drench::render {

/// Vertices before roulette may end a path: few are worth ending that may still leave the water for
/// the sky (decision 0100). And the probability of survival at most on long specular paths: total
/// reflection alone would go on for ever. It is high because the few that last would otherwise come
/// out of a glass as bright dots.
inline constexpr int roulette_start = 10, long_path = 64;
inline constexpr float long_path_survival = 0.99f;

/// What a camera sample's first interface mirrors is followed beside what it lets through, where it
/// is less than this by roulette: water from above mirrors 2 %, of which one sample in twelve knows
/// nearly as much as all (decision 0101).
inline constexpr float small_branch = 0.25f;

/// The fraction of a path's second and later diffuse vertices that gather photons: they are all
/// over the scene, where each waits for memory, and find indirect light that many samples add up
/// (decision 0102).
inline constexpr float later_gather_probability = 0.25f;

/// Of a sample: more go round in a circle that rounding has closed, and would for ever.
inline constexpr uint64_t max_rays = 1u << 16;

/// Sampling dimensions after those of the camera: a block for every vertex of a branch.
enum VertexDimension : uint32_t {
  light_choice,
  light_point,
  scatter_side,
  scatter_direction,
  roulette,
  vertex_dimensions
};
inline constexpr uint32_t first_vertex_dimension = 8, branch_stride = 1u << 16;
/// The points of all of them but roulette's, of which it is rarely asked.
using VertexNumbers = std::array<V2f, roulette>;
/// One for every sheet with gaps, apart from those, so that gaps shift nothing.
inline constexpr uint32_t first_gap_dimension = 1u << 24;

/// Where a path stands: the ray about to be traced and what it carries.
struct PathState {
  Ray ray;
  V3f throughput{1, 1, 1};
  // What surfaces and water left of the light, whatever the densities of the directions: roulette
  // plays for it. A ray aimed at a lamp has a small throughput because it will find much light.
  V3f survival{1, 1, 1};
  V3f vertex;          // where the ray comes from, before its offset
  float bsdf_pdf = 0;  // density of its direction; 0: lights ahead have not been sampled from here
  Bodies in = 0;
  int vertices = 0, diffuse = 0;
  // Gaps of cloth: how far the ray came from its vertex to the last one, how many sheets with gaps
  // it met, and whether it came through one from where no fluid was.
  float before = 0;
  uint32_t sheets = 0;
  bool dry_gap = false;
  int interfaces = 0;        // since the last diffuse surface
  bool has_photons = false;  // that surface, and nothing but smooth bodies since
  bool clear = false;        // nothing but smooth bodies on the path, none of them a mirror
  uint32_t branch = 0;

  /// Of its next vertex.
  uint32_t dimension(VertexDimension which) const {
    return first_vertex_dimension + branch * branch_stride +
           uint32_t(vertices) * vertex_dimensions + which;
  }
};

/// Cosine of the most that smooth bodies may bend the view for a plate to stand for what is seen
/// through them: 15 degrees, a third of a usual lens's picture. Farther away the plate shows
/// something else; drops show the sky there.
inline constexpr float max_bend_cosine = 0.9659258f;

/// What a path must remember that may meet the plate.
struct PlateState {
  V3f view;                 // where the camera looks along this sample
  bool on_catcher = false;  // what is found comes from a shadow catcher
  bool caught = false;      // there was one:
  PathState start;          // where the path in the plate's world begins
  Surface surface;
  Hit hit;
  World world = World::whole;  // now
};

}  // namespace drench::render

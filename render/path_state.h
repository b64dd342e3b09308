#pragma once
// A path between two of its vertices, and the random numbers that it takes.

#include <cstdint>

#include "render/scene.h"

namespace drench {

/// Sampling dimensions after those of the camera: a block for every vertex of a branch.
enum VertexDimension : uint32_t {
  kLightChoice,
  kLightPoint,
  kScatterSide,
  kScatterDirection,
  kRoulette,
  kVertexDimensions
};
inline constexpr uint32_t kFirstVertexDimension = 8, kBranchStride = 1u << 16;
/// One for every sheet with gaps, apart from those, so that gaps shift nothing.
inline constexpr uint32_t kFirstGapDimension = 1u << 24;

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
  bool specular_only = true;
  int vertices = 0, diffuse = 0;
  // Gaps of cloth: how far the ray came from its vertex to the last one, how many sheets with gaps
  // it met, and whether it came through one from where no fluid was.
  float before = 0;
  uint32_t sheets = 0;
  bool dry_gap = false;
  int interfaces = 0;        // since the last diffuse surface
  bool has_photons = false;  // that surface, and nothing but smooth bodies since
  uint32_t branch = 0;
};

}  // namespace drench

#pragma once
// What the path loop asks of a surface that scatters light over many directions. Every lobe has
//   V3f value(const V3f& incoming, float& pdf) const   value x |cos|, and the density of `sample`
//   Scatter sample(const V2f& u) const                 a rough dielectric takes one number more
// and every surface, of one lobe or two,
//   V3f albedo() const                                 fraction of the light that goes on, roughly
// The loop's parts are templates over them; which it is the material's type says.

#include "render/vector.h"

namespace drench::render {

struct Scatter {
  V3f direction;  // unit
  V3f weight;     // value x |cos| / pdf, per channel
  float pdf = 0;  // per steradian; 0: absorbed; infinity: the one direction of a mirror
};

/// The shading normal, bent towards the geometric one until the mirrored direction leaves the real
/// surface, so that a smooth or mapped normal shows no reflections from behind it.
/// All unit; `outgoing` and `shading` in the hemisphere of `geometric`.
inline V3f mirroring_normal(const V3f& outgoing, const V3f& geometric, const V3f& shading) {
  constexpr float min_cosine = 0.01f;  // cosine of a mirrored direction
  const V3f mirrored = shading * (2 * dot(shading, outgoing)) - outgoing;
  const float least = std::min(0.9f * dot(outgoing, geometric), min_cosine);
  const float height = dot(mirrored, geometric);
  if (height >= least) return shading;
  const V3f half = outgoing + normalized(mirrored + geometric * (least - height));
  const float square = dot(half, half);
  return square > 1e-8f ? half * (1 / std::sqrt(square)) : geometric;
}

/// A frame on the side of the surface that light leaves to: z is the normal to shade with.
struct FacingFrame {
  V3f geometric;  // unit, on that side
  Basis basis;

  FacingFrame(const V3f& outgoing, const V3f& geometric_normal, const V3f& shading)
      : FacingFrame(outgoing, geometric_normal, shading,
                    dot(outgoing, geometric_normal) < 0 ? -1.f : 1.f) {}

  V3f local(const V3f& v) const {
    return {dot(v, basis.tangent), dot(v, basis.bitangent), dot(v, basis.normal)};
  }
  /// Whether a direction is on the same side of the real surface as of the one to shade with.
  bool agrees(const V3f& direction, float local_z) const {
    return dot(direction, geometric) * local_z > 0;
  }

 private:
  FacingFrame(const V3f& outgoing, const V3f& geometric_normal, const V3f& shading, float side)
      : geometric(geometric_normal * side),
        basis(mirroring_normal(outgoing, geometric_normal * side, shading * side)) {}
};

}  // namespace drench::render

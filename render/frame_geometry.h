#pragma once
// What moves in a frame.

#include <vector>

#include "pipeline/contract/frames.h"

namespace drench::render {

/// The moving geometry of one frame. Blurred from stored velocity: x + t v / fps over the shutter.
struct FrameGeometry {
  TriangleMesh fluid;                     // closed; material shot.fluid.material; may be empty
  std::vector<ClothFrame> cloth;          // material of the shot's cloth of the same name
  std::vector<ObstacleFrame> obstacle{};  // material of the shot's obstacle of the same name
  FoamFrame foam{};                       // small white spheres; may be empty
};

}  // namespace drench::render

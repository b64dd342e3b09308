#pragma once
// What a draw of a light gives.

#include "render/vector.h"

namespace drench {

/// Light arriving at a point from one sampled direction.
struct LightSample {
  V3f direction;       // unit, towards the light
  float distance = 0;  // m; infinity for sun and environment
  V3f radiance;        // W/(sr m^2)
  float pdf = 0;       // per steradian, with the choice of the light; 0: no sample
  uint32_t group = 0;
  int mesh = -1;  // which of the objects that shine, if it is one
};

}  // namespace drench

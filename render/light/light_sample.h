#pragma once
// What a draw of a light gives.

#include "render/vector.h"

namespace drench::render {

/// Light arriving at a point from one sampled direction.
struct LightSample {
  V3f direction;       // unit, towards the light
  float distance = 0;  // m; infinity for sun and environment
  V3f radiance;        // W/(sr m^2)
  float pdf = 0;       // per steradian, with the choice of the light; 0: no sample
  uint32_t group = 0;
  int mesh = -1;  // which of the objects that shine, if it is one
  int lamp = -1;  // which of the shapes and suns, if it is one
};

/// A point of a lamp to aim at past a surface that bends the light: on the plane of a rectangle or
/// disk, on the disc that a sphere shows, or a direction to a sun.
struct LampPoint {
  V3f at;             // m; of a sun unit, towards it
  V3f normal;         // unit, of the plane, on the side that shines
  V3f radiance;       // W/(sr m^2)
  float density = 0;  // of the draw, per m^2 of the plane or sr of a sun; 0: no point
  float extent = 0;   // of the lamp, m or rad
  bool sun = false;
  size_t lamp = 0;  // which of the shapes and suns
};

}  // namespace drench::render

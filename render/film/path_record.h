#pragma once
// What a camera sample leaves for the layers of a film and for what goes over a plate (matte.h).

#include <vector>

#include "render/scene/scene.h"

namespace drench::render {

/// What one camera sample met of the plate, fractions of light by colour.
struct MatteRecord {
  V3f background{0, 0, 0}, catcher{0, 0, 0};  // b, c
  V3f with{0, 0, 0}, without{0, 0, 0};        // W, O in W/(sr m^2)
  std::vector<V3f> light;                     // W of each group of lights; empty: not asked for
};

/// What a camera sample met, for the layers of a film.
struct PathRecord {
  std::vector<V3f> light;  // W/(sr m^2), what each group of lights gave; empty: not asked for
  Hit first;               // the ground or object met first, if any
  V3f position, normal;    // of it; normal to the side seen
  float time = 0;          // in the shutter
  V3f albedo;              // of the first diffuse surfaces, through water and glass
  bool shaded = false;     // whether there was one on this branch
  MatteRecord matte;
};

}  // namespace drench::render

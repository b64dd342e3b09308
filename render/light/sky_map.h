#pragma once
// A latitude-longitude picture of a sky, ready to be sampled and changed.

#include <vector>

#include "render/vector.h"

namespace drench::render {

struct SkyMap {
  int width = 0, height = 0;
  std::vector<V3f> texel;  // linear ACEScg, row-major from the top left
};

}  // namespace drench::render

#pragma once
// A box along the axes.

#include <Imath/ImathVec.h>

#include <algorithm>

namespace drench {

struct Bounds {
  Imath::V3d low{1e300}, high{-1e300};  // holds nothing

  void add(const Imath::V3d& p) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
};

}  // namespace drench

#pragma once
// The kernel's shape for eight distances at once.

#include "surfacing/pack.h"

namespace drench::surfacing {

/// 2 (1-q)^3 - 8 (1/2-q)^3, each term where its base is positive: the cubic spline in one line.
/// Distance in supports; adds weight W to `sum`, given twice and eight times the weight.
inline Pack add_spline(Pack sum, Pack distance_squared, Pack weight2, Pack weight8) {
  const Pack a = larger(1.f - square_root(distance_squared), Pack{});
  const Pack b = larger(a - 0.5f, Pack{});
  sum = multiply_add(a * a, a * weight2, sum);
  return subtract_product(sum, b * b, b * weight8);
}

}  // namespace drench::surfacing

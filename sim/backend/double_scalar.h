#pragma once
// The operations of pass functors on a double, for those that tests and set-up evaluate in double.

#include <cmath>

#include "sim/backend/pack.h"

namespace drench::sim::DRENCH_BACKEND {

DRENCH_HD double max0(double a) { return a > 0. ? a : 0.; }
DRENCH_HD double select(bool mask, double a, double b) { return mask ? a : b; }
DRENCH_HD double minimum(double a, double b) { return a < b ? a : b; }
DRENCH_HD double maximum(double a, double b) { return a > b ? a : b; }
DRENCH_HD double square_root(double a) { return ::sqrt(a); }

}  // namespace drench::sim::DRENCH_BACKEND

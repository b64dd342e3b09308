#pragma once
// The domain as passes see it: a box in the simulator's local frame, each axis of which ends in two
// walls, is open or is periodic (sim/neighbours/periodic.h).

#include "sim/backend/backend.h"
#include "sim/parameters.h"

namespace drench::sim::DRENCH_BACKEND {

struct DomainWalls {
  float low[3], high[3];  // m, of the box
  bool on[3];             // the axis ends in walls
};

inline DomainWalls domain_walls(const Parameters& p) {
  return {{p.low[0], p.low[1], p.low[2]},
          {p.high[0], p.high[1], p.high[2]},
          {p.wall[0], p.wall[1], p.wall[2]}};
}

}  // namespace drench::sim::DRENCH_BACKEND

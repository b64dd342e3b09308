#include "sim/parameters.h"

namespace drench::sim {

void set_gravity(Parameters& p, const float (&gravity)[3]) {
  for (int k = 0; k < 3; ++k) {
    const bool held = p.full && p.wall[k];
    p.gravity[k] = held ? 0 : gravity[k], p.held[k] = held ? gravity[k] : 0;
  }
}

}  // namespace drench::sim

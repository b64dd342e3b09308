#pragma once
// What holds vertices of sheets in one step. Host arrays.

#include "sim/host_vec.h"

namespace drench::sim {

/// Of each of ClothTopology::pin_vertex.
struct PinsNow {
  HostVec place;            // m, at the end of the step
  HostVec low;              // m, what single precision takes off that
  HostVec velocity;         // m/s, there
  std::vector<float> pull;  // N/m, of the spring to its place; 0: held there; -1: let go
};

}  // namespace drench::sim

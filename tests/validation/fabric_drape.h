#pragma once
// Cusick's drape test of the fabrics (ISO 9073-9): a disc of radius 15 cm on a support of 9 cm.

#include <string>
#include <vector>

namespace drench::validation {

/// What a fabric's drape coefficient was measured to be, %.
struct MeasuredDrape {
  std::string fabric;
  double least, most;
};
/// Of silk last. Gan, Ly and Steven 1991 measured 68.4 % for cotton; leather: Memon et al. 2021.
const std::vector<MeasuredDrape>& measured_drapes();

struct Drape {
  double coefficient = 0;  // share of the overhanging ring that the disc's shadow covers, %
  int unsolved_loads = 0;  // quarters of the weight that found no rest
  int ways_to_fall = 0;    // negative eigenvalues of the tangent at the end
};
/// The disc brought to rest, in double. The folds start from six waves of a centimetre.
/// @param rings  of vertices from the middle to the rim, each of six more
Drape fabric_drape(const std::string& fabric, int rings);

}  // namespace drench::validation

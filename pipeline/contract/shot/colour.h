#pragma once
// Colours of shot files: linear ACEScg (primaries AP1, white near D60).

#include <Imath/ImathVec.h>

#include <array>

namespace drench {

using Matrix3 = std::array<std::array<double, 3>, 3>;  // row-major

/// Linear Rec. 709 (D65) to linear ACEScg with Bradford adaptation of the white, derived from the
/// primaries of both spaces.
const Matrix3& acescg_from_rec709();

/// Display-encoded sRGB, 0..1, to linear ACEScg.
Imath::V3f acescg_from_srgb(const Imath::V3d& encoded);

}  // namespace drench

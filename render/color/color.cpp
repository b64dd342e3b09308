#include "render/color/color.h"

#include "pipeline/contract/error.h"

namespace drench::render {

namespace {

using Imath::M33d;
using Imath::V3d;

V3d times(const M33d& m, const V3d& v) {
  return {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
          m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
          m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

V3d xyz_of(const Imath::V2f& xy) {
  if (!(std::abs(xy.y) > 1e-6f) || !std::isfinite(xy.x) || !std::isfinite(xy.y))
    throw Error("chromaticities with y = 0 name no colour");
  return {double(xy.x) / xy.y, 1, (1 - double(xy.x) - xy.y) / xy.y};
}

M33d inverse(const M33d& m) {
  if (!(std::abs(m.determinant()) > 1e-9))
    throw Error("chromaticities on one line span no colour space");
  return m.inverse();
}

/// RGB to XYZ, white at Y = 1.
M33d rgb_to_xyz(const Imf::Chromaticities& c) {
  const V3d r = xyz_of(c.red), g = xyz_of(c.green), b = xyz_of(c.blue);
  const M33d primaries(r.x, g.x, b.x, r.y, g.y, b.y, r.z, g.z, b.z);
  const V3d s = times(inverse(primaries), xyz_of(c.white));
  return primaries * M33d(s.x, 0, 0, 0, s.y, 0, 0, 0, s.z);
}

M33d adaptation(const Imath::V2f& from, const Imath::V2f& to) {
  const M33d bradford(0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296);
  const V3d a = times(bradford, xyz_of(from)), b = times(bradford, xyz_of(to));
  return inverse(bradford) * M33d(b.x / a.x, 0, 0, 0, b.y / a.y, 0, 0, 0, b.z / a.z) * bradford;
}

}  // namespace

Imf::Chromaticities acescg_chromaticities() {
  return {{0.713f, 0.293f}, {0.165f, 0.830f}, {0.128f, 0.044f}, {0.32168f, 0.33767f}};
}

Imf::Chromaticities rec709_chromaticities() {
  return {{0.64f, 0.33f}, {0.30f, 0.60f}, {0.15f, 0.06f}, {0.3127f, 0.3290f}};
}

ColorMatrix color_conversion(const Imf::Chromaticities& from, const Imf::Chromaticities& to) {
  return {inverse(rgb_to_xyz(to)) * adaptation(from.white, to.white) * rgb_to_xyz(from)};
}

float srgb_encode(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

float srgb_decode(float code) {
  return code <= 0.04045f ? code / 12.92f : std::pow((code + 0.055f) / 1.055f, 2.4f);
}

}  // namespace drench::render

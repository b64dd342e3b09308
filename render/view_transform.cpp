// The built-in view of linear ACEScg on an sRGB display.
//
// Each ACEScg channel passes a shoulder: values to 0.18 unchanged, above them
//   y = 0.18 + 0.82 u / (1 + u^1.5)^(1/1.5),  u = (x - 0.18) / 0.82,
// which leaves the line with the same slope and reaches 1 only at infinity. Working on ACEScg
// channels lets bright saturated colours whiten as film does, and greys stay grey. Then AP1 to Rec.
// 709, whatever leaves that gamut clipped, and the sRGB curve: 18 % grey shows as code 0.46.

#include "pipeline/contract/error.h"
#include "render/color.h"
#include "render/renderer.h"

namespace drench {

namespace {

constexpr float kGrey = 0.18f, kRange = 1 - kGrey, kPower = 1.5f;

float shoulder(float x) {
  if (!(x > kGrey)) return std::max(x, 0.f);  // also catches NaN
  if (x > 1e6f) return 1;
  const float u = (x - kGrey) / kRange;
  return kGrey + kRange * u / std::pow(1 + std::pow(u, kPower), 1 / kPower);
}

uint8_t code_of(float linear) {
  return uint8_t(srgb_encode(std::clamp(linear, 0.f, 1.f)) * 255 + 0.5f);
}

}  // namespace

std::vector<uint8_t> view_transform(const Film& film) {
  const size_t pixels = size_t(std::max(film.width, 0)) * std::max(film.height, 0);
  if (film.rgba.size() != 4 * pixels) throw Error("a film's values do not match its size");
  const ColorMatrix matrix = color_conversion(acescg_chromaticities(), rec709_chromaticities());
  std::vector<uint8_t> rgb(3 * pixels);
  for (size_t p = 0; p < pixels; ++p) {
    const float* x = &film.rgba[4 * p];
    const V3f shown = matrix({shoulder(x[0]), shoulder(x[1]), shoulder(x[2])});
    for (int c = 0; c < 3; ++c) rgb[3 * p + c] = code_of(shown[c]);
  }
  return rgb;
}

}  // namespace drench

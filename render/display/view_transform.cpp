// The built-in view of linear ACEScg on an sRGB display, unless a config gives another.
//
// Each ACEScg channel passes a shoulder: values to 0.18 unchanged, above them
//   y = 0.18 + 0.82 u / (1 + u^1.5)^(1/1.5),  u = (x - 0.18) / 0.82,
// which leaves the line with the same slope and reaches 1 only at infinity. Working on ACEScg
// channels lets bright saturated colours whiten as film does, and greys stay grey. Then AP1 to Rec.
// 709, whatever leaves that gamut clipped, and the sRGB curve: 18 % grey shows as code 0.46.

#include "render/display/view_transform.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "render/color/color.h"
#include "render/display/ocio_view.h"

namespace drench::render {

namespace {

constexpr float middle_grey = 0.18f, shoulder_range = 1 - middle_grey, shoulder_power = 1.5f;

float shoulder(float x) {
  if (!(x > middle_grey)) return std::max(x, 0.f);  // also catches NaN
  if (x > 1e6f) return 1;
  const float u = (x - middle_grey) / shoulder_range;
  return middle_grey +
         shoulder_range * u / std::pow(1 + std::pow(u, shoulder_power), 1 / shoulder_power);
}

/// NaN is black.
uint8_t code_of(float display) {
  return display > 0 ? uint8_t(std::floor(std::min(display, 1.f) * 255 + 0.5f)) : uint8_t(0);
}

std::vector<uint8_t> built_in_view(const Film& film) {
  const size_t pixels = film.rgba.size() / 4;
  const ColorMatrix matrix = color_conversion(acescg_chromaticities(), rec709_chromaticities());
  std::vector<uint8_t> rgb(3 * pixels);
  for (size_t p = 0; p < pixels; ++p) {
    const float* x = &film.rgba[4 * p];
    const V3f shown = matrix({shoulder(x[0]), shoulder(x[1]), shoulder(x[2])});
    for (int c = 0; c < 3; ++c)
      rgb[3 * p + c] = code_of(srgb_encode(std::clamp(shown[c], 0.f, 1.f)));
  }
  return rgb;
}

}  // namespace

ViewTransform::ViewTransform(const ViewSettings& settings) {
  if (!settings.ocio_config.empty() || !settings.display.empty() || !settings.view.empty())
    ocio_ = make_ocio_view(settings);
}

std::vector<uint8_t> ViewTransform::operator()(const Film& film) const {
  const size_t pixels = size_t(std::max(film.width, 0)) * std::max(film.height, 0);
  if (film.rgba.size() != 4 * pixels) throw Error("a film's values do not match its size");
  if (!ocio_) return built_in_view(film);
  std::vector<float> shown(3 * pixels);
  for (size_t p = 0; p < pixels; ++p) std::copy_n(&film.rgba[4 * p], 3, &shown[3 * p]);
  ocio_->apply(shown);
  std::vector<uint8_t> rgb(shown.size());
  std::transform(shown.begin(), shown.end(), rgb.begin(), code_of);
  return rgb;
}

std::string ViewTransform::key() const { return ocio_ ? ocio_->key() : std::string(); }

}  // namespace drench::render

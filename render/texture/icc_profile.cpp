#include "render/texture/icc_profile.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "render/color/color.h"

namespace drench::render {

namespace {

using Bytes = std::span<const unsigned char>;

uint32_t number(Bytes bytes, size_t at, size_t count) {
  uint32_t out = 0;
  for (size_t k = 0; k < count; ++k) out = out << 8 | (at + k < bytes.size() ? bytes[at + k] : 0);
  return out;
}

/// s15Fixed16Number.
double fixed(Bytes bytes, size_t at) { return double(int32_t(number(bytes, at, 4))) / 65536; }

bool has_text(Bytes bytes, size_t at, std::string_view text) {
  return at + text.size() <= bytes.size() &&
         std::equal(text.begin(), text.end(), bytes.begin() + std::ptrdiff_t(at),
                    [](char a, unsigned char b) { return static_cast<unsigned char>(a) == b; });
}

/// The data of a tag; empty if there is none.
Bytes tag(Bytes profile, std::string_view name) {
  constexpr size_t table_offset = 128, entry_size = 12, max_tags = 1000;
  const size_t count = std::min<size_t>(number(profile, table_offset, 4), max_tags);
  for (size_t k = 0; k < count; ++k) {
    const size_t entry = table_offset + 4 + k * entry_size;
    if (!has_text(profile, entry, name)) continue;
    const size_t at = number(profile, entry + 4, 4), size = number(profile, entry + 8, 4);
    if (at > profile.size() || size > profile.size() - at) return {};
    return profile.subspan(at, size);
  }
  return {};
}

/// Of desc (version 2, ASCII) or mluc (version 4, UTF-16): printable ASCII of its start.
std::string description(Bytes profile) {
  const Bytes text = tag(profile, "desc");
  const bool wide = has_text(text, 0, "mluc");
  const size_t from = wide ? number(text, 24, 4) : 12;
  const size_t size = wide ? number(text, 20, 4) : number(text, 8, 4);
  std::string out;
  for (size_t k = wide ? 1 : 0; k < std::min<size_t>(size, 128); k += wide ? 2 : 1) {
    if (from > text.size() || k >= text.size() - from) break;
    const unsigned char c = text[from + k];
    if (c >= 0x20 && c < 0x7f) out += char(c);
  }
  return out;
}

ColourCode::Curve sampled_curve(Bytes data) {
  const size_t count = number(data, 8, 4);
  if (count == 0) return [](float x) { return x; };
  if (data.size() < 12 || count > (data.size() - 12) / 2) return {};
  if (count == 1) {
    const float gamma = float(number(data, 12, 2)) / 256;
    return [gamma](float x) { return std::pow(x, gamma); };
  }
  std::vector<float> value(count);
  for (size_t k = 0; k < count; ++k) value[k] = float(number(data, 12 + 2 * k, 2)) / 65535;
  return [value](float x) {
    const float position = x * float(value.size() - 1);
    const size_t k = std::min(size_t(position), value.size() - 2);
    const float t = position - float(k);
    return value[k] * (1 - t) + value[k + 1] * t;
  };
}

/// Y = (aX + b)^g + c or e from X = d on, cX + f below; Table 68 of ICC.1:2022.
ColourCode::Curve parametric_curve(Bytes data) {
  const size_t kind = number(data, 8, 2);
  constexpr size_t parameter_count[] = {1, 3, 4, 5, 7};
  if (kind > 4 || data.size() < 12 + 4 * parameter_count[kind]) return {};
  double p[7] = {};
  for (size_t k = 0; k < parameter_count[kind]; ++k) p[k] = fixed(data, 12 + 4 * k);
  double g = p[0], a = 1, b = 0, d = 0, slope = 0, above = 0, below = 0;
  if (kind >= 1) a = p[1], b = p[2];
  if (kind == 1 || kind == 2) d = a != 0 ? -b / a : 0;
  if (kind == 2) above = below = p[3];
  if (kind >= 3) slope = p[3], d = p[4];
  if (kind == 4) above = p[5], below = p[6];
  return [=](float x) {
    const double y = x >= d ? std::pow(std::max(a * x + b, 0.0), g) + above : slope * x + below;
    return float(std::clamp(y, 0.0, 1.0));
  };
}

/// None if it cannot be read or gives what is no light.
ColourCode::Curve curve_of(Bytes data) {
  ColourCode::Curve curve;
  if (has_text(data, 0, "curv")) curve = sampled_curve(data);
  if (has_text(data, 0, "para")) curve = parametric_curve(data);
  if (!curve) return {};
  for (int k = 0; k <= 255; ++k)
    if (const float y = curve(float(k) / 255); !(y >= 0 && y <= 1)) return {};
  return curve;
}

/// Of CIE L*, 0 to 100; 24389 / 27 is the slope at black.
float luminance_of(float lightness) {
  const float root = (lightness + 16) / 116;
  return lightness > 8 ? root * root * root : lightness * 27 / 24389;
}

struct Colorant {
  double x = 0, y = 0, z = 0;  // XYZ under D50, the profile connection space
};

Colorant colorant(Bytes data) {
  if (!has_text(data, 0, "XYZ ") || data.size() < 20) return {};
  return {fixed(data, 8), fixed(data, 12), fixed(data, 16)};
}

Imath::V2f chromaticity(const Colorant& c) {
  const double sum = c.x + c.y + c.z;
  return {float(c.x / sum), float(c.y / sum)};
}

/// Within what profiles of sRGB by different makers differ.
bool is_srgb(const std::array<Colorant, 3>& rgb, const std::array<ColourCode::Curve, 3>& curves) {
  constexpr Colorant srgb_colorant[3] = {// IEC 61966-2-1 adapted to D50 by Bradford
                                         {0.4360, 0.2225, 0.0139},
                                         {0.3851, 0.7169, 0.0971},
                                         {0.1431, 0.0606, 0.7141}};
  constexpr double tolerance = 0.002;
  for (size_t c = 0; c < 3; ++c) {
    if (std::abs(rgb[c].x - srgb_colorant[c].x) > tolerance ||
        std::abs(rgb[c].y - srgb_colorant[c].y) > tolerance ||
        std::abs(rgb[c].z - srgb_colorant[c].z) > tolerance)
      return false;
    for (int k = 0; k <= 255; ++k)
      if (std::abs(curves[c](float(k) / 255) - srgb_decode(float(k) / 255)) > tolerance)
        return false;
  }
  return true;
}

/// What is not usable is said by `why_not`.
std::optional<ColourCode> code_of(Bytes bytes, std::string& why_not) {
  const auto cannot = [&](const char* why) {
    why_not = why;
    return std::optional<ColourCode>();
  };
  if (bytes.size() < 132) return cannot("it is cut off");
  const bool grey = has_text(bytes, 16, "GRAY");
  if (!grey && !has_text(bytes, 16, "RGB ")) return cannot("it is not of RGB or grey");
  const bool lightness = grey && has_text(bytes, 20, "Lab ");
  if ((!lightness && !has_text(bytes, 20, "XYZ ")) || !tag(bytes, "A2B0").empty() ||
      !tag(bytes, "D2B0").empty())  // which go before a matrix and curves
    return cannot("it is one of tables");
  std::array<ColourCode::Curve, 3> curves;
  const char* names[3] = {"rTRC", "gTRC", "bTRC"};
  for (size_t c = 0; c < 3; ++c) curves[c] = curve_of(tag(bytes, grey ? "kTRC" : names[c]));
  if (!curves[0] || !curves[1] || !curves[2]) return cannot("it has no curves that can be used");
  if (lightness)
    for (auto& curve : curves)
      curve = [l = curve](float code) { return luminance_of(100 * l(code)); };
  if (grey) return ColourCode{curves, rec709_chromaticities()};
  const std::array<Colorant, 3> rgb{colorant(tag(bytes, "rXYZ")), colorant(tag(bytes, "gXYZ")),
                                    colorant(tag(bytes, "bXYZ"))};
  if (is_srgb(rgb, curves)) return ColourCode::srgb();
  Colorant white;
  for (const Colorant& c : rgb) {
    if (!(c.x + c.y + c.z > 1e-3)) return cannot("it has no primaries that can be used");
    white = {white.x + c.x, white.y + c.y, white.z + c.z};
  }
  const Imf::Chromaticities primaries{chromaticity(rgb[0]), chromaticity(rgb[1]),
                                      chromaticity(rgb[2]), chromaticity(white)};
  try {
    color_conversion(primaries, acescg_chromaticities());
  } catch (const std::exception&) {
    return cannot("its primaries span no colour space");
  }
  return ColourCode{curves, primaries};
}

}  // namespace

IccProfile::IccProfile(Bytes bytes) : code_(code_of(bytes, why_not_)) {
  if (const std::string text = description(bytes); !text.empty()) name_ = text;
}

}  // namespace drench::render

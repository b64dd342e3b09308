#include "render/texture/texture.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "pipeline/contract/log.h"

namespace drench::render {

namespace {

template <class Value>
Value sample_at(const Raster& picture, size_t index) {
  Value value;
  std::memcpy(&value, picture.bytes.data() + index * sizeof(Value), sizeof value);
  return value;
}

size_t codes_of(Raster::Sample sample) { return sample == Raster::Sample::u8 ? 256 : 65536; }

/// Of a code, as a number 0 to 1 or, for half, what it says.
float number_of(Raster::Sample sample, size_t code) {
  if (sample == Raster::Sample::u8) return float(code) / 255;
  if (sample == Raster::Sample::u16) return float(code) / 65535;
  Imath::half h;
  h.setBits(uint16_t(code));
  return h;
}

float direction_of(Raster::Sample sample, size_t code) {
  if (sample == Raster::Sample::u8) return (float(code) - 128) / 127;
  if (sample == Raster::Sample::u16) return (float(code) - 32768) / 32767;
  return number_of(sample, code) * 2.f - 1.f;
}

}  // namespace

Texture::Texture(Raster picture, Values values)
    : picture_(std::move(picture)), direction_(values == Values::direction) {
  if (!direction_) {
    converts_ = !(picture_.code.primaries == acescg_chromaticities());
    if (converts_) {
      const ColorMatrix matrix = color_conversion(picture_.code.primaries, acescg_chromaticities());
      for (size_t c = 0; c < 3; ++c)
        for (size_t r = 0; r < 3; ++r) column_[c][r] = matrix.m[int(r)][int(c)];
    }
  }
  const Raster::Sample sample = picture_.sample;
  if (sample == Raster::Sample::f32) return;
  const bool integer = sample != Raster::Sample::f16;
  for (size_t c = 0; c < 3; ++c) {
    value_[c].resize(codes_of(sample));
    for (size_t code = 0; code < value_[c].size(); ++code) {
      const float number = number_of(sample, code);
      value_[c][code] = direction_ ? direction_of(sample, code)
                        : integer  ? picture_.code.to_linear[c](number)
                                   : number;
    }
  }
  if (sample != Raster::Sample::u8 || picture_.colours != 1) return;
  for (size_t code = 0; code < 256; ++code) {
    const auto grey = uint8_t(code);
    const std::array<uint8_t, 3> rgb =
        picture_.palette.empty() ? std::array{grey, grey, grey} : picture_.palette[code];
    entry_.push_back(converted(value_[0][rgb[0]], value_[1][rgb[1]], value_[2][rgb[2]]));
  }
}

/// ColorMatrix to the bit, all rows at once.
V3f Texture::converted(float r, float g, float b) const {
  if (!converts_) return {r, g, b};
  Column sum;
  for (size_t k = 0; k < 4; ++k)
    sum[k] = column_[0][k] * double(r) + column_[1][k] * double(g) + column_[2][k] * double(b);
  return {float(sum[0]), float(sum[1]), float(sum[2])};
}

V3f Texture::texel(size_t index) const {
  const size_t first = index * size_t(picture_.stride);
  const size_t step = picture_.colours == 1 ? 0 : 1;
  switch (picture_.sample) {
    case Raster::Sample::u8: {
      const std::byte* at = picture_.bytes.data() + first;
      if (!entry_.empty()) return entry_[size_t(at[0])];
      return converted(value_[0][size_t(at[0])], value_[1][size_t(at[step])],
                       value_[2][size_t(at[2 * step])]);
    }
    case Raster::Sample::u16:
    case Raster::Sample::f16:
      return converted(value_[0][sample_at<uint16_t>(picture_, first)],
                       value_[1][sample_at<uint16_t>(picture_, first + step)],
                       value_[2][sample_at<uint16_t>(picture_, first + 2 * step)]);
    case Raster::Sample::f32:
      break;
  }
  const V3f v(sample_at<float>(picture_, first), sample_at<float>(picture_, first + step),
              sample_at<float>(picture_, first + 2 * step));
  return direction_ ? v * 2.f - V3f(1) : converted(v.x, v.y, v.z);
}

V3f Texture::at(const V2f& uv) const {
  const auto wrap = [](float s) {
    const float w = s - std::floor(s);
    return w >= 0 ? w : 0.f;  // of what is not finite
  };
  const int width = picture_.width, height = picture_.height;
  const float x = wrap(uv.x) * float(width) - 0.5f, y = (1 - wrap(uv.y)) * float(height) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y), s = x - x0, t = y - y0;
  const auto texel_at = [&](int column, int row) {
    column = (column + width) % width;
    row = (row + height) % height;
    return texel(size_t(row) * size_t(width) + size_t(column));
  };
  const int c = int(x0), r = int(y0);
  return (texel_at(c, r) * (1 - s) + texel_at(c + 1, r) * s) * (1 - t) +
         (texel_at(c, r + 1) * (1 - s) + texel_at(c + 1, r + 1) * s) * t;
}

Texture read_texture(const std::filesystem::path& path, PictureMemory& memory) {
  return {read_picture(path, PictureUse::colour, memory), Texture::Values::colour};
}

Texture read_normal_map(const std::filesystem::path& path, PictureMemory& memory) {
  return {read_picture(path, PictureUse::data, memory), Texture::Values::direction};
}

Texture read_sky(const std::filesystem::path& path, PictureMemory& memory) {
  Raster picture = read_picture(path, PictureUse::sky, memory);
  if (std::abs(picture.width - 2 * picture.height) > 1)
    log_warning("render",
                fmt::format("{}: as a sky its {} x {} pixels are stretched to latitude and "
                            "longitude, which are twice as wide as high; convert a cube map or "
                            "mirror ball before",
                            path.string(), picture.width, picture.height));
  if (picture.sample == Raster::Sample::u8 || picture.sample == Raster::Sample::u16)
    log_warning("render",
                fmt::format("{}: as a sky it has no light above 1, its {} bits end there: suns and "
                            "lamps in it are as dim as white paper. Give an EXR or HDR",
                            path.string(), 8 * bytes_of(picture.sample)));
  return {std::move(picture), Texture::Values::colour};
}

}  // namespace drench::render

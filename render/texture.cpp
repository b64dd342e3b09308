#include "render/texture.h"

#include <fmt/format.h>
#include <jpeglib.h>
#include <png.h>

#include <array>
#include <csetjmp>
#include <cstring>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files.h"
#include "render/color.h"
#include "render/renderer.h"

namespace drench {

namespace {

constexpr uint64_t kLargestFile = uint64_t(1) << 32;
constexpr uint64_t kLargestPixels = uint64_t(1) << 28;  // 16384 x 16384

struct Bytes {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;
};

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& why) {
  throw Error(
      fmt::format("{}: not a usable picture: {}; give a PNG, JPEG or EXR", path.string(), why));
}

void check_size(const std::filesystem::path& path, uint64_t width, uint64_t height) {
  if (width == 0 || height == 0 || width > kLargestPixels || width * height > kLargestPixels)
    fail(path, fmt::format("{} x {} pixels (at most {})", width, height, kLargestPixels));
}

/// @param flags  of libpng: how 16-bit files are taken
Bytes read_png(const std::filesystem::path& path, const std::vector<std::byte>& file,
               uint32_t flags = 0) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&image, file.data(), file.size()))
    fail(path, image.message);
  if (image.width == 0 || uint64_t(image.width) * image.height > kLargestPixels) {
    png_image_free(&image);
    check_size(path, image.width, image.height);
  }
  image.flags |= flags;
  image.format = PNG_FORMAT_RGBA;
  Bytes out{int(image.width), int(image.height), {}};
  std::vector<uint8_t> rgba(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, rgba.data(), 0, nullptr)) fail(path, image.message);
  out.rgb.resize(rgba.size() / 4 * 3);
  for (size_t p = 0; p < rgba.size() / 4; ++p)
    for (size_t c = 0; c < 3; ++c) out.rgb[3 * p + c] = rgba[4 * p + c];
  return out;
}

struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf jump;
  char message[JMSG_LENGTH_MAX];
};

/// libjpeg reports errors by a jump, so nothing with a destructor may live in this function.
/// Called twice: for the size with `rgb` null, then for the pixels. False on error.
bool decode_jpeg(const std::byte* data, size_t size, int* width, int* height, uint8_t* rgb,
                 JpegErrors* errors) {
  jpeg_decompress_struct jpeg;
  jpeg.err = jpeg_std_error(&errors->manager);
  errors->manager.error_exit = [](j_common_ptr info) {
    auto* e = reinterpret_cast<JpegErrors*>(info->err);
    e->manager.format_message(info, e->message);
    std::longjmp(e->jump, 1);
  };
  // A warning means damaged data, which libjpeg would fill with grey.
  errors->manager.emit_message = [](j_common_ptr info, int level) {
    if (level < 0) info->err->error_exit(info);
  };
  if (setjmp(errors->jump)) {
    jpeg_destroy_decompress(&jpeg);
    return false;
  }
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(data), size);
  jpeg_read_header(&jpeg, TRUE);
  jpeg.out_color_space = JCS_RGB;
  *width = int(jpeg.image_width);
  *height = int(jpeg.image_height);
  if (rgb) {
    jpeg_start_decompress(&jpeg);
    while (jpeg.output_scanline < jpeg.output_height) {
      uint8_t* row = rgb + size_t(3) * jpeg.output_scanline * jpeg.output_width;
      jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);  // sees a missing end
  }
  jpeg_destroy_decompress(&jpeg);
  return true;
}

Bytes read_jpeg(const std::filesystem::path& path, const std::vector<std::byte>& file) {
  JpegErrors errors{};
  Bytes out;
  if (!decode_jpeg(file.data(), file.size(), &out.width, &out.height, nullptr, &errors))
    fail(path, errors.message);
  check_size(path, uint64_t(out.width), uint64_t(out.height));
  out.rgb.resize(size_t(3) * out.width * out.height);
  if (!decode_jpeg(file.data(), file.size(), &out.width, &out.height, out.rgb.data(), &errors))
    fail(path, errors.message);
  return out;
}

Texture from_srgb(const Bytes& bytes) {
  std::array<float, 256> linear;
  for (int k = 0; k < 256; ++k) linear[k] = srgb_decode(float(k) / 255);
  const ColorMatrix matrix = color_conversion(rec709_chromaticities(), acescg_chromaticities());
  Texture out{bytes.width, bytes.height, {}};
  out.texel.resize(bytes.rgb.size() / 3);
  for (size_t p = 0; p < out.texel.size(); ++p)
    out.texel[p] = matrix(
        {linear[bytes.rgb[3 * p]], linear[bytes.rgb[3 * p + 1]], linear[bytes.rgb[3 * p + 2]]});
  return out;
}

Texture from_exr(const std::filesystem::path& path, Primaries primaries) {
  const Film film = read_exr(path, primaries);
  Texture out{film.width, film.height, {}};
  out.texel.resize(size_t(film.width) * film.height);
  for (size_t p = 0; p < out.texel.size(); ++p) {
    const V3f rgb(film.rgba[4 * p], film.rgba[4 * p + 1], film.rgba[4 * p + 2]);
    if (!finite(rgb)) fail(path, fmt::format("pixel {} is not finite", p));
    out.texel[p] = rgb;
  }
  return out;
}

}  // namespace

V3f Texture::at(const V2f& uv) const {
  const auto wrap = [](float s) {
    const float w = s - std::floor(s);
    return w >= 0 ? w : 0.f;  // of what is not finite
  };
  const float x = wrap(uv.x) * float(width) - 0.5f, y = (1 - wrap(uv.y)) * float(height) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y), s = x - x0, t = y - y0;
  const auto texel_at = [&](int column, int row) {
    column = (column + width) % width;
    row = (row + height) % height;
    return texel[size_t(row) * width + column];
  };
  const int c = int(x0), r = int(y0);
  return (texel_at(c, r) * (1 - s) + texel_at(c + 1, r) * s) * (1 - t) +
         (texel_at(c, r + 1) * (1 - s) + texel_at(c + 1, r + 1) * s) * t;
}

namespace {

enum class Format { png, jpeg, exr };

Format format_of(const std::filesystem::path& path, const std::vector<std::byte>& file) {
  const auto starts_with = [&](std::initializer_list<int> magic) {
    size_t k = 0;
    for (int byte : magic)
      if (k >= file.size() || file[k++] != std::byte(byte)) return false;
    return true;
  };
  if (starts_with({0x89, 'P', 'N', 'G'})) return Format::png;
  if (starts_with({0xff, 0xd8, 0xff})) return Format::jpeg;
  if (starts_with({0x76, 0x2f, 0x31, 0x01})) return Format::exr;
  fail(path, "it is none of the known formats");
}

}  // namespace

Texture read_texture(const std::filesystem::path& path) {
  const std::vector<std::byte> file = read_file(path, kLargestFile);
  switch (format_of(path, file)) {
    case Format::png:
      return from_srgb(read_png(path, file));
    case Format::jpeg:
      return from_srgb(read_jpeg(path, file));
    case Format::exr:
      return from_exr(path, Primaries::converted);
  }
  return {};
}

Texture read_normal_map(const std::filesystem::path& path) {
  const std::vector<std::byte> file = read_file(path, kLargestFile);
  const Format format = format_of(path, file);
  if (format == Format::exr) {
    Texture out = from_exr(path, Primaries::as_they_are);
    for (V3f& n : out.texel) n = n * 2.f - V3f(1);
    return out;
  }
  // Taken as sRGB, 16 bits keep their values.
  const Bytes bytes = format == Format::png ? read_png(path, file, PNG_IMAGE_FLAG_16BIT_sRGB)
                                            : read_jpeg(path, file);
  Texture out{bytes.width, bytes.height, {}};
  out.texel.resize(bytes.rgb.size() / 3);
  for (size_t p = 0; p < out.texel.size(); ++p)
    for (int c = 0; c < 3; ++c) out.texel[p][c] = (float(bytes.rgb[3 * p + size_t(c)]) - 128) / 127;
  return out;
}

}  // namespace drench

#pragma once
// Pictures written by tests, and what reading them says.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <png.h>

#include "render/color/color.h"
#include "render/texture/texture.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::error_of;
using drench::test::TemporaryFolder;
using drench::test::write_quickly;

/// What `f` writes to stderr, which is free again even where it throws.
inline std::string said_by(const std::function<void()>& f) {
  testing::internal::CaptureStderr();
  try {
    f();
  } catch (...) {
    testing::internal::GetCapturedStderr();
    throw;
  }
  return testing::internal::GetCapturedStderr();
}

inline testing::AssertionResult tells(const std::string& text,
                                      const std::vector<std::string>& words) {
  for (const std::string& word : words)
    if (text.find(word) == std::string::npos)
      return testing::AssertionFailure() << "'" << text << "' lacks '" << word << "'";
  return testing::AssertionSuccess();
}

/// IEC 61966-2-1 of a code in 0..1.
inline double linear_of_srgb(double c) {
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

/// Linear Rec. 709 of a texel.
inline V3f rec709_of(const V3f& acescg) {
  return color_conversion(acescg_chromaticities(), rec709_chromaticities())(acescg);
}

inline void expect_near(const V3f& found, const V3f& expected, float error,
                        const std::string& what = {}) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], error) << what << " channel " << c;
}

/// A PNG: samples row by row, each of `depth` bits in a number of its own.
struct PngOfTest {
  int width = 1, height = 1, depth = 8, type = PNG_COLOR_TYPE_RGB;
  bool interlaced = false;
  std::vector<uint16_t> samples{};
  double gamma = 0;            // 0: no gAMA
  bool srgb = false;           // an sRGB chunk
  std::vector<double> chrm{};  // white, red, green, blue; x, y
  std::string icc{};           // an iCCP chunk
  std::vector<png_color> palette{};
  std::vector<uint8_t> alphas{};  // of the palette

  int channels() const {
    return type == PNG_COLOR_TYPE_RGB          ? 3
           : type == PNG_COLOR_TYPE_RGB_ALPHA  ? 4
           : type == PNG_COLOR_TYPE_GRAY_ALPHA ? 2
                                               : 1;
  }

  std::string bytes() const {
    std::string out;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(
        png, &out,
        [](png_structp p, png_bytep data, png_size_t size) {
          static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<char*>(data), size);
        },
        nullptr);
    png_set_IHDR(png, info, png_uint_32(width), png_uint_32(height), depth, type,
                 interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE,
                 PNG_FILTER_TYPE_BASE);
    if (gamma > 0) png_set_gAMA(png, info, gamma);
    if (srgb) png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    if (!chrm.empty())
      png_set_cHRM(png, info, chrm[0], chrm[1], chrm[2], chrm[3], chrm[4], chrm[5], chrm[6],
                   chrm[7]);
    if (!icc.empty())
      png_set_iCCP(png, info, "test", 0, reinterpret_cast<png_const_bytep>(icc.data()),
                   png_uint_32(icc.size()));
    if (!palette.empty()) png_set_PLTE(png, info, palette.data(), int(palette.size()));
    if (!alphas.empty()) png_set_tRNS(png, info, alphas.data(), int(alphas.size()), nullptr);
    png_write_info(png, info);
    png_set_packing(png);
    png_set_swap(png);
    const size_t in_row = size_t(width) * size_t(channels()), sample = depth == 16 ? 2 : 1;
    std::vector<uint8_t> data(in_row * size_t(height) * sample);
    for (size_t k = 0; k < in_row * size_t(height); ++k) {
      if (depth == 16)
        std::memcpy(&data[2 * k], &samples.at(k), 2);
      else
        data[k] = uint8_t(samples.at(k));
    }
    std::vector<png_bytep> rows;
    for (int y = 0; y < height; ++y) rows.push_back(data.data() + size_t(y) * in_row * sample);
    png_write_image(png, rows.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return out;
  }
};

/// An ICC profile of a matrix and one curve for R, G and B: ICC.1:2022.
class IccOfTest {
 public:
  /// @param colorants  XYZ of red, green and blue under D50
  /// @param space  of the colours, then that of their connection
  IccOfTest(const std::array<std::array<double, 3>, 3>& colorants, const std::string& curve,
            const std::string& space = "RGB XYZ ")
      : space_(space) {
    const char* names[] = {"rXYZ", "gXYZ", "bXYZ"};
    add("desc", std::string("desc\0\0\0\0\0\0\0\x0b", 12) + "of the test");
    add("wtpt", std::string("XYZ \0\0\0\0", 8) + fixed(0.9642) + fixed(1) + fixed(0.8249));
    for (size_t k = 0; k < 3; ++k)
      add(names[k], std::string("XYZ \0\0\0\0", 8) + fixed(colorants[k][0]) +
                        fixed(colorants[k][1]) + fixed(colorants[k][2]));
    for (const char* name : {"rTRC", "gTRC", "bTRC", "kTRC"}) add(name, curve);
  }
  void add(const std::string& name, const std::string& content) {
    tags_.emplace_back(name, content);
  }

  static std::string gamma(double g) {
    return std::string("curv\0\0\0\0\0\0\0\x01", 12) + number(uint32_t(g * 256), 2) +
           std::string(2, '\0');
  }
  /// The curve of IEC 61966-2-1.
  static std::string srgb() {
    return std::string("para\0\0\0\0\0\3\0\0", 12) + fixed(2.4) + fixed(1 / 1.055) +
           fixed(0.055 / 1.055) + fixed(1 / 12.92) + fixed(0.04045);
  }

  std::string bytes() const {
    std::string table = number(uint32_t(tags_.size()), 4), data;
    const size_t from = 128 + 4 + 12 * tags_.size();
    for (const auto& [name, content] : tags_) {
      table += name + number(uint32_t(from + data.size()), 4) + number(uint32_t(content.size()), 4);
      data += content + std::string((4 - content.size() % 4) % 4, '\0');
    }
    std::string head(128, '\0');
    const auto put = [&](size_t at, const std::string& text) {
      head.replace(at, text.size(), text);
    };
    put(0, number(uint32_t(from + data.size()), 4));
    put(8, std::string("\2\x40\0\0", 4));
    put(12, "mntr" + space_);
    put(36, "acsp");
    put(68, fixed(0.9642) + fixed(1) + fixed(0.8249));
    return head + table + data;
  }

 private:
  static std::string number(uint32_t value, int count) {
    std::string out;
    for (int k = count - 1; k >= 0; --k) out += char(value >> (8 * k) & 255);
    return out;
  }
  static std::string fixed(double value) {
    return number(uint32_t(int32_t(std::lround(value * 65536))), 4);
  }
  std::string space_;
  std::vector<std::pair<std::string, std::string>> tags_;
};

inline constexpr std::array<std::array<double, 3>, 3> srgb_colorants{
    {{0.4360, 0.2225, 0.0139}, {0.3851, 0.7169, 0.0971}, {0.1431, 0.0606, 0.7141}}};
/// Display P3 adapted to D50, as Apple's profile has them.
inline constexpr std::array<std::array<double, 3>, 3> p3_colorants{
    {{0.5151, 0.2412, -0.0011}, {0.2920, 0.6922, 0.0419}, {0.1571, 0.0666, 0.7841}}};
inline Imf::Chromaticities display_p3() {
  return {{0.680f, 0.320f}, {0.265f, 0.690f}, {0.150f, 0.060f}, {0.3127f, 0.3290f}};
}

/// A test with a folder for pictures.
class PictureTest : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    write_quickly(folder_ / name, bytes);
    return folder_ / name;
  }
  /// A texture of these bytes, and what is said as it is read.
  Texture read(std::string_view bytes, std::string* said = nullptr) {
    const auto path = write("picture." + std::to_string(++count_), bytes);
    Texture out;
    const std::string text = said_by([&] { out = read_texture(path); });
    if (said)
      *said = text;
    else
      EXPECT_EQ(text, "");
    return out;
  }
  Texture read_normals(std::string_view bytes) {
    const auto path = write("normals." + std::to_string(++count_), bytes);
    Texture out;
    EXPECT_EQ(said_by([&] { out = read_normal_map(path); }), "");
    return out;
  }
  std::string refused(std::string_view bytes) {
    const auto path = write("refused." + std::to_string(++count_), bytes);
    return error_of([&] { read_texture(path); });
  }

  const TemporaryFolder folder_;
  int count_ = 0;
};

}  // namespace drench::render::test

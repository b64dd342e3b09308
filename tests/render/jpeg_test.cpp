// JPEG textures against pictures written with known quantisation tables.
//
// Where the error bounds come from: a JPEG's 8 x 8 DCT is orthonormal, so a coefficient rounded to
// multiples of q errs by q/2 at most, the mean of a block (DC / 8) by q/16, and the root mean
// square over a block by half that of the table's entries. Y, Cb and Cr are rounded to integers on
// both ways, R, G and B on the way back: half a level each.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

#include "pipeline/contract/error.h"
#include "tests/render/picture_support.h"

namespace drench::render::test {
namespace {

using Imath::V3d;

struct Jpeg {
  std::string bytes;
  std::array<std::array<double, 64>, 2> step;  // of luma and chroma coefficients, in levels
};

enum class Scans { baseline, progressive, arithmetic };

/// Chroma at full resolution; `components` is 1 (grey) or 3 (RGB).
Jpeg encode(int width, int height, int components, std::vector<uint8_t> pixels, int quality,
            Scans scans = Scans::baseline) {
  jpeg_compress_struct jpeg;
  jpeg_error_mgr errors;
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &memory, &size);
  jpeg.image_width = JDIMENSION(width), jpeg.image_height = JDIMENSION(height);
  jpeg.input_components = components;
  jpeg.in_color_space = components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, quality, TRUE);
  jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = 1;
  if (scans == Scans::progressive) jpeg_simple_progression(&jpeg);
  jpeg.arith_code = scans == Scans::arithmetic ? TRUE : FALSE;
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    uint8_t* row = pixels.data() + size_t(jpeg.next_scanline) * width * components;
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  Jpeg result;
  result.bytes.assign(reinterpret_cast<char*>(memory), size);
  for (size_t table : {0, 1})
    for (size_t k = 0; k < 64; ++k) result.step[table][k] = jpeg.quant_tbl_ptrs[table]->quantval[k];
  jpeg_destroy_compress(&jpeg);
  std::free(memory);
  return result;
}

/// Bounds of R, G and B from those of Y and of Cb and Cr: ITU-T T.871, R = Y + 1.402 Cr,
/// G = Y - 0.344 Cb - 0.714 Cr, B = Y + 1.772 Cb.
std::array<double, 3> rgb_bounds(double luma, double chroma) {
  return {luma + 1.402 * chroma + 0.5, luma + (0.344 + 0.714) * chroma + 0.5,
          luma + 1.772 * chroma + 0.5};
}

/// IEC 61966-2-1 of a level in 0..255.
double linear_of(double level) {
  const double c = std::clamp(level / 255, 0.0, 1.0);
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

/// Linear Rec. 709 to ACEScg as the ACES project publishes it; the entries hold to
/// 2e-4 (white points of four digits).
V3d acescg_of(const V3d& c) {
  return {0.613097 * c.x + 0.339523 * c.y + 0.047379 * c.z,
          0.070194 * c.x + 0.916354 * c.y + 0.013452 * c.z,
          0.020616 * c.x + 0.109570 * c.y + 0.869815 * c.z};
}

/// The texel lies between what the levels `error` below and above give: every map on the way rises.
void expect_within(const V3f& texel, const std::array<uint8_t, 3>& level,
                   const std::array<double, 3>& error) {
  V3d low, high;
  for (int c = 0; c < 3; ++c) {
    low[c] = linear_of(level[size_t(c)] - error[size_t(c)]);
    high[c] = linear_of(level[size_t(c)] + error[size_t(c)]);
  }
  const V3d least = acescg_of(low), most = acescg_of(high);
  constexpr double matrix = 3 * 2e-4;
  for (int c = 0; c < 3; ++c) {
    EXPECT_GE(texel[c], least[c] - matrix) << c;
    EXPECT_LE(texel[c], most[c] + matrix) << c;
  }
}

using Rgb = std::array<uint8_t, 3>;
constexpr Rgb red{200, 30, 40}, moss{60, 110, 20}, dusk{12, 18, 60}, paper{250, 245, 235};

/// Four flat blocks of 8 x 8: red and moss above, dusk and paper below.
const Rgb& block_colour(int x, int y) {
  return y < 8 ? (x < 8 ? red : moss) : (x < 8 ? dusk : paper);
}

class JpegTexture : public PictureTest {};

TEST_F(JpegTexture, ReturnsFlatBlocksWithinTheStepOfTheirMean) {
  std::vector<uint8_t> pixels;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      pixels.insert(pixels.end(), block_colour(x, y).begin(), block_colour(x, y).end());
  for (const Scans scans : {Scans::baseline, Scans::progressive}) {
    const Jpeg jpeg = encode(16, 16, 3, pixels, 90, scans);
    const Texture texture = read(jpeg.bytes);
    ASSERT_EQ(texture.width(), 16);
    ASSERT_EQ(texture.height(), 16);
    const auto error = rgb_bounds(1 + jpeg.step[0][0] / 16, 1 + jpeg.step[1][0] / 16);
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x)
        expect_within(texture.texel(size_t(16 * y + x)), block_colour(x, y), error);
  }
}

TEST_F(JpegTexture, ReturnsGreyPicturesAsGreys) {
  std::vector<uint8_t> pixels;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 24; ++x) pixels.push_back(uint8_t(40 + 80 * (x / 8)));
  const Jpeg jpeg = encode(24, 8, 1, pixels, 90);
  const Texture texture = read(jpeg.bytes);
  ASSERT_EQ(texture.texels(), pixels.size());
  const double error = 0.5 + jpeg.step[0][0] / 16;
  for (size_t p = 0; p < pixels.size(); ++p)
    expect_within(texture.texel(p), {pixels[p], pixels[p], pixels[p]}, {error, error, error});
}

// Waves of different lengths in each channel, so that every coefficient is used.
TEST_F(JpegTexture, ReturnsWavesWithinTheQuantisation) {
  constexpr int size = 64;
  std::vector<uint8_t> pixels;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (const double wave :
           {std::sin(0.9 * x + 0.2 * y), std::cos(0.4 * x - 1.1 * y), std::sin(0.05 * x * y)})
        pixels.push_back(uint8_t(std::lround(128 + 60 * wave)));
  const Jpeg jpeg = encode(size, size, 3, pixels, 95);
  const Texture texture = read(jpeg.bytes);
  ASSERT_EQ(texture.texels(), size_t(size * size));
  const auto half_step = [&](int table) {
    double sum = 0;
    for (double q : jpeg.step[size_t(table)]) sum += q * q / 4;
    return std::sqrt(sum / 64);
  };
  const auto bound = rgb_bounds(1 + half_step(0), 1 + half_step(1));
  const ColorMatrix to_rec709 = color_conversion(acescg_chromaticities(), rec709_chromaticities());
  std::array<double, 3> square{};
  for (size_t p = 0; p < texture.texels(); ++p) {
    const V3f linear = to_rec709(texture.texel(p));
    for (int c = 0; c < 3; ++c)
      square[size_t(c)] += std::pow(srgb_encode(linear[c]) * 255 - pixels[3 * p + size_t(c)], 2);
  }
  for (size_t c = 0; c < 3; ++c) {
    const double rms = std::sqrt(square[c] / (size * size));
    EXPECT_LE(rms, bound[c]) << c;
    EXPECT_GT(rms, 0) << c << ": nothing was quantised";
  }
}

// libjpeg fills what is missing with grey and only warns.
TEST_F(JpegTexture, IsRefusedWhereAPixelIsMissing) {
  const std::string whole = encode(64, 64, 3, std::vector<uint8_t>(64 * 64 * 3, 90), 90).bytes;
  const Texture texture = read(whole);
  EXPECT_EQ(texture.width(), 64);
  for (size_t size = 3; size + 2 < whole.size(); ++size)
    EXPECT_TRUE(tells(refused(whole.substr(0, size)), {"refused.", "JPEG"})) << size;
  // Without the two bytes of the end marker every pixel is there.
  for (const size_t size : {whole.size() - 2, whole.size() - 1}) {
    std::string said;
    const Texture same = read(whole.substr(0, size), &said);
    EXPECT_TRUE(tells(said, {"all its pixels are there", "end is missing"}));
    for (size_t p = 0; p < texture.texels(); ++p) EXPECT_EQ(same.texel(p), texture.texel(p));
  }
}

std::vector<uint8_t> noise() {
  std::vector<uint8_t> pixels;
  for (int k = 0; k < 64 * 64 * 3; ++k) pixels.push_back(uint8_t(k * 37 % 251));
  return pixels;
}

// A cut between scans leaves a coarser picture that decodes without a fault.
TEST_F(JpegTexture, ProgressiveIsRefusedWithoutItsLastScans) {
  const std::string whole = encode(64, 64, 3, noise(), 90, Scans::progressive).bytes;
  EXPECT_EQ(read(whole).width(), 64);
  int scans = 0;
  for (size_t at = whole.find("\xff\xda"); at != std::string::npos;
       at = whole.find("\xff\xda", at + 2), ++scans)
    EXPECT_TRUE(tells(refused(whole.substr(0, at)), {"JPEG"})) << scans;
  EXPECT_GT(scans, 5);
}

// Past its data an arithmetic decoder reads zeros (ITU-T T.81, annex D), so that pixels that are
// missing decode without a fault.
TEST_F(JpegTexture, ArithmeticIsRefusedWithoutItsEnd) {
  const std::string whole = encode(64, 64, 3, noise(), 90, Scans::arithmetic).bytes;
  EXPECT_EQ(read(whole).width(), 64);
  for (size_t size = whole.find("\xff\xda"); size < whole.size(); size += 10)
    EXPECT_TRUE(tells(refused(whole.substr(0, size)), {"JPEG"})) << size;
  EXPECT_TRUE(tells(refused(whole.substr(0, whole.size() - 2)), {"cut off"}));
}

// Codes have no common length: after a wrong bit the scan ends too early or too late.
TEST_F(JpegTexture, DamageWithinAScanIsRefused) {
  int late = 0;
  for (const Scans scans : {Scans::baseline, Scans::progressive}) {
    const std::string whole = encode(64, 64, 3, noise(), 90, scans).bytes;
    for (size_t place = whole.size() / 2; place < whole.size() / 2 + 200; place += 10) {
      std::string damaged = whole;
      damaged[place] ^= 0x55;
      const auto path = write("damaged", damaged);
      std::string error, said;
      try {
        said = said_by([&] { read_texture(path); });
      } catch (const Error& e) {
        error = e.what();
      }
      EXPECT_EQ(said.find("extraneous"), std::string::npos) << said;
      late += error.find("extraneous") != std::string::npos ? 1 : 0;
    }
  }
  EXPECT_GT(late, 5);
  // Some cameras pad a scan with zeros.
  const std::string whole = encode(64, 64, 3, noise(), 90).bytes;
  std::string padded = whole, said;
  padded.insert(whole.size() - 2, 20, '\0');
  const Texture texture = read(padded, &said), same = read(whole);
  EXPECT_TRUE(tells(said, {"not quite right", "extraneous"}));
  for (size_t p = 0; p < texture.texels(); ++p) EXPECT_EQ(texture.texel(p), same.texel(p));
  padded.resize(padded.size() - 2);
  EXPECT_NE(refused(padded), "");
}

TEST_F(JpegTexture, StrayBytesAreAWarning) {
  const std::string whole = encode(64, 64, 3, std::vector<uint8_t>(64 * 64 * 3, 90), 90).bytes;
  const Texture texture = read(whole);
  std::string said;
  const Texture after = read(whole + "some bytes", &said);
  EXPECT_TRUE(tells(said, {"10 bytes after the picture's end"}));
  std::string stray = whole;
  stray.insert(whole.find("\xff\xda"), "abc");  // before the marker of the scan
  const Texture between = read(stray, &said);
  EXPECT_TRUE(tells(said, {"not quite right"}));
  for (size_t p = 0; p < texture.texels(); ++p) {
    EXPECT_EQ(after.texel(p), texture.texel(p));
    EXPECT_EQ(between.texel(p), texture.texel(p));
  }
}

enum class Marker { adobe, none };

/// Four inks of one colour, as the samples are stored. @param inner  CMYK, or YCCK
std::string encode_inks(const std::array<uint8_t, 4>& stored, J_COLOR_SPACE inner, Marker marker) {
  jpeg_compress_struct jpeg;
  jpeg_error_mgr errors;
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &memory, &size);
  jpeg.image_width = jpeg.image_height = 16;
  jpeg.input_components = 4;
  jpeg.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&jpeg);
  jpeg_set_colorspace(&jpeg, inner);
  jpeg.write_Adobe_marker = marker == Marker::adobe ? TRUE : FALSE;
  jpeg_set_quality(&jpeg, 100, TRUE);
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<uint8_t> row;
  for (int x = 0; x < 16; ++x) row.insert(row.end(), stored.begin(), stored.end());
  while (jpeg.next_scanline < jpeg.image_height) {
    uint8_t* from = row.data();
    jpeg_write_scanlines(&jpeg, &from, 1);
  }
  jpeg_finish_compress(&jpeg);
  const std::string out(reinterpret_cast<char*>(memory), size);
  jpeg_destroy_compress(&jpeg);
  std::free(memory);
  return out;
}

// Light is what each ink and black leave. Adobe's programs store 255 minus the ink, and say so by a
// marker. Quality 100 has steps of 1: two levels for each of two factors, rounding and YCCK.
TEST_F(JpegTexture, InksAreReadAsTheColourTheyLeave) {
  const std::array<double, 4> ink{0.1, 0.6, 0.8, 0.1};  // cyan, magenta, yellow, black
  for (const Marker marker : {Marker::adobe, Marker::none})
    for (const J_COLOR_SPACE inner : {JCS_CMYK, JCS_YCCK}) {
      if (marker == Marker::none && inner == JCS_YCCK) continue;  // only the marker tells it
      std::array<uint8_t, 4> stored;
      for (size_t c = 0; c < 4; ++c)
        stored[c] = uint8_t(std::lround(255 * (marker == Marker::adobe ? 1 - ink[c] : ink[c])));
      std::string said;
      const Texture texture = read(encode_inks(stored, inner, marker), &said);
      EXPECT_TRUE(tells(said, {"CMYK", "approximate"}));
      const V3f linear = rec709_of(texture.texel(40));
      for (int c = 0; c < 3; ++c) {
        const double code = (1 - ink[size_t(c)]) * (1 - ink[3]);
        EXPECT_NEAR(srgb_encode(linear[c]), code, 4. / 255) << c;
      }
    }
}

std::string with_segment(const std::string& jpeg, char marker, const std::string& content) {
  const size_t size = content.size() + 2;
  return jpeg.substr(0, 2) + '\xff' + marker + char(size >> 8) + char(size & 255) + content +
         jpeg.substr(2);
}

TEST_F(JpegTexture, ProfilesAreHonouredForColoursAlone) {
  const std::string whole = encode(16, 16, 3, std::vector<uint8_t>(16 * 16 * 3, 90), 90).bytes;
  const std::string linear = IccOfTest(srgb_colorants, IccOfTest::gamma(1)).bytes();
  const std::string marked =
      with_segment(whole, '\xe2', std::string("ICC_PROFILE\0\1\1", 14) + linear);
  EXPECT_NEAR(read(whole).texel(0).x, linear_of_srgb(90 / 255.), 0.01);
  EXPECT_NEAR(read(marked).texel(0).x, 90 / 255., 0.01);
  EXPECT_NEAR(read_normals(marked).texel(0).x, (90 - 128) / 127., 0.02);
  EXPECT_EQ(read_normals(marked).texel(0), read_normals(whole).texel(0));
}

TEST_F(JpegTexture, TurnedPicturesOfCamerasAreNamed) {
  const std::string whole = encode(16, 8, 3, std::vector<uint8_t>(16 * 8 * 3, 90), 90).bytes;
  const std::string exif("Exif\0\0MM\0\x2a\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0", 32);
  std::string said;
  EXPECT_EQ(read(with_segment(whole, '\xe1', exif), &said).width(), 16);
  EXPECT_TRUE(tells(said, {"orientation 6"}));
}

}  // namespace
}  // namespace drench::render::test

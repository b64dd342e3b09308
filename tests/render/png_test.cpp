// PNG: every kind gives its values, and what a file says of its colours holds for colours alone.

#include <cstring>

#include "tests/render/picture_support.h"

namespace drench::render::test {
namespace {

class Png : public PictureTest {};

/// Of a chunk's type and data: ISO 3309, as the PNG specification has it.
uint32_t crc_of(const std::string& bytes) {
  uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= uint8_t(byte);
    for (int k = 0; k < 8; ++k) crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
  }
  return ~crc;
}

std::string number_of(uint32_t value) {
  return {char(value >> 24), char(value >> 16 & 255), char(value >> 8 & 255), char(value & 255)};
}

std::string chunk(const std::string& type, const std::string& data) {
  return number_of(uint32_t(data.size())) + type + data + number_of(crc_of(type + data));
}

PngOfTest ramp(int depth) {
  PngOfTest png;
  png.width = 256;
  png.depth = depth;
  for (int k = 0; k < 256; ++k)
    for (const int code : {k, 255 - k, k / 2})
      png.samples.push_back(uint16_t(depth == 16 ? code * 257 : code));
  return png;
}

// Nothing tells a 16-bit picture of a paint program from its 8-bit one but its depth.
TEST_F(Png, SixteenBitsAreSrgbAsEightAre) {
  const Texture eight = read(ramp(8).bytes()), sixteen = read(ramp(16).bytes());
  ASSERT_EQ(sixteen.texels(), 256u);
  for (size_t k = 0; k < 256; ++k) {
    expect_near(sixteen.texel(k), eight.texel(k), 1e-6f, std::to_string(k));
    EXPECT_NEAR(rec709_of(eight.texel(k)).x, linear_of_srgb(double(k) / 255), 1e-5);
  }
}

TEST_F(Png, SixteenBitsKeepTheirPrecision) {
  PngOfTest png{
      .width = 2, .depth = 16, .samples = {0x1234, 0x1234, 0x1234, 0x1235, 0x1235, 0x1235}};
  const Texture texture = read(png.bytes());
  EXPECT_NEAR(rec709_of(texture.texel(0)).y, linear_of_srgb(0x1234 / 65535.), 1e-6);
  EXPECT_GT(texture.texel(1).y, texture.texel(0).y);
}

/// Each kind of grey, and the codes of a picture of 5 x 3 pixels in it.
TEST_F(Png, GreysOfEveryDepthAreRead) {
  for (const int depth : {1, 2, 4, 8, 16})
    for (const int type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA})
      for (const bool interlaced : {false, true}) {
        const int most = (1 << depth) - 1;
        if (type == PNG_COLOR_TYPE_GRAY_ALPHA && depth < 8) continue;
        PngOfTest png{
            .width = 5, .height = 3, .depth = depth, .type = type, .interlaced = interlaced};
        std::vector<int> codes;
        for (int k = 0; k < 15; ++k) {
          codes.push_back(k * most / 14);
          png.samples.push_back(uint16_t(codes.back()));
          if (type == PNG_COLOR_TYPE_GRAY_ALPHA) png.samples.push_back(uint16_t(most));
        }
        const Texture texture = read(png.bytes());
        ASSERT_EQ(texture.texels(), codes.size());
        for (size_t k = 0; k < codes.size(); ++k) {
          const auto value = float(linear_of_srgb(double(codes[k]) / most));
          expect_near(texture.texel(k), V3f(value), 1e-5f,
                      std::to_string(depth) + " bits, pixel " + std::to_string(k));
        }
      }
}

TEST_F(Png, ColoursOfEveryKindAreRead) {
  for (const int depth : {8, 16})
    for (const int type : {PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA})
      for (const bool interlaced : {false, true}) {
        PngOfTest png{
            .width = 5, .height = 3, .depth = depth, .type = type, .interlaced = interlaced};
        const int most = (1 << depth) - 1;
        for (int k = 0; k < 15; ++k) {
          for (const int c : {k * most / 14, most - k * most / 14, most / 3})
            png.samples.push_back(uint16_t(c));
          if (type == PNG_COLOR_TYPE_RGB_ALPHA) png.samples.push_back(uint16_t(most));
        }
        const Texture texture = read(png.bytes());
        ASSERT_EQ(texture.texels(), 15u);
        for (size_t k = 0; k < 15; ++k) {
          const double red = double(int(k) * most / 14) / most;
          const V3f expected(float(linear_of_srgb(red)), float(linear_of_srgb(1 - red)),
                             float(linear_of_srgb(double(most / 3) / most)));
          expect_near(rec709_of(texture.texel(k)), expected, 1e-5f, std::to_string(k));
        }
      }
}

TEST_F(Png, PalettesOfEveryDepthAreRead) {
  for (const int depth : {1, 2, 4, 8})
    for (const bool interlaced : {false, true}) {
      PngOfTest png{.width = 5,
                    .height = 3,
                    .depth = depth,
                    .type = PNG_COLOR_TYPE_PALETTE,
                    .interlaced = interlaced};
      const int count = 1 << depth;
      for (int k = 0; k < count; ++k)
        png.palette.push_back({uint8_t(k), uint8_t(255 - k), uint8_t(k / 2)});
      for (int k = 0; k < 15; ++k) png.samples.push_back(uint16_t((k * 7) % count));
      const Texture texture = read(png.bytes());
      for (size_t k = 0; k < 15; ++k) {
        const int entry = int(k * 7) % count;
        EXPECT_NEAR(rec709_of(texture.texel(k)).x, linear_of_srgb(entry / 255.), 1e-5) << depth;
        EXPECT_NEAR(rec709_of(texture.texel(k)).y, linear_of_srgb(1 - entry / 255.), 1e-5) << depth;
      }
    }
}

TEST_F(Png, GammaChunkIsHonoured) {
  for (const int depth : {8, 16}) {
    PngOfTest png = ramp(depth);
    const Texture plain = read(png.bytes());
    for (const double gamma : {1., 0.55, 0.3}) {
      png.gamma = gamma;
      const Texture texture = read(png.bytes());
      for (size_t k = 0; k < 256; ++k)
        EXPECT_NEAR(rec709_of(texture.texel(k)).x, std::pow(double(k) / 255, 1 / gamma), 1e-5) << k;
    }
    png.gamma = 0.45455;  // how sRGB is written with this chunk
    const Texture same = read(png.bytes());
    // sRGB goes before what gAMA says; that they differ is a word.
    png.gamma = 0;
    png.srgb = true;
    std::string both = png.bytes(), said;
    both.insert(33, chunk("gAMA", std::string("\0\1\x86\xa0", 4)));  // 1
    const Texture marked = read(both, &said);
    EXPECT_TRUE(tells(said, {"gamma"}));
    for (size_t k = 0; k < 256; ++k) {
      EXPECT_EQ(same.texel(k), plain.texel(k)) << k;
      EXPECT_EQ(marked.texel(k), plain.texel(k)) << k;
    }
  }
}

TEST_F(Png, ChromaticitiesAreHonoured) {
  PngOfTest png = ramp(8);
  const Texture plain = read(png.bytes());
  png.chrm = {0.3127, 0.329, 0.68, 0.32, 0.265, 0.69, 0.15, 0.06};
  const Texture wide = read(png.bytes());
  const ColorMatrix matrix = color_conversion(display_p3(), acescg_chromaticities());
  for (size_t k = 0; k < 256; ++k) {
    const V3f code(float(k) / 255, float(255 - k) / 255, float(k / 2) / 255);
    const V3f linear(float(linear_of_srgb(code.x)), float(linear_of_srgb(code.y)),
                     float(linear_of_srgb(code.z)));
    expect_near(wide.texel(k), matrix(linear), 1e-5f);
  }
  png.chrm = {0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06};
  const Texture same = read(png.bytes());
  for (size_t k = 0; k < 256; ++k) EXPECT_EQ(same.texel(k), plain.texel(k)) << k;
}

TEST_F(Png, ProfilesOfMatrixAndCurvesAreHonoured) {
  PngOfTest png = ramp(8);
  const Texture plain = read(png.bytes());
  png.icc = IccOfTest(srgb_colorants, IccOfTest::srgb()).bytes();
  const Texture same = read(png.bytes());
  png.icc = IccOfTest(p3_colorants, IccOfTest::srgb()).bytes();
  const Texture wide = read(png.bytes());
  png.icc = IccOfTest(srgb_colorants, IccOfTest::gamma(1)).bytes();
  const Texture linear = read(png.bytes());
  const ColorMatrix matrix = color_conversion(display_p3(), acescg_chromaticities());
  for (size_t k = 0; k < 256; ++k) {
    EXPECT_EQ(same.texel(k), plain.texel(k)) << k;
    const V3f light(float(linear_of_srgb(double(k) / 255)),
                    float(linear_of_srgb(double(255 - k) / 255)),
                    float(linear_of_srgb(double(k / 2) / 255)));
    expect_near(wide.texel(k), matrix(light), 1e-3f);  // colorants have four digits
    EXPECT_NEAR(rec709_of(linear.texel(k)).x, double(k) / 255, 1e-3) << k;
  }
}

// ITU-T H.273: primaries 12 and transfer 13 are Display P3, 9 and 16 those of HDR video.
TEST_F(Png, CodePointsGoBeforeAllElse) {
  PngOfTest png = ramp(8);
  const Texture plain = read(png.bytes());
  png.gamma = 1;
  std::string p3 = png.bytes(), video = png.bytes(), said;
  p3.insert(33, chunk("cICP", std::string("\x0c\x0d\0\1", 4)));
  video.insert(33, chunk("cICP", std::string("\x09\x10\0\1", 4)));
  const ColorMatrix matrix = color_conversion(display_p3(), acescg_chromaticities());
  const Texture wide = read(p3);
  for (size_t k = 0; k < 256; ++k)
    expect_near(wide.texel(k), matrix(rec709_of(plain.texel(k))), 1e-4f);
  EXPECT_NEAR(rec709_of(read(video, &said).texel(51)).x, 0.2, 1e-5);  // by its gAMA
  EXPECT_TRUE(tells(said, {"cICP", "primaries 9", "transfer 16"}));
}

// The picture is of RGB in full range, as PNG's third edition asks: matrix 0, range 1.
TEST_F(Png, CodePointsOfVideoAreNamed) {
  const Texture plain = read(ramp(8).bytes());
  for (const auto& [points, words] :
       {std::pair{"\x0c\x0d\0\0", "narrow range"}, std::pair{"\x0c\x0d\1\1", "matrix 1"}}) {
    std::string png = ramp(8).bytes(), said;
    png.insert(33, chunk("cICP", std::string(points, 4)));
    const Texture texture = read(png, &said);
    EXPECT_TRUE(tells(said, {"cICP", words}));
    for (size_t k = 0; k < 256; ++k) EXPECT_EQ(texture.texel(k), plain.texel(k)) << k;
  }
}

TEST_F(Png, CodePointsThatAreDamagedAreNotApplied) {
  const Texture plain = read(ramp(8).bytes());
  std::string wrong = chunk("cICP", std::string("\x0c\x0d\0\1", 4));
  wrong.back() ^= 1;  // of its check sum
  for (const std::string& damaged : {wrong, chunk("cICP", std::string("\x0c\x0d\0\1\0", 5))}) {
    std::string png = ramp(8).bytes(), said;
    png.insert(33, damaged);
    const Texture texture = read(png, &said);
    EXPECT_TRUE(tells(said, {"cICP"}));
    for (size_t k = 0; k < 256; ++k) EXPECT_EQ(texture.texel(k), plain.texel(k)) << k;
  }
}

// ICC.1, annex F: where colours connect by CIE L*a*b*, the curve of a grey gives L* / 100.
TEST_F(Png, GreyProfilesGiveLightnessOrLuminance) {
  PngOfTest png{.width = 256, .type = PNG_COLOR_TYPE_GRAY};
  for (int k = 0; k < 256; ++k) png.samples.push_back(uint16_t(k));
  png.icc = IccOfTest(srgb_colorants, IccOfTest::gamma(1), "GRAYXYZ ").bytes();
  const Texture luminance = read(png.bytes());
  png.icc = IccOfTest(srgb_colorants, IccOfTest::gamma(1), "GRAYLab ").bytes();
  const Texture lightness = read(png.bytes());
  for (size_t k = 0; k < 256; ++k) {
    const double l = 100 * double(k) / 255;  // CIE 15: the inverse of L* = 116 f(Y) - 16
    const double y = l > 8 ? std::pow((l + 16) / 116, 3) : l * 27 / 24389;
    EXPECT_NEAR(luminance.texel(k).y, double(k) / 255, 1e-5) << k;
    EXPECT_NEAR(lightness.texel(k).y, y, 1e-5) << k;
  }
}

// ICC.1: where there are both, tables go before matrix and curves.
TEST_F(Png, ProfilesOfTablesAndMatrixAreNamed) {
  PngOfTest png = ramp(8);
  const Texture plain = read(png.bytes());
  IccOfTest icc(p3_colorants, IccOfTest::gamma(1));
  icc.add("A2B0", "mft2, a table");
  png.icc = icc.bytes();
  std::string said;
  const Texture texture = read(png.bytes(), &said);
  EXPECT_TRUE(tells(said, {"ICC profile 'of the test'", "tables"}));
  for (size_t k = 0; k < 256; ++k) EXPECT_EQ(texture.texel(k), plain.texel(k)) << k;
}

TEST_F(Png, ProfilesThatCannotBeUsedAreNamed) {
  PngOfTest png = ramp(8);
  const Texture plain = read(png.bytes());
  png.icc = IccOfTest(srgb_colorants, "mft2, a table").bytes();
  std::string said;
  const Texture texture = read(png.bytes(), &said);
  EXPECT_TRUE(tells(said, {"ICC profile 'of the test'", "picture.2", "sRGB"}));
  for (size_t k = 0; k < 256; ++k) EXPECT_EQ(texture.texel(k), plain.texel(k)) << k;
}

// 128 of 8 bits and 32768 of 16 are 0, the ends -1 and 1, whatever the file says of colours.
TEST_F(Png, NormalsAreNeverConverted) {
  for (const int depth : {8, 16}) {
    for (const int chunk : {0, 1, 2, 3, 4}) {
      PngOfTest png = ramp(depth);
      if (chunk == 1) png.gamma = 1;
      if (chunk == 2) png.srgb = true;
      if (chunk == 3) png.chrm = {0.3127, 0.329, 0.68, 0.32, 0.265, 0.69, 0.15, 0.06};
      if (chunk == 4) png.icc = IccOfTest(p3_colorants, IccOfTest::gamma(1.8)).bytes();
      const Texture normals = read_normals(png.bytes());
      for (int k = 0; k < 256; ++k) {
        const double expected = depth == 8 ? (k - 128) / 127. : (k * 257 - 32768) / 32767.;
        EXPECT_NEAR(normals.texel(size_t(k)).x, expected, 1e-6) << depth << " " << chunk;
      }
    }
  }
}

TEST_F(Png, AlphaThatIsLeftOutIsCounted) {
  PngOfTest png{.width = 3,
                .type = PNG_COLOR_TYPE_RGB_ALPHA,
                .samples = {10, 20, 30, 255, 10, 20, 30, 254, 10, 20, 30, 0}};
  std::string said;
  const Texture texture = read(png.bytes(), &said);
  EXPECT_TRUE(tells(said, {"alpha", "2 pixels"}));
  EXPECT_EQ(texture.texel(0), texture.texel(2));
  PngOfTest palette{.width = 3,
                    .type = PNG_COLOR_TYPE_PALETTE,
                    .samples = {0, 1, 1},
                    .palette = {{1, 2, 3}, {4, 5, 6}},
                    .alphas = {255, 7}};
  read(palette.bytes(), &said);
  EXPECT_TRUE(tells(said, {"alpha", "2 pixels"}));
}

TEST_F(Png, WhatIsCutOffIsRefusedUntilAllPixelsAreThere) {
  PngOfTest png = ramp(8);
  const std::string whole = png.bytes();
  const size_t end = whole.find("IDAT") + 4 + 4;  // of the chunk's header
  const auto size = size_t(uint8_t(whole[end - 10]) << 8 | uint8_t(whole[end - 9]));
  const size_t data_end = whole.find("IDAT") + 4 + size;
  for (size_t cut = 8; cut + 8 < data_end; ++cut)
    EXPECT_TRUE(tells(refused(whole.substr(0, cut)), {"refused.", "PNG"})) << cut;
  std::string said;
  EXPECT_EQ(read(whole.substr(0, whole.size() - 8), &said).texels(), 256u);
  EXPECT_TRUE(tells(said, {"all its pixels are there"}));
  read(whole + "more", &said);
  EXPECT_TRUE(tells(said, {"4 bytes after the picture's end"}));
  std::string damaged = whole;
  damaged[data_end - 20] ^= 0x55;
  EXPECT_TRUE(tells(refused(damaged), {"PNG", "damaged"}));
}

TEST_F(Png, SizesThatNoSuchFileHoldsAreRefused) {
  std::string forged = ramp(8).bytes();
  forged.replace(16, 8, std::string("\0\1\x86\xa0\0\0\x27\x10", 8));  // 100,000 x 10,000
  forged.replace(29, 4, number_of(crc_of(forged.substr(12, 17))));
  EXPECT_TRUE(tells(refused(forged), {"100000 x 10000"}));
}

TEST_F(Png, TakesNoMoreMemoryThanItsPixelsAndHeedsTheLimit) {
  PngOfTest png{.width = 2048, .height = 2048, .depth = 1, .type = PNG_COLOR_TYPE_GRAY};
  png.samples.assign(2048 * 2048, 1);
  const auto path = write("white.png", png.bytes());
  PictureMemory enough(5 << 20), little(1 << 20);
  EXPECT_EQ(read_texture(path, enough).texels(), 2048u * 2048);
  EXPECT_EQ(enough.taken(), 2048u * 2048);
  EXPECT_TRUE(tells(error_of([&] { read_texture(path, little); }),
                    {"white.png", "2048 x 2048 pixels of 1 x 8 bits", "--memory"}));
  // Pictures share it.
  EXPECT_TRUE(tells(error_of([&] { read_texture(path, enough); }), {"--memory"}));
}

}  // namespace
}  // namespace drench::render::test

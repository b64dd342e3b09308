// Radiance HDR, written by the test byte by byte.

#include "render/light/environment.h"
#include "tests/render/picture_support.h"

namespace drench::render::test {
namespace {

class Hdr : public PictureTest {};

using Pixel = std::array<uint8_t, 4>;

/// m / 256 x 2^(e - 128).
V3f radiance_of(const Pixel& p) { return V3f(p[0], p[1], p[2]) * std::ldexp(1.f, int(p[3]) - 136); }

Pixel pixel_of(int x, int y) {
  return {uint8_t(130 + x), uint8_t(40 + 3 * y), uint8_t(7 * x + y), uint8_t(126 + (x + y) % 5)};
}

std::string head(const std::string& lines, const std::string& size) {
  return "#?RADIANCE\n# a comment\n" + lines + "FORMAT=32-bit_rle_rgbe\n\n" + size + "\n";
}

std::string flat(int width, int height) {
  std::string out;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const uint8_t byte : pixel_of(x, y)) out += char(byte);
  return out;
}

void expect_pixels(const Texture& texture, int width, int height, float scale = 1) {
  ASSERT_EQ(texture.width(), width);
  ASSERT_EQ(texture.height(), height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const V3f light = radiance_of(pixel_of(x, y)) * scale;
      expect_near(rec709_of(texture.texel(size_t(y * width + x))), light, 1e-5f * (1 + light.x));
    }
}

TEST_F(Hdr, FlatPixelsAreRead) {
  expect_pixels(read(head("", "-Y 3 +X 5") + flat(5, 3)), 5, 3);
  std::string rgbe = head("", "-Y 3 +X 5") + flat(5, 3);
  rgbe.replace(0, 10, "#?RGBE");
  expect_pixels(read(rgbe), 5, 3);
}

/// Each component in runs: equal bytes as one of 128 + count, others as they are.
std::string with_runs(int width, int height) {
  std::string out;
  for (int y = 0; y < height; ++y) {
    out += {2, 2, char(width >> 8), char(width & 255)};
    for (size_t c = 0; c < 4; ++c)
      for (int x = 0; x < width;) {
        int same = 1;
        while (x + same < width && same < 127 && pixel_of(x + same, y)[c] == pixel_of(x, y)[c])
          ++same;
        if (same > 1) {
          out += {char(128 + same), char(pixel_of(x, y)[c])};
          x += same;
        } else {
          out += {1, char(pixel_of(x, y)[c])};
          ++x;
        }
      }
  }
  return out;
}

TEST_F(Hdr, RunsOfComponentsAreRead) {
  expect_pixels(read(head("", "-Y 3 +X 20") + with_runs(20, 3)), 20, 3);
}

// 1, 1, 1, n repeats the pixel before n times; several in a row are digits of base 256.
TEST_F(Hdr, RunsOfPixelsAreRead) {
  const Pixel a = pixel_of(0, 0), b = pixel_of(1, 0);
  std::string data(a.begin(), a.end());
  data += {1, 1, 1, 3};
  data.append(b.begin(), b.end());
  data += {1, 1, 1, 44, 1, 1, 1, 1};  // 44 + 256
  const Texture texture = read(head("", "-Y 1 +X 305") + data);
  ASSERT_EQ(texture.texels(), 305u);
  for (size_t x = 0; x < 305; ++x)
    expect_near(rec709_of(texture.texel(x)), radiance_of(x < 4 ? a : b), 1e-5f);
}

TEST_F(Hdr, ScanlinesMayRunAnyWay) {
  constexpr int width = 5, height = 3;
  for (const bool y_first : {true, false})
    for (const bool down : {true, false})
      for (const bool right : {true, false}) {
        const std::string y = (down ? "-Y " : "+Y ") + std::to_string(height);
        const std::string x = (right ? "+X " : "-X ") + std::to_string(width);
        std::string data;
        for (int row = 0; row < (y_first ? height : width); ++row)
          for (int column = 0; column < (y_first ? width : height); ++column) {
            const int along = y_first ? column : row, across = y_first ? row : column;
            const Pixel p =
                pixel_of(right ? along : width - 1 - along, down ? across : height - 1 - across);
            data.append(p.begin(), p.end());
          }
        expect_pixels(read(head("", y_first ? y + " " + x : x + " " + y) + data), width, height);
      }
}

TEST_F(Hdr, ExposureIsTakenOut) {
  expect_pixels(read(head("EXPOSURE=2\n", "-Y 3 +X 5") + flat(5, 3)), 5, 3, 0.5f);
  expect_pixels(read(head("EXPOSURE= 2.0\nEXPOSURE=0.25\n", "-Y 3 +X 5") + flat(5, 3)), 5, 3, 2);
}

TEST_F(Hdr, PrimariesAreHonoured) {
  const Texture wide = read(
      head("PRIMARIES=0.68 0.32 0.265 0.69 0.15 0.06 0.3127 0.329\n", "-Y 3 +X 5") + flat(5, 3));
  const ColorMatrix matrix = color_conversion(display_p3(), acescg_chromaticities());
  expect_near(wide.texel(0), matrix(radiance_of(pixel_of(0, 0))), 1e-5f);
}

TEST_F(Hdr, XyzIsConverted) {
  std::string text = head("", "-Y 1 +X 1") + std::string("\xc0\xc8\xd2\x80", 4);
  text.replace(text.find("rgbe"), 4, "xyze");
  // About D65 white, 0.7505, 0.7813, 0.8203: X is 0.9505 and Z 1.089 of Y there, so a little red.
  const V3f rgb = rec709_of(read(text).texel(0));
  expect_near(rgb, V3f(0.821f, 0.773f, 0.750f), 0.005f);
}

TEST_F(Hdr, HeadersThatAreNotUnderstoodAreNamed) {
  std::string said;
  expect_pixels(read(head("EXPOSURE=bright\n", "-Y 3 +X 5") + flat(5, 3), &said), 5, 3);
  EXPECT_TRUE(tells(said, {"EXPOSURE=bright"}));
  EXPECT_TRUE(tells(refused(head("", "-Z 3 +X 5") + flat(5, 3)), {"HDR", "-Z 3 +X 5"}));
  EXPECT_TRUE(tells(refused("#?RADIANCE\nFORMAT=words\n\n-Y 1 +X 1\nabcd"), {"FORMAT=words"}));
}

// Radiance's programs add their command lines, with the names of all files, to the header.
TEST_F(Hdr, LinesOfTheHeaderMayBeLong) {
  const std::string command = "pcomb " + std::string(60000, 'x') + "\n";
  expect_pixels(read(head(command, "-Y 3 +X 5") + flat(5, 3)), 5, 3);
  EXPECT_TRUE(tells(refused(head(command + std::string(70000, 'x') + "\n", "-Y 3 +X 5")),
                    {"no end", "65536 bytes"}));
}

TEST_F(Hdr, LightBeyondMeasureIsNamedAsIs) {
  // 255 / 256 x 2^127, which a float still holds.
  const std::string said = refused(head("", "-Y 1 +X 1") + std::string("\xff\xff\xff\xff", 4));
  EXPECT_TRUE(tells(said, {"pixel 0, 0", "1.69", "above 1e+37"}));
  EXPECT_EQ(said.find("finite"), std::string::npos) << said;
}

TEST_F(Hdr, WhatIsCutOffOrDamagedIsRefused) {
  const std::string before = head("", "-Y 3 +X 20"), data = with_runs(20, 3);
  for (size_t size = 0; size < data.size(); ++size)
    EXPECT_TRUE(tells(refused(before + data.substr(0, size)), {"cut off", "scanline"})) << size;
  for (size_t size = 10; size < before.size(); ++size)
    EXPECT_NE(refused(before.substr(0, size)), "") << size;
  std::string damaged = data;
  damaged[4] = char(255);  // a run of 127 in a line of 20
  EXPECT_TRUE(tells(refused(before + damaged), {"scanline 1", "damaged"}));
  EXPECT_TRUE(tells(refused(head("", "-Y 1 +X 9") + std::string("\1\1\1\5", 4)), {"damaged"}));
}

TEST_F(Hdr, IsTheSkyOfALight) {
  Light light;
  light.type = LightType::environment;
  light.split_suns = false;
  light.map = write("sky.hdr", head("", "-Y 1 +X 1") + std::string("\x80\x80\x80\x84", 4));
  EXPECT_EQ(said_by([&] {
              const Environment sky(light, Environment::Sampling::on);
              expect_near(sky.radiance({0, 1, 0}), V3f(8), 1e-4f);
            }),
            "");
}

}  // namespace
}  // namespace drench::render::test

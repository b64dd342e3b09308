// What a picture is, is found in its bytes; what it takes is known before it is taken.

#include "render/light/environment.h"
#include "tests/render/picture_support.h"

namespace drench::render::test {
namespace {

class PictureFormat : public PictureTest {};

TEST_F(PictureFormat, IsToldByContentNotByName) {
  PngOfTest png{.samples = {255, 255, 255}};
  for (const char* name : {"picture.exr", "picture.jpg", "picture", "picture.tif"}) {
    const auto path = write(name, png.bytes());
    expect_near(read_texture(path).texel(0), V3f(1), 1e-5f, name);
  }
}

TEST_F(PictureFormat, WhatIsNoneSaysWhatItLooksLike) {
  using namespace std::string_literals;
  const std::pair<std::string, const char*> files[] = {
      {"GIF89a and more"s, "a GIF"},
      {"RIFF\x10\0\0\0WEBPVP8 "s, "a WebP"},
      {"BM and more bytes"s, "a BMP"},
      {"8BPS\0\1"s, "Photoshop"},
      {"DDS |"s, "a DDS"},
      {"\0\0\0\x20"
       "ftypavif"s,
       "an AVIF"},
      {"\0\0\0\x20"
       "ftypheic"s,
       "a HEIF"},
      {"\0\0\0\x0cjP  \r\n\x87\n"s, "a JPEG 2000"},
      {"<!DOCTYPE html><html>"s, "a web page"},
      {"version https://git-lfs.github.com/spec/v1"s, "Git LFS"},
      {""s, "it is empty"},
      {"hello, picture"s, "68 65 6c 6c 6f 2c 20 70"},
      {"\x89"s, "89"},
  };
  for (const auto& [bytes, words] : files)
    EXPECT_TRUE(tells(refused(bytes), {"refused.", words, "EXR, HDR, PNG, JPEG or TIFF"})) << bytes;
}

/// Radiance straight up, and what is said.
V3f up_in(const std::filesystem::path& map, std::string* said,
          PictureMemory& memory = PictureMemory::without_limit()) {
  Light light;
  light.type = LightType::environment;
  light.name = "dome";
  light.map = map;
  light.split_suns = false;
  V3f out;
  *said = said_by([&] {
    out = Environment(light, Environment::Sampling::on, memory).radiance({0, 1, 0});
  });
  return out;
}

TEST_F(PictureFormat, SkiesOfIntegersAreReadWithAWord) {
  std::string said;
  for (const int depth : {8, 16}) {
    PngOfTest png{.depth = depth,
                  .samples = std::vector<uint16_t>(3, uint16_t(depth == 8 ? 100 : 25700))};
    const auto path = write("sky" + std::to_string(depth) + ".png", png.bytes());
    expect_near(up_in(path, &said), V3f(float(linear_of_srgb(100 / 255.))), 1e-5f);
    EXPECT_TRUE(tells(said, {"sky" + std::to_string(depth) + ".png", "no light above 1"}));
  }
}

// A sphere is twice as long around as from pole to pole; a pixel of rounding is no matter.
TEST_F(PictureFormat, SkiesOfAnotherShapeAreReadWithAWord) {
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
  std::string said;
  for (const auto& [width, height] : {std::pair{8, 4}, {7, 4}, {1, 1}, {4, 4}, {4, 6}, {12, 2}}) {
    const auto path =
        write("sky.hdr", head + "-Y " + std::to_string(height) + " +X " + std::to_string(width) +
                             "\n" + std::string(size_t(4 * width * height), '\x80'));
    expect_near(up_in(path, &said), V3f(0.5f), 1e-5f);
    if (width == 8 || width == 7 || width == 1)
      EXPECT_EQ(said, "");
    else
      EXPECT_TRUE(tells(said, {"sky.hdr", std::to_string(width) + " x " + std::to_string(height),
                               "twice as wide"}));
  }
}

TEST_F(PictureFormat, SkiesHeedTheLimitOfMemory) {
  PngOfTest png{.width = 512, .height = 256, .depth = 1, .type = PNG_COLOR_TYPE_GRAY};
  png.samples.assign(512 * 256, 1);
  const auto path = write("sky.png", png.bytes());
  std::string said;
  PictureMemory enough(8 << 20), little(1 << 20);  // 24 bytes a texel: 3 MiB
  expect_near(up_in(path, &said, enough), V3f(1), 1e-5f);
  EXPECT_TRUE(tells(error_of([&] { up_in(path, &said, little); }),
                    {"sky.png", "512 x 256", "'dome'", "--memory"}));
}

}  // namespace
}  // namespace drench::render::test

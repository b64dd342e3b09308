// EXR, PNG and the view transform: what goes in comes out, and greys stay grey.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "render/color/color.h"
#include "render/display/view_transform.h"
#include "render/texture/texture.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::error_of;
using drench::test::TemporaryFolder;
namespace {

namespace fs = std::filesystem;

class FilmFile : public testing::Test {
 protected:
  fs::path at(const std::string& name) const { return folder_ / name; }
  const TemporaryFolder folder_;
};

Film random_film(int width, int height) {
  std::mt19937 random(4);
  std::lognormal_distribution<float> value(0, 2);
  Film film{width, height, {}};
  for (int k = 0; k < width * height; ++k)
    film.rgba.insert(film.rgba.end(), {value(random), value(random), value(random), 0.75f});
  return film;
}

TEST_F(FilmFile, ExrReturnsEveryValueToHalfPrecision) {
  const Film film = random_film(37, 21);
  write_exr(at("a.exr"), film, {});
  const Film back = read_exr(at("a.exr"));
  ASSERT_EQ(back.width, 37);
  ASSERT_EQ(back.height, 21);
  for (size_t k = 0; k < film.rgba.size(); ++k)
    EXPECT_NEAR(back.rgba[k], film.rgba[k], film.rgba[k] / 2048) << k;  // 11 bits
}

TEST_F(FilmFile, ExrSaysItsColoursAndItsOrigin) {
  write_exr(at("a.exr"), random_film(8, 8), {{"shot", "pour"}, {"key.mesh", "00ff"}});
  const Imf::InputFile file(at("a.exr").c_str());
  const Imf::Header& header = file.header();
  EXPECT_EQ(Imf::chromaticities(header), acescg_chromaticities());
  EXPECT_EQ(header.compression(), Imf::ZIP_COMPRESSION);
  EXPECT_EQ(header.channels().findChannel("R")->type, Imf::HALF);
  EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("shot").value(), "pour");
  EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("key.mesh").value(), "00ff");
  EXPECT_FALSE(Imf::hasCapDate(header));
}

TEST_F(FilmFile, ExrOfEqualFilmsIsEqualInEveryByte) {
  const auto a = write_exr(at("a.exr"), random_film(64, 40), {{"seed", "1"}});
  const auto b = write_exr(at("b.exr"), random_film(64, 40), {{"seed", "1"}});
  EXPECT_EQ(a.digest, b.digest);
  EXPECT_EQ(a.size, fs::file_size(at("a.exr")));
}

TEST_F(FilmFile, ExrClampsWhatNoHalfHolds) {
  Film film{2, 1, {1e6f, -1e6f, 3, 1, std::nanf(""), INFINITY, 65504, 1}};
  write_exr(at("a.exr"), film, {});
  const std::vector<float> expected{65504, -65504, 3, 1, 0, 65504, 65504, 1};
  EXPECT_EQ(read_exr(at("a.exr")).rgba, expected);
}

TEST_F(FilmFile, ExrOfOtherPrimariesIsConverted) {
  // Float R, G, B without alpha or chromaticities, hence Rec. 709, with a data window off the
  // origin.
  Imf::Header header(Imath::Box2i({0, 0}, {9, 9}), Imath::Box2i({3, -2}, {4, -2}));
  std::vector<float> rgb{1, 1, 1, 1, 0, 0};
  Imf::FrameBuffer buffer;
  const char* names[3] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    header.channels().insert(names[c], Imf::Channel(Imf::FLOAT));
    buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, rgb.data() + c, header.dataWindow(),
                                             3 * sizeof(float), 6 * sizeof(float)));
  }
  {
    Imf::OutputFile file(at("a.exr").c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(1);
  }
  const Film film = read_exr(at("a.exr"));
  // White stays white; the red column of the published Rec. 709 (D65) to ACEScg matrix.
  const std::vector<float> expected{1, 1, 1, 1, 0.6131f, 0.0702f, 0.0206f, 1};
  ASSERT_EQ(film.rgba.size(), expected.size());
  for (size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(film.rgba[k], expected[k], 2e-4) << k;
}

TEST_F(FilmFile, ExrThatIsDamagedIsRefused) {
  write_exr(at("a.exr"), random_film(64, 64), {});
  std::vector<char> bytes(fs::file_size(at("a.exr")));
  std::ifstream(at("a.exr"), std::ios::binary).read(bytes.data(), std::streamsize(bytes.size()));
  const auto refused = [&](const std::vector<char>& content) {
    std::ofstream(at("b.exr"), std::ios::binary)
        .write(content.data(), std::streamsize(content.size()));
    return error_of([&] { read_exr(at("b.exr")); });
  };
  EXPECT_NE(refused({}).find("b.exr"), std::string::npos);
  EXPECT_NE(refused({bytes.begin(), bytes.begin() + 100}), "");
  EXPECT_NE(refused({bytes.begin(), bytes.begin() + std::ptrdiff_t(bytes.size() / 2)}), "");
  EXPECT_NE(refused(std::vector<char>(5000, 'x')), "");
  EXPECT_NE(error_of([&] { read_exr(at("none.exr")); }).find("none.exr"), std::string::npos);
  // A header that promises 2^40 pixels: the data window's maximum corner is 4 ints after its name.
  std::vector<char> huge = bytes;
  const std::string name = "dataWindow";
  const auto found = std::search(huge.begin(), huge.end(), name.begin(), name.end());
  ASSERT_NE(found, huge.end());
  const auto corner = found + std::ptrdiff_t(name.size() + 1 + 6 + 4 + 8);
  corner[2] = corner[6] = 15;  // 983,103 pixels a side
  EXPECT_NE(refused(huge), "");
}

TEST_F(FilmFile, PngReturnsItsPixelsAsTexture) {
  std::vector<uint8_t> rgb;
  for (int k = 0; k < 4 * 2; ++k)
    for (int c = 0; c < 3; ++c) rgb.push_back(uint8_t(k * 30 + c));
  write_png(at("a.png"), 4, 2, rgb);
  const Texture texture = read_texture(at("a.png"));
  ASSERT_EQ(texture.width(), 4);
  ASSERT_EQ(texture.height(), 2);
  const ColorMatrix to_rec709 = color_conversion(acescg_chromaticities(), rec709_chromaticities());
  for (size_t p = 0; p < 8; ++p) {
    const V3f linear = to_rec709(texture.texel(p));
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(srgb_encode(linear[c]) * 255, rgb[3 * p + size_t(c)], 0.01);
  }
  // v runs upwards and pictures repeat.
  EXPECT_EQ(texture.at({0.125f, 0.75f}), texture.texel(0));
  EXPECT_EQ(texture.at({1.125f, -0.25f}), texture.texel(0));
}

/// Coordinates of a hostile mesh, divided by a small texture_size.
TEST_F(FilmFile, TextureHasATexelAtEveryCoordinate) {
  write_png(at("a.png"), 3, 1, std::vector<uint8_t>(9, 255));
  const Texture white = read_texture(at("a.png"));
  const float most = std::numeric_limits<float>::max(), beyond = 2 * most;
  for (const float u : {-1e-9f, 1e30f, -most, most, beyond, -beyond, beyond - beyond}) {
    EXPECT_NEAR(white.at({u, 0.5f}).y, 1, 1e-3) << u;
    EXPECT_NEAR(white.at({0.5f, u}).y, 1, 1e-3) << u;
  }
}

/// They hold the name of a file, and that the name of a sheet, which may have 64 characters.
TEST_F(FilmFile, AttributesHaveLongNames) {
  Film film;
  film.width = film.height = 1;
  film.rgba = {1, 2, 3, 1};
  const std::string name = "key.sim/cloth." + std::string(64, 'x') + ".1001.ply";
  write_exr(at("a.exr"), film, {{name, "digest"}});
  const Imf::InputFile file(at("a.exr").c_str());
  const auto* found = file.header().findTypedAttribute<Imf::StringAttribute>(name);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->value(), "digest");
  EXPECT_THROW(write_exr(at("b.exr"), film, {{std::string(256, 'x'), ""}}), Error);
}

TEST_F(FilmFile, TextureThatIsNoPictureIsRefused) {
  std::ofstream(at("a.png"), std::ios::binary) << "\x89PNG\r\n\x1a\n and nothing more";
  std::ofstream(at("a.jpg"), std::ios::binary) << "\xff\xd8\xff\xe0 and nothing more";
  std::ofstream(at("a.txt"), std::ios::binary) << "hello";
  for (const char* name : {"a.png", "a.jpg", "a.txt", "missing.png"})
    EXPECT_NE(error_of([&] { read_texture(at(name)); }).find(name), std::string::npos) << name;
}

TEST(Color, PublishedMatrixFromSrgb) {
  // Rec. 709 (D65) to AP1 (ACES white) by Bradford, as the ACES project publishes it.
  const double published[3][3] = {{0.613097, 0.339523, 0.047379},
                                  {0.070194, 0.916354, 0.013452},
                                  {0.020616, 0.109570, 0.869815}};
  const ColorMatrix m = color_conversion(rec709_chromaticities(), acescg_chromaticities());
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(m.m[r][c], published[r][c], 2e-4) << r << c;
}

Film greys(const std::vector<float>& values) {
  Film film{int(values.size()), 1, {}};
  for (float v : values) film.rgba.insert(film.rgba.end(), {v, v, v, 1});
  return film;
}

TEST(ViewTransform, KeepsGreysGreyAndRising) {
  std::vector<float> values;
  for (int k = 0; k < 400; ++k) values.push_back(std::pow(10.f, -4 + 0.02f * float(k)));
  const std::vector<uint8_t> rgb = ViewTransform()(greys(values));
  for (size_t k = 0; k < values.size(); ++k) {
    EXPECT_EQ(rgb[3 * k], rgb[3 * k + 1]);
    EXPECT_EQ(rgb[3 * k], rgb[3 * k + 2]);
    if (k > 0) {
      EXPECT_GE(rgb[3 * k], rgb[3 * k - 3]);
    }
  }
}

TEST(ViewTransform, ShowsMiddleGreyInTheMiddleAndHighlightsBelowWhite) {
  const std::vector<uint8_t> rgb =
      ViewTransform()(greys({0, 0.18f, 1, 4, 1e4f, -1, std::nanf("")}));
  EXPECT_EQ(rgb[0], 0);
  EXPECT_NEAR(rgb[3], 0.461 * 255, 1);  // the sRGB code of 0.18
  EXPECT_GT(rgb[6], 190);
  EXPECT_LT(rgb[6], 230);
  EXPECT_LT(rgb[9], 253);  // two stops over white still show texture
  EXPECT_EQ(rgb[12], 255);
  EXPECT_EQ(rgb[15], 0);
  EXPECT_EQ(rgb[18], 0);
}

TEST(ViewTransform, WhitensBrightColours) {
  Film film{2, 1, {0.5f, 0.05f, 0.05f, 1, 50, 5, 5, 1}};
  const std::vector<uint8_t> rgb = ViewTransform()(film);
  EXPECT_GT(int(rgb[0]) - int(rgb[1]), 60);
  EXPECT_LT(int(rgb[3]) - int(rgb[4]), 40);
}

}  // namespace
}  // namespace drench::render::test

// EXR from other programs: windows, layers, parts, grey, luminance-chroma.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include <deque>
#include <fstream>
#include <iterator>
#include <limits>

#include "render/light/environment.h"
#include "tests/render/picture_support.h"

namespace drench::render::test {
namespace {

using Imath::Box2i;

/// The value of a channel at a pixel: rising, and another for each.
float value_of(const std::string& channel, int x, int y) {
  float sum = 0.01f * float(x + 20) + 0.05f * float(y + 20);
  for (const char c : channel) sum += 0.001f * float(c);
  return sum;
}

/// Scanlines of channels, float or half, each value_of.
struct Part {
  std::vector<std::string> channels;
  Box2i display{{0, 0}, {15, 7}}, data = display;
  Imf::PixelType type = Imf::FLOAT;
  std::string name{};
};

/// What a header and a frame buffer need of a part.
struct Written {
  explicit Written(const Part& part) : header(part.display, part.data) {
    const size_t width = size_t(part.data.size().x) + 1;
    for (const std::string& channel : part.channels) {
      header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
      if (part.type == Imf::HALF) header.channels().findChannel(channel.c_str())->type = Imf::HALF;
      auto& value = values.emplace_back();
      for (int y = part.data.min.y; y <= part.data.max.y; ++y)
        for (int x = part.data.min.x; x <= part.data.max.x; ++x)
          value.push_back(value_of(channel, x, y));
      auto& half = halves.emplace_back(value.begin(), value.end());
      if (part.type == Imf::HALF)
        buffer.insert(channel, Imf::Slice::Make(Imf::HALF, half.data(), part.data, 2, 2 * width));
      else
        buffer.insert(channel, Imf::Slice::Make(Imf::FLOAT, value.data(), part.data, 4, 4 * width));
    }
    if (!part.name.empty()) header.setName(part.name);
    header.setType(Imf::SCANLINEIMAGE);
  }
  Imf::Header header;
  Imf::FrameBuffer buffer;
  std::deque<std::vector<float>> values;
  std::deque<std::vector<Imath::half>> halves;
};

class ExrPicture : public PictureTest {
 protected:
  std::filesystem::path write_part(const Part& part) {
    const auto path = next();
    Written w(part);
    Imf::OutputFile file(path.c_str(), w.header);
    file.setFrameBuffer(w.buffer);
    file.writePixels(part.data.size().y + 1);
    return path;
  }
  std::filesystem::path write_parts(const std::vector<Part>& parts) {
    const auto path = next();
    std::deque<Written> written;
    std::vector<Imf::Header> headers;
    for (const Part& part : parts) headers.push_back(written.emplace_back(part).header);
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), int(headers.size()));
    for (size_t k = 0; k < parts.size(); ++k) {
      Imf::OutputPart part(file, int(k));
      part.setFrameBuffer(written[k].buffer);
      part.writePixels(parts[k].data.size().y + 1);
    }
    return path;
  }
  std::filesystem::path next() { return folder_ / (std::to_string(++count_) + ".exr"); }

  Texture read_path(const std::filesystem::path& path, std::string* said = nullptr) {
    Texture out;
    const std::string text = said_by([&] { out = read_texture(path); });
    if (said)
      *said = text;
    else
      EXPECT_EQ(text, "");
    return out;
  }
};

V3f expected(int x, int y, const std::string& layer = "") {
  return {value_of(layer + "R", x, y), value_of(layer + "G", x, y), value_of(layer + "B", x, y)};
}

// Coordinates count over the display window; what was not written is black, what lies beyond it is
// not seen.
TEST_F(ExrPicture, PixelsStandInTheDisplayWindow) {
  const Box2i display({0, 0}, {15, 7});
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT})
    for (const Box2i& data : {display, Box2i({3, 2}, {9, 5}), Box2i({-4, -3}, {18, 12}),
                              Box2i({-5, 4}, {6, 20}), Box2i({15, 7}, {15, 7})}) {
      const Texture texture = read_path(write_part({{"R", "G", "B"}, display, data, type, {}}));
      ASSERT_EQ(texture.width(), 16);
      ASSERT_EQ(texture.height(), 8);
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) {
          const V3f found = rec709_of(texture.texel(size_t(16 * y + x)));
          const bool inside = data.intersects(Imath::V2i(x, y));
          expect_near(found, inside ? expected(x, y) : V3f(0), type == Imf::HALF ? 2e-3f : 1e-5f);
        }
    }
}

TEST_F(ExrPicture, DisplayWindowMayLieAnywhere) {
  const Box2i display({100, -50}, {103, -49});
  const Texture texture =
      read_path(write_part({{"R", "G", "B"}, display, {{101, -50}, {120, -50}}, Imf::FLOAT, {}}));
  ASSERT_EQ(texture.texels(), 8u);
  expect_near(rec709_of(texture.texel(1)), expected(101, -50), 1e-5f);
  expect_near(texture.texel(0), V3f(0), 0);
  expect_near(texture.texel(5), V3f(0), 0);
  const auto path = write_part({{"R", "G", "B"}, display, {{0, 0}, {3, 3}}, Imf::FLOAT, {}});
  EXPECT_TRUE(tells(error_of([&] { read_texture(path); }), {"outside its display window"}));
}

TEST_F(ExrPicture, SkiesStandInTheDisplayWindow) {
  Light whole, cropped;
  whole.type = cropped.type = LightType::environment;
  whole.split_suns = cropped.split_suns = false;
  const Box2i display({0, 0}, {63, 31});
  whole.map = write_part({{"R", "G", "B"}, display, display, Imf::FLOAT, {}});
  cropped.map = write_part({{"R", "G", "B"}, display, {{-9, 0}, {70, 15}}, Imf::FLOAT, {}});
  const Environment a(whole, Environment::Sampling::off), b(cropped, Environment::Sampling::off);
  for (const float height : {0.9f, 0.5f, 0.1f, -0.2f, -0.8f})
    for (int k = 0; k < 16; ++k) {
      const float side = std::sqrt(1 - height * height);
      const V3f d(side * std::sin(0.4f * float(k)), height, side * std::cos(0.4f * float(k)));
      expect_near(b.radiance(d), height > 0 ? a.radiance(d) : V3f(0), 1e-6f);
    }
}

TEST_F(ExrPicture, OneChannelIsGrey) {
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
    const Texture texture =
        read_path(write_part({{"Y"}, {{0, 0}, {15, 7}}, {{0, 0}, {15, 7}}, type, {}}));
    for (int x = 0; x < 16; ++x)
      expect_near(texture.texel(size_t(x)), V3f(value_of("Y", x, 0)), 2e-3f);
  }
  std::string said;
  const Texture other = read_path(write_part({{"height"}}), &said);
  expect_near(other.texel(3), V3f(value_of("height", 3, 0)), 1e-5f);
  EXPECT_TRUE(tells(said, {"height", "grey"}));
}

TEST_F(ExrPicture, AlphaAloneIsGrey) {
  std::string said;
  const Texture texture = read_path(write_part({{"A"}}), &said);
  for (int x = 0; x < 16; ++x)
    expect_near(texture.texel(size_t(x)), V3f(value_of("A", x, 0)), 1e-5f);
  EXPECT_TRUE(tells(said, {"A, is read as grey"}));
  EXPECT_EQ(said.find("alpha"), std::string::npos) << said;
}

// Two of the eight columns that the data window has are seen.
TEST_F(ExrPicture, AlphaIsCountedWhereItIsSeen) {
  const Part part{{"R", "G", "B", "A"}, {{0, 0}, {1, 7}}, {{0, 0}, {7, 9}}, Imf::FLOAT, {}};
  for (const int transparent : {1, 2}) {  // the columns from here on
    const auto path = next();
    Written w(part);
    for (size_t p = 0; p < 80; ++p) w.values[3][p] = int(p % 8) < transparent ? 1.f : 0.f;
    {
      Imf::OutputFile file(path.c_str(), w.header);
      file.setFrameBuffer(w.buffer);
      file.writePixels(10);
    }
    std::string said;
    read_path(path, &said);
    if (transparent == 2)
      EXPECT_EQ(said, "");
    else
      EXPECT_TRUE(tells(said, {"8 pixels are not opaque"}));
  }
}

// OpenEXR has UINT for numbers of objects and the like.
TEST_F(ExrPicture, IntegersAreNoLight) {
  for (const std::vector<std::string>& channels :
       {std::vector<std::string>{"R", "G", "B"}, std::vector<std::string>{"id"}}) {
    const auto path = next();
    {
      std::vector<unsigned> value(16 * 8, 7);
      Imf::Header header(16, 8);
      Imf::FrameBuffer buffer;
      for (const std::string& channel : channels) {
        header.channels().insert(channel, Imf::Channel(Imf::UINT));
        buffer.insert(channel, Imf::Slice(Imf::UINT, reinterpret_cast<char*>(value.data()), 4, 64));
      }
      Imf::OutputFile file(path.c_str(), header);
      file.setFrameBuffer(buffer);
      file.writePixels(8);
    }
    EXPECT_TRUE(tells(error_of([&] { read_texture(path); }),
                      {"channel " + channels[0], "integers", "half or float"}));
  }
}

TEST_F(ExrPicture, ChromaOfAnotherSizeIsNamed) {
  const auto path = write_part({{"Y", "RY", "BY"}});
  const std::string said = error_of([&] { read_texture(path); });
  EXPECT_TRUE(tells(said, {"channel RY", "1 x 1", "2 x 2", "R, G and B"}));
  EXPECT_EQ(said.find("damaged"), std::string::npos) << said;
}

TEST_F(ExrPicture, CubeMapsAreRefusedAsSkiesAlone) {
  const auto path = next();
  {
    Written w({{"R", "G", "B"}, {{0, 0}, {7, 47}}, {{0, 0}, {7, 47}}, Imf::FLOAT, {}});
    Imf::addEnvmap(w.header, Imf::ENVMAP_CUBE);
    Imf::OutputFile file(path.c_str(), w.header);
    file.setFrameBuffer(w.buffer);
    file.writePixels(48);
  }
  Light light;
  light.type = LightType::environment;
  light.map = path;
  EXPECT_TRUE(tells(error_of([&] { Environment(light, Environment::Sampling::off); }),
                    {"cube map", "latitude"}));
  EXPECT_EQ(read_path(path).height(), 48);
}

TEST_F(ExrPicture, LuminanceAndChromaGiveColours) {
  const auto path = next();
  const V3f colour(0.6f, 0.3f, 0.1f);
  {
    std::vector<Imf::Rgba> pixels(32 * 16, Imf::Rgba(colour.x, colour.y, colour.z, 1));
    Imf::RgbaOutputFile file(path.c_str(), 32, 16, Imf::WRITE_YC);
    file.setFrameBuffer(pixels.data(), 1, 32);
    file.writePixels(16);
  }
  const Texture texture = read_path(path);
  ASSERT_EQ(texture.width(), 32);
  // Chroma is rounded to fewer bits by the writer.
  for (size_t p = 0; p < texture.texels(); ++p)
    expect_near(rec709_of(texture.texel(p)), colour, 0.01f, std::to_string(p));
}

TEST_F(ExrPicture, LayersAreReadWhereNothingElseIs) {
  std::string said;
  const Texture first = read_path(
      write_part({{"diffuse.R", "diffuse.G", "diffuse.B", "spec.R", "spec.G", "spec.B", "Z"}}),
      &said);
  expect_near(rec709_of(first.texel(18)), expected(2, 1, "diffuse."), 1e-5f);
  EXPECT_TRUE(tells(said, {"diffuse.R", "spec.R", "Z"}));
  const Texture finished =
      read_path(write_part({{"View.AO.R", "View.AO.G", "View.AO.B", "View.Combined.R",
                             "View.Combined.G", "View.Combined.B"}}),
                &said);
  expect_near(rec709_of(finished.texel(18)), expected(2, 1, "View.Combined."), 1e-5f);
  // Colours of their own go before those of layers, without a word.
  const Texture own =
      read_path(write_part({{"R", "G", "B", "diffuse.R", "diffuse.G", "diffuse.B"}}));
  expect_near(rec709_of(own.texel(18)), expected(2, 1), 1e-5f);
}

TEST_F(ExrPicture, PartsWithoutColourArePassedOver) {
  const Part depth{{"Z"}, {{0, 0}, {15, 7}}, {{0, 0}, {3, 3}}, Imf::FLOAT, "depth"};
  const Part colour{{"R", "G", "B"}, {{0, 0}, {15, 7}}, {{0, 0}, {15, 7}}, Imf::HALF, "colour"};
  std::string said;
  const Texture texture = read_path(write_parts({depth, colour}), &said);
  expect_near(rec709_of(texture.texel(18)), expected(2, 1), 2e-3f);
  EXPECT_TRUE(tells(said, {"part 2", "depth"}));
  EXPECT_EQ(read_path(write_parts({colour, depth})).texels(), 128u);
}

TEST_F(ExrPicture, WhatHoldsNoColourSaysWhatItHolds) {
  const auto layers = write_part({{"Z", "N.X", "N.Y", "id"}});
  EXPECT_TRUE(tells(error_of([&] { read_texture(layers); }), {"1.exr", "N.X, N.Y, Z, id"}));
  const auto parts =
      write_parts({{{"Z", "id"}, {{0, 0}, {3, 3}}, {{0, 0}, {3, 3}}, Imf::FLOAT, "a"},
                   {{"u", "v"}, {{0, 0}, {3, 3}}, {{0, 0}, {3, 3}}, Imf::FLOAT, "b"}});
  EXPECT_TRUE(
      tells(error_of([&] { read_texture(parts); }), {"part 1 'a': Z, id", "part 2 'b': u, v"}));
}

TEST_F(ExrPicture, TilesAreReadAsScanlinesAre) {
  const Part part{{"R", "G", "B"}, {{0, 0}, {15, 7}}, {{-3, 2}, {12, 9}}, Imf::FLOAT, {}};
  const Texture lines = read_path(write_part(part));
  const auto path = next();
  {
    Written w(part);
    w.header.setType(Imf::TILEDIMAGE);
    w.header.setTileDescription(Imf::TileDescription(5, 3, Imf::ONE_LEVEL));
    Imf::TiledOutputFile file(path.c_str(), w.header);
    file.setFrameBuffer(w.buffer);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  }
  const Texture tiles = read_path(path);
  for (size_t p = 0; p < lines.texels(); ++p) EXPECT_EQ(tiles.texel(p), lines.texel(p)) << p;
}

TEST_F(ExrPicture, PixelThatIsNotFiniteIsNamed) {
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
    const auto path = next();
    {
      Written w({{"R", "G", "B"}, {{0, 0}, {15, 7}}, {{0, 0}, {15, 7}}, type, {}});
      w.values[1][16 * 2 + 3] = std::numeric_limits<float>::infinity();
      w.halves[1][16 * 2 + 3] = Imath::half::posInf();
      Imf::OutputFile file(path.c_str(), w.header);
      file.setFrameBuffer(w.buffer);
      file.writePixels(8);
    }
    EXPECT_TRUE(tells(error_of([&] { read_texture(path); }), {"pixel 3, 2", "not finite"}));
  }
}

// OpenEXR would take 2 GiB for it.
TEST_F(ExrPicture, AttributeLargerThanTheFileIsRefused) {
  const auto paths = {write_part({{"R", "G", "B"}}),
                      write_parts({{{"R"}, {{0, 0}, {3, 3}}, {{0, 0}, {3, 3}}, Imf::FLOAT, "a"},
                                   {{"G"}, {{0, 0}, {3, 3}}, {{0, 0}, {3, 3}}, Imf::FLOAT, "b"}})};
  for (const auto& path : paths) {
    std::ifstream in(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const std::string type("lineOrder\0lineOrder\0", 20);
    const size_t last = bytes.rfind(type);  // of the last part
    ASSERT_NE(last, std::string::npos);
    bytes.replace(last + type.size(), 4, "\xff\xff\xff\x7f");
    std::ofstream(path, std::ios::binary) << bytes;
    EXPECT_TRUE(tells(error_of([&] { read_texture(path); }), {"lineOrder", "2147483647 bytes"}));
  }
}

// OpenEXR reads of these types what they take and not what they say: what follows would be read as
// attributes that nobody checked, here one that asks for 2 GB.
TEST_F(ExrPicture, AttributeThatLiesAboutItsSizeIsRefused) {
  using namespace std::string_literals;
  const auto attribute = [](const std::string& name, const std::string& type, uint32_t size,
                            const std::string& bytes) {
    std::string text = name + '\0' + type + '\0';
    for (int k = 0; k < 4; ++k) text += char(size >> 8 * k & 0xff);
    return text + bytes;
  };
  const std::string greedy = attribute("b", "string", 0x7fffffff, ""),
                    channel = "R\0"s + std::string(16, '\2') + '\0';
  for (const auto& [type, real] : {std::pair{"box2i"s, std::string(16, '\1')},
                                   {"float"s, std::string(4, '\1')},
                                   {"compression"s, std::string(1, '\0')},
                                   {"chlist"s, channel},
                                   {"preview"s, "\1\0\0\0\1\0\0\0rgba"s}}) {
    const std::string hidden = real + greedy;
    const auto path = folder_ / "liar.exr";
    std::ofstream(path, std::ios::binary)
        << "\x76\x2f\x31\x01\2\0\0\0"s + attribute("a", type, uint32_t(hidden.size()), hidden) +
               std::string(8, '\0');
    EXPECT_TRUE(
        tells(error_of([&] { read_texture(path); }), {"liar.exr", "attribute a of type " + type}))
        << type;
  }
}

TEST_F(ExrPicture, NormalsAreNotConverted) {
  const auto path = write_part({{"R", "G", "B"}});
  const Texture normals = read_normal_map(path);
  for (int x = 0; x < 16; ++x)
    expect_near(normals.texel(size_t(x)), expected(x, 0) * 2.f - V3f(1), 1e-6f);
}

TEST_F(ExrPicture, HeedsTheLimitOfMemory) {
  const auto path =
      write_part({{"R", "G", "B"}, {{0, 0}, {8191, 8191}}, {{0, 0}, {3, 3}}, Imf::HALF, {}});
  PictureMemory little(100 << 20);
  EXPECT_TRUE(tells(error_of([&] { read_texture(path, little); }),
                    {"8192 x 8192 pixels of 3 x 16 bits", "--memory"}));
}

}  // namespace
}  // namespace drench::render::test

// TIFF written by libtiff in every layout that is read.

#include <tiffio.h>

#include <Imath/half.h>

#include "tests/render/picture_support.h"

namespace drench::render::test {
namespace {

/// One picture of a file, samples as numbers by pixel and channel.
struct TiffOfTest {
  int width = 21, height = 18, channels = 3, bits = 8;
  int photometric = PHOTOMETRIC_RGB, format = SAMPLEFORMAT_UINT, orientation = 1;
  int compression = COMPRESSION_NONE;
  bool tiled = false, planar = false;
  std::vector<uint16_t> extra{};
  std::vector<std::array<uint16_t, 256>> palette{};
  std::string icc{};
  std::vector<float> primaries{}, white{};  // x, y of each
  bool transfer = false;                    // a TransferFunction
  int ink_set = 0;                          // 0: no tag

  /// Of 0 to 2^bits - 1; of floats a number above 1, too.
  double sample(int x, int y, int c) const {
    if (format == SAMPLEFORMAT_IEEEFP) return 0.125 * x + 0.25 * y + 0.5 * c;
    const int most = (1 << bits) - 1;
    return (x * 997 + y * 331 + c * 71) % (most + 1);
  }

  void write(const std::filesystem::path& path, int pages = 1) const {
    TIFF* tiff = TIFFOpen(path.c_str(), "w");
    for (int page = 0; page < pages; ++page) write_page(tiff);
    TIFFClose(tiff);
  }

 private:
  void write_page(TIFF* tiff) const {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, photometric);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, orientation);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, planar ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    if (!extra.empty()) TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, int(extra.size()), extra.data());
    if (!palette.empty())
      TIFFSetField(tiff, TIFFTAG_COLORMAP, palette[0].data(), palette[1].data(), palette[2].data());
    if (!icc.empty()) TIFFSetField(tiff, TIFFTAG_ICCPROFILE, uint32_t(icc.size()), icc.data());
    if (!primaries.empty()) TIFFSetField(tiff, TIFFTAG_PRIMARYCHROMATICITIES, primaries.data());
    if (!white.empty()) TIFFSetField(tiff, TIFFTAG_WHITEPOINT, white.data());
    if (ink_set > 0) TIFFSetField(tiff, TIFFTAG_INKSET, ink_set);
    std::vector<uint16_t> curve(transfer ? size_t(1) << bits : 0);
    if (transfer)
      TIFFSetField(tiff, TIFFTAG_TRANSFERFUNCTION, curve.data(), curve.data(), curve.data());
    const int wide = tiled ? 16 : width, high = tiled ? 16 : 5;
    if (tiled) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, wide);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, high);
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, high);
    }
    for (int plane = 0; plane < (planar ? channels : 1); ++plane)
      for (int y = 0; y < height; y += high)
        for (int x = 0; x < width; x += wide) {
          std::string block =
              block_of(x, y, wide, tiled ? high : std::min(high, height - y), plane);
          const auto size = tmsize_t(block.size());
          if (tiled)
            TIFFWriteEncodedTile(
                tiff, TIFFComputeTile(tiff, uint32_t(x), uint32_t(y), 0, uint16_t(plane)),
                block.data(), size);
          else
            TIFFWriteEncodedStrip(tiff, TIFFComputeStrip(tiff, uint32_t(y), uint16_t(plane)),
                                  block.data(), size);
        }
    TIFFWriteDirectory(tiff);
  }

  std::string block_of(int x0, int y0, int wide, int high, int plane) const {
    std::string out;
    for (int y = y0; y < y0 + high; ++y) {
      unsigned packed = 0;
      int filled = 0;
      for (int x = x0; x < x0 + wide; ++x)
        for (int c = planar ? plane : 0; c < (planar ? plane + 1 : channels); ++c) {
          const double value = sample(x, y, c);
          if (bits < 8) {
            packed = packed << bits | unsigned(value);
            filled += bits;
            if (filled == 8) out += char(packed), filled = 0, packed = 0;
          } else if (format == SAMPLEFORMAT_IEEEFP && bits == 32) {
            append(out, float(value));
          } else if (format == SAMPLEFORMAT_IEEEFP) {
            append(out, Imath::half(float(value)).bits());
          } else if (bits == 16) {
            append(out, uint16_t(value));
          } else {
            out += char(int(value));
          }
        }
      if (filled > 0) out += char(packed << (8 - filled));
    }
    return out;
  }
  template <class T>
  static void append(std::string& out, T value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
};

class Tiff : public PictureTest {
 protected:
  Texture read(const TiffOfTest& tiff, std::string* said = nullptr, int pages = 1) {
    const auto path = next();
    tiff.write(path, pages);
    Texture out;
    const std::string text = said_by([&] { out = read_texture(path); });
    if (said)
      *said = text;
    else
      EXPECT_EQ(text, "");
    return out;
  }
  std::filesystem::path next() { return folder_ / (std::to_string(++count_) + ".tif"); }
};

/// Light of a sample: integers are sRGB, floats are linear.
double light_of(const TiffOfTest& tiff, int x, int y, int c) {
  const double value = tiff.sample(x, y, c);
  if (tiff.format == SAMPLEFORMAT_IEEEFP) return value;
  return linear_of_srgb(value / ((1 << tiff.bits) - 1));
}

void expect_pixels(const Texture& texture, const TiffOfTest& tiff, const std::string& what) {
  ASSERT_EQ(texture.width(), tiff.width) << what;
  ASSERT_EQ(texture.height(), tiff.height) << what;
  for (int y = 0; y < tiff.height; ++y)
    for (int x = 0; x < tiff.width; ++x) {
      V3f light;
      for (int c = 0; c < 3; ++c)
        light[c] = float(light_of(tiff, x, y, tiff.channels >= 3 ? c : 0));
      expect_near(rec709_of(texture.texel(size_t(y * tiff.width + x))), light,
                  1e-5f * (1 + light.x), what);
    }
}

TEST_F(Tiff, EverySampleAndLayoutIsRead) {
  struct Kind {
    int bits, format;
  };
  for (const Kind kind : {Kind{8, SAMPLEFORMAT_UINT}, Kind{16, SAMPLEFORMAT_UINT},
                          Kind{16, SAMPLEFORMAT_IEEEFP}, Kind{32, SAMPLEFORMAT_IEEEFP}})
    for (const int channels : {1, 3})
      for (const bool tiled : {false, true})
        for (const bool planar : {false, true})
          for (const int compression :
               {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
            TiffOfTest tiff{.channels = channels, .bits = kind.bits};
            tiff.format = kind.format;
            tiff.photometric = channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB;
            tiff.tiled = tiled;
            tiff.planar = planar;
            tiff.compression = compression;
            expect_pixels(read(tiff), tiff,
                          std::to_string(kind.bits) + " bits, " + std::to_string(channels) +
                              " channels, tiled " + std::to_string(tiled) + ", planar " +
                              std::to_string(planar));
          }
}

TEST_F(Tiff, FewBitsOfGreyAreRead) {
  for (const int bits : {1, 2, 4}) {
    TiffOfTest tiff{.channels = 1, .bits = bits, .photometric = PHOTOMETRIC_MINISBLACK};
    expect_pixels(read(tiff), tiff, std::to_string(bits));
    const Texture black = read(tiff);
    tiff.photometric = PHOTOMETRIC_MINISWHITE;
    const Texture white = read(tiff);
    for (int x = 0; x < tiff.width; ++x) {
      const int most = (1 << bits) - 1;
      EXPECT_NEAR(white.texel(size_t(x)).x, linear_of_srgb(1 - tiff.sample(x, 0, 0) / most), 1e-5);
    }
  }
}

TEST_F(Tiff, PaletteIsRead) {
  TiffOfTest tiff{.channels = 1, .photometric = PHOTOMETRIC_PALETTE};
  tiff.palette.resize(3);
  for (size_t k = 0; k < 256; ++k) {
    tiff.palette[0][k] = uint16_t(k * 257);
    tiff.palette[1][k] = uint16_t((255 - k) * 257);
    tiff.palette[2][k] = uint16_t(128 * 257);
  }
  const Texture texture = read(tiff);
  for (int x = 0; x < tiff.width; ++x) {
    const V3f found = rec709_of(texture.texel(size_t(x)));
    EXPECT_NEAR(found.x, linear_of_srgb(tiff.sample(x, 0, 0) / 255), 1e-5);
    EXPECT_NEAR(found.y, linear_of_srgb(1 - tiff.sample(x, 0, 0) / 255), 1e-5);
  }
}

// TIFF 6.0, tag 274: where the first stored row and column stand.
TEST_F(Tiff, OrientationIsTheOrderOfItsPixels) {
  TiffOfTest tiff{.width = 5, .height = 3};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    tiff.orientation = orientation;
    const Texture texture = read(tiff);
    const bool turned = orientation >= 5;
    const int width = turned ? 3 : 5, height = turned ? 5 : 3;
    ASSERT_EQ(texture.width(), width);
    ASSERT_EQ(texture.height(), height);
    // Of the pixel at the top left: row and column as stored.
    const bool last_row =
        orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
    const bool last_column =
        orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
    const V3f found = rec709_of(texture.texel(0));
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(found[c], light_of(tiff, last_column ? 4 : 0, last_row ? 2 : 0, c), 1e-5)
          << orientation;
    // One pixel to the right.
    const V3f right = rec709_of(texture.texel(1));
    const int column = turned ? (last_column ? 4 : 0) : (last_column ? 3 : 1);
    const int row = turned ? (last_row ? 1 : 1) : (last_row ? 2 : 0);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(right[c], light_of(tiff, column, row, c), 1e-5) << orientation;
  }
}

TEST_F(Tiff, InksAreReadAsTheColourTheyLeave) {
  for (const int bits : {8, 16}) {
    TiffOfTest tiff{.channels = 4, .bits = bits, .photometric = PHOTOMETRIC_SEPARATED};
    std::string said;
    const Texture texture = read(tiff, &said);
    EXPECT_TRUE(tells(said, {"CMYK", "approximate"}));
    const double most = (1 << bits) - 1;
    for (int x = 0; x < tiff.width; ++x) {
      const V3f found = rec709_of(texture.texel(size_t(x)));
      for (int c = 0; c < 3; ++c) {
        const double code = (1 - tiff.sample(x, 0, c) / most) * (1 - tiff.sample(x, 0, 3) / most);
        EXPECT_NEAR(srgb_encode(found[c]), code, 0.6 / most + 1e-4);
      }
    }
  }
}

TEST_F(Tiff, WhatIsLeftOutIsAWarning) {
  std::string said;
  TiffOfTest tiff{.channels = 4};
  tiff.extra = {EXTRASAMPLE_UNASSALPHA};
  const Texture alpha = read(tiff, &said);
  EXPECT_TRUE(tells(said, {"alpha"}));
  TiffOfTest plain;
  const Texture first = read(plain, &said, 3);
  EXPECT_TRUE(tells(said, {"first of its 3 pictures"}));
  expect_pixels(first, plain, "pages");
}

TEST_F(Tiff, ProfileIsHonoured) {
  TiffOfTest tiff;
  tiff.icc = IccOfTest(srgb_colorants, IccOfTest::gamma(1)).bytes();
  const Texture texture = read(tiff);
  for (int x = 0; x < tiff.width; ++x)
    EXPECT_NEAR(rec709_of(texture.texel(size_t(x))).x, tiff.sample(x, 0, 0) / 255, 1e-3);
}

// A curve ends at 1, so that of floats none but a straight one can be applied.
TEST_F(Tiff, ProfileOfFloatsIsHonouredIfItIsLinear) {
  for (const int bits : {16, 32}) {
    TiffOfTest tiff{.bits = bits, .format = SAMPLEFORMAT_IEEEFP};
    const Texture plain = read(tiff);
    const ColorMatrix matrix = color_conversion(display_p3(), acescg_chromaticities());
    tiff.icc = IccOfTest(p3_colorants, IccOfTest::gamma(1)).bytes();
    const Texture linear = read(tiff);
    tiff.icc = IccOfTest(p3_colorants, IccOfTest::gamma(2.2)).bytes();
    std::string said;
    const Texture curved = read(tiff, &said);
    EXPECT_TRUE(tells(said, {"ICC profile 'of the test'", "linear sRGB"}));
    for (size_t p = 0; p < plain.texels(); ++p) {
      const V3f wide = matrix(rec709_of(plain.texel(p)));
      expect_near(linear.texel(p), wide, 1e-3f * (1 + wide.x));  // colorants have four digits
      EXPECT_EQ(curved.texel(p), plain.texel(p));
    }
  }
}

TEST_F(Tiff, PrimariesAreHonoured) {
  for (const int format : {SAMPLEFORMAT_UINT, SAMPLEFORMAT_IEEEFP}) {
    TiffOfTest tiff{.bits = format == SAMPLEFORMAT_UINT ? 8 : 32, .format = format};
    const Texture plain = read(tiff);
    tiff.white = {0.3127f, 0.329f};
    tiff.primaries = {0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f};
    const Texture same = read(tiff);
    tiff.primaries = {0.68f, 0.32f, 0.265f, 0.69f, 0.15f, 0.06f};
    const Texture wide = read(tiff);
    tiff.white = {};
    std::string said;
    const Texture guessed = read(tiff, &said);
    EXPECT_TRUE(tells(said, {"PrimaryChromaticities", "white"}));
    const ColorMatrix matrix = color_conversion(display_p3(), acescg_chromaticities());
    for (size_t p = 0; p < plain.texels(); ++p) {
      EXPECT_EQ(same.texel(p), plain.texel(p));
      const V3f expected = matrix(rec709_of(plain.texel(p)));
      expect_near(wide.texel(p), expected, 1e-5f * (1 + expected.x));
      EXPECT_EQ(guessed.texel(p), wide.texel(p));
    }
  }
}

TEST_F(Tiff, TransferFunctionIsNamed) {
  TiffOfTest tiff{.transfer = true};
  std::string said;
  expect_pixels(read(tiff, &said), tiff, "curves");
  EXPECT_TRUE(tells(said, {"TransferFunction", "sRGB"}));
}

TEST_F(Tiff, NormalsAreNotConverted) {
  for (const int bits : {8, 16}) {
    TiffOfTest tiff{.bits = bits};
    tiff.icc = IccOfTest(srgb_colorants, IccOfTest::gamma(1)).bytes();
    const auto path = next();
    tiff.write(path);
    const Texture normals = read_normal_map(path);
    const double half = bits == 8 ? 128 : 32768;
    for (int x = 0; x < tiff.width; ++x)
      EXPECT_NEAR(normals.texel(size_t(x)).y, (tiff.sample(x, 0, 1) - half) / (half - 1), 1e-6);
  }
}

TEST_F(Tiff, KindsThatAreNotReadAreNamed) {
  TiffOfTest lab{.photometric = PHOTOMETRIC_CIELAB};
  lab.write(next());
  EXPECT_TRUE(tells(error_of([&] { read_texture(folder_ / "1.tif"); }), {"CIE L*a*b*", "8 bits"}));
}

TEST_F(Tiff, InksOtherThanCmykAreRefused) {
  TiffOfTest tiff{.channels = 4, .photometric = PHOTOMETRIC_SEPARATED, .ink_set = INKSET_MULTIINK};
  tiff.write(next());
  EXPECT_TRUE(tells(error_of([&] { read_texture(folder_ / "1.tif"); }), {"inks other than CMYK"}));
  tiff.ink_set = INKSET_CMYK;
  std::string said;
  EXPECT_EQ(read(tiff, &said).width(), tiff.width);
}

// TIFF 6.0 has the maximum black then, and floats have none.
TEST_F(Tiff, FloatsWithWhiteAtZeroAreRefused) {
  for (const int bits : {16, 32}) {
    const TiffOfTest tiff{.channels = 1,
                          .bits = bits,
                          .photometric = PHOTOMETRIC_MINISWHITE,
                          .format = SAMPLEFORMAT_IEEEFP};
    const auto path = next();
    tiff.write(path);
    EXPECT_TRUE(tells(error_of([&] { read_texture(path); }), {"white at 0", "floats"}));
  }
}

/// Black, or the first strip of it, in strips of `rows`.
void write_black(const std::filesystem::path& path, int size, int channels, int bits,
                 int compression, int rows, int strips) {
  TIFF* tiff = TIFFOpen(path.c_str(), "w");
  for (const int tag : {TIFFTAG_IMAGEWIDTH, TIFFTAG_IMAGELENGTH}) TIFFSetField(tiff, tag, size);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
  if (compression == COMPRESSION_WEBP) TIFFSetField(tiff, TIFFTAG_WEBP_LOSSLESS, 1);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, rows);
  std::string strip(size_t(rows) * size_t(size) * size_t(channels) * size_t(bits) / 8, '\0');
  for (int k = 0; k < strips; ++k)
    TIFFWriteEncodedStrip(tiff, uint32_t(k), strip.data(), tmsize_t(strip.size()));
  TIFFWriteDirectory(tiff);
  TIFFClose(tiff);
}

// Some codecs pack what is even far tighter than deflate, whose 1032 to 1 is the most.
TEST_F(Tiff, EvenPicturesAreReadHoweverTheyArePacked) {
  struct Even {
    int size, channels, bits, compression;
  };
  for (const Even& even :
       {Even{2048, 3, 8, COMPRESSION_ZSTD}, Even{2048, 3, 8, COMPRESSION_LZMA},
        Even{2048, 3, 8, COMPRESSION_WEBP}, Even{8192, 1, 1, COMPRESSION_CCITTFAX4},
        Even{2048, 3, 8, COMPRESSION_ADOBE_DEFLATE}}) {
    if (!TIFFIsCODECConfigured(uint16_t(even.compression))) continue;
    const auto path = next();
    write_black(path, even.size, even.channels, even.bits, even.compression, even.size, 1);
    const uint64_t samples = uint64_t(even.size) * uint64_t(even.size) * uint64_t(even.channels);
    const double packing =
        double(samples) * even.bits / 8 / double(std::filesystem::file_size(path));
    EXPECT_GT(packing, even.compression == COMPRESSION_ADOBE_DEFLATE ? 500 : 4096)
        << even.compression;
    const Texture texture = [&] {
      Texture out;
      EXPECT_EQ(said_by([&] { out = read_texture(path); }), "");
      return out;
    }();
    EXPECT_EQ(texture.texels(), size_t(even.size) * size_t(even.size)) << even.compression;
    EXPECT_EQ(texture.texel(texture.texels() - 1), V3f(0)) << even.compression;
  }
}

// Of 768 MiB of samples the file holds a strip: whatever the codec, no room is asked for.
TEST_F(Tiff, StripsThatAreMissingAreSeenBeforeRoomIsMade) {
  for (const int compression : {COMPRESSION_ADOBE_DEFLATE, COMPRESSION_WEBP, COMPRESSION_ZSTD}) {
    if (!TIFFIsCODECConfigured(uint16_t(compression))) continue;
    const auto path = next();
    write_black(path, 16384 - 64, 3, 8, compression, 16, 1);
    PictureMemory little(64 << 20);
    const std::string said = error_of([&] { read_texture(path, little); });
    EXPECT_TRUE(tells(said, {"cut off"})) << compression;
    EXPECT_EQ(said.find("--memory"), std::string::npos) << said;
  }
}

// 4 GiB of samples of which the file holds a strip: refused before room is made.
TEST_F(Tiff, PixelsThatCannotBeInTheFileAreRefused) {
  const auto path = next();
  TIFF* tiff = TIFFOpen(path.c_str(), "w");
  for (const int tag : {TIFFTAG_IMAGEWIDTH, TIFFTAG_IMAGELENGTH}) TIFFSetField(tiff, tag, 16384);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 4);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 64);
  std::string strip(size_t(64) * 16384 * 16, '\0');
  TIFFWriteEncodedStrip(tiff, 0, strip.data(), tmsize_t(strip.size()));
  TIFFWriteDirectory(tiff);
  TIFFClose(tiff);
  EXPECT_TRUE(tells(error_of([&] { read_texture(path); }), {"16384 x 16384", "cannot come from"}));
}

TEST_F(Tiff, WhatIsCutOffIsRefused) {
  const TiffOfTest tiff;
  const auto path = next();
  tiff.write(path);
  std::string whole(std::filesystem::file_size(path), '\0');
  std::ifstream(path, std::ios::binary).read(whole.data(), std::streamsize(whole.size()));
  for (size_t size = 4; size < whole.size(); size += 7)
    EXPECT_TRUE(tells(refused(whole.substr(0, size)), {"TIFF"})) << size;
}

}  // namespace
}  // namespace drench::render::test

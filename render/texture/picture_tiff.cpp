// TIFF by libtiff: strips and tiles, planar or not, of 1 to 16 bits and floats.

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include "render/color/color.h"
#include "render/texture/picture_file.h"

namespace drench::render {

namespace {

/// Of one strip or tile, and of what libtiff takes for itself at once.
constexpr uint64_t max_block_size = uint64_t(1) << 30;
/// The most bytes that one of a codec's stands for; none where only decoding tells.
std::optional<double> largest_packing(int compression, uint32_t width) {
  switch (compression) {
    case COMPRESSION_NONE:
    case COMPRESSION_PACKBITS:
    case COMPRESSION_JPEG:  // a block of 64 samples takes 2 bits
    case COMPRESSION_DEFLATE:
    case COMPRESSION_ADOBE_DEFLATE:  // 1032
    case COMPRESSION_LZW:            // 3838 a code of 12 bits
      return 4096;
    case COMPRESSION_LZMA:  // 273 bytes by 14 decisions of at least 0.022 bits: 7090
      return 8192;
    case COMPRESSION_ZSTD:  // a block of 128 KiB of one byte takes 4
      return 32768;
    case COMPRESSION_CCITTRLE:
    case COMPRESSION_CCITTRLEW:
    case COMPRESSION_CCITTFAX3:
    case COMPRESSION_CCITTFAX4:  // a row like the one above takes a bit
      return width + 8.0;
    default:
      return {};
  }
}

struct Source {
  const std::byte* data = nullptr;
  uint64_t size = 0, at = 0;
  std::string error, warning;
};

Source& source_of(thandle_t handle) { return *static_cast<Source*>(handle); }

tmsize_t read_bytes(thandle_t handle, void* to, tmsize_t size) {
  Source& source = source_of(handle);
  const uint64_t count = std::min(uint64_t(size), source.size - std::min(source.at, source.size));
  std::memcpy(to, source.data + source.at, count);
  source.at += count;
  return tmsize_t(count);
}

uint64_t seek(thandle_t handle, uint64_t offset, int from) {
  Source& source = source_of(handle);
  source.at = from == SEEK_SET   ? offset
              : from == SEEK_CUR ? source.at + offset
                                 : source.size + offset;
  source.at = std::min(source.at, source.size);
  return source.at;
}

std::string text_of(const char* format, va_list list) {
  char text[256];
  std::vsnprintf(text, sizeof text, format, list);
  return text;
}

int on_error(TIFF*, void* source, const char*, const char* format, va_list list) {
  std::string& text = static_cast<Source*>(source)->error;
  if (text.empty()) text = text_of(format, list);
  return 1;
}

int on_warning(TIFF*, void* source, const char*, const char* format, va_list list) {
  std::string& text = static_cast<Source*>(source)->warning;
  const std::string found = text_of(format, list);
  // Tags of one program or another say nothing of pixels.
  if (text.empty() && found.find("nknown field") == std::string::npos) text = found;
  return 1;
}

struct Close {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

std::unique_ptr<TIFF, Close> open(Source& source) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetMaxSingleMemAlloc(options, tmsize_t(max_block_size));
  TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, &source);
  TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, &source);
  std::unique_ptr<TIFF, Close> tiff(TIFFClientOpenExt(
      "picture", "rm", &source, read_bytes, [](thandle_t, void*, tmsize_t) { return tmsize_t(0); },
      seek, [](thandle_t) { return 0; }, [](thandle_t handle) { return source_of(handle).size; },
      [](thandle_t, void**, toff_t*) { return 0; }, [](thandle_t, void*, toff_t) {}, options));
  TIFFOpenOptionsFree(options);
  return tiff;
}

class TiffReader {
 public:
  explicit TiffReader(const PictureFile& file) : file_(file) {
    source_.data = file.bytes().data();
    source_.size = file.bytes().size();
    tiff_ = open(source_);
    if (!tiff_) fail();
  }

  Raster read() {
    read_tags();
    Raster picture = kind();
    const Orientation orientation(orientation_, int(width_), int(height_));
    const uint64_t block = tiled_ ? uint64_t(TIFFTileSize64(tiff())) : strip_size();
    if (block == 0 || block > max_block_size)
      file_.fail(
          fmt::format("its strips or tiles have {} bytes each; write it again with smaller "
                      "ones",
                      block));
    check_size(orientation, block);
    file_.make_room(picture, uint64_t(orientation.width()), uint64_t(orientation.height()),
                    2 * block);
    read_blocks(picture, orientation, block);
    if (inks_) to_rgb(picture);
    if (photometric_ == PHOTOMETRIC_PALETTE) picture.palette = palette();
    picture.code = code(picture.sample);
    warn(picture);
    return picture;
  }

 private:
  TIFF* tiff() const { return tiff_.get(); }
  [[noreturn]] void fail() const {
    file_.fail(
        fmt::format("it is damaged or cut off: {}; write it again or give another",
                    source_.error.empty() ? "its first directory cannot be read" : source_.error));
  }
  uint16_t tag(ttag_t name) const {
    uint16_t value = 0;
    TIFFGetFieldDefaulted(tiff(), name, &value);
    return value;
  }

  void read_tags() {
    if (!TIFFGetField(tiff(), TIFFTAG_IMAGEWIDTH, &width_) ||
        !TIFFGetField(tiff(), TIFFTAG_IMAGELENGTH, &height_) || width_ == 0 || height_ == 0 ||
        width_ > 0x7fffffff || height_ > 0x7fffffff)
      file_.fail("it has no size");
    uint16_t value = 0;
    photometric_ = TIFFGetField(tiff(), TIFFTAG_PHOTOMETRIC, &value) ? value : 0xffff;
    if (tag(TIFFTAG_COMPRESSION) == COMPRESSION_JPEG && photometric_ == PHOTOMETRIC_YCBCR) {
      TIFFSetField(tiff(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
      photometric_ = PHOTOMETRIC_RGB;
    }
    if (!TIFFIsCODECConfigured(tag(TIFFTAG_COMPRESSION)))
      file_.fail(
          fmt::format("its compression, number {}, is not known here; write it with "
                      "deflate, LZW or none",
                      tag(TIFFTAG_COMPRESSION)));
    bits_ = tag(TIFFTAG_BITSPERSAMPLE);
    samples_ = tag(TIFFTAG_SAMPLESPERPIXEL);
    format_ = tag(TIFFTAG_SAMPLEFORMAT);
    planar_ = tag(TIFFTAG_PLANARCONFIG) == PLANARCONFIG_SEPARATE && samples_ > 1;
    tiled_ = TIFFIsTiled(tiff()) != 0;
    orientation_ = tag(TIFFTAG_ORIENTATION);
    if (orientation_ < 1 || orientation_ > 8) orientation_ = 1;
  }

  /// Before room is made: whether the file can hold what its header says.
  void check_size(const Orientation& orientation, uint64_t block) {
    const auto packing = largest_packing(tag(TIFFTAG_COMPRESSION), width_);
    if (!packing) {
      file_.check_room("a strip or tile of it", 2 * block);
      Raster none;
      return read_blocks(none, orientation, block);
    }
    const uint64_t size = file_.bytes().size();
    if (double(width_) * height_ * samples_ * bits_ / 8 > *packing * double(size))
      file_.fail(
          fmt::format("its {} x {} pixels cannot come from {} bytes; it is cut off or "
                      "forged. Write it again or give another",
                      width_, height_, size));
  }

  std::string described() const {
    const char* names[] = {"grey, white at 0", "grey", "RGB", "palette", "mask", "CMYK", "YCbCr"};
    static_assert(PHOTOMETRIC_MINISWHITE == 0 && PHOTOMETRIC_YCBCR + 1 == std::size(names));
    const bool other_inks = photometric_ == PHOTOMETRIC_SEPARATED && !is_cmyk();
    const std::string colours = other_inks                                ? "inks other than CMYK"
                                : size_t(photometric_) < std::size(names) ? names[photometric_]
                                : photometric_ == PHOTOMETRIC_CIELAB      ? "CIE L*a*b*"
                                : photometric_ == PHOTOMETRIC_LOGL        ? "LogL"
                                : photometric_ == PHOTOMETRIC_LOGLUV      ? "LogLuv"
                                : photometric_ == 0xffff                  ? "no colours named"
                                                         : fmt::format("colours {}", photometric_);
    return fmt::format("{}, {} x {} bits{}", colours, samples_, bits_,
                       format_ == SAMPLEFORMAT_IEEEFP ? " of floats"
                       : format_ == SAMPLEFORMAT_INT  ? " with sign"
                                                      : "");
  }

  bool is_cmyk() const { return tag(TIFFTAG_INKSET) == INKSET_CMYK; }

  Raster kind() {
    const bool grey =
        photometric_ == PHOTOMETRIC_MINISBLACK || photometric_ == PHOTOMETRIC_MINISWHITE;
    inks_ = photometric_ == PHOTOMETRIC_SEPARATED && samples_ >= 4 && is_cmyk();
    const bool integer = format_ == SAMPLEFORMAT_UINT || format_ == SAMPLEFORMAT_VOID;
    const bool real = format_ == SAMPLEFORMAT_IEEEFP && (bits_ == 16 || bits_ == 32);
    const bool packed = integer && samples_ == 1 && (bits_ == 1 || bits_ == 2 || bits_ == 4);
    const bool palette = photometric_ == PHOTOMETRIC_PALETTE && integer && bits_ <= 8;
    // White at 0 has black at the maximum, which floats do not have.
    const bool inverse = photometric_ == PHOTOMETRIC_MINISWHITE;
    const bool known = (grey && samples_ >= 1 && !(real && inverse)) ||
                       (photometric_ == PHOTOMETRIC_RGB && samples_ >= 3) || (inks_ && integer) ||
                       (palette && samples_ >= 1);
    if (!known || samples_ > 16 || !(real || packed || (integer && (bits_ == 8 || bits_ == 16))))
      file_.fail(
          fmt::format("it holds {}; give one of grey, RGB, CMYK or a palette, with 8 or 16 "
                      "bits, or floats of 16 or 32",
                      described()));
    Raster picture;
    picture.sample = bits_ == 32   ? Raster::Sample::f32
                     : real        ? Raster::Sample::f16
                     : bits_ == 16 ? Raster::Sample::u16
                                   : Raster::Sample::u8;
    picture.colours = grey || palette ? 1 : 3;
    picture.stride = samples_;
    return picture;
  }

  uint64_t strip_size() const {
    return std::min(TIFFStripSize64(tiff()), TIFFVStripSize64(tiff(), height_));
  }

  /// Reads each strip or tile and puts its samples where they belong, if `picture` has room.
  void read_blocks(Raster& picture, const Orientation& orientation, uint64_t size) {
    uint32_t wide = width_, high = height_;
    if (tiled_) {
      TIFFGetField(tiff(), TIFFTAG_TILEWIDTH, &wide);
      TIFFGetField(tiff(), TIFFTAG_TILELENGTH, &high);
    } else {
      TIFFGetFieldDefaulted(tiff(), TIFFTAG_ROWSPERSTRIP, &high);
      high = std::min(high, height_);
    }
    if (wide == 0 || high == 0) fail();
    const uint64_t row_bytes =
        tiled_ ? TIFFTileRowSize64(tiff()) : uint64_t(TIFFScanlineSize64(tiff()));
    const uint64_t in_block = planar_ ? 1 : uint64_t(samples_);
    if (row_bytes < (uint64_t(wide) * in_block * bits_ + 7) / 8) fail();
    std::vector<std::byte> block(size);
    for (int plane = 0; plane < (planar_ ? samples_ : 1); ++plane)
      for (uint64_t y = 0; y < height_; y += high)
        for (uint64_t x = 0; x < width_; x += wide) {
          const auto rows = std::min<uint64_t>(high, height_ - y);
          const auto columns = std::min<uint64_t>(wide, width_ - x);
          read_block(block, uint32_t(x), uint32_t(y), uint16_t(plane), rows * row_bytes);
          for (uint64_t r = 0; r < rows && !picture.bytes.empty(); ++r)
            for (uint64_t c = 0; c < columns; ++c)
              put(picture, orientation.pixel(int(x + c), int(y + r)), plane,
                  block.data() + r * row_bytes, c);
        }
  }

  void read_block(std::vector<std::byte>& block, uint32_t x, uint32_t y, uint16_t plane,
                  uint64_t needed) {
    if (needed > block.size()) fail();
    const tmsize_t got = tiled_
                             ? TIFFReadEncodedTile(tiff(), TIFFComputeTile(tiff(), x, y, 0, plane),
                                                   block.data(), tmsize_t(block.size()))
                             : TIFFReadEncodedStrip(tiff(), TIFFComputeStrip(tiff(), y, plane),
                                                    block.data(), tmsize_t(block.size()));
    if (got < 0 || uint64_t(got) < needed) fail();
  }

  /// The samples of a pixel, number `column` of a row in a block.
  void put(Raster& picture, size_t pixel, int plane, const std::byte* row, uint64_t column) const {
    const size_t sample = bytes_of(picture.sample);
    std::byte* to = picture.bytes.data() + (pixel * samples_ + size_t(plane)) * sample;
    if (bits_ < 8) {
      const uint64_t bit = column * bits_;
      const unsigned mask = (1u << bits_) - 1;
      const unsigned code = unsigned(row[bit / 8]) >> (8 - bits_ - bit % 8) & mask;
      *to = std::byte(photometric_ == PHOTOMETRIC_PALETTE ? code : code * (255 / mask));
    } else {
      const size_t count = planar_ ? 1 : size_t(samples_);
      std::memcpy(to, row + column * count * sample, count * sample);
    }
    if (photometric_ == PHOTOMETRIC_MINISWHITE && plane == 0)
      for (size_t k = 0; k < sample; ++k) to[k] = ~to[k];
  }
  bool is_integer() const { return format_ != SAMPLEFORMAT_IEEEFP; }

  /// Inks, 0 where there is none, to R, G and B: each takes its part of the light that black
  /// leaves.
  static void to_rgb(Raster& picture) {
    const bool wide = picture.sample == Raster::Sample::u16;
    const uint64_t most = wide ? 65535 : 255;
    for (size_t p = 0; p < picture.pixels(); ++p) {
      std::byte* at = picture.bytes.data() + p * size_t(picture.stride) * (wide ? 2 : 1);
      uint64_t ink[4];
      for (size_t c = 0; c < 4; ++c) {
        uint16_t value = uint16_t(at[c]);
        if (wide) std::memcpy(&value, at + 2 * c, 2);
        ink[c] = value;
      }
      for (size_t c = 0; c < 3; ++c) {
        const auto value = uint16_t(((most - ink[c]) * (most - ink[3]) + most / 2) / most);
        if (wide)
          std::memcpy(at + 2 * c, &value, 2);
        else
          at[c] = std::byte(value);
      }
    }
  }

  /// 16 bits an entry, but some writers have 8.
  std::vector<std::array<uint8_t, 3>> palette() const {
    uint16_t* entry[3] = {};
    if (!TIFFGetField(tiff(), TIFFTAG_COLORMAP, &entry[0], &entry[1], &entry[2]))
      file_.fail("it has no palette; write it again");
    const size_t count = size_t(1) << bits_;
    bool wide = false;
    for (const uint16_t* e : entry)
      wide = wide || std::any_of(e, e + count, [](uint16_t v) { return v > 255; });
    std::vector<std::array<uint8_t, 3>> out(256);
    for (size_t k = 0; k < count; ++k)
      for (size_t c = 0; c < 3; ++c) out[k][c] = uint8_t(wide ? entry[c][k] / 257 : entry[c][k]);
    return out;
  }

  ColourCode code(Raster::Sample sample) const {
    ColourCode out =
        is_integer() ? ColourCode::srgb() : ColourCode::linear(rec709_chromaticities());
    if (file_.is_data() || inks_) return out;
    uint32_t size = 0;
    void* profile = nullptr;
    if (TIFFGetField(tiff(), TIFFTAG_ICCPROFILE, &size, &profile))
      return file_.code_of_profile(static_cast<const unsigned char*>(profile), size, sample);
    if (const auto primaries = primaries_of_tags()) out.primaries = *primaries;
    uint16_t* curve[3] = {};
    if (TIFFGetField(tiff(), TIFFTAG_TRANSFERFUNCTION, &curve[0], &curve[1], &curve[2]))
      file_.warn(
          "its TransferFunction is not applied. Convert it to sRGB in the program that made it");
    return out;
  }

  std::optional<Imf::Chromaticities> primaries_of_tags() const {
    Imf::Chromaticities found = rec709_chromaticities();
    float *rgb = nullptr, *white = nullptr;
    const bool has_rgb = TIFFGetField(tiff(), TIFFTAG_PRIMARYCHROMATICITIES, &rgb) != 0;
    const bool has_white = TIFFGetField(tiff(), TIFFTAG_WHITEPOINT, &white) != 0;
    if (has_rgb) found = {{rgb[0], rgb[1]}, {rgb[2], rgb[3]}, {rgb[4], rgb[5]}, found.white};
    if (has_white) found.white = {white[0], white[1]};
    const auto out = file_.other_primaries(found, "its tags");
    if (out && has_rgb != has_white)
      file_.warn(has_rgb ? "it has PrimaryChromaticities without a white; that of sRGB is taken"
                         : "it has a WhitePoint without PrimaryChromaticities; those of sRGB are "
                           "taken");
    return out;
  }

  void warn(const Raster& picture) {
    if (inks_ && !file_.is_data())
      file_.warn(
          "it is CMYK, converted to sRGB without the profile of its press; its colours are "
          "approximate. Convert it to sRGB in the program that made it");
    if (!source_.warning.empty())
      file_.warn(fmt::format("the TIFF is not quite right, but can be read: {}", source_.warning));
    warn_of_alpha(picture);
    uint32_t pages = 0;
    while (pages < 1000 && TIFFReadDirectory(tiff())) {
      uint32_t kind = 0;
      TIFFGetField(tiff(), TIFFTAG_SUBFILETYPE, &kind);
      pages += kind & FILETYPE_REDUCEDIMAGE ? 0 : 1;  // smaller copies are no pages
    }
    if (pages > 0)
      file_.warn(
          fmt::format("the first of its {} pictures is read, the others are not", pages + 1));
  }

  void warn_of_alpha(const Raster& picture) const {
    uint16_t count = 0, *kinds = nullptr;
    TIFFGetField(tiff(), TIFFTAG_EXTRASAMPLES, &count, &kinds);
    const int at = inks_ ? 4 : picture.colours;
    if (count == 0 || !kinds || kinds[0] == EXTRASAMPLE_UNSPECIFIED || picture.stride <= at) return;
    const size_t sample = bytes_of(picture.sample);
    uint64_t transparent = 0;
    for (size_t p = 0; p < picture.pixels(); ++p) {
      const std::byte* from =
          picture.bytes.data() + (p * size_t(picture.stride) + size_t(at)) * sample;
      uint16_t half_or_word = 0;
      float real = 0;
      if (sample == 2) std::memcpy(&half_or_word, from, 2);
      if (sample == 4) std::memcpy(&real, from, 4);
      const bool opaque = sample == 1                             ? *from == std::byte(255)
                          : sample == 4                           ? real >= 1
                          : picture.sample == Raster::Sample::u16 ? half_or_word == 65535
                                                                  : half_or_word >= 0x3c00;
      transparent += opaque ? 0 : 1;
    }
    file_.warn_of_alpha(transparent);
  }

  const PictureFile& file_;
  Source source_;
  std::unique_ptr<TIFF, Close> tiff_;
  uint32_t width_ = 0, height_ = 0;
  int photometric_ = 0, bits_ = 0, samples_ = 0, format_ = 0, orientation_ = 1;
  bool planar_ = false, tiled_ = false, inks_ = false;
};

}  // namespace

Raster read_tiff(const PictureFile& file) { return TiffReader(file).read(); }

}  // namespace drench::render

// PNG by libpng. Which colours its samples are: PNG specification, third edition, 4.3.

#include <fmt/format.h>
#include <png.h>
#include <zlib.h>

#include <cmath>
#include <csetjmp>
#include <cstring>
#include <optional>
#include <span>

#include "render/texture/picture_file.h"

namespace drench::render {

namespace {

/// File gammas nearer to sRGB's 1/2.2 than this fraction are taken as sRGB, as libpng does.
constexpr double same_gamma = 0.05;
/// No deflate stream unpacks to more bytes than this for one of its own.
constexpr uint64_t max_compression_ratio = 1032;

/// What libpng is given and says; it must not hold what a jump would leave undestroyed.
struct Png {
  const std::byte* data = nullptr;
  size_t size = 0, at = 0;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::jmp_buf jump;
  char error[256] = "";
  char warning[4][256] = {};
  int warnings = 0;
};

void copy_text(char (&to)[256], const char* from) {
  std::strncpy(to, from ? from : "", sizeof to - 1);
}

void on_error(png_structp png, const char* text) {
  auto* state = static_cast<Png*>(png_get_error_ptr(png));
  copy_text(state->error, text);
  std::longjmp(state->jump, 1);
}

void on_warning(png_structp png, const char* text) {
  auto* state = static_cast<Png*>(png_get_error_ptr(png));
  if (state->warnings < 4) copy_text(state->warning[state->warnings++], text);
}

void on_read(png_structp png, png_bytep to, size_t count) {
  auto* state = static_cast<Png*>(png_get_io_ptr(png));
  if (count > state->size - state->at) png_error(png, "the file ends too early");
  std::memcpy(to, state->data + state->at, count);
  state->at += count;
}

/// What stands before the pixels. False on error, as of all that follow.
bool read_header(Png& state) {
  if (setjmp(state.jump)) return false;
  state.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &state, on_error, on_warning);
  if (!state.png) return false;
  state.info = png_create_info_struct(state.png);
  png_set_read_fn(state.png, &state, on_read);
  png_set_benign_errors(state.png, 1);
  png_read_info(state.png, state.info);
  return true;
}

/// Samples of 8 or 16 bits, otherwise as they stand in the file.
bool start_rows(Png& state) {
  if (setjmp(state.jump)) return false;
  png_set_packing(state.png);
  if (png_get_color_type(state.png, state.info) == PNG_COLOR_TYPE_GRAY)
    png_set_expand_gray_1_2_4_to_8(state.png);
  png_set_swap(state.png);
  png_set_interlace_handling(state.png);
  png_read_update_info(state.png, state.info);
  return true;
}

bool read_rows(Png& state, png_bytep* rows) {
  if (setjmp(state.jump)) return false;
  png_read_image(state.png, rows);
  return true;
}

bool read_end(Png& state) {
  if (setjmp(state.jump)) return false;
  png_read_end(state.png, nullptr);
  return true;
}

class PngReader {
 public:
  explicit PngReader(const PictureFile& file) : file_(file) {
    state_.data = file.bytes().data();
    state_.size = file.bytes().size();
  }
  ~PngReader() { png_destroy_read_struct(&state_.png, &state_.info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  Raster read() {
    if (!read_header(state_)) fail();
    Raster picture;
    const int type = png_get_color_type(state_.png, state_.info);
    depth_ = png_get_bit_depth(state_.png, state_.info);
    picture.sample = depth_ == 16 ? Raster::Sample::u16 : Raster::Sample::u8;
    picture.colours = type & PNG_COLOR_MASK_COLOR && type != PNG_COLOR_TYPE_PALETTE ? 3 : 1;
    picture.stride = int(png_get_channels(state_.png, state_.info));
    read_samples(picture);
    if (type == PNG_COLOR_TYPE_PALETTE) picture.palette = palette();
    picture.code = file_.is_data() ? ColourCode::srgb() : code(picture.sample);
    file_.warn_of_alpha(transparent(picture));
    for (int k = 0; k < state_.warnings; ++k)
      if (!std::strstr(state_.warning[k], "known incorrect sRGB profile"))
        file_.warn(
            fmt::format("the PNG is not quite right, but can be read: {}", state_.warning[k]));
    return picture;
  }

 private:
  [[noreturn]] void fail() const {
    file_.fail(
        fmt::format("it is damaged or cut off: {}; write it again or give another", state_.error));
  }

  void read_samples(Raster& picture) {
    const uint64_t width = png_get_image_width(state_.png, state_.info);
    const uint64_t height = png_get_image_height(state_.png, state_.info);
    const uint64_t bits = width * depth_ * uint64_t(picture.stride);  // of a row
    if ((bits + 7) / 8 * height / max_compression_ratio > state_.size)
      file_.fail(
          fmt::format("its {} x {} pixels cannot come from {} bytes; it is cut off or "
                      "forged. Write it again or give another",
                      width, height, state_.size));
    constexpr uint64_t library_rows = 4;
    file_.make_room(picture, width, height, height * sizeof(png_bytep) + library_rows * 8 * width);
    if (!start_rows(state_)) fail();
    const size_t row = picture.bytes.size() / height;
    if (png_get_rowbytes(state_.png, state_.info) != row)
      file_.fail("its rows have another size than its header says; write it again");
    std::vector<png_bytep> rows;
    for (uint64_t y = 0; y < height; ++y)
      rows.push_back(reinterpret_cast<png_bytep>(picture.bytes.data()) + y * row);
    if (!read_rows(state_, rows.data())) fail();
    if (!read_end(state_)) {
      if (std::strstr(state_.error, "CRC")) fail();
      file_.warn(fmt::format("all its pixels are there, but what follows cannot be read: {}",
                             state_.error));
    } else if (state_.at < state_.size) {
      file_.warn(
          fmt::format("{} bytes after the picture's end are not read", state_.size - state_.at));
    }
  }

  std::vector<std::array<uint8_t, 3>> palette() {
    std::vector<std::array<uint8_t, 3>> out(256);
    png_colorp entries = nullptr;
    int count = 0;
    png_get_PLTE(state_.png, state_.info, &entries, &count);
    for (int k = 0; k < std::min(count, 256); ++k)
      out[size_t(k)] = {entries[k].red, entries[k].green, entries[k].blue};
    return out;
  }

  /// Pixels that are not opaque, by an alpha channel or a transparent colour.
  uint64_t transparent(const Raster& picture) {
    png_bytep alphas = nullptr;
    png_color_16p colour = nullptr;
    int count = 0;
    const bool has_key =
        png_get_tRNS(state_.png, state_.info, &alphas, &count, &colour) & PNG_INFO_tRNS;
    if (picture.stride == picture.colours && !has_key) return 0;
    const bool wide = picture.sample == Raster::Sample::u16;
    const auto sample = [&](size_t index) {
      if (!wide) return uint16_t(picture.bytes[index]);
      uint16_t value;
      std::memcpy(&value, picture.bytes.data() + 2 * index, 2);
      return value;
    };
    const bool grey = picture.colours == 1;
    // A key of 1, 2 or 4 bits is in these, the samples are in 8.
    const int key_scale = depth_ < 8 ? 255 / ((1 << depth_) - 1) : 1;
    uint64_t found = 0;
    for (size_t p = 0; p < picture.pixels(); ++p) {
      const size_t at = p * size_t(picture.stride);
      if (picture.stride > picture.colours)
        found += sample(at + size_t(picture.colours)) < (wide ? 65535 : 255) ? 1 : 0;
      else if (!picture.palette.empty())
        found += int(sample(at)) < count && alphas && alphas[sample(at)] < 255 ? 1 : 0;
      else if (colour && grey)
        found += sample(at) == colour->gray * key_scale ? 1 : 0;
      else if (colour)
        found += sample(at) == colour->red && sample(at + 1) == colour->green &&
                         sample(at + 2) == colour->blue
                     ? 1
                     : 0;
    }
    return found;
  }

  ColourCode code(Raster::Sample sample) {
    if (const auto code = code_of_cicp()) return *code;
    png_charp name = nullptr;
    int compression = 0;
    png_bytep profile = nullptr;
    png_uint_32 size = 0;
    if (png_get_iCCP(state_.png, state_.info, &name, &compression, &profile, &size))
      return file_.code_of_profile(profile, size, sample);
    if (png_get_valid(state_.png, state_.info, PNG_INFO_sRGB)) return ColourCode::srgb();
    ColourCode out = ColourCode::srgb();
    double gamma = 0;
    if (png_get_gAMA(state_.png, state_.info, &gamma) && gamma > 0 &&
        std::abs(gamma * 2.2 - 1) > same_gamma) {
      const auto power = float(1 / gamma);
      for (auto& curve : out.to_linear)
        curve = [power](float code) { return std::pow(code, power); };
    }
    if (const auto primaries = primaries_of_chrm()) out.primaries = *primaries;
    return out;
  }

  std::optional<Imf::Chromaticities> primaries_of_chrm() {
    double c[8];
    if (!png_get_cHRM(state_.png, state_.info, &c[0], &c[1], &c[2], &c[3], &c[4], &c[5], &c[6],
                      &c[7]))
      return {};
    const auto at = [&](int k) { return Imath::V2f(float(c[k]), float(c[k + 1])); };
    return file_.other_primaries({at(2), at(4), at(6), at(0)}, "its cHRM chunk");
  }

  /// The data of the cICP chunk before the pixels, which libpng knows from 1.6.45 on; none if there
  /// is none or its check sum is wrong, of which libpng warns.
  std::span<const unsigned char> cicp() const {
    const auto* file = reinterpret_cast<const unsigned char*>(state_.data);
    const auto number = [&](size_t from) { return size_t(png_get_uint_32(file + from)); };
    constexpr size_t chunk_overhead = 12;  // length and type before the data, check sum after
    for (size_t at = 8; at + chunk_overhead <= state_.size;) {
      const size_t size = number(at);
      const unsigned char* type = file + at + 4;
      if (size > state_.size - at - chunk_overhead || std::memcmp(type, "IDAT", 4) == 0) break;
      if (std::memcmp(type, "cICP", 4) == 0 &&
          crc32(0, type, uInt(4 + size)) == number(at + 8 + size))
        return {type + 4, size};
      at += chunk_overhead + size;
    }
    return {};
  }

  /// Of ITU-T H.273 code points; none if there are none or they are not known here. PNG has R, G
  /// and B in full range: matrix 0, range 1.
  std::optional<ColourCode> code_of_cicp() const {
    const auto chunk = cicp();
    if (chunk.empty()) return {};
    if (chunk.size() != 4) {
      file_.warn(
          fmt::format("its cICP chunk has {} bytes, not 4; it is read without", chunk.size()));
      return {};
    }
    const int primaries = chunk[0], transfer = chunk[1], matrix = chunk[2], range = chunk[3];
    ColourCode out = ColourCode::srgb();
    if (primaries == 12)  // Display P3
      out.primaries = {{0.680f, 0.320f}, {0.265f, 0.690f}, {0.150f, 0.060f}, {0.3127f, 0.3290f}};
    if (transfer == 8) out.to_linear = ColourCode::linear(out.primaries).to_linear;
    if ((primaries == 1 || primaries == 12) && (transfer == 13 || transfer == 8) && matrix == 0 &&
        range == 1)
      return out;
    file_.warn(
        fmt::format("its cICP chunk names primaries {}, transfer {}, matrix {} and {} range, "
                    "which are not known here; it is read without. Convert it to sRGB or EXR",
                    primaries, transfer, matrix, range == 1 ? "full" : "narrow"));
    return {};
  }

  const PictureFile& file_;
  Png state_;
  unsigned depth_ = 8;  // bits of a sample in the file
};

}  // namespace

Raster read_png(const PictureFile& file) { return PngReader(file).read(); }

}  // namespace drench::render

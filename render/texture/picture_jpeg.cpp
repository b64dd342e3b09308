// JPEG by libjpeg.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include <jpeglib.h>

#include <jerror.h>

#include "render/texture/picture_file.h"

namespace drench::render {

namespace {

/// A file of more scans only takes time: a picture that is refined bit by bit has a dozen or two.
constexpr int max_scans = 200;

/// What libjpeg is given and says. It reports errors by a jump, so nothing with a destructor may
/// live here.
struct Jpeg {
  jpeg_decompress_struct library{};
  jpeg_error_mgr manager{};
  jpeg_progress_mgr progress{};
  std::jmp_buf jump;
  char error[JMSG_LENGTH_MAX] = "";
  char warning[JMSG_LENGTH_MAX] = "";
  int warnings = 0;
  bool lacks_end = false;
  unsigned char* profile = nullptr;
  unsigned int profile_size = 0;
};

Jpeg& state_of(j_common_ptr info) { return *static_cast<Jpeg*>(info->client_data); }

void on_error(j_common_ptr info) {
  Jpeg& state = state_of(info);
  info->err->format_message(info, state.error);
  std::longjmp(state.jump, 1);
}

/// Whether the bytes that were passed over before a marker are zeros, as some cameras pad scans by.
bool is_padding(const jpeg_decompress_struct& jpeg, int count) {
  const JOCTET* end = jpeg.src->next_input_byte;
  return std::all_of(end - count, end, [](JOCTET byte) { return byte == 0; });
}

/// Where data is damaged or missing, libjpeg would go on with grey; that is an error here. So are
/// bytes that a scan leaves over: it was decoded out of step.
void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;  // of what is traced
  Jpeg& state = state_of(info);
  const int code = info->err->msg_code;
  if (code == JWRN_JPEG_EOF) {
    state.lacks_end = true;
    return;
  }
  const auto& jpeg = *reinterpret_cast<j_decompress_ptr>(info);
  const bool left_over = code == JWRN_EXTRANEOUS_DATA && jpeg.input_scan_number > 0;
  if (left_over && (state.lacks_end || !is_padding(jpeg, info->err->msg_parm.i[0]))) on_error(info);
  if (code != JWRN_EXTRANEOUS_DATA && code != JWRN_ADOBE_XFORM && code != JWRN_JFIF_MAJOR &&
      code != JWRN_BOGUS_ICC)
    on_error(info);
  if (state.warnings++ == 0) info->err->format_message(info, state.warning);
}

void on_progress(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= max_scans) return;
  Jpeg& state = state_of(info);
  std::snprintf(state.error, sizeof state.error, "it has more than %d scans", max_scans);
  std::longjmp(state.jump, 1);
}

/// False on error, as of all that follow.
bool read_header(Jpeg& state, const std::byte* data, size_t size) {
  state.library.err = jpeg_std_error(&state.manager);
  state.library.client_data = &state;
  state.manager.error_exit = on_error;
  state.manager.emit_message = on_message;
  if (setjmp(state.jump)) return false;
  jpeg_create_decompress(&state.library);
  state.progress.progress_monitor = on_progress;
  state.library.progress = &state.progress;
  jpeg_mem_src(&state.library, reinterpret_cast<const unsigned char*>(data), size);
  jpeg_save_markers(&state.library, JPEG_APP0 + 1, 0xffff);  // EXIF
  jpeg_save_markers(&state.library, JPEG_APP0 + 2, 0xffff);  // ICC
  jpeg_read_header(&state.library, TRUE);
  jpeg_read_icc_profile(&state.library, &state.profile, &state.profile_size);
  return true;
}

enum class Inks { plain, inverted };

/// 4 inks to R, G and B without their press: each takes its part of the light that the other
/// inks and black leave. With Adobe's marker the samples are 255 where there is no ink.
void from_inks(const uint8_t* inks, uint8_t* rgb, size_t pixels, Inks stored) {
  for (size_t p = 0; p < pixels; ++p)
    for (size_t c = 0; c < 3; ++c) {
      const int ink = inks[4 * p + c], black = inks[4 * p + 3];
      const int product = stored == Inks::inverted ? ink * black : (255 - ink) * (255 - black);
      rgb[3 * p + c] = uint8_t((product + 127) / 255);
    }
}

/// @param inks  of one row, for CMYK; else null
bool read_rows(Jpeg& state, uint8_t* to, uint8_t* inks) {
  jpeg_decompress_struct& j = state.library;
  if (setjmp(state.jump)) return false;
  jpeg_start_decompress(&j);
  const size_t stride = inks ? 3 : size_t(j.output_components);
  while (j.output_scanline < j.output_height) {
    uint8_t* row = to + stride * j.output_width * j.output_scanline;
    uint8_t* into = inks ? inks : row;
    jpeg_read_scanlines(&j, &into, 1);
    if (inks)
      from_inks(inks, row, j.output_width, j.saw_Adobe_marker ? Inks::inverted : Inks::plain);
  }
  jpeg_finish_decompress(&j);
  return true;
}

/// Of an EXIF block, 1 to 8; 1 if it says nothing. Tag 274 of its first directory.
int exif_orientation(const unsigned char* data, size_t size) {
  if (size < 14 || std::memcmp(data, "Exif\0\0", 6) != 0) return 1;
  const unsigned char* tiff = data + 6;
  const size_t length = size - 6;
  const bool little = tiff[0] == 'I';
  const auto number = [&](size_t at, size_t count) -> size_t {
    if (at + count > length) return 0;
    size_t out = 0;
    for (size_t k = 0; k < count; ++k) out = out << 8 | tiff[at + (little ? count - 1 - k : k)];
    return out;
  };
  const size_t directory = number(4, 4), entries = number(directory, 2);
  for (size_t k = 0; k < entries; ++k)
    if (number(directory + 2 + 12 * k, 2) == 274) {
      const size_t value = number(directory + 2 + 12 * k + 8, 2);
      return value >= 1 && value <= 8 ? int(value) : 1;
    }
  return 1;
}

class JpegReader {
 public:
  explicit JpegReader(const PictureFile& file) : file_(file) {}
  ~JpegReader() {
    jpeg_destroy_decompress(&state_.library);
    std::free(state_.profile);
  }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  Raster read() {
    if (!read_header(state_, file_.bytes().data(), file_.bytes().size())) fail();
    Raster picture;
    choose_colours(picture);
    warn_of_orientation();  // while the library still holds the markers
    const jpeg_decompress_struct& j = state_.library;
    uint64_t beside = inks_ ? 4 * uint64_t(j.image_width) : 0;
    if (jpeg_has_multiple_scans(&state_.library))  // 16-bit coefficients of the whole picture
      beside += 2 * uint64_t(j.num_components) * j.image_width * j.image_height;
    file_.make_room(picture, j.image_width, j.image_height, beside);
    std::vector<uint8_t> inks(inks_ ? size_t(4) * j.image_width : 0);
    if (!read_rows(state_, reinterpret_cast<uint8_t*>(picture.bytes.data()),
                   inks_ ? inks.data() : nullptr))
      fail();
    check_end();
    if (state_.warnings > 0)
      file_.warn(fmt::format("the JPEG is not quite right, but can be read: {}", state_.warning));
    picture.code = code();
    return picture;
  }

 private:
  [[noreturn]] void fail() const {
    file_.fail(fmt::format("{}; write it again or give another", state_.error));
  }

  void choose_colours(Raster& picture) {
    jpeg_decompress_struct& j = state_.library;
    switch (j.jpeg_color_space) {
      case JCS_GRAYSCALE:
        j.out_color_space = JCS_GRAYSCALE;
        picture.colours = picture.stride = 1;
        return;
      case JCS_RGB:
      case JCS_YCbCr:
        j.out_color_space = JCS_RGB;
        return;
      case JCS_CMYK:
      case JCS_YCCK:
        j.out_color_space = JCS_CMYK;
        inks_ = true;
        return;
      default:
        file_.fail(
            fmt::format("it has {} components of no known colours; give one of grey, RGB "
                        "or CMYK",
                        j.num_components));
    }
  }

  /// All pixels of a single scan of Huffman codes were decoded without a word. Of several scans
  /// some may lack; an arithmetic decoder reads zeros past its end (ITU-T T.81, annex D).
  void check_end() const {
    const bool several = state_.library.progressive_mode ||
                         state_.library.comps_in_scan < state_.library.num_components;
    if (state_.lacks_end && several)
      file_.fail("it is cut off: its last scans are missing; write it again or give another");
    if (state_.lacks_end && state_.library.arith_code)
      file_.fail(
          "it is cut off: its end is missing, and pixels may be with it; write it again or give "
          "another");
    if (state_.lacks_end)
      file_.warn("all its pixels are there, but its end is missing; it may have been cut off");
    const size_t rest = state_.library.src->bytes_in_buffer;
    if (!state_.lacks_end && rest > 0)
      file_.warn(fmt::format("{} bytes after the picture's end are not read", rest));
  }

  ColourCode code() const {
    if (file_.is_data()) return ColourCode::srgb();
    if (inks_)
      file_.warn(
          fmt::format("it is CMYK, converted to sRGB without the profile of its press{}; "
                      "its colours are approximate. Convert it to sRGB in the program "
                      "that made it",
                      state_.library.saw_Adobe_marker
                          ? ""
                          : " and, since it lacks Adobe's marker, with 0 for no ink"));
    if (inks_ || !state_.profile) return ColourCode::srgb();
    return file_.code_of_profile(state_.profile, state_.profile_size, Raster::Sample::u8);
  }

  void warn_of_orientation() const {
    for (const jpeg_marker_struct* m = state_.library.marker_list; m; m = m->next) {
      const int orientation = exif_orientation(m->data, m->data_length);
      if (m->marker != JPEG_APP0 + 1 || orientation == 1) continue;
      file_.warn(
          fmt::format("its EXIF orientation {} is not applied: texture coordinates count "
                      "on the pixels as they are stored. Turn the pixels if that is meant",
                      orientation));
      return;
    }
  }

  const PictureFile& file_;
  Jpeg state_;
  bool inks_ = false;
};

}  // namespace

Raster read_jpeg(const PictureFile& file) { return JpegReader(file).read(); }

}  // namespace drench::render

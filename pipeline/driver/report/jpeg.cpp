#include "pipeline/driver/report/jpeg.h"

#include <fmt/format.h>

#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include <jpeglib.h>

#include "pipeline/contract/error.h"

namespace drench {

namespace {

/// libjpeg reports errors by a jump, so nothing with a destructor may live here.
struct Jpeg {
  jpeg_compress_struct library{};
  jpeg_error_mgr manager{};
  std::jmp_buf jump;
  char error[JMSG_LENGTH_MAX] = "";
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
};

void on_error(j_common_ptr info) {
  Jpeg& state = *static_cast<Jpeg*>(info->client_data);
  info->err->format_message(info, state.error);
  std::longjmp(state.jump, 1);
}

/// @return whether it worked
bool compress(Jpeg& jpeg, const Picture& picture, int quality) {
  jpeg.library.err = jpeg_std_error(&jpeg.manager);
  jpeg.manager.error_exit = on_error;
  jpeg.library.client_data = &jpeg;
  if (setjmp(jpeg.jump)) return false;
  jpeg_create_compress(&jpeg.library);
  jpeg_mem_dest(&jpeg.library, &jpeg.bytes, &jpeg.size);
  jpeg.library.image_width = JDIMENSION(picture.width);
  jpeg.library.image_height = JDIMENSION(picture.height);
  jpeg.library.input_components = 3;
  jpeg.library.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg.library);
  jpeg_set_quality(&jpeg.library, quality, TRUE);
  // Whole resolution of colours: a red sheet must not bleed.
  jpeg.library.comp_info[0].h_samp_factor = jpeg.library.comp_info[0].v_samp_factor = 1;
  jpeg_start_compress(&jpeg.library, TRUE);
  while (jpeg.library.next_scanline < jpeg.library.image_height) {
    auto* row =
        const_cast<uint8_t*>(&picture.rgb[3 * size_t(picture.width) * jpeg.library.next_scanline]);
    jpeg_write_scanlines(&jpeg.library, &row, 1);
  }
  jpeg_finish_compress(&jpeg.library);
  return true;
}

}  // namespace

std::vector<uint8_t> jpeg_bytes(const Picture& picture, int quality) {
  const auto jpeg = std::make_unique<Jpeg>();
  const bool done = compress(*jpeg, picture, quality);
  std::vector<uint8_t> bytes;
  if (done) bytes.assign(jpeg->bytes, jpeg->bytes + jpeg->size);
  jpeg_destroy_compress(&jpeg->library);
  std::free(jpeg->bytes);
  if (!done) {
    throw Error(fmt::format("a picture of {} x {} pixels cannot be a JPEG: {}", picture.width,
                            picture.height, jpeg->error));
  }
  return bytes;
}

std::string data_url(std::string_view type, const std::vector<uint8_t>& bytes) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = fmt::format("data:{};base64,", type);
  text.reserve(text.size() + (bytes.size() + 2) / 3 * 4);
  for (size_t k = 0; k < bytes.size(); k += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - k);
    uint32_t bits = 0;
    for (size_t b = 0; b < 3; ++b) bits = bits << 8 | (b < count ? bytes[k + b] : 0);
    for (size_t d = 0; d < 4; ++d) text += d <= count ? digits[bits >> (18 - 6 * d) & 63] : '=';
  }
  return text;
}

}  // namespace drench

#include "pipeline/driver/report/frame_jpeg.h"

#include <algorithm>
#include <cmath>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/report/jpeg.h"

namespace drench {

std::filesystem::path FrameReader::file(int frame) const {
  return folder_ / layout::image(shot_, frame);
}

std::vector<uint8_t> FrameReader::jpeg(const render::Film& film, double scale) const {
  constexpr int quality = 92, small_quality = 82;
  const int width = std::max(1, int(std::lround(film.width * scale))),
            height = std::max(1, int(std::lround(film.height * scale)));
  const Picture picture{width, height, view_(scale < 1 ? shrink(film, width, height) : film)};
  return jpeg_bytes(picture, scale <= small_scale(film) ? small_quality : quality);
}

double small_scale(const render::Film& film) {
  constexpr double width = 320;
  return std::min(1.0, width / film.width);
}

}  // namespace drench

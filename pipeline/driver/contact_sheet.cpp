#include "pipeline/driver/contact_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "pipeline/contract/error.h"

namespace drench {

namespace {

constexpr int max_thumbnails = 64;
constexpr int thumbnail_width = 240;  // pixels
constexpr int gap = 4;                // pixels between thumbnails
constexpr uint8_t background = 24;

// Rows of five bits, the leftmost the highest: 0 ... 9 and '-'.
using Glyph = std::array<uint8_t, 7>;
constexpr std::array<Glyph, 11> font{{
    {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e},
    {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e},
    {0x0e, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1f},
    {0x1f, 0x02, 0x04, 0x02, 0x01, 0x11, 0x0e},
    {0x02, 0x06, 0x0a, 0x12, 0x1f, 0x02, 0x02},
    {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e},
    {0x06, 0x08, 0x10, 0x1e, 0x11, 0x11, 0x0e},
    {0x1f, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08},
    {0x0e, 0x11, 0x11, 0x0e, 0x11, 0x11, 0x0e},
    {0x0e, 0x11, 0x11, 0x0f, 0x01, 0x02, 0x0c},
    {0x00, 0x00, 0x00, 0x0e, 0x00, 0x00, 0x00},
}};

void fill(Picture& picture, int x0, int y0, int size, uint8_t value) {
  for (int y = std::max(y0, 0); y < std::min(y0 + size, picture.height); ++y) {
    for (int x = std::max(x0, 0); x < std::min(x0 + size, picture.width); ++x) {
      for (int c = 0; c < 3; ++c) picture.rgb[3 * (size_t(y) * picture.width + x) + c] = value;
    }
  }
}

void draw_glyph(Picture& picture, int x, int y, int scale, const Glyph& glyph, int rim,
                uint8_t value) {
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 5; ++column) {
      if (!(glyph[size_t(row)] >> (4 - column) & 1)) continue;
      fill(picture, x + column * scale - rim, y + row * scale - rim, scale + 2 * rim, value);
    }
  }
}

std::vector<NumberedImage> evenly_picked(const std::vector<NumberedImage>& images) {
  if (images.size() <= size_t(max_thumbnails)) return images;
  std::vector<NumberedImage> picked;
  for (size_t k = 0; k < size_t(max_thumbnails); ++k) {
    picked.push_back(images[k * (images.size() - 1) / (max_thumbnails - 1)]);
  }
  return picked;
}

void place(Picture& sheet, const Picture& thumbnail, int x0, int y0) {
  for (int y = 0; y < thumbnail.height; ++y) {
    std::copy_n(&thumbnail.rgb[3 * size_t(y) * thumbnail.width], 3 * thumbnail.width,
                &sheet.rgb[3 * (size_t(y0 + y) * sheet.width + x0)]);
  }
}

}  // namespace

render::Film shrink(const render::Film& film, int width, int height) {
  render::Film small{width, height, std::vector<float>(4 * size_t(width) * height)};
  for (int y = 0; y < height; ++y) {
    const int y0 = int(int64_t(y) * film.height / height);
    const int y1 = std::max(y0 + 1, int(int64_t(y + 1) * film.height / height));
    for (int x = 0; x < width; ++x) {
      const int x0 = int(int64_t(x) * film.width / width);
      const int x1 = std::max(x0 + 1, int(int64_t(x + 1) * film.width / width));
      std::array<double, 4> sum{};
      for (int v = y0; v < y1; ++v) {
        for (int u = x0; u < x1; ++u) {
          for (size_t c = 0; c < 4; ++c) sum[c] += film.rgba[4 * (size_t(v) * film.width + u) + c];
        }
      }
      for (size_t c = 0; c < 4; ++c) {
        small.rgba[4 * (size_t(y) * width + x) + c] = float(sum[c] / ((y1 - y0) * (x1 - x0)));
      }
    }
  }
  return small;
}

void draw_number(Picture& picture, int x, int y, int scale, std::string_view text) {
  for (const bool rim : {true, false}) {
    for (size_t k = 0; k < text.size(); ++k) {
      const bool digit = text[k] >= '0' && text[k] <= '9';
      const Glyph& glyph = font[digit ? size_t(text[k] - '0') : 10];
      draw_glyph(picture, x + int(k) * 6 * scale, y, scale, glyph, rim ? std::max(1, scale / 2) : 0,
                 rim ? 0 : 255);
    }
  }
}

Picture contact_sheet(const std::vector<NumberedImage>& images, const render::ViewTransform& view) {
  if (images.empty()) throw std::logic_error("contact sheet without frames");
  const std::vector<NumberedImage> shown = evenly_picked(images);
  render::Film film = render::read_exr(shown.front().file);
  const int width = std::min(film.width, thumbnail_width);
  const int height = std::max(1, int(std::lround(double(width) * film.height / film.width)));
  // Wider than high, like a screen: columns x width about 16/9 of rows x height.
  const double ratio = 16.0 / 9.0 * height / width * double(shown.size());
  const int columns = std::clamp(int(std::lround(std::sqrt(ratio))), 1, int(shown.size()));
  const int rows = (int(shown.size()) + columns - 1) / columns;
  Picture sheet{columns * (width + gap) + gap, rows * (height + gap) + gap, {}};
  sheet.rgb.assign(3 * size_t(sheet.width) * sheet.height, background);
  for (size_t k = 0; k < shown.size(); ++k) {
    if (k > 0) film = render::read_exr(shown[k].file);
    if (film.width < 1 || film.height < 1) {
      throw Error(
          fmt::format("{}: holds no pixels; render the frame again", shown[k].file.string()));
    }
    Picture thumbnail{width, height, view(shrink(film, width, height))};
    draw_number(thumbnail, 6, 6, width >= 160 ? 2 : 1, std::to_string(shown[k].frame));
    place(sheet, thumbnail, gap + int(k % size_t(columns)) * (width + gap),
          gap + int(k / size_t(columns)) * (height + gap));
  }
  return sheet;
}

WrittenFile write_contact_sheet(const std::filesystem::path& path,
                                const std::vector<NumberedImage>& images,
                                const render::ViewTransform& view) {
  const Picture sheet = contact_sheet(images, view);
  return render::write_png(path, sheet.width, sheet.height, sheet.rgb);
}

}  // namespace drench

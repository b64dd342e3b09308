// Radiance HDR: Ward, "Real Pixels", Graphics Gems II (1991), and the format's description in
// Radiance's own filefmts document.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>

#include "render/color/color.h"
#include "render/texture/picture_file.h"

namespace drench::render {

namespace {

struct Rgbe {
  uint8_t r = 0, g = 0, b = 0, e = 0;
};

class HdrReader {
 public:
  explicit HdrReader(const PictureFile& file) : file_(file) {}

  Raster read() {
    read_header();
    const Orientation orientation = read_resolution();
    Raster picture;
    picture.sample = Raster::Sample::f32;
    picture.code = ColourCode::linear(primaries_);
    // Runs hold 255 pixels or, of the old kind, any number; what is cut off is seen as it is read.
    file_.make_room(picture, uint64_t(orientation.width()), uint64_t(orientation.height()));
    std::vector<Rgbe> line(static_cast<size_t>(columns_));
    auto* texel = reinterpret_cast<float*>(picture.bytes.data());
    for (int row = 0; row < rows_; ++row) {
      read_line(line, row);
      for (int column = 0; column < columns_; ++column) {
        const V3f rgb = radiance_of(line[size_t(column)]);
        std::memcpy(texel + 3 * orientation.pixel(column, row), &rgb, sizeof rgb);
      }
    }
    if (at_ < file_.bytes().size())
      file_.warn(
          fmt::format("{} bytes after the picture's end are not read", file_.bytes().size() - at_));
    return picture;
  }

 private:
  /// Up to the end of the line, which must be there.
  std::string text_line() {
    std::string out;
    constexpr size_t max_length = 1 << 16;
    while (at_ < file_.bytes().size() && out.size() < max_length) {
      const char c = char(file_.bytes()[at_++]);
      if (c == '\n') {
        if (!out.empty() && out.back() == '\r') out.pop_back();
        return out;
      }
      out += c;
    }
    file_.fail(
        fmt::format("its header has no end or a line of more than {} bytes; write it again or "
                    "give another",
                    max_length));
  }

  enum class Sign { any, positive };
  /// Numbers after the '='. Fewer than `count`, or such that are not finite, or not above 0 where
  /// they must be: none.
  std::vector<float> numbers(const std::string& line, size_t count, Sign sign = Sign::any) {
    std::vector<float> out;
    const char* from = line.c_str() + line.find('=') + 1;
    for (char* to = nullptr; out.size() < count; from = to) {
      const float value = std::strtof(from, &to);
      if (to == from || !std::isfinite(value) || (sign == Sign::positive && value <= 0)) break;
      out.push_back(value);
    }
    if (out.size() == count) return out;
    file_.warn(
        fmt::format("the header's line '{}' is not understood and left out", line.substr(0, 60)));
    return {};
  }

  void read_header() {
    text_line();  // #?RADIANCE
    for (std::string line = text_line(); !line.empty(); line = text_line()) {
      const auto begins = [&](const char* key) { return line.rfind(key, 0) == 0; };
      if (begins("FORMAT=")) {
        xyz_ = line.find("xyze") != std::string::npos;
        if (!xyz_ && line.find("rgbe") == std::string::npos)
          file_.fail(fmt::format("its {} is not known; give 32-bit_rle_rgbe", line.substr(0, 60)));
      } else if (begins("EXPOSURE=")) {  // each multiplied the pixels by so much
        const auto found = numbers(line, 1, Sign::positive);
        if (!found.empty()) scale_ *= 1 / found[0];
      } else if (begins("COLORCORR=")) {
        const auto found = numbers(line, 3, Sign::positive);
        if (!found.empty()) scale_ *= V3f(1 / found[0], 1 / found[1], 1 / found[2]);
      } else if (begins("PRIMARIES=")) {
        read_primaries(line);
      } else if (begins("GAMMA=")) {
        const auto found = numbers(line, 1);
        if (!found.empty() && found[0] != 1)
          file_.warn(
              fmt::format("its header says {}, which is not applied: pixels of an HDR are "
                          "taken as linear",
                          line.substr(0, 60)));
      }
    }
    if (xyz_) primaries_ = rec709_chromaticities();  // X, Y and Z have none of their own
    if (!finite(scale_)) file_.fail("the exposures in its header have no finite product; mend it");
  }

  void read_primaries(const std::string& line) {
    const auto p = numbers(line, 8);
    if (p.empty()) return;
    const Imf::Chromaticities found({p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}, {p[6], p[7]});
    try {
      color_conversion(found, acescg_chromaticities());
      primaries_ = found;
    } catch (const std::exception&) {
      file_.warn("the PRIMARIES in its header span no colour space; those of Rec. 709 are taken");
    }
  }

  /// "-Y 512 +X 1024": the axis that scanlines run across first, '-' from the top or right.
  Orientation read_resolution() {
    const std::string line = text_line();
    char sign[2], axis[2];
    int count[2];
    if (std::sscanf(line.c_str(), " %c%c %d %c%c %d", &sign[0], &axis[0], &count[0], &sign[1],
                    &axis[1], &count[1]) != 6 ||
        !((axis[0] == 'Y' && axis[1] == 'X') || (axis[0] == 'X' && axis[1] == 'Y')) ||
        count[0] <= 0 || count[1] <= 0)
      file_.fail(fmt::format("'{}' is no size; it reads -Y 512 +X 1024", line.substr(0, 60)));
    rows_ = count[0];
    columns_ = count[1];
    const bool y_first = axis[0] == 'Y';
    const bool down = sign[y_first ? 0 : 1] == '-', right = sign[y_first ? 1 : 0] == '+';
    const int code = y_first ? (down ? (right ? 1 : 2) : (right ? 4 : 3))
                             : (down ? (right ? 5 : 6) : (right ? 8 : 7));
    return {code, columns_, rows_};
  }

  uint8_t byte(int row) {
    if (at_ >= file_.bytes().size())
      file_.fail(fmt::format("it is cut off in scanline {} of {}; write it again or give another",
                             row + 1, rows_));
    return uint8_t(file_.bytes()[at_++]);
  }

  Rgbe pixel(int row) {
    Rgbe out;
    for (uint8_t* to : {&out.r, &out.g, &out.b, &out.e}) *to = byte(row);
    return out;
  }

  void read_line(std::vector<Rgbe>& line, int row) {
    constexpr size_t min_length = 8, max_length = 0x7fff;  // that the new kind of runs is for
    Rgbe first = pixel(row);
    if (line.size() >= min_length && line.size() <= max_length && first.r == 2 && first.g == 2 &&
        first.b < 128) {
      if (size_t(first.b) << 8 != (line.size() & ~size_t(255)) || first.e != (line.size() & 255))
        damaged(row);
      return read_runs(line, row);
    }
    size_t x = 0;
    for (int shift = 0; x < line.size(); first = x < line.size() ? pixel(row) : first) {
      if (first.r != 1 || first.g != 1 || first.b != 1) {
        line[x++] = first;
        shift = 0;
        continue;
      }
      // The old kind: the pixel before, so many times; counts of several in a row are digits.
      const size_t count = shift > 24 ? line.size() + 1 : size_t(first.e) << shift;
      if (x == 0 || count > line.size() - x) damaged(row);
      std::fill_n(line.begin() + std::ptrdiff_t(x), count, line[x - 1]);
      x += count;
      shift += 8;
    }
  }

  /// Each component for itself, in runs of equal and of different bytes.
  void read_runs(std::vector<Rgbe>& line, int row) {
    for (uint8_t Rgbe::*component : {&Rgbe::r, &Rgbe::g, &Rgbe::b, &Rgbe::e})
      for (size_t x = 0; x < line.size();) {
        const unsigned code = byte(row);
        const size_t count = code > 128 ? code - 128 : code;
        if (count == 0 || count > line.size() - x) damaged(row);
        const uint8_t same = code > 128 ? byte(row) : 0;
        for (size_t k = 0; k < count; ++k, ++x) line[x].*component = code > 128 ? same : byte(row);
      }
  }

  [[noreturn]] void damaged(int row) const {
    file_.fail(fmt::format("scanline {} of {} is damaged; write it again or give another", row + 1,
                           rows_));
  }

  V3f radiance_of(const Rgbe& p) const {
    if (p.e == 0) return V3f(0);
    const float unit = std::ldexp(1.f, int(p.e) - (128 + 8));
    const V3f v = V3f(p.r, p.g, p.b) * unit;
    if (!xyz_) return v * scale_;
    // CIE XYZ to linear Rec. 709 of the same white, IEC 61966-2-1.
    return V3f(3.2406f * v.x - 1.5372f * v.y - 0.4986f * v.z,
               -0.9689f * v.x + 1.8758f * v.y + 0.0415f * v.z,
               0.0557f * v.x - 0.2040f * v.y + 1.0570f * v.z) *
           scale_;
  }

  const PictureFile& file_;
  size_t at_ = 0;
  int columns_ = 0, rows_ = 0;
  bool xyz_ = false;
  V3f scale_{1, 1, 1};
  Imf::Chromaticities primaries_ = rec709_chromaticities();
};

}  // namespace

Raster read_hdr(const PictureFile& file) { return HdrReader(file).read(); }

}  // namespace drench::render

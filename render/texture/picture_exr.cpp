// OpenEXR pictures of other programs: windows, layers, parts, grey and luminance-chroma. Channel
// names and windows: "Technical Introduction to OpenEXR".

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/printable.h"
#include "render/color/color.h"
#include "render/texture/picture_file.h"

namespace drench::render {

namespace {

/// No codec of OpenEXR packs much tighter than deflate's 1032 to 1, so a header that promises far
/// more pixels than the file could hold is refused before memory is taken for them.
constexpr uint64_t max_compression_ratio = 4096;
constexpr int max_rows_at_once = 256;            // read at once,
constexpr uint64_t max_bytes_at_once = 1 << 24;  // in so many bytes

/// Which channels of a file are its colours.
struct Choice {
  enum class Kind { none, rgb, grey, luminance_chroma };
  Kind kind = Kind::none;
  int part = 0;
  std::string layer;                  // "diffuse.", or none
  std::vector<std::string> channels;  // 1 or 3, luminance before chroma
};

bool has(const Imf::Header& header, const std::string& channel) {
  return header.channels().findChannel(channel) != nullptr;
}

/// The layers whose names channels of a header have, "" for those without.
std::set<std::string> layers_of(const Imf::Header& header) {
  std::set<std::string> out;
  for (auto at = header.channels().begin(); at != header.channels().end(); ++at) {
    const std::string name = at.name();
    const size_t dot = name.rfind('.');
    out.insert(dot == std::string::npos ? "" : name.substr(0, dot + 1));
  }
  return out;
}

Choice choice_in(const Imf::Header& header, int part, const std::string& layer) {
  const auto all = [&](std::initializer_list<const char*> names) {
    return std::all_of(names.begin(), names.end(),
                       [&](const char* name) { return has(header, layer + name); });
  };
  using Kind = Choice::Kind;
  for (const auto& names :
       {std::array{"R", "G", "B"}, std::array{"r", "g", "b"}, std::array{"red", "green", "blue"}})
    if (all({names[0], names[1], names[2]}))
      return {Kind::rgb, part, layer, {layer + names[0], layer + names[1], layer + names[2]}};
  if (all({"X", "Y"})) return {};  // a position or direction
  if (all({"Y", "RY", "BY"}))
    return {Kind::luminance_chroma, part, layer, {layer + "Y", layer + "RY", layer + "BY"}};
  if (all({"Y"})) return {Kind::grey, part, layer, {layer + "Y"}};
  return {};
}

/// "part 1 'depth' of 2: Z; part ...".
std::string contents_of(const Imf::MultiPartInputFile& exr) {
  constexpr size_t max_names = 12;
  constexpr int max_parts = 8;
  std::vector<std::string> parts;
  for (int p = 0; p < std::min(exr.parts(), max_parts); ++p) {
    const Imf::Header& header = exr.header(p);
    std::vector<std::string> names;
    for (auto at = header.channels().begin(); at != header.channels().end(); ++at)
      names.push_back(std::string(at.name()).substr(0, 64));
    const size_t count = names.size();
    names.resize(std::min(count, max_names));
    const std::string more =
        count > max_names ? fmt::format(" and {} more", count - max_names) : "";
    parts.push_back(exr.parts() == 1
                        ? fmt::format("{}{}", fmt::join(names, ", "), more)
                        : fmt::format("part {}{}: {}{}", p + 1,
                                      header.hasName() ? " '" + header.name() + "'" : "",
                                      fmt::join(names, ", "), more));
  }
  const std::string more =
      exr.parts() > max_parts ? fmt::format("; and {} parts more", exr.parts() - max_parts) : "";
  return fmt::format("{}{}", fmt::join(parts, "; "), more);
}

/// The bytes of a file, as the library reads them.
class ByteStream : public Imf::IStream {
 public:
  explicit ByteStream(const PictureFile& file)
      : Imf::IStream(file.path().c_str()), bytes_(file.bytes()) {}

  bool read(char to[], int count) override {
    if (count < 0 || uint64_t(count) > bytes_.size() - std::min<uint64_t>(at_, bytes_.size()))
      throw std::runtime_error("the file ends too early");
    std::memcpy(to, bytes_.data() + at_, size_t(count));
    at_ += uint64_t(count);
    return at_ < bytes_.size();
  }
  uint64_t tellg() override { return at_; }
  void seekg(uint64_t offset) override { at_ = offset; }

 private:
  const std::vector<std::byte>& bytes_;
  uint64_t at_ = 0;
};

class ExrReader {
 public:
  explicit ExrReader(const PictureFile& file) : file_(file), stream_(file), exr_(stream_) {}

  Raster read() {
    choose();
    const Imf::Header& header = exr_.header(choice_.part);
    data_ = header.dataWindow();
    display_ = header.displayWindow();
    seen_ = {{std::max(data_.min.x, display_.min.x), std::max(data_.min.y, display_.min.y)},
             {std::min(data_.max.x, display_.max.x), std::min(data_.max.y, display_.max.y)}};
    check_windows();
    check_channels(header);
    if (file_.is_sky() && Imf::hasEnvmap(header) && Imf::envmap(header) == Imf::ENVMAP_CUBE)
      file_.fail(
          "its header says that it is a cube map; convert it to latitude and longitude "
          "(exrenvmap -l)");
    Raster picture;
    picture.code = ColourCode::linear(Imf::hasChromaticities(header) ? Imf::chromaticities(header)
                                                                     : rec709_chromaticities());
    check_primaries(picture);
    if (choice_.kind == Choice::Kind::luminance_chroma)
      read_luminance_chroma(picture);
    else
      read_channels(picture, header);
    file_.warn_of_alpha(transparent_);
    return picture;
  }

 private:
  static uint64_t width_of(const Imath::Box2i& box) {
    return uint64_t(std::max<int64_t>(int64_t(box.max.x) - box.min.x + 1, 0));
  }
  static uint64_t height_of(const Imath::Box2i& box) {
    return uint64_t(std::max<int64_t>(int64_t(box.max.y) - box.min.y + 1, 0));
  }

  /// Colours without a layer of the first part that has some, else of a layer.
  void choose() {
    std::vector<Choice> plain, layered;
    std::vector<std::string> others;
    for (int p = 0; p < exr_.parts(); ++p) {
      const Imf::Header& header = exr_.header(p);
      if (header.hasType() && Imf::isDeepData(header.type())) continue;
      for (const std::string& layer : layers_of(header))
        if (const Choice found = choice_in(header, p, layer); found.kind != Choice::Kind::none)
          (layer.empty() ? plain : layered).push_back(found);
    }
    if (plain.empty() && layered.empty()) return choose_single();
    std::stable_sort(layered.begin(), layered.end(), [](const Choice& a, const Choice& b) {
      return is_beauty(a.layer) > is_beauty(b.layer);
    });
    choice_ = plain.empty() ? layered.front() : plain.front();
    if (choice_.part == 0 && choice_.layer.empty() && plain.size() == 1) return;
    file_.warn(
        fmt::format("{} of it is read as its colours; it holds {}. Write a file with R, G "
                    "and B alone if others are meant",
                    described(choice_), contents_of(exr_)));
  }

  /// Layers that programs name so hold the finished picture.
  static bool is_beauty(const std::string& layer) {
    for (const char* name : {"Combined.", "beauty.", "Beauty.", "rgba.", "RGBA.", "rgb.", "C."})
      if (layer.ends_with(name)) return true;
    return false;
  }

  static std::string described(const Choice& choice) {
    return fmt::format("{} of part {}", fmt::join(choice.channels, ", "), choice.part + 1);
  }

  /// A file of one channel, whatever its name, is grey.
  void choose_single() {
    const Imf::ChannelList& channels = exr_.header(0).channels();
    const bool deep = exr_.header(0).hasType() && Imf::isDeepData(exr_.header(0).type());
    auto second = channels.begin();
    if (exr_.parts() == 1 && !deep && second != channels.end() && ++second == channels.end()) {
      choice_ = {Choice::Kind::grey, 0, "", {channels.begin().name()}};
      file_.warn(fmt::format("its one channel, {}, is read as grey", choice_.channels[0]));
      return;
    }
    file_.fail(
        fmt::format("it has no colours R, G and B, nor grey Y, in a part that is not deep; "
                    "it holds {}. Write it again with them or give another",
                    contents_of(exr_)));
  }

  void check_windows() const {
    const auto text = [](const Imath::Box2i& b) {
      return fmt::format("[{}, {}] to [{}, {}]", b.min.x, b.min.y, b.max.x, b.max.y);
    };
    if (seen_.isEmpty())
      file_.fail(fmt::format("its pixels, {}, lie outside its display window, {}; write it again",
                             text(data_), text(display_)));
    const uint64_t size = file_.bytes().size();
    const uint64_t width = width_of(data_), height = height_of(data_);
    if (width > 1 << 20 || height > 1 << 20 || width * height / max_compression_ratio > size)
      file_.fail(
          fmt::format("its {} x {} pixels cannot come from {} bytes; it is cut off or "
                      "forged. Write it again or give another",
                      width, height, size));
  }

  /// UINT is for what is counted, such as objects. Chroma alone may be coarser, as its writers are.
  void check_channels(const Imf::Header& header) const {
    for (const std::string& name : choice_.channels) {
      const Imf::Channel& channel = *header.channels().findChannel(name);
      if (channel.type == Imf::UINT)
        file_.fail(
            fmt::format("its channel {} holds integers, which are no light; write it as half or "
                        "float",
                        name));
      const bool chroma =
          choice_.kind == Choice::Kind::luminance_chroma && name != choice_.channels.front();
      const int step = chroma ? 2 : 1;
      if (channel.xSampling != step || channel.ySampling != step)
        file_.fail(
            fmt::format("its channel {} has one sample for {} x {} pixels, where only {} x {} is "
                        "read; write it again as R, G and B at full resolution",
                        name, channel.xSampling, channel.ySampling, step, step));
    }
  }

  void check_primaries(Raster& picture) const {
    try {
      color_conversion(picture.code.primaries, acescg_chromaticities());
    } catch (const Error&) {
      if (!file_.is_data())
        file_.warn("its chromaticities span no colour space; those of Rec. 709 are taken");
      picture.code.primaries = rec709_chromaticities();
    }
  }

  /// Copies what is seen of a row of the data window to where it belongs.
  void place_row(Raster& picture, int y, const std::byte* row) const {
    const size_t pixel = size_t(picture.colours) * bytes_of(picture.sample);
    const size_t to =
        size_t(y - display_.min.y) * width_of(display_) + size_t(seen_.min.x - display_.min.x);
    std::memcpy(picture.bytes.data() + to * pixel, row + size_t(seen_.min.x - data_.min.x) * pixel,
                width_of(seen_) * pixel);
  }

  /// @param first  of a row of the data window, whose alphas `alpha` gives
  template <class Alpha>
  void count_transparent(size_t first, const Alpha& alpha) {
    const size_t from = first + size_t(seen_.min.x - data_.min.x);
    for (size_t at = from; at < from + width_of(seen_); ++at) transparent_ += alpha(at) < 1 ? 1 : 0;
  }

  /// What the library keeps of all channels: a row of tiles, or the lines of its largest chunks.
  uint64_t taken_by_library(const Imf::Header& header) const {
    constexpr uint64_t chunk_lines = 256;
    const uint64_t lines =
        header.hasTileDescription() ? uint64_t(header.tileDescription().ySize) : chunk_lines;
    uint64_t pixel = 0;
    for (auto at = header.channels().begin(); at != header.channels().end(); ++at)
      pixel += at.channel().type == Imf::HALF ? 2 : 4;
    return width_of(data_) * lines * pixel;
  }

  void read_channels(Raster& picture, const Imf::Header& header) {
    bool half = true;
    for (const std::string& name : choice_.channels)
      half = half && header.channels().findChannel(name)->type == Imf::HALF;
    picture.sample = half ? Raster::Sample::f16 : Raster::Sample::f32;
    picture.colours = picture.stride = int(choice_.channels.size());
    const Imf::PixelType type = half ? Imf::HALF : Imf::FLOAT;
    const size_t sample = bytes_of(picture.sample), pixel = sample * choice_.channels.size();
    const size_t width = width_of(data_), row = width * pixel;
    const int at_once = std::clamp(int(max_bytes_at_once / row), 1, max_rows_at_once);
    const uint64_t buffer = uint64_t(at_once) * (row + width * sizeof(float));
    file_.make_room(picture, width_of(display_), height_of(display_),
                    buffer + taken_by_library(header));
    std::vector<std::byte> rows(size_t(at_once) * row);
    std::vector<float> alpha;
    const std::string alpha_name = choice_.layer + "A";
    if (const Imf::Channel* a = header.channels().findChannel(alpha_name);
        a && a->xSampling == 1 && a->ySampling == 1 && choice_.channels[0] != alpha_name)
      alpha.resize(size_t(at_once) * width);
    Imf::InputPart part(exr_, choice_.part);
    for (int y = seen_.min.y; y <= seen_.max.y; y += at_once) {
      const int last = std::min(y + at_once - 1, seen_.max.y);
      const Imath::Box2i box({data_.min.x, y}, {data_.max.x, last});
      Imf::FrameBuffer frame;
      for (size_t c = 0; c < choice_.channels.size(); ++c)
        frame.insert(choice_.channels[c],
                     Imf::Slice::Make(type, rows.data() + c * sample, box, pixel, row));
      if (!alpha.empty())
        frame.insert(alpha_name, Imf::Slice::Make(Imf::FLOAT, alpha.data(), box, sizeof(float),
                                                  width * sizeof(float)));
      part.setFrameBuffer(frame);
      part.readPixels(y, last);
      for (int r = y; r <= last; ++r) {
        const size_t k = size_t(r - y);
        place_row(picture, r, rows.data() + k * row);
        if (!alpha.empty()) count_transparent(k * width, [&](size_t at) { return alpha[at]; });
      }
    }
  }

  /// The library's own conversion, in half.
  void read_luminance_chroma(Raster& picture) {
    if (choice_.part != 0)
      file_.fail(
          fmt::format("part {} is luminance-chroma, which is read from the first part only; "
                      "write it alone or as R, G and B",
                      choice_.part + 1));
    const std::string layer =
        choice_.layer.empty() ? "" : choice_.layer.substr(0, choice_.layer.size() - 1);
    picture.sample = Raster::Sample::f16;
    const size_t width = width_of(data_);
    file_.make_room(picture, width_of(display_), height_of(display_),
                    64 * width * sizeof(Imf::Rgba) + taken_by_library(exr_.header(0)));
    ByteStream stream(file_);
    Imf::RgbaInputFile exr(stream, layer);
    std::vector<Imf::Rgba> row(width);
    std::vector<half> rgb(3 * width);
    for (int y = seen_.min.y; y <= seen_.max.y; ++y) {
      exr.setFrameBuffer(row.data() - data_.min.x - std::ptrdiff_t(y) * std::ptrdiff_t(width), 1,
                         width);
      exr.readPixels(y);
      for (size_t x = 0; x < width; ++x)
        rgb[3 * x] = row[x].r, rgb[3 * x + 1] = row[x].g, rgb[3 * x + 2] = row[x].b;
      count_transparent(0, [&](size_t at) { return float(row[at].a); });
      place_row(picture, y, reinterpret_cast<const std::byte*>(rgb.data()));
    }
  }

  const PictureFile& file_;
  ByteStream stream_;
  Imf::MultiPartInputFile exr_;
  Choice choice_;
  Imath::Box2i data_, display_, seen_;
  uint64_t transparent_ = 0;
};

/// Bytes of an attribute of a type whose size OpenEXR knows by itself, and does not read.
std::optional<size_t> size_of_type(const std::string& type) {
  static const std::map<std::string, size_t> sizes{
      {"box2i", 16},      {"box2f", 16},    {"chromaticities", 32},
      {"compression", 1}, {"double", 8},    {"deepImageState", 1},
      {"envmap", 1},      {"float", 4},     {"int", 4},
      {"keycode", 28},    {"lineOrder", 1}, {"m33f", 36},
      {"m33d", 72},       {"m44f", 64},     {"m44d", 128},
      {"rational", 8},    {"timecode", 8},  {"tiledesc", 9},
      {"v2i", 8},         {"v2f", 8},       {"v2d", 16},
      {"v3i", 12},        {"v3f", 12},      {"v3d", 24}};
  const auto found = sizes.find(type);
  if (found == sizes.end()) return {};
  return found->second;
}

/// Walks the headers of an EXR before OpenEXR does, which takes the memory that an attribute asks
/// for before it finds that the file ends.
class HeaderWalk {
 public:
  explicit HeaderWalk(const PictureFile& file) : file_(file), bytes_(file.bytes()) {}

  void check() {
    // Headers of parts follow each other; what is not a name ends them, or the reader says why not.
    while (at_ < bytes_.size() && bytes_[at_] != std::byte(0)) {
      const std::string name = text(), type = text();
      if (at_ + sizeof(int32_t) > bytes_.size()) return;
      const int32_t size = number();
      if (size < 0 || size_t(size) > bytes_.size() - at_)
        fail(name, fmt::format("asks for {} bytes where {} are left", size, bytes_.size() - at_));
      const std::optional<size_t> real = real_size(type, size_t(size));
      if (real && *real != size_t(size))
        fail(name, fmt::format("of type {} says that it has {} bytes, and has {}",
                               printable(type, Lines::one), size, *real));
      at_ += size_t(size);
      const bool parts = (std::to_integer<int>(bytes_[5]) & 0x10) != 0;
      if (parts && at_ < bytes_.size() && bytes_[at_] == std::byte(0)) ++at_;
    }
  }

 private:
  [[noreturn]] void fail(const std::string& name, const std::string& why) const {
    file_.fail(
        fmt::format("it is damaged or cut off: its attribute {} {}; write it again or give "
                    "another",
                    printable(name, Lines::one), why));
  }
  std::string text() {
    std::string found;
    while (at_ < bytes_.size() && bytes_[at_] != std::byte(0)) found += char(bytes_[at_++]);
    ++at_;
    return found;
  }
  int32_t number() {
    int32_t value = 0;
    std::memcpy(&value, &bytes_[at_], sizeof value);
    at_ += sizeof value;
    return value;
  }

  /// What OpenEXR will read of an attribute, whatever it says; none: what it says.
  std::optional<size_t> real_size(const std::string& type, size_t size) {
    if (type != "chlist" && type != "preview") return size_of_type(type);
    const size_t begin = at_, end = at_ + size;
    size_t real = 0;
    if (type == "preview") {
      if (size < 8) return 8;
      const auto width = uint32_t(number()), height = uint32_t(number());
      real = size_t(8) + 4 * size_t(width) * height;
    } else {
      constexpr size_t channel = 16;  // bytes behind a name
      while (at_ < end && bytes_[at_] != std::byte(0)) text(), at_ += channel;
      real = at_ + 1 - begin;
    }
    at_ = begin;
    return real;
  }

  const PictureFile& file_;
  const std::vector<std::byte>& bytes_;
  size_t at_ = 8;  // after the magic number and the version
};

}  // namespace

Raster read_exr_picture(const PictureFile& file) {
  try {
    HeaderWalk(file).check();
    return ExrReader(file).read();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    file.fail(
        fmt::format("it is damaged or cut off: {}; write it again or give another", e.what()));
  }
}

}  // namespace drench::render

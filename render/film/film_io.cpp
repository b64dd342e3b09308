// Films to and from OpenEXR, and 8-bit pictures to PNG.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <new>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "render/color/color.h"
#include "render/film/exr_memory.h"
#include "render/film/film.h"

namespace drench::render {

namespace {

constexpr uint64_t max_pixels = uint64_t(1) << 27;  // 2 GiB as float RGBA
/// No codec of OpenEXR packs much tighter than deflate's 1032 to 1, so a header that promises far
/// more pixels than the file could hold is refused before memory is taken for them.
constexpr uint64_t max_compression_ratio = 4096;
constexpr float max_half = 65504;

[[noreturn]] void fail_read(const std::filesystem::path& path, const std::string& why) {
  throw Error(fmt::format("{}: cannot read this EXR: {}; write it again or give another",
                          path.string(), why));
}

/// Values as half, those that no half holds brought to the nearest it does and counted.
std::vector<half> to_half(const std::vector<float>& values, uint64_t& clamped) {
  std::vector<half> out(values.size());
  for (size_t k = 0; k < values.size(); ++k) {
    const float value = values[k];
    const bool fits = std::abs(value) <= max_half;
    clamped += fits ? 0 : 1;
    out[k] = fits ? value : std::isnan(value) ? 0.f : std::copysign(max_half, value);
  }
  return out;
}

void check_film(const Film& film) {
  const size_t pixels = size_t(std::max(film.width, 0)) * size_t(std::max(film.height, 0));
  if (pixels == 0 || film.rgba.size() != 4 * pixels)
    throw Error(fmt::format("a film of {} x {} pixels with {} values cannot be written", film.width,
                            film.height, film.rgba.size()));
  for (const FilmLayer& layer : film.layer)
    if (layer.value.size() != layer.channel.size() * pixels)
      throw Error(fmt::format("layer '{}' has {} values for {} x {} pixels of {} channels",
                              layer.name, layer.value.size(), film.width, film.height,
                              layer.channel.size()));
}

/// Channels of a picture and the values they are written from.
class Channels {
 public:
  Channels(Imf::Header& header, const Film& film) : header_(header) {
    add("", {"R", "G", "B", "A"}, FilmLayer::Precision::half, film.rgba);
    for (const FilmLayer& layer : film.layer)
      add(layer.name + ".", layer.channel, layer.precision, layer.value);
  }
  const Imf::FrameBuffer& buffer() const { return buffer_; }
  uint64_t clamped() const { return clamped_; }

 private:
  void add(const std::string& prefix, const std::vector<std::string>& names,
           FilmLayer::Precision precision, const std::vector<float>& values) {
    if (precision == FilmLayer::Precision::full) return add_as(Imf::FLOAT, prefix, names, values);
    halves_.push_back(to_half(values, clamped_));
    add_as(Imf::HALF, prefix, names, halves_.back());
  }

  template <class Value>
  void add_as(Imf::PixelType type, const std::string& prefix, const std::vector<std::string>& names,
              const std::vector<Value>& values) {
    const size_t stride = names.size() * sizeof(Value);
    for (size_t c = 0; c < names.size(); ++c) {
      const std::string name = prefix + names[c];
      if (header_.channels().findChannel(name))
        throw Error(fmt::format("two layers have a channel {}; give one another name", name));
      header_.channels().insert(name, Imf::Channel(type));
      // Imf takes no pointer to const, but writing a file only reads.
      const Imath::Box2i& window = header_.dataWindow();
      buffer_.insert(name, Imf::Slice::Make(type, const_cast<Value*>(values.data() + c), window,
                                            stride, stride * size_t(window.size().x + 1)));
    }
  }

  Imf::Header& header_;
  Imf::FrameBuffer buffer_;
  std::deque<std::vector<half>> halves_;
  uint64_t clamped_ = 0;
};

/// Layers of a file by the names of its channels, with room for their values; beauty aside.
std::vector<FilmLayer> layers_of(const Imf::Header& header, size_t pixels) {
  std::map<std::string, FilmLayer> layers;
  for (auto at = header.channels().begin(); at != header.channels().end(); ++at) {
    const std::string channel = at.name();
    const size_t dot = channel.rfind('.');
    if (dot == std::string::npos) continue;
    FilmLayer& layer = layers[channel.substr(0, dot)];
    layer.name = channel.substr(0, dot);
    layer.channel.push_back(channel.substr(dot + 1));
    layer.precision =
        at.channel().type == Imf::FLOAT ? FilmLayer::Precision::full : FilmLayer::Precision::half;
  }
  std::vector<FilmLayer> out;
  for (auto& [name, layer] : layers) {
    layer.value.resize(layer.channel.size() * pixels);
    out.push_back(std::move(layer));
  }
  return out;
}

/// The window of pixels that a header promises, checked against the file that made the promise.
Imath::Box2i checked_window(const std::filesystem::path& path, const Imf::Header& header) {
  const Imath::Box2i window = header.dataWindow();
  const int64_t width = int64_t(window.max.x) - window.min.x + 1;
  const int64_t height = int64_t(window.max.y) - window.min.y + 1;
  if (width <= 0 || height <= 0 || width > 1 << 20 || height > 1 << 20 ||
      uint64_t(width * height) > max_pixels)
    fail_read(path, fmt::format("{} x {} pixels (at most {})", width, height, max_pixels));
  if (uint64_t(width * height) / max_compression_ratio > std::filesystem::file_size(path))
    fail_read(path, fmt::format("{} x {} pixels cannot come from {} bytes", width, height,
                                std::filesystem::file_size(path)));
  return window;
}

Film read_pixels(const std::filesystem::path& path) {
  Imf::InputFile file(path.c_str());
  const Imf::Header& header = file.header();
  const Imath::Box2i window = checked_window(path, header);
  Film film{.width = window.max.x - window.min.x + 1,
            .height = window.max.y - window.min.y + 1,
            .rgba = {}};
  for (const char* name : {"R", "G", "B"}) {
    const Imf::Channel* channel = header.channels().findChannel(name);
    if (!channel) fail_read(path, fmt::format("it has no channel {}", name));
    if (channel->xSampling != 1 || channel->ySampling != 1)
      fail_read(path, fmt::format("channel {} is subsampled", name));
  }
  film.rgba.resize(size_t(4) * film.width * film.height);
  Imf::FrameBuffer buffer;
  const size_t x_stride = 4 * sizeof(float), y_stride = x_stride * size_t(film.width);
  const char* names[4] = {"R", "G", "B", "A"};
  for (int c = 0; c < 4; ++c)
    buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, film.rgba.data() + c, window, x_stride,
                                             y_stride, 1, 1, c == 3 ? 1.0 : 0.0));
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);

  const Imf::Chromaticities from =
      Imf::hasChromaticities(header) ? Imf::chromaticities(header) : rec709_chromaticities();
  if (from == acescg_chromaticities()) return film;
  const ColorMatrix matrix = color_conversion(from, acescg_chromaticities());
  for (size_t p = 0; p < film.rgba.size(); p += 4) {
    const V3f rgb = matrix({film.rgba[p], film.rgba[p + 1], film.rgba[p + 2]});
    for (int c = 0; c < 3; ++c) film.rgba[p + c] = rgb[c];
  }
  return film;
}

FilmWindow film_window(const Imf::Header& header) {
  const Imath::Box2i &all = header.displayWindow(), &part = header.dataWindow();
  if (all == part) return {};
  return {part.min.x, part.min.y, all.size().x + 1, all.size().y + 1};
}

Film read_all(const std::filesystem::path& path) {
  Imf::InputFile file(path.c_str());
  const Imf::Header& header = file.header();
  const Imath::Box2i window = checked_window(path, header);
  Film film{.width = window.size().x + 1,
            .height = window.size().y + 1,
            .rgba = {},
            .window = film_window(header)};
  const size_t pixels = size_t(film.width) * size_t(film.height);
  film.rgba.resize(4 * pixels);
  film.layer = layers_of(header, pixels);
  Imf::FrameBuffer buffer;
  const auto add = [&](const std::string& prefix, const std::vector<std::string>& names,
                       std::vector<float>& value) {
    const size_t stride = names.size() * sizeof(float);
    for (size_t c = 0; c < names.size(); ++c)
      buffer.insert(prefix + names[c], Imf::Slice::Make(Imf::FLOAT, value.data() + c, window,
                                                        stride, stride * size_t(film.width)));
  };
  add("", {"R", "G", "B", "A"}, film.rgba);
  for (FilmLayer& layer : film.layer) add(layer.name + ".", layer.channel, layer.value);
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  for (auto at = header.begin(); at != header.end(); ++at)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute()))
      film.header.emplace_back(at.name(), text->value());
  return film;
}

/// What a reader gives. @throws Error with the path for whatever it throws
template <class Read>
Film read_or_fail(const std::filesystem::path& path, const Read& read) {
  if (!std::filesystem::is_regular_file(path)) fail_read(path, "there is no such file");
  try {
    return read();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    fail_read(path, e.what());
  }
}

}  // namespace

WrittenFile write_exr(const std::filesystem::path& path, const Film& film,
                      const std::vector<std::pair<std::string, std::string>>& attributes) {
  check_film(film);
  Imf::Header header(film.width, film.height);
  const FilmWindow& window = film.window;
  if (window.frame_width > 0) {
    header.displayWindow() = {{0, 0}, {window.frame_width - 1, window.frame_height - 1}};
    header.dataWindow() = {{window.x, window.y},
                           {window.x + film.width - 1, window.y + film.height - 1}};
  }
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, acescg_chromaticities());
  for (const auto* entries : {&attributes, &film.header})
    for (const auto& [name, value] : *entries) {
      if (name.empty() || name.size() > 255 || header.find(name.c_str()) != header.end())
        throw Error(
            fmt::format("'{}' cannot name an EXR attribute: use 1 to 255 characters and no "
                        "name of OpenEXR's own",
                        name));
      header.insert(name, Imf::StringAttribute(value));
    }
  const Channels channels(header, film);
  if (channels.clamped() > 0)
    log_file_warning("render", path,
                     fmt::format("{} values beyond half clamped", channels.clamped()));
  std::string bytes;
  try {
    bytes = exr_bytes(header, channels.buffer());
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    throw Error(fmt::format("{}: cannot write the frame: {}", path.string(), e.what()));
  }
  return write_file_whole(path, bytes);
}

Film read_layers(const std::filesystem::path& path) {
  return read_or_fail(path, [&] { return read_all(path); });
}

Film read_exr(const std::filesystem::path& path) {
  return read_or_fail(path, [&] { return read_pixels(path); });
}

WrittenFile write_png(const std::filesystem::path& path, int width, int height,
                      const std::vector<uint8_t>& rgb) {
  if (width <= 0 || height <= 0 || rgb.size() != size_t(3) * width * height)
    throw Error(fmt::format("{}: a picture of {} x {} pixels with {} bytes cannot be written",
                            path.string(), width, height, rgb.size()));
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(width);
  image.height = png_uint_32(height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr))
    throw Error(fmt::format("{}: cannot write the picture: {}", path.string(), image.message));
  bytes.resize(size);
  return write_file_whole(path, bytes);
}

}  // namespace drench::render

#include "render/denoise/noisy_frame.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <string_view>

#include "pipeline/contract/error.h"
#include "render/denoise/oidn.h"

namespace drench::render {

namespace {

constexpr std::string_view layer_prefix = "denoise_";
constexpr const char* units_entry = "denoise_units";  // entry of the header

using Plane = NoisyPicture::Plane;
using Precision = FilmLayer::Precision;
using Planes = std::vector<std::pair<std::string, Plane*>>;

struct StoredLayer {
  std::string name;
  Precision precision;
  Planes planes;
};

/// Names of the layers and their channels, and where a picture has their values. All but variances
/// of the light, which may be too large for 16 bits, are noisier than these round them.
std::vector<StoredLayer> layout_of(NoisyPicture& picture) {
  const auto rgb = [](Plane(&colour)[3]) {
    return Planes{{"R", &colour[0]}, {"G", &colour[1]}, {"B", &colour[2]}};
  };
  const auto numbered = [](std::vector<Plane>& planes) {
    Planes out;
    for (size_t f = 0; f < planes.size(); ++f)
      out.emplace_back(fmt::format("F{:02}", f), &planes[f]);
    return out;
  };
  return {{"denoise_first", Precision::half, rgb(picture.half[0])},
          {"denoise_second", Precision::half, rgb(picture.half[1])},
          {"denoise_variance", Precision::full, rgb(picture.variance)},
          {"denoise_guide", Precision::half, numbered(picture.feature)},
          {"denoise_scatter", Precision::half, numbered(picture.feature_variance)},
          {"denoise_motion",
           Precision::half,
           {{"beforeX", &picture.motion[0][0]},
            {"beforeY", &picture.motion[0][1]},
            {"afterX", &picture.motion[1][0]},
            {"afterY", &picture.motion[1][1]}}}};
}

float as_half(float value) {
  constexpr float max_half = HALF_MAX;
  return Imath::half(std::clamp(value, -max_half, max_half));
}

[[noreturn]] void fail(const std::string& why) {
  throw Error(fmt::format("a noisy frame {}; render it again", why));
}

const FilmLayer& layer_of(const Film& film, const std::string& name) {
  const auto found = std::find_if(film.layer.begin(), film.layer.end(),
                                  [&](const FilmLayer& layer) { return layer.name == name; });
  if (found == film.layer.end()) fail(fmt::format("has no layer {}", name));
  return *found;
}

std::vector<float> units_of(const Film& film) {
  std::vector<float> units;
  for (const auto& [name, text] : film.header) {
    if (name != units_entry) continue;
    std::istringstream words(text);
    for (std::string word; words >> word;) units.push_back(std::strtof(word.c_str(), nullptr));
  }
  return units;
}

NoisyPicture read_picture(const std::filesystem::path& file, int width, int height) {
  const Film film = read_layers(file);
  if (film.width != width || film.height != height)
    throw Error(fmt::format("{}: {} x {} pixels beside a frame of {} x {}; render it again",
                            file.string(), film.width, film.height, width, height));
  return picture_of(film);
}

}  // namespace

std::vector<Plane> denoised_by(Denoiser denoiser, NoisyPicture picture, Neighbours neighbours) {
  if (denoiser == Denoiser::oidn) return OpenImageDenoise().denoise(picture);
  return denoise(std::move(picture), std::move(neighbours));
}

void put_clean(Film& film, const std::vector<Plane>& clean) {
  FilmLayer noisy{"noisy", {"R", "G", "B"}, FilmLayer::Precision::half, {}};
  for (size_t p = 0; p < clean[0].size(); ++p)
    for (size_t c = 0; c < 3; ++c) {
      noisy.value.push_back(film.rgba[4 * p + c]);
      film.rgba[4 * p + c] = clean[c][p];
    }
  film.layer.push_back(std::move(noisy));
}

void round_as_stored(NoisyPicture& picture) {
  for (const auto& [name, precision, planes] : layout_of(picture)) {
    if (precision == Precision::full) continue;
    for (const auto& [channel, plane] : planes)
      for (float& value : *plane) value = as_half(value);
  }
}

void add_picture(Film& film, NoisyPicture picture) {
  for (const auto& [name, precision, planes] : layout_of(picture)) {
    FilmLayer layer{name, {}, precision, {}};
    layer.value.resize(planes.size() * picture.half[0][0].size());
    for (size_t c = 0; c < planes.size(); ++c) {
      layer.channel.push_back(planes[c].first);
      for (size_t p = 0; p < planes[c].second->size(); ++p)
        layer.value[planes.size() * p + c] = (*planes[c].second)[p];
    }
    film.layer.push_back(std::move(layer));
  }
  std::string units;
  for (size_t f = 0; f < picture.feature.size(); ++f)
    units += fmt::format("{}{:.9g}", units.empty() ? "" : " ", picture.unit(f));
  film.header.emplace_back(units_entry, units);
}

NoisyPicture picture_of(const Film& film) {
  NoisyPicture picture;
  picture.width = film.width;
  picture.height = film.height;
  picture.feature_unit = units_of(film);
  picture.feature.resize(layer_of(film, "denoise_guide").channel.size());
  picture.feature_variance.resize(picture.feature.size());
  if (picture.feature_unit.size() != picture.feature.size())
    fail(fmt::format("has {} units of {} guides", picture.feature_unit.size(),
                     picture.feature.size()));
  const size_t pixels = size_t(film.width) * size_t(film.height);
  for (const auto& [name, precision, planes] : layout_of(picture)) {
    const FilmLayer& layer = layer_of(film, name);
    for (const auto& [channel, plane] : planes) {
      const auto found = std::find(layer.channel.begin(), layer.channel.end(), channel);
      if (found == layer.channel.end()) fail(fmt::format("has no channel {}.{}", name, channel));
      const size_t c = size_t(found - layer.channel.begin()), stride = layer.channel.size();
      plane->resize(pixels);
      for (size_t p = 0; p < pixels; ++p) (*plane)[p] = layer.value[stride * p + c];
    }
  }
  return picture;
}

Film denoised_film(const std::filesystem::path& frame,
                   const std::vector<std::filesystem::path>& before,
                   const std::vector<std::filesystem::path>& after, Denoiser denoiser) {
  Film film = read_layers(frame);
  NoisyPicture picture = picture_of(film);
  Neighbours neighbours;
  for (const std::filesystem::path& file : before)
    neighbours.before.push_back(read_picture(file, film.width, film.height));
  for (const std::filesystem::path& file : after)
    neighbours.after.push_back(read_picture(file, film.width, film.height));
  std::erase_if(film.layer,
                [](const FilmLayer& layer) { return layer.name.starts_with(layer_prefix); });
  std::erase_if(film.header, [](const auto& entry) { return entry.first == units_entry; });
  put_clean(film, denoised_by(denoiser, std::move(picture), std::move(neighbours)));
  return film;
}

}  // namespace drench::render

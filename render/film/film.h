#pragma once
// A rendered frame, and the files it is kept in.

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/contract/files/files.h"

namespace drench::render {

/// Channels of a frame besides the beauty, in the EXR as NAME.CHANNEL.
struct FilmLayer {
  enum class Precision { half, full };  // in the file, 16 or 32 bits
  std::string name;
  std::vector<std::string> channel;
  Precision precision = Precision::half;
  std::vector<float> value;  // channels x width x height, a pixel's side by side
};

/// Where a film lies in the whole frame; a size of 0: it is the whole frame.
struct FilmWindow {
  int x = 0, y = 0;  // of its top left pixel
  int frame_width = 0, frame_height = 0;
};

/// One rendered frame or a part of it: beauty in linear ACEScg with alpha, row-major from the top
/// left.
struct Film {
  int width = 0, height = 0;
  std::vector<float> rgba;  // 4 x width x height
  FilmWindow window{};
  std::vector<FilmLayer> layer{};
  std::vector<std::pair<std::string, std::string>> header{};  // entries that layers need
};

/// Half RGBA, layers, ZIP, chromaticities of ACEScg, and the given attributes as strings ("shot",
/// "frame", "seed", "samples", "version", "key.*"); no times or dates, so that equal inputs give
/// equal files.
WrittenFile write_exr(const std::filesystem::path& path, const Film& film,
                      const std::vector<std::pair<std::string, std::string>>& attributes);
/// A file of write_exr with all its layers, and its attributes as the film's header.
/// @throws Error if it cannot be read.
Film read_layers(const std::filesystem::path& path);
/// RGB(A) of a frame as Film (missing alpha is 1), its data window alone; what comes from outside
/// is read by picture.h. @throws Error if unreadable.
Film read_exr(const std::filesystem::path& path);

WrittenFile write_png(const std::filesystem::path& path, int width, int height,
                      const std::vector<uint8_t>& rgb);

}  // namespace drench::render

#pragma once
// Meshes + camera + lights -> film -> EXR.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/frames.h"
#include "pipeline/contract/shot/shot.h"

namespace drench::render {

/// The moving geometry of one frame. Blurred from stored velocity: x + t v / fps over the shutter.
struct FrameGeometry {
  TriangleMesh fluid;                     // closed; material shot.fluid.material; may be empty
  std::vector<ClothFrame> cloth;          // material of the shot's cloth of the same name
  std::vector<ObstacleFrame> obstacle{};  // material of the shot's obstacle of the same name
  FoamFrame foam{};                       // small white spheres; may be empty
};

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

struct RenderStats {
  uint64_t camera_samples = 0, rays = 0;
  double relative_mse = 0;  // of the frame, as its samples tell; 0 with fewer than 16 a pixel
  double photon_error = 0;  // the part of it that photons have
  double cpu_s = 0;         // of the whole process during the call
  /// m: photons blur caustics by that at most, of several rounds in the mean; 0: all is right in
  /// the mean.
  double photon_radius = 0;
  double walked = 0;  // fraction of photons' light that manifold walks (manifold.h) would find
};

/// Path-traces one frame. The same bits for any thread count and tile order.
/// @param progress  called with the finished fraction 0..1; may throw to stop.
/// @throws Error for a map or texture that cannot be read, or a light or camera without extent.
Film render_frame(const Shot& shot, int frame, const FrameGeometry& geometry,
                  RenderStats* stats = nullptr, const std::function<void(double)>& progress = {});

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

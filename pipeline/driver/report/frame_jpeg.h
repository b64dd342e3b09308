#pragma once
// Frames of an output folder as JPEG.

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/driver/job.h"
#include "render/display/view_transform.h"

namespace drench {

/// Reads rendered frames of a folder and shows them as the shot says.
class FrameReader {
 public:
  explicit FrameReader(const Job& job)
      : folder_(job.folder), shot_(job.targets.shot), view_(job.shot.view) {}

  bool has(int frame) const { return std::filesystem::exists(file(frame)); }
  /// @throws Error if there is none that can be read
  render::Film read(int frame) const { return render::read_exr(file(frame)); }
  /// Scaled down in linear light. @param scale  at most 1
  std::vector<uint8_t> jpeg(const render::Film& film, double scale) const;

 private:
  std::filesystem::path file(int frame) const;

  const std::filesystem::path folder_;
  const std::string shot_;
  const render::ViewTransform view_;
};

/// That of a frame in the contact sheet.
double small_scale(const render::Film& film);

}  // namespace drench

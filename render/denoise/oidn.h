#pragma once
// Open Image Denoise, loaded when a shot asks for it: Drench is neither built nor linked with it,
// and runs where there is none.

#include <memory>
#include <string>
#include <vector>

#include "render/denoise/denoise.h"

namespace drench::render {

class OpenImageDenoise {
 public:
  /// @param file  the library; empty: by its usual names, where the loader looks
  /// @throws Error if it cannot be loaded, lacks a function or does not run on this machine
  explicit OpenImageDenoise(const std::string& file = {});
  ~OpenImageDenoise();

  /// As 20301 for 2.3.1.
  int version() const;

  /// By its filter for ray tracing, from all samples, albedo and normal; on the CPU, so that no
  /// frame depends on the GPU that a machine has.
  /// @return the three colours
  /// @throws Error with the library's own words
  std::vector<NoisyPicture::Plane> denoise(const NoisyPicture& picture) const;

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace drench::render

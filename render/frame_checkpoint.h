#pragma once
// The samples of a frame in work, on disk, so that a stopped frame goes on where it was.

#include <vector>

#include "render/layers.h"
#include "render/matte.h"
#include "render/options.h"
#include "render/sample_plan.h"

namespace drench {

/// What the samples of a picture have added up to.
struct Sums {
  std::vector<PixelSum> pixel;
  LayerFilm layers;
  PlateFilm plate;
  SamplePlan plan;
  std::vector<PixelSum> without_plate{};  // with catchers, once settled

  /// Takes what shadow catchers leave to the plate out of the picture.
  void settle() {
    if (plate.has_catchers()) without_plate = plate.beauty(pixel);
  }
  /// Sums of the beauty.
  const std::vector<PixelSum>& beauty() const {
    return plate.has_catchers() ? without_plate : pixel;
  }
};

/// @throws Error if the file cannot be written.
void write_checkpoint(const FrameCheckpoint& checkpoint, Sums& sums);
/// @return whether `sums` are those of the checkpoint now; else there is none that is whole and of
/// these inputs, and they are as they were.
bool read_checkpoint(const FrameCheckpoint& checkpoint, Sums& sums);

}  // namespace drench

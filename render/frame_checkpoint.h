#pragma once
// The samples of a frame in work, on disk, so that a stopped frame goes on where it was.

#include <vector>

#include "render/layers.h"
#include "render/options.h"
#include "render/sample_plan.h"

namespace drench {

/// What the samples of a picture have added up to.
struct Sums {
  std::vector<PixelSum> pixel;
  LayerFilm layers;
  SamplePlan plan;
};

/// @throws Error if the file cannot be written.
void write_checkpoint(const FrameCheckpoint& checkpoint, Sums& sums);
/// @return whether `sums` are those of the checkpoint now; else there is none that is whole and of
/// these inputs, and they are as they were.
bool read_checkpoint(const FrameCheckpoint& checkpoint, Sums& sums);

}  // namespace drench

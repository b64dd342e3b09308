#pragma once
// The samples of a frame in work, on disk, so that a stopped frame goes on where it was.

#include <algorithm>
#include <vector>

#include "render/film/layers.h"
#include "render/film/matte.h"
#include "render/integrator/photon_rounds.h"
#include "render/integrator/sample_plan.h"
#include "render/options.h"

namespace drench::render {

/// What the samples of a picture have added up to.
struct Sums {
  std::vector<PixelSum> pixel;
  LayerFilm layers;
  PlateFilm plate;
  SamplePlan plan;
  PhotonRounds rounds;
  std::vector<PixelSum> split{};          // of what photons bring; empty without any
  std::vector<PixelSum> without_plate{};  // with catchers, once settled

  /// Takes what shadow catchers leave to the plate out of the picture.
  void settle() {
    if (plate.has_catchers()) without_plate = plate.beauty(pixel);
  }
  /// Decides on the next pass. @return whether there is one
  bool begin_pass(double photon_error) {
    if (!plan.next(beauty(), photon_error)) return false;
    rounds.begin_pass(plan.fraction());
    return true;
  }
  /// Samples that a pixel shall have after a round of this pass.
  int wanted(size_t p, int round) const { return rounds.upto(round, plan.wanted(p)); }
  /// The largest of them.
  int most_wanted(int round) const {
    int most = 0;
    for (size_t p = 0; p < pixel.size(); ++p) most = std::max(most, wanted(p, round));
    return most;
  }
  bool is_through(int round) const {
    for (size_t p = 0; p < pixel.size(); ++p)
      if (pixel[p].samples() < wanted(p, round)) return false;
    return true;
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

}  // namespace drench::render

#pragma once
// How many camera samples each pixel gets.

#include <vector>

#include "render/film/checkpoint_archive.h"
#include "render/film/pixel_sum.h"

namespace drench::render {

/// The relative error of a pixel as its samples tell: mean over the colours of variance of the mean
/// / (mean^2 + 0.01). Its mean over a picture is the picture's relative MSE.
float relative_error(const PixelSum& pixel);

/// What the error of photons adds to a picture's relative MSE: it is alike in all of a pixel's
/// samples that find the same photons, so that their scatter does not tell it. A half of the
/// photons differs from the other as the whole differs from what many more would bring.
/// @param split  of each pixel, of GatheredLight; empty: there are no photons
double photon_error(const std::vector<PixelSum>& pixels, const std::vector<PixelSum>& split);

/// With a target, samples go where they lower the mean of the pixels' errors most: in proportion to
/// the scatter of a pixel's samples (Neyman 1934, "On the Two Different Aspects of the
/// Representative Method"). It is told by the samples themselves, in passes: each looks at all
/// pixels first and no more than doubles a pixel's number.
class SamplePlan {
 public:
  /// @param most    samples of a pixel
  /// @param target  relative MSE of the picture; 0: all pixels get `most`
  SamplePlan(int width, int height, int most, double target);

  /// Decides on the next pass. Samples are to bring what the target leaves beside the error of
  /// photons, or half of it: they would be without end where that alone is above the target.
  /// @return whether there is one
  bool next(const std::vector<PixelSum>& pixels, double photon_error = 0);
  /// Samples that a pixel shall have after this pass.
  int wanted(size_t pixel) const { return wanted_.empty() ? most_ : wanted_[pixel]; }
  void archive(CheckpointArchive& file);
  /// Samples that all pixels will have after this pass, over the most.
  double fraction() const;
  /// How many all pixels are expected to have at the end.
  double expected() const { return expected_; }

 private:
  static constexpr int first_samples = 32;  // samples before the scatter is trusted
  static constexpr int radius = 3;          // pixels around one that tell its scatter with it

  std::vector<float> deviations(const std::vector<PixelSum>& pixels) const;

  int width_, height_, most_;
  double target_, expected_;
  int passes_ = 0;
  std::vector<int> wanted_;
};

}  // namespace drench::render

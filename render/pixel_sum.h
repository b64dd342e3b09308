#pragma once
// What a pixel's camera samples add up to, and how far their mean may be off.

#include <algorithm>
#include <cstdint>

#include "render/vector.h"

namespace drench {

/// Sums of a pixel in the order of its samples. Every kBatch of them are a stratified set of their
/// own (a net of the Sobol sequence), so that the scatter of the batches' means tells the error of
/// stratified sampling; single samples would tell that of random ones, which is larger.
class PixelSum {
 public:
  static constexpr int kBatch = 8;

  void add(const V3f& radiance, float alpha) {
    for (int c = 0; c < 3; ++c) batch_[c] += radiance[c];
    alpha_ += alpha;
    if (++samples_ % kBatch != 0) return;
    for (int c = 0; c < 3; ++c) {
      sum_[c] += batch_[c];
      if (samples_ / kBatch % 2 != 0) odd_[c] += batch_[c];
      squares_[c] += batch_[c] * batch_[c];
      batch_[c] = 0;
    }
  }

  int samples() const { return samples_; }
  int batches() const { return samples_ / kBatch; }
  /// Mean of a colour, or for channel 3 of alpha.
  float mean(int channel) const {
    return float((channel < 3 ? sum_[channel] + batch_[channel] : alpha_) / samples_);
  }
  /// Variance of the mean of a colour; 0 while there are fewer than two batches.
  float variance(int channel) const {
    const double n = batches();
    if (n < 2) return 0;
    const double mean = sum_[channel] / n;
    const double of_batch = std::max(0., squares_[channel] / n - mean * mean) * n / (n - 1);
    return float(of_batch / (n * kBatch * kBatch));
  }
  /// Means of a colour by every second batch: two pictures of independent errors. From two batches
  /// on.
  float half(int which, int channel) const {
    const int odd = (batches() + 1) / 2;
    return float(which == 0 ? odd_[channel] / (odd * kBatch)
                            : (sum_[channel] - odd_[channel]) / ((batches() - odd) * kBatch));
  }

 private:
  double sum_[3] = {0, 0, 0}, batch_[3] = {0, 0, 0}, squares_[3] = {0, 0, 0}, alpha_ = 0;
  double odd_[3] = {0, 0, 0};  // of the first batch, the third, ...
  int samples_ = 0;
};

}  // namespace drench

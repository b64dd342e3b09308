#pragma once
// What a pixel's camera samples add up to, and how far their mean may be off.

#include "render/vector.h"

namespace drench::render {

/// Sums of a pixel in the order of its samples. They are kept in 4 to 7 whole batches too, of 8
/// samples at first; two become one when there are 8. A batch is a net of the Sobol sequence,
/// stratified of its own, so that the scatter of the batches' means tells the error of stratified
/// sampling; single samples would tell that of random ones, which is far larger.
class PixelSum {
 public:
  static constexpr int smallest_batch = 8;  // samples of the smallest

  void add(const V3f& radiance, float alpha) {
    for (int c = 0; c < 3; ++c) {
      sum_[c] += radiance[c];
      batch_[whole_][c] += radiance[c];
    }
    alpha_ += alpha;
    // size_ is a power of two
    if ((++samples_ & (size_ - 1)) == 0 && ++whole_ == max_batches) merge();
  }

  int samples() const { return samples_; }
  /// Mean of a colour, or for channel 3 of alpha.
  float mean(int channel) const { return float((channel < 3 ? sum_[channel] : alpha_) / samples_); }
  /// Variance of the mean of a colour; 0 while there are fewer than two batches.
  float variance(int channel) const {
    if (whole_ < 2) return 0;
    double mean = 0, square = 0;
    for (int b = 0; b < whole_; ++b) mean += double(batch_[b][channel]) / whole_;
    for (int b = 0; b < whole_; ++b) {
      const double off = batch_[b][channel] - mean;
      square += off * off;
    }
    return float(square / (whole_ - 1) / (double(size_) * samples_));
  }
  /// Of the mean's square what its batches have in common: that less the mean's variance. Right in
  /// the mean, if not above 0; 0 while there are fewer than two batches.
  float common_square(int channel) const {
    return whole_ < 2 ? 0 : mean(channel) * mean(channel) - variance(channel);
  }
  /// This, less a fraction of the colours that the same samples add up to elsewhere.
  PixelSum less(const PixelSum& other, const V3f& fraction) const {
    PixelSum out = *this;
    for (int c = 0; c < 3; ++c) out.sum_[c] -= double(fraction[c]) * other.sum_[c];
    for (int b = 0; b < max_batches; ++b) out.batch_[b] -= other.batch_[b] * fraction;
    return out;
  }
  /// Means of a colour by every second batch: two pictures of independent errors. From two batches
  /// on.
  float half(int which, int channel) const {
    double sum = 0;
    for (int b = which; b < whole_; b += 2) sum += batch_[b][channel];
    const int batches = (whole_ + 1 - which) / 2;
    return float(sum / (size_ * batches));
  }

 private:
  static constexpr int max_batches = 8;

  void merge() {
    for (int b = 0; b < max_batches; ++b)
      batch_[b] = b < max_batches / 2 ? batch_[2 * b] + batch_[2 * b + 1] : V3f(0);
    whole_ = max_batches / 2;
    size_ *= 2;
  }

  double sum_[3] = {0, 0, 0}, alpha_ = 0;
  V3f batch_[max_batches] = {V3f(0), V3f(0), V3f(0), V3f(0), V3f(0), V3f(0), V3f(0), V3f(0)};
  int samples_ = 0, size_ = smallest_batch, whole_ = 0;
};

}  // namespace drench::render

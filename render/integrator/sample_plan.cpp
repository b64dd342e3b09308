#include "render/integrator/sample_plan.h"

#include <algorithm>
#include <cmath>

namespace drench::render {

float relative_error(const PixelSum& pixel) {
  float sum = 0;
  for (int c = 0; c < 3; ++c) {
    const float mean = pixel.mean(c);
    sum += pixel.variance(c) / (mean * mean + 0.01f);
  }
  return sum / 3;
}

double photon_error(const std::vector<PixelSum>& pixels, const std::vector<PixelSum>& split) {
  double sum = 0;
  for (size_t p = 0; p < split.size(); ++p)
    for (int c = 0; c < 3; ++c) {
      const float mean = pixels[p].mean(c);
      sum += split[p].common_square(c) / (mean * mean + 0.01f) / 3;
    }
  return std::max(0., sum / double(pixels.size()));
}

SamplePlan::SamplePlan(int width, int height, int most, double target)
    : width_(width),
      height_(height),
      most_(most),
      target_(target),
      expected_(double(most) * width * height) {}

/// Standard deviation of one sample of each pixel, in units of its mean, from the pixels around it:
/// a pixel alone knows too little of its own, and nothing of a bright dot beside it.
std::vector<float> SamplePlan::deviations(const std::vector<PixelSum>& pixels) const {
  std::vector<float> one(pixels.size()), rows(pixels.size()), out(pixels.size());
  for (size_t p = 0; p < pixels.size(); ++p)
    one[p] = relative_error(pixels[p]) * float(pixels[p].samples());
  const auto mean_around = [](int k, int count, auto&& value) {
    const int from = std::max(k - radius, 0), to = std::min(k + radius, count - 1);
    float sum = 0;
    for (int j = from; j <= to; ++j) sum += value(j);
    return sum / float(to - from + 1);
  };
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      rows[size_t(y) * width_ + x] =
          mean_around(x, width_, [&](int k) { return one[size_t(y) * width_ + k]; });
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      out[size_t(y) * width_ + x] =
          std::sqrt(mean_around(y, height_, [&](int k) { return rows[size_t(k) * width_ + x]; }));
  return out;
}

void SamplePlan::archive(CheckpointArchive& file) {
  file.value(passes_), file.value(expected_);
  uint64_t planned = wanted_.size();
  file.value(planned);
  wanted_.resize(planned == 0 ? 0 : size_t(width_) * height_);
  file.column(wanted_);
}

double SamplePlan::fraction() const {
  if (wanted_.empty()) return 1;
  double sum = 0;
  for (const int wanted : wanted_) sum += wanted;
  return sum / (double(most_) * double(wanted_.size()));
}

bool SamplePlan::next(const std::vector<PixelSum>& pixels, double photon_error) {
  if (passes_++ == 0) {
    if (target_ > 0 && most_ > first_samples)
      wanted_.assign(size_t(width_) * height_, first_samples);
    return true;
  }
  if (wanted_.empty()) return false;
  const std::vector<float> deviation = deviations(pixels);
  const auto samples = [&](size_t p, double per_deviation) {
    return std::clamp(per_deviation * deviation[p], double(pixels[p].samples()), double(most_));
  };
  const auto error = [&](double per_deviation) {
    double sum = 0;
    for (size_t p = 0; p < pixels.size(); ++p)
      sum += double(deviation[p]) * deviation[p] / samples(p, per_deviation);
    return sum / double(pixels.size());
  };
  const double target = std::max(target_ - photon_error, target_ / 2);
  // The number that meets the target lies where the error has fallen to it: found by halving.
  double low = 0, high = 1;
  while (error(high) > target && high < 1e12) low = high, high *= 4;
  for (int k = 0; k < 20; ++k) {
    const double middle = (low + high) / 2;
    (error(middle) > target ? low : high) = middle;
  }
  bool more = false;
  expected_ = 0;
  for (size_t p = 0; p < pixels.size(); ++p) {
    const double all = samples(p, high);
    expected_ += all;
    const int now = pixels[p].samples();
    const int whole = int(std::ceil(all / PixelSum::smallest_batch)) * PixelSum::smallest_batch;
    wanted_[p] = std::min({whole, 2 * now, most_});
    more |= wanted_[p] > now;
  }
  return more;
}

}  // namespace drench::render

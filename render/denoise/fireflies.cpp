#include "render/denoise/fireflies.h"

#include <cmath>
#include <functional>

namespace drench::render {

namespace {

using Plane = NoisyPicture::Plane;

/// A firefly is this many times brighter than all but a few of the 24 pixels around it, and its own
/// samples do not know its brightness to this relative error. Many may lie together that one or two
/// samples found each: these are compared with the median around them, and brought down to it.
constexpr float firefly_ratio = 4, firefly_error = 0.25f, one_sample_error = 0.9f;
constexpr size_t few = 3, half_of_window = 12;
/// A glint is this many times brighter than half of what is around it, with its noise; if few of
/// its samples found it, which then lie loosely together, than half of what is farther around. So
/// it is over the mean of the picture: before black anything would be. It and the 24 pixels around
/// it know their brightness to this part, which takes seven samples; or one within that reach is
/// such a glint: the ends of a streak, where its pixels are few.
constexpr float glint_ratio = 16, glint_error = 0.4f;
constexpr int window_radius = 2;
/// What a pixel of a glint shows stays there if noise is less than this part of it in the squares
/// of 25 pixels, which takes three samples of each. Else it is spread to the pixels beside it by a
/// normal distribution of so many pixels: more would blur edges more than it fills holes (decision
/// 0105).
constexpr float shape_noise = 0.5f, spread_deviation = 0.65f;
constexpr int block_size = 8;  // pixels a side; 3 x 3 blocks are what is farther around

/// The value that only `count` of a list are above.
float beyond(std::vector<float>& list, size_t count) {
  std::nth_element(list.begin(), list.begin() + long(count), list.end(), std::greater<>());
  return std::max(list[count], 0.f);
}

struct Firefly {
  float factor = 1;     // takes it down to what is around it
  bool bright = false;  // as a glint is
  bool glint = false;
  bool localized = false;  // its position is known
};

class Brightness {
 public:
  explicit Brightness(const NoisyPicture& picture)
      : width_(picture.width),
        height_(picture.height),
        columns_((width_ + block_size - 1) / block_size),
        mean_(picture.variance[0].size(), 0.f),
        scatter_(mean_) {
    for (size_t p = 0; p < mean_.size(); ++p) {
      for (const auto& half : picture.half)
        for (const Plane& colour : half) mean_[p] += colour[p] / 6;
      for (const Plane& variance : picture.variance) scatter_[p] += variance[p] / 3;
      scatter_[p] = std::sqrt(scatter_[p]);
    }
    for (int y = 0; y < height_; y += block_size)
      for (int x = 0; x < width_; x += block_size) block_.push_back(median_of_block(x, y));
    for (const float median : block_) picture_ += median / float(block_.size());
  }

  Firefly classify(size_t p, const std::vector<size_t>& window) {
    if (window.size() <= half_of_window + 1) return {};
    around_.clear(), noisy_.clear();
    for (const size_t q : window) {
      if (q == p) continue;
      around_.push_back(mean_[q]);
      noisy_.push_back(mean_[q] + scatter_[q]);
    }
    const bool one_sample = !(scatter_[p] < one_sample_error * mean_[p]);
    const float usual = beyond(around_, half_of_window);
    if (!one_sample && mean_[p] > glint_ratio * std::max(beyond(noisy_, half_of_window), picture_))
      return {.factor = usual / mean_[p],
              .bright = true,
              .glint = seen(window),
              .localized = knows_shape(window)};
    if (scatter_[p] < firefly_error * mean_[p]) return {};
    const float far = std::max(farther_around(p), picture_);
    if (mean_[p] > glint_ratio * far)
      return {.factor = std::min(usual, far) / mean_[p],
              .bright = true,
              .glint = seen(window),
              .localized = knows_shape(window)};
    if (one_sample) return {mean_[p] > firefly_ratio * usual ? usual / mean_[p] : 1};
    const float most = firefly_ratio * beyond(around_, few);
    return {mean_[p] > most ? most / mean_[p] : 1};
  }

 private:
  /// Whether samples enough met what a pixel shows.
  bool seen(const std::vector<size_t>& window) const {
    float sum = 0, square = 0;
    for (const size_t q : window) {
      sum += mean_[q];
      square += scatter_[q] * scatter_[q];
    }
    return square < glint_error * glint_error * sum * sum;
  }

  /// Whether what pixels differ by is more than their noise.
  bool knows_shape(const std::vector<size_t>& window) const {
    float light = 0, noise = 0;
    for (const size_t q : window) {
      light += mean_[q] * mean_[q];
      noise += scatter_[q] * scatter_[q];
    }
    return noise < shape_noise * light;
  }

  float median_of_block(int x0, int y0) {
    noisy_.clear();
    for (int y = y0; y < std::min(y0 + block_size, height_); ++y)
      for (int x = x0; x < std::min(x0 + block_size, width_); ++x) {
        const size_t p = size_t(y) * size_t(width_) + size_t(x);
        noisy_.push_back(mean_[p] + scatter_[p]);
      }
    return beyond(noisy_, noisy_.size() / 2);
  }
  float farther_around(size_t p) {
    const int column = int(p % size_t(width_)) / block_size,
              row = int(p / size_t(width_)) / block_size;
    noisy_.clear();
    for (int r = row - 1; r <= row + 1; ++r)
      for (int c = column - 1; c <= column + 1; ++c)
        if (r >= 0 && c >= 0 && c < columns_ && r * block_size < height_)
          noisy_.push_back(block_[size_t(r * columns_ + c)]);
    return beyond(noisy_, noisy_.size() / 2);
  }

  int width_, height_, columns_;  // columns of blocks
  Plane mean_, scatter_;          // over colours; of a half's mean
  Plane block_;                   // medians of the blocks, with noise
  float picture_ = 0;             // their mean
  std::vector<float> around_, noisy_;
};

/// Makes glints of what is as bright and hangs together with one.
void grow_glints(int width, int height, std::vector<Firefly>& fireflies) {
  std::vector<size_t> found;
  for (size_t p = 0; p < fireflies.size(); ++p)
    if (fireflies[p].glint) found.push_back(p);
  while (!found.empty()) {
    const size_t p = found.back();
    found.pop_back();
    for_each_near(width, height, p, window_radius, [&](size_t q) {
      if (fireflies[q].glint || !fireflies[q].bright) return;
      fireflies[q].glint = true;
      found.push_back(q);
    });
  }
}

/// Adds what a glint lost to its pixel and those beside it: one whose lamp few samples of each
/// pixel find is a handful of white dots as it is.
void spread(int width, int height, size_t p, const V3f& lost, std::vector<Plane>& out) {
  const auto weight = [&](size_t q) {
    const float x = float(q % size_t(width)) - float(p % size_t(width));
    const float y = float(q / size_t(width)) - float(p / size_t(width));
    return std::exp(-(x * x + y * y) / (2 * spread_deviation * spread_deviation));
  };
  float sum = 0;
  for_each_near(width, height, p, 1, [&](size_t q) { sum += weight(q); });
  for_each_near(width, height, p, 1, [&](size_t q) {
    for (int c = 0; c < 3; ++c) out[size_t(c)][q] += lost[c] * (weight(q) / sum);
  });
}

}  // namespace

std::vector<Plane> suppress_fireflies(NoisyPicture& picture) {
  Brightness bright(picture);
  std::vector<Firefly> fireflies(picture.variance[0].size());
  for_each_window(picture.width, picture.height, window_radius,
                  [&](size_t p, const auto& window) { fireflies[p] = bright.classify(p, window); });
  grow_glints(picture.width, picture.height, fireflies);
  std::vector<Plane> glints(3, Plane(fireflies.size(), 0.f));
  for (size_t p = 0; p < fireflies.size(); ++p) {
    const Firefly& o = fireflies[p];
    if (o.factor == 1) continue;
    V3f lost(0);
    for (size_t c = 0; c < 3; ++c) {
      Plane &first = picture.half[0][c], &second = picture.half[1][c];
      if (o.glint) lost[int(c)] = (1 - o.factor) * 0.5f * (first[p] + second[p]);
      first[p] *= o.factor, second[p] *= o.factor;
      picture.variance[c][p] *= o.factor * o.factor;
    }
    if (o.localized)
      for (size_t c = 0; c < 3; ++c) glints[c][p] += lost[int(c)];
    else if (o.glint)
      spread(picture.width, picture.height, p, lost, glints);
  }
  return glints;
}

}  // namespace drench::render

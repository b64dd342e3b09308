#include "render/outliers.h"

#include <cmath>
#include <functional>

namespace drench {

namespace {

using Plane = NoisyPicture::Plane;

/// Luck is this many times brighter than all but a few of the 24 pixels around it, and its own
/// samples do not know its brightness to this part; many may lie together that one or two samples
/// found each.
constexpr float kLuck = 4, kUnsure = 0.25f, kOneSample = 0.9f;
constexpr size_t kFew = 3, kHalf = 12;
/// A glint is this many times brighter than half of what is around it, with its noise; if few of
/// its samples found it, which then lie loosely together, than half of what is farther around. So
/// it is over the mean of the picture: before black anything would be. It and the 24 pixels around
/// it know their brightness to this part, which takes seven samples; or one within that reach is
/// such a glint: the ends of a streak, where its pixels are few.
constexpr float kGlint = 16, kSeen = 0.4f;
constexpr int kReach = 2;
constexpr int kBlock = 8;  // pixels a side; 3 x 3 blocks are what is farther around

/// The value that only `few` of a list are above.
float beyond(std::vector<float>& list, size_t few) {
  std::nth_element(list.begin(), list.begin() + long(few), list.end(), std::greater<>());
  return std::max(list[few], 0.f);
}

struct Outlier {
  float factor = 1;     // takes it down to what is around it
  bool bright = false;  // as a glint is
  bool glint = false;
};

class Brightness {
 public:
  explicit Brightness(const NoisyPicture& picture)
      : width_(picture.width),
        height_(picture.height),
        columns_((width_ + kBlock - 1) / kBlock),
        mean_(picture.variance[0].size(), 0.f),
        scatter_(mean_) {
    for (size_t p = 0; p < mean_.size(); ++p) {
      for (const auto& half : picture.half)
        for (const Plane& colour : half) mean_[p] += colour[p] / 6;
      for (const Plane& variance : picture.variance) scatter_[p] += variance[p] / 3;
      scatter_[p] = std::sqrt(scatter_[p]);
    }
    for (int y = 0; y < height_; y += kBlock)
      for (int x = 0; x < width_; x += kBlock) block_.push_back(median_of_block(x, y));
    for (const float median : block_) picture_ += median / float(block_.size());
  }

  Outlier judge(size_t p, const std::vector<size_t>& window) {
    if (window.size() <= kHalf + 1) return {};
    around_.clear(), noisy_.clear();
    for (const size_t q : window) {
      if (q == p) continue;
      around_.push_back(mean_[q]);
      noisy_.push_back(mean_[q] + scatter_[q]);
    }
    const bool one_sample = !(scatter_[p] < kOneSample * mean_[p]);
    const float usual = beyond(around_, kHalf);
    if (!one_sample && mean_[p] > kGlint * std::max(beyond(noisy_, kHalf), picture_))
      return {usual / mean_[p], true, seen(window)};
    if (scatter_[p] < kUnsure * mean_[p]) return {};
    const float far = std::max(farther_around(p), picture_);
    if (mean_[p] > kGlint * far) return {std::min(usual, far) / mean_[p], true, seen(window)};
    const float most = kLuck * beyond(around_, one_sample ? kHalf : kFew);
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
    return square < kSeen * kSeen * sum * sum;
  }

  float median_of_block(int x0, int y0) {
    noisy_.clear();
    for (int y = y0; y < std::min(y0 + kBlock, height_); ++y)
      for (int x = x0; x < std::min(x0 + kBlock, width_); ++x) {
        const size_t p = size_t(y) * size_t(width_) + size_t(x);
        noisy_.push_back(mean_[p] + scatter_[p]);
      }
    return beyond(noisy_, noisy_.size() / 2);
  }
  float farther_around(size_t p) {
    const int column = int(p % size_t(width_)) / kBlock, row = int(p / size_t(width_)) / kBlock;
    noisy_.clear();
    for (int r = row - 1; r <= row + 1; ++r)
      for (int c = column - 1; c <= column + 1; ++c)
        if (r >= 0 && c >= 0 && c < columns_ && r * kBlock < height_)
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
void follow_glints(int width, int height, std::vector<Outlier>& outliers) {
  std::vector<size_t> found;
  for (size_t p = 0; p < outliers.size(); ++p)
    if (outliers[p].glint) found.push_back(p);
  while (!found.empty()) {
    const size_t p = found.back();
    found.pop_back();
    for_each_near(width, height, p, kReach, [&](size_t q) {
      if (outliers[q].glint || !outliers[q].bright) return;
      outliers[q].glint = true;
      found.push_back(q);
    });
  }
}

}  // namespace

std::vector<Plane> tame_outliers(NoisyPicture& picture) {
  Brightness bright(picture);
  std::vector<Outlier> outliers(picture.variance[0].size());
  for_each_window(picture.width, picture.height, kReach,
                  [&](size_t p, const auto& window) { outliers[p] = bright.judge(p, window); });
  follow_glints(picture.width, picture.height, outliers);
  std::vector<Plane> glints(3, Plane(outliers.size(), 0.f));
  for (size_t p = 0; p < outliers.size(); ++p) {
    const Outlier& o = outliers[p];
    if (o.factor == 1) continue;
    for (size_t c = 0; c < 3; ++c) {
      Plane &first = picture.half[0][c], &second = picture.half[1][c];
      if (o.glint) glints[c][p] = (1 - o.factor) * 0.5f * (first[p] + second[p]);
      first[p] *= o.factor, second[p] *= o.factor;
      picture.variance[c][p] *= o.factor * o.factor;
    }
  }
  return glints;
}

}  // namespace drench

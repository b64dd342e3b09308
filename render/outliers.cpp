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
/// A glint is this many times brighter than half of what is around it, with its noise. It and what
/// touches it know their brightness to this part, which takes three samples.
constexpr float kGlint = 16, kSeen = 0.5f;

/// The value that only `few` of a list are above.
float beyond(std::vector<float>& list, size_t few) {
  std::nth_element(list.begin(), list.begin() + long(few), list.end(), std::greater<>());
  return std::max(list[few], 0.f);
}

struct Outlier {
  float factor = 1;  // takes it down to what is around it
  bool glint = false;
};

class Brightness {
 public:
  explicit Brightness(const NoisyPicture& picture)
      : width_(size_t(picture.width)), mean_(picture.variance[0].size(), 0.f), scatter_(mean_) {
    for (size_t p = 0; p < mean_.size(); ++p) {
      for (const auto& half : picture.half)
        for (const Plane& colour : half) mean_[p] += colour[p] / 6;
      for (const Plane& variance : picture.variance) scatter_[p] += variance[p] / 3;
      scatter_[p] = std::sqrt(scatter_[p]);
    }
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
    if (!one_sample && mean_[p] > kGlint * beyond(noisy_, kHalf))
      return {beyond(around_, kHalf) / mean_[p], seen(p, window)};
    if (scatter_[p] < kUnsure * mean_[p]) return {};
    const float most = kLuck * beyond(around_, one_sample ? kHalf : kFew);
    return {mean_[p] > most ? most / mean_[p] : 1};
  }

 private:
  /// Whether samples enough met what a pixel shows.
  bool seen(size_t p, const std::vector<size_t>& window) const {
    float sum = 0, square = 0;
    for (const size_t q : window) {
      if (apart(p % width_, q % width_) > 1 || apart(p / width_, q / width_) > 1) continue;
      sum += mean_[q];
      square += scatter_[q] * scatter_[q];
    }
    return square < kSeen * kSeen * sum * sum;
  }

  static size_t apart(size_t a, size_t b) { return a > b ? a - b : b - a; }

  size_t width_;
  Plane mean_, scatter_;  // over colours; of a half's mean
  std::vector<float> around_, noisy_;
};

}  // namespace

std::vector<Plane> tame_outliers(NoisyPicture& picture) {
  Brightness bright(picture);
  std::vector<Plane> glints(3, Plane(picture.variance[0].size(), 0.f));
  for_each_window(picture.width, picture.height, 2, [&](size_t p, const auto& window) {
    const auto [factor, glint] = bright.judge(p, window);
    if (factor == 1) return;
    for (size_t c = 0; c < 3; ++c) {
      Plane &first = picture.half[0][c], &second = picture.half[1][c];
      if (glint) glints[c][p] = (1 - factor) * 0.5f * (first[p] + second[p]);
      first[p] *= factor, second[p] *= factor;
      picture.variance[c][p] *= factor * factor;
    }
  });
  return glints;
}

}  // namespace drench

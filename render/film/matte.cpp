#include "render/film/matte.h"

#include <algorithm>

namespace drench::render {

namespace {

constexpr float almost_one = 1 - 1e-3f;  // this and more is what smoothing leaves of 1

float ratio(float with, float without) { return without > 0 ? std::min(1.f, with / without) : 1.f; }

}  // namespace

V3f PlateFilm::noisy_shadow_ratio(size_t pixel) const {
  V3f left;
  for (int c = 0; c < 3; ++c) left[c] = ratio(with_[pixel].mean(c), without_[pixel].mean(c));
  return left;
}

V3f PlateFilm::shadow_ratio(size_t pixel) const {
  if (!has_catchers()) return V3f(1);
  return smooth_shadows_.empty() ? noisy_shadow_ratio(pixel) : at(smooth_shadows_, pixel);
}

V3f PlateFilm::seen(size_t pixel) const {
  if (caught_.empty()) return V3f(0);
  const V3f here = mean_of(caught_[pixel]) * shadow_ratio(pixel);
  return smooth_plate_.empty() ? here : here + at(smooth_plate_, pixel) - mean_of(plate(pixel));
}

std::vector<PixelSum> PlateFilm::beauty(const std::vector<PixelSum>& all) const {
  std::vector<PixelSum> out;
  out.reserve(all.size());
  for (size_t p = 0; p < all.size(); ++p) out.push_back(all[p].less(without_[p], shadow_ratio(p)));
  return out;
}

NoisyPicture PlateFilm::shadows(int width, int height) const {
  NoisyPicture picture;
  picture.width = width;
  picture.height = height;
  for (size_t p = 0; p < with_.size(); ++p) {
    const PixelSum difference = with_[p].less(without_[p], noisy_shadow_ratio(p));
    for (int c = 0; c < 3; ++c) {
      for (int h = 0; h < 2; ++h)
        picture.half[h][c].push_back(ratio(with_[p].half(h, c), without_[p].half(h, c)));
      const float without = without_[p].mean(c);  // the variance of W / O to first order
      picture.variance[c].push_back(without > 0 ? 2 * difference.variance(c) / (without * without)
                                                : 0);
    }
  }
  return picture;
}

NoisyPicture PlateFilm::coverage(int width, int height) const {
  std::vector<PixelSum> sums;
  sums.reserve(background_.size());
  for (size_t p = 0; p < background_.size(); ++p) sums.push_back(plate(p));
  NoisyPicture picture = noisy_picture(sums);
  picture.width = width;
  picture.height = height;
  return picture;
}

void PlateFilm::smooth_shadows(std::vector<NoisyPicture::Plane> smooth) {
  for (size_t p = 0; p < with_.size(); ++p) {
    const V3f noisy = noisy_shadow_ratio(p);
    for (size_t c = 0; c < 3; ++c)
      if (smooth[c][p] > almost_one && noisy[int(c)] == 1) smooth[c][p] = 1;
  }
  smooth_shadows_ = std::move(smooth);
}

void PlateFilm::smooth_coverage(std::vector<NoisyPicture::Plane> smooth,
                                const std::function<bool(size_t)>& objects) {
  for (size_t p = 0; p < background_.size(); ++p) {
    if (objects(p)) continue;
    const V3f kept = mean_of(plate(p));
    for (size_t c = 0; c < 3; ++c) smooth[c][p] = kept[int(c)];
  }
  smooth_plate_ = std::move(smooth);
}

}  // namespace drench::render

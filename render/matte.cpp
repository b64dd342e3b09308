#include "render/matte.h"

#include <algorithm>

#include "render/scene.h"

namespace drench {

namespace {

constexpr float kWhole = 1 - 1e-3f;  // this and more is what smoothing leaves of 1

}  // namespace

bool Scene::has_mattes() const {
  return (has_ground_ && ground_matte_ != Matte::none) ||
         std::any_of(objects_.begin(), objects_.end(),
                     [](const SceneObject& o) { return o.matte != Matte::none; });
}

bool Scene::has_catchers() const {
  return (has_ground_ && ground_matte_ == Matte::shadow_catcher) ||
         std::any_of(objects_.begin(), objects_.end(),
                     [](const SceneObject& o) { return o.matte == Matte::shadow_catcher; });
}

Bodies Scene::plate_bodies() const {
  Bodies in = 0;
  for (const SceneObject& object : objects_)
    if (object.matte != Matte::none) in |= object.body;
  return in;
}

bool Scene::in_plate(const LightSample& light) const {
  return light.mesh < 0 ||
         std::none_of(objects_.begin(), objects_.end(), [&](const SceneObject& o) {
           return o.light == light.mesh && o.matte == Matte::none;
         });
}

std::vector<PixelSum> PlateFilm::beauty(const std::vector<PixelSum>& all) const {
  std::vector<PixelSum> out;
  out.reserve(all.size());
  for (size_t p = 0; p < all.size(); ++p) out.push_back(all[p].less(without_[p], light_left(p)));
  return out;
}

NoisyPicture PlateFilm::shadows(int width, int height) const {
  NoisyPicture picture;
  picture.width = width;
  picture.height = height;
  for (size_t p = 0; p < with_.size(); ++p) {
    const Dimmest all = dimmest(p);
    const float without = without_[p].mean(all.colour);
    const float unit = without > 0 ? without : 1;
    // That of W / O to first order.
    const float variance =
        2 * with_[p].less(without_[p], all.left).variance(all.colour) / (unit * unit);
    for (int h = 0; h < 2; ++h) {
      const float of_half = without_[p].half(h, all.colour);
      const float left =
          of_half > 0 ? std::min(1.f, with_[p].half(h, all.colour) / of_half) : all.left;
      for (NoisyPicture::Plane& colour : picture.half[h]) colour.push_back(left);
    }
    for (NoisyPicture::Plane& colour : picture.variance) colour.push_back(variance);
  }
  return picture;
}

NoisyPicture PlateFilm::shares(int width, int height) const {
  std::vector<PixelSum> sums;
  sums.reserve(background_.size());
  for (size_t p = 0; p < background_.size(); ++p) sums.push_back(plate(p));
  NoisyPicture picture = noisy_picture(sums);
  picture.width = width;
  picture.height = height;
  return picture;
}

void PlateFilm::smooth_shadows(NoisyPicture::Plane light_left) {
  for (size_t p = 0; p < light_left.size(); ++p)
    if (light_left[p] > kWhole && dimmest(p).left == 1) light_left[p] = 1;
  smooth_ = std::move(light_left);
}

void PlateFilm::smooth_shares(std::vector<NoisyPicture::Plane> smooth,
                              const std::function<bool(size_t)>& seen) {
  for (size_t p = 0; p < background_.size(); ++p) {
    if (seen(p)) continue;
    const V3f kept = mean_of(plate(p));
    for (size_t c = 0; c < 3; ++c) smooth[c][p] = kept[int(c)];
  }
  smooth_plate_ = std::move(smooth);
}

}  // namespace drench

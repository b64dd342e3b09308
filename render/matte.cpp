#include "render/matte.h"

#include <algorithm>

#include "render/scene.h"

namespace drench {

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

std::vector<PixelSum> CatcherFilm::beauty(const std::vector<PixelSum>& all) const {
  std::vector<PixelSum> out;
  out.reserve(all.size());
  for (size_t p = 0; p < all.size(); ++p) out.push_back(all[p].less(without_[p], light_left(p)));
  return out;
}

NoisyPicture CatcherFilm::shadows(int width, int height) const {
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

}  // namespace drench

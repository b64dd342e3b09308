// Of the scene what a filmed plate stands for (film/matte.h).

#include <algorithm>

#include "render/scene/scene.h"

namespace drench::render {

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

}  // namespace drench::render

#include "render/scene/scene_cache.h"

#include <algorithm>
#include <stdexcept>

namespace drench::render {

namespace {

EmbreeDevice make_device() {
  // One instruction set on every machine, so that rays meet the same triangles everywhere.
  EmbreeDevice device(rtcNewDevice("isa=avx2"));
  if (!device) throw std::runtime_error("Embree could not be started with isa=avx2");
  return device;
}

}  // namespace

SceneCache::SceneCache(PictureMemory picture_memory)
    : device_(make_device()), picture_memory_(picture_memory) {}

ShadingMaterial SceneCache::material(const Shot& shot, const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto known = materials_.find(name);
  if (known != materials_.end()) return known->second;
  return materials_.emplace(name, find_material(shot, name, picture_memory_)).first->second;
}

std::shared_ptr<const Environment> SceneCache::environment(const Light& light,
                                                           Environment::Sampling sampling) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<const Environment>& known = environments_[{sampling, light.name}];
  if (!known) known = std::make_shared<const Environment>(light, sampling, picture_memory_);
  return known;
}

std::shared_ptr<const AlbedoTable> SceneCache::albedo(float alpha, float eta) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<const AlbedoTable>& known = albedos_[{alpha, eta}];
  if (!known)
    known = std::make_shared<const AlbedoTable>(eta == 0 ? AlbedoTable::mirrors(alpha)
                                                         : AlbedoTable::dielectric(alpha, eta));
  return known;
}

std::optional<SceneObject> SceneCache::take(const Digest& contents) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(objects_.begin(), objects_.end(),
                                  [&](const SceneObject& o) { return o.contents == contents; });
  if (found == objects_.end()) return {};
  SceneObject object = std::move(*found);
  objects_.erase(found);
  return object;
}

void SceneCache::give_back(SceneObject object) {
  const std::lock_guard lock(mutex_);
  const auto same_name = [&](const SceneObject& o) { return o.name == object.name; };
  if (size_t(std::count_if(objects_.begin(), objects_.end(), same_name)) == max_objects_per_name)
    objects_.erase(std::find_if(objects_.begin(), objects_.end(), same_name));
  objects_.push_back(std::move(object));
}

}  // namespace drench::render

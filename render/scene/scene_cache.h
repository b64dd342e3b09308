#pragma once
// What the frames of a shot share: pictures, tables and Embree scenes of objects that stand. Safe
// from several frames at once; a frame has the same bits with a cache and without.

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/contract/hash.h"
#include "render/scene/scene.h"

namespace drench::render {

class SceneCache final : public EnvironmentSource {
 public:
  /// @param picture_memory  what all pictures may take together
  explicit SceneCache(PictureMemory picture_memory = {});

  const EmbreeDevice& device() const { return device_; }
  /// find_material of the shot, read once.
  ShadingMaterial material(const Shot& shot, const std::string& name);
  /// The shot's one environment, read once.
  std::shared_ptr<const Environment> environment(const Light& light,
                                                 Environment::Sampling sampling) override;
  /// Of facets that divide indices of ratio `eta`; 0: of mirrors.
  std::shared_ptr<const AlbedoTable> albedo(float alpha, float eta);

  /// An object given back, ready to be traced, if there is one of these contents.
  std::optional<SceneObject> take(const Digest& contents);
  void give_back(SceneObject object);

 private:
  /// Of objects of one name: one for every frame that may be at work. More would only pile up
  /// where a sheet creeps too slowly to be blurred.
  static constexpr size_t max_objects_per_name = 4;

  EmbreeDevice device_;
  std::mutex mutex_;
  PictureMemory picture_memory_;
  std::map<std::string, ShadingMaterial> materials_;
  std::map<std::pair<Environment::Sampling, std::string>, std::shared_ptr<const Environment>>
      environments_;
  std::map<std::pair<float, float>, std::shared_ptr<const AlbedoTable>> albedos_;
  std::vector<SceneObject> objects_;  // oldest first
};

}  // namespace drench::render

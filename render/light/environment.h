#pragma once
// Light from infinitely far away all around: a constant, a gradient sky, or a latitude-longitude
// map.

#include <cstdint>
#include <memory>
#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "render/light/environment_suns.h"
#include "render/light/sky_map.h"
#include "render/texture/picture.h"

namespace drench::render {

/// Draws from a discrete distribution in constant time. Walker's alias method in Vose's form.
class AliasTable {
 public:
  AliasTable() = default;
  explicit AliasTable(const std::vector<float>& weights);  // >= 0; all zero gives an even draw

  /// The drawn index; `u` is replaced by a fresh number in [0, 1).
  uint32_t sample(float& u) const;
  float probability(uint32_t index) const { return probability_[index]; }

 private:
  struct Bin {
    float keep = 1;
    uint32_t other = 0;
  };

 public:
  static constexpr size_t bytes_per_entry = sizeof(Bin) + sizeof(float);

 private:
  std::vector<Bin> bins_;
  std::vector<float> probability_;
};

struct DirectionSample {
  V3f direction;
  float pdf = 0;  // per steradian
};

/// Maps have +Y at the top row and -Z in the middle column, +X to the right of it.
class Environment {
 public:
  enum class Sampling { off, on };

  /// What the map's suns send is taken out of it, unless the light says otherwise.
  /// @throws Error for a map that cannot be read, holds infinite light or takes too much memory.
  Environment(const Light& light, Sampling sampling,
              PictureMemory& memory = PictureMemory::without_limit());

  V3f radiance(const V3f& direction) const;
  DirectionSample sample(const V2f& u) const;
  float pdf(const V3f& direction) const;
  /// Mean radiance over the sphere.
  V3f mean() const { return mean_; }
  /// Suns that were taken out, as they stand in the sky.
  const std::vector<ExtractedSun>& suns() const { return suns_; }
  bool is_map() const { return map_.width > 0; }

 private:
  void read_map(const Light& light, PictureMemory& memory);
  void build_tables(int width, int height);
  V2f to_map(const V3f& direction) const;
  V3f from_map(const V2f& uv) const;

  V3f scale_, horizon_, ground_, mean_;
  float rotation_ = 0;  // turns of the map, 0..1
  SkyMap map_;
  std::vector<ExtractedSun> suns_;
  int columns_ = 0, rows_ = 0;
  AliasTable row_table_;
  std::vector<AliasTable> column_tables_;
};

/// Where lights take their environment from, so that frames may share one.
class EnvironmentSource {
 public:
  virtual ~EnvironmentSource() = default;
  virtual std::shared_ptr<const Environment> environment(const Light& light,
                                                         Environment::Sampling sampling) = 0;
};

}  // namespace drench::render

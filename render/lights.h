#pragma once
// The lights of a shot: shapes that rays can hit, suns and an environment at infinity, and a draw
// among them by what each could send to a point.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/shot.h"
#include "render/environment.h"

namespace drench {

/// Light arriving at a point from one sampled direction.
struct LightSample {
  V3f direction;       // unit, towards the light
  float distance = 0;  // m; infinity for sun and environment
  V3f radiance;        // W/(sr m^2)
  float pdf = 0;       // per steradian, with the choice of the light; 0: no sample
  uint32_t group = 0;
};

/// A rectangle or sphere, ready to be hit and sampled.
struct ShapeLight {
  LightType type = LightType::rectangle;
  V3f radiance;
  V3f center, u, v, normal;  // m; half edges, unit normal on the shining side
  V3f dual_u, dual_v;        // 1/m; a point of the plane is (dual_u . p) u + (dual_v . p) v
  float area = 0, radius = 0;

  /// Distance along the ray of its emitting side, or infinity.
  float intersect(const V3f& origin, const V3f& direction) const;
  LightSample sample(const V3f& from, const V2f& u) const;
  /// Density of `sample` for a direction that does hit it at `distance`.
  float pdf(const V3f& from, const V3f& direction, float distance) const;
  /// Irradiance it could cause at `from`, roughly: its weight in the draw. 0 only where it is 0.
  float importance(const V3f& from) const;
};

struct SunLight {
  V3f toward;               // unit
  V3f radiance;             // W/(sr m^2)
  float one_minus_cos = 0;  // of the half angle
  float sin2 = 0;
  float importance = 0;

  bool covers(const V3f& direction) const;
};

class Lights {
 public:
  enum class SampleEnvironment { automatic, always, never };

  /// @throws Error for a light without extent or with impossible numbers, or a second environment.
  Lights(const std::vector<Light>& lights, SampleEnvironment sample_environment);

  struct Hit {
    int light = -1;
    float distance = 0;
  };
  /// Nearest shape light closer than `distance`.
  Hit intersect(const V3f& origin, const V3f& direction, float distance) const;

  /// Draws a light, then a direction to it.
  LightSample sample(const V3f& from, float u_light, const V2f& u) const {
    return sample_first(environment_index() + (sample_environment_ ? 1 : 0), from, u_light, u);
  }
  /// The same among all but the environment.
  LightSample sample_lamps(const V3f& from, float u_light, const V2f& u) const {
    return sample_first(environment_index(), from, u_light, u);
  }

  /// Radiance of a hit shape light, and the density with which `sample` finds it from `from`.
  V3f shape_radiance(int light) const { return shapes_[light].radiance; }
  float shape_pdf(int light, const V3f& from, const V3f& direction, float distance) const;

  enum class Suns { seen, hidden };

  /// Calls `found(radiance, density, group)` for each light at infinity that shines along a
  /// direction, where the density is that of `sample` at `from`; 0 if it is not asked for.
  template <class Found>
  void for_each_infinite(const V3f& from, const V3f& direction, bool weighed, Suns suns,
                         const Found& found) const {
    if (environment_) {
      const float pdf =
          weighed && sample_environment_
              ? environment_->pdf(direction) * choice_probability(environment_index(), from)
              : 0.f;
      found(environment_->radiance(direction), pdf, group(environment_index()));
    }
    for (size_t s = 0; s < suns_.size() && suns == Suns::seen; ++s) {
      if (!suns_[s].covers(direction)) continue;
      const float pdf = weighed ? choice_probability(shapes_.size() + s, from) /
                                      (2 * kPi * suns_[s].one_minus_cos)
                                : 0.f;
      found(suns_[s].radiance, pdf, group(shapes_.size() + s));
    }
  }

  /// Names of the groups, and which one a light is of: shapes, then suns, then the environment.
  const std::vector<std::string>& groups() const { return groups_; }
  uint32_t group(size_t light) const { return group_[light]; }
  bool has_lights(uint32_t group) const {
    return std::find(group_.begin(), group_.end(), group) != group_.end();
  }
  /// The group of what photons bring, whatever lamp sent them.
  uint32_t caustics_group() const { return caustics_group_; }

  bool has_lamps() const { return environment_index() > 0; }
  bool has_environment() const { return environment_.has_value(); }
  bool can_sample() const { return !shapes_.empty() || !suns_.empty() || sample_environment_; }
  const std::vector<ShapeLight>& shapes() const { return shapes_; }
  const std::vector<SunLight>& suns() const { return suns_; }
  /// Mean irradiance of the environment, as luminance.
  float environment_importance() const { return environment_importance_; }

 private:
  void find_groups(const std::vector<Light>& lights);
  LightSample sample_first(size_t count, const V3f& from, float u_light, const V2f& u) const;
  size_t environment_index() const { return shapes_.size() + suns_.size(); }
  float importance(size_t index, const V3f& from) const;
  float choice_probability(size_t index, const V3f& from) const;

  std::vector<ShapeLight> shapes_;
  std::vector<SunLight> suns_;
  std::optional<Environment> environment_;
  std::vector<std::string> groups_;
  std::vector<uint32_t> group_;  // by light
  uint32_t caustics_group_ = 0;
  bool sample_environment_ = false;
  float environment_importance_ = 0;
};

}  // namespace drench

#pragma once
// The lights of a shot: shapes that rays can hit, objects that shine, suns and an environment at
// infinity, and a draw among them by what each could send to a point.

#include <memory>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "render/light/environment.h"
#include "render/light/light_sample.h"
#include "render/light/light_tree.h"
#include "render/light/mesh_light.h"

namespace drench::render {

/// A rectangle, disk or sphere, ready to be hit and sampled.
struct ShapeLight {
  LightType type = LightType::rectangle;
  V3f radiance;
  V3f center, u, v, normal;  // m; half edges or radii, unit normal on the shining side
  V3f dual_u, dual_v;        // 1/m; a point of the plane is (dual_u . p) u + (dual_v . p) v
  float area = 0, radius = 0;
  uint32_t group = 0;

  /// Distance along the ray of its emitting side, if it is less than `reach`, or infinity.
  float intersect(const V3f& origin, const V3f& direction, float reach) const;
  LightSample sample(const V3f& from, const V2f& u) const;
  /// Density of `sample` for a direction that does hit it at `distance`.
  float pdf(const V3f& from, const V3f& direction, float distance) const;
  /// Irradiance it could cause at `from`, roughly: its weight in the draw. 0 only where it is 0.
  float importance(const V3f& from) const;
  LightTree::Light extent() const;
};

struct SunLight {
  V3f toward;               // unit
  V3f radiance;             // W/(sr m^2)
  float one_minus_cos = 0;  // of the half angle
  float sin2 = 0;
  float importance = 0;
  uint32_t group = 0;

  bool covers(const V3f& direction) const;
};

class Lights {
 public:
  enum class SampleEnvironment { automatic, always, never };

  /// @throws Error for a light without extent or with impossible numbers, or a second environment.
  Lights(const std::vector<Light>& lights, SampleEnvironment sample_environment,
         EnvironmentSource& environments);

  /// Adds an object that shines. @return its number among them
  int add_mesh(const MeshLight::Faces& faces, const V3f& radiance, const std::string& group) {
    meshes_.emplace_back(faces, radiance);
    mesh_group_.push_back(group_named(group));
    ++count_;
    return int(meshes_.size()) - 1;
  }
  /// To be called once all are there: many are drawn from a tree.
  void finish();

  struct Hit {
    int light = -1;
    float distance = 0;
  };
  /// Nearest shape light closer than `distance`, of all but one.
  Hit intersect(const V3f& origin, const V3f& direction, float distance, int except = -1) const;

  /// Draws a light, then a direction to it. `time` of the shutter, 0..1.
  LightSample sample(const V3f& from, float time, float u_light, const V2f& u) const {
    return sample_chosen(choose_first(count_, from, u_light), from, time, u);
  }
  /// The same among lamps: shapes and suns.
  LightSample sample_lamps(const V3f& from, float u_light, const V2f& u) const {
    return sample_chosen(choose_first(lamps(), from, u_light), from, 0, u);
  }

  /// Draws a lamp, then a point of it.
  LampPoint sample_lamp_point(const V3f& from, float u_light, const V2f& u) const;
  /// The point of a lamp that a ray aims at which ends on it.
  LampPoint lamp_point_of(size_t lamp, const V3f& from, const V3f& origin,
                          const V3f& direction) const;

  /// Radiance of a hit shape light, and the density with which `sample` finds it from `from`.
  V3f shape_radiance(int light) const { return shapes_[light].radiance; }
  float shape_pdf(int light, const V3f& from, const V3f& direction, float distance) const;
  /// Density with which `sample` finds the outer side of a triangle of a mesh from `from`.
  float mesh_pdf(int mesh, uint32_t triangle, const V3f& from, float time, float distance,
                 float facing) const {
    return meshes_[mesh].pdf(triangle, time, distance, facing) *
           choice_probability(lamps() + size_t(mesh), from);
  }

  enum class Suns { seen, hidden };

  /// Calls `found(radiance, density, group)` for each light at infinity that shines along a
  /// direction; the density is that of `sample` at `from`.
  /// @param bsdf_pdf  of the direction; 0: lights were not sampled there, and no density is found
  template <class Found>
  void for_each_infinite(const V3f& from, const V3f& direction, float bsdf_pdf, Suns suns,
                         const Found& found) const {
    const bool weighed = bsdf_pdf > 0;
    if (environment_) {
      const float pdf =
          weighed && sample_environment_
              ? environment_->pdf(direction) * choice_probability(environment_index(), from)
              : 0.f;
      found(environment_->radiance(direction), pdf, environment_group_);
    }
    for (size_t s = 0; s < suns_.size() && suns == Suns::seen; ++s) {
      if (!suns_[s].covers(direction)) continue;
      const float pdf =
          weighed ? choice_probability(shapes_.size() + s, from) / (2 * pi * suns_[s].one_minus_cos)
                  : 0.f;
      found(suns_[s].radiance, pdf, suns_[s].group);
    }
  }

  /// Names of the groups of lights; photons are a group of their own beyond them.
  const std::vector<std::string>& groups() const { return groups_; }
  uint32_t caustics_group() const { return uint32_t(groups_.size()); }
  uint32_t shape_group(uint32_t shape) const { return shapes_[shape].group; }
  uint32_t mesh_group(int mesh) const { return mesh_group_[size_t(mesh)]; }

  /// How many shapes and suns there are.
  size_t lamps() const { return shapes_.size() + suns_.size(); }
  bool has_environment() const { return environment_ != nullptr; }
  bool can_sample() const { return count_ > 0; }
  const std::vector<ShapeLight>& shapes() const { return shapes_; }
  const std::vector<SunLight>& suns() const { return suns_; }
  const std::vector<MeshLight>& meshes() const { return meshes_; }
  /// Of shapes and of meshes, numbered in this order; empty if these are few.
  const LightTree& tree() const { return tree_; }
  /// Mean irradiance of the environment, as luminance.
  float environment_importance() const { return environment_importance_; }

 private:
  uint32_t group_of(const Light& light);
  uint32_t group_named(const std::string& name);
  struct Choice {
    size_t light;       // its number
    float probability;  // 0: none
  };
  /// Of the first `count`.
  Choice choose_first(size_t count, const V3f& from, float u_light) const {
    if (count < 2) return {0, float(count)};
    return choose_of_many(count, from, u_light);
  }
  Choice choose_of_many(size_t count, const V3f& from, float u_light) const;
  /// Calls `visit(number)` for those of the first `count` that are not in the tree.
  template <class Visit>
  void for_each_alone(size_t count, const Visit& visit) const;
  LightTree::Cut cut(size_t count, const V3f& from) const;
  auto tree_importance(const V3f& from) const {
    return [this, &from](uint32_t number) {
      return number < shapes_.size() ? shapes_[number].importance(from)
                                     : meshes_[number - shapes_.size()].importance(from);
    };
  }
  LampPoint aim_at(size_t lamp, const V3f& from) const;
  /// Each makes the sample where it is returned to: a copy would wait for what was just written.
  LightSample sample_shape(const Choice& choice, const V3f& from, const V2f& u) const;
  LightSample sample_sun(const Choice& choice, const V2f& u) const;
  LightSample sample_mesh(const Choice& choice, const V3f& from, float time, const V2f& u) const;
  LightSample sample_chosen(const Choice& choice, const V3f& from, float time, const V2f& u) const;
  size_t environment_index() const { return lamps() + meshes_.size(); }
  float importance(size_t index, const V3f& from) const;
  float choice_probability(size_t index, const V3f& from) const;

  std::vector<ShapeLight> shapes_;
  std::vector<SunLight> suns_;
  std::vector<MeshLight> meshes_;
  size_t count_ = 0;  // of all that `sample` draws from
  LightTree tree_;
  std::shared_ptr<const Environment> environment_;
  std::vector<std::string> groups_;
  std::vector<uint32_t> mesh_group_;
  uint32_t environment_group_ = 0;
  bool sample_environment_ = false;
  float environment_importance_ = 0;
};

}  // namespace drench::render

#pragma once
// What a path leaves behind, for path.cpp: light and alpha of the picture, what the layers record,
// and what of it stands over a plate.

#include <type_traits>
#include <variant>

#include "render/integrator/path.h"
#include "render/integrator/path_state.h"

namespace drench::render {

template <bool has_plate>
class PathFilm {
 public:
  explicit PathFilm(PathRecord* record) : record_(record) {}

  PathSample sample() const { return {radiance_, alpha_, split_}; }
  bool records() const { return record_ != nullptr; }

  World world() const {
    if constexpr (has_plate) return plate.world;
    return World::whole;
  }

  /// Whether a plate stands for what this path meets.
  bool sees_plate(const PathState& state) const {
    return state.clear && dot(state.ray.direction, plate.view) > max_bend_cosine;
  }

  /// Ends the path on the plate.
  bool show_plate(const PathState& state) {
    const V3f& weight = state.throughput;
    alpha_ -= (weight.x + weight.y + weight.z) / 3;
    if (!record_) return false;
    record_->matte.background += weight;
    record_->shaded = true;
    return false;
  }

  void show_nothing() {
    alpha_ = 0;
    if (record_) record_->matte.background = V3f(1);
  }

  /// What is found from here on comes from a shadow catcher; kept for the plate's world.
  void start_catching(PathState& state, const Surface& surface, const Hit& hit, Bodies in_plate) {
    state.clear = false;
    plate.on_catcher = plate.caught = true;
    plate.start = state;
    plate.start.in &= in_plate;
    plate.surface = surface;
    plate.hit = hit;
    record_->matte.catcher = state.throughput;
    record_->shaded = true;
  }

  void record_first(const PathState& state, const Surface& surface, const Hit& hit) {
    if (!record_ || state.vertices > 0) return;
    if constexpr (has_plate)
      if (plate.on_catcher) return;
    record_->first = hit;
    record_->position = surface.position;
    record_->normal = dot(state.ray.direction, surface.geometric_normal) < 0
                          ? surface.shading_normal
                          : -surface.shading_normal;
    record_->time = state.ray.time;
  }

  void record_albedo(const V3f& albedo) {
    if (!record_ || record_->shaded) return;
    record_->albedo += albedo;
    record_->shaded = true;
  }

  /// The mirrored branch has an albedo of its own throughput.
  void begin_branch() {
    if constexpr (has_plate) plate.on_catcher = false;
    if (record_) record_->shaded = false;
  }

  /// Adds light to the picture.
  void deposit(const V3f& found, uint32_t group) {
    if constexpr (has_plate) {
      if (world() == World::plate) {
        record_->matte.without += found;
        return;
      }
      if (plate.on_catcher) {
        record_->matte.with += found;
        if (!record_->light.empty()) record_->matte.light[group] += found;
      }
    }
    radiance_ += found;
    if (record_ && !record_->light.empty()) record_->light[group] += found;
  }

  /// By how much one half of the photons adds more to that than the other.
  void split(const V3f& found) { split_ += found; }

  [[no_unique_address]] std::conditional_t<has_plate, PlateState, std::monostate> plate;

 private:
  PathRecord* record_;
  V3f radiance_{0, 0, 0}, split_{0, 0, 0};
  float alpha_ = 1;
};

}  // namespace drench::render

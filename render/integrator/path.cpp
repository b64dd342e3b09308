#include "render/integrator/path.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

#include "render/integrator/path_tracer.h"

namespace drench::render {

namespace {

void clear_light(PathRecord& record) {
  for (std::vector<V3f>* light : {&record.light, &record.matte.light})
    std::fill(light->begin(), light->end(), V3f(0));
  record.matte.with = record.matte.without = V3f(0);
}

template <unsigned features>
void finish(const PathTracer<features>& path, CameraSample& sample, uint64_t& rays) {
  rays += path.rays();
  sample.found = path.sample();
  PathRecord* const record = sample.record;
  if (finite(sample.found.radiance) && !(record && !finite(record->matte.without))) return;
  sample.found.radiance = sample.found.split = V3f(0);
  if (record) clear_light(*record);
}

/// Paths go on in step: one waits for the triangle that its ray met while the others trace theirs.
template <unsigned features>
void trace(const Scene& scene, const PathSettings& settings, std::span<CameraSample> samples,
           uint64_t& rays) {
  using Path = PathTracer<features>;
  static_assert(std::is_trivially_destructible_v<Path>);
  alignas(Path) std::byte storage[paths_in_flight][sizeof(Path)];
  std::array<Path*, paths_in_flight> paths, going;
  size_t left = 0;
  const auto keep = [&](Path* path) {  // without a branch, which nothing foretells
    going[left] = path;
    left += path->going();
  };
  for (size_t k = 0; k < samples.size(); ++k)
    keep(paths[k] = new (storage[k]) Path(scene, settings, samples[k]));
  while (const size_t n = left) {
    for (size_t k = 0; k < n; ++k) going[k]->find();
    for (size_t k = 0; k < n; ++k) going[k]->fetch();
    left = 0;
    for (size_t k = 0; k < n; ++k) {
      going[k]->shade();
      keep(going[k]);
    }
  }
  for (size_t k = 0; k < samples.size(); ++k) finish(*paths[k], samples[k], rays);
}

template <size_t... features>
constexpr std::array<PathFunction, sizeof...(features)> table(std::index_sequence<features...>) {
  return {&trace<unsigned(features)>...};
}

}  // namespace

PathFunction path_function(unsigned features) {
  static constexpr auto functions = table(std::make_index_sequence<Feature::combinations>{});
  if (features & Feature::mattes) return &trace<Feature::mattes | (Feature::combinations - 1)>;
  return functions[features % Feature::combinations];
}

}  // namespace drench::render

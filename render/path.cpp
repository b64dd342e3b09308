#include "render/path.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "render/path_tracer.h"

namespace drench {

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
  std::array<std::optional<PathTracer<features>>, kPathsAtOnce> paths;
  for (size_t k = 0; k < samples.size(); ++k) paths[k].emplace(scene, settings, samples[k]);
  const auto each = [&](const auto& act) {
    bool any = false;
    for (size_t k = 0; k < samples.size(); ++k)
      if (paths[k]->going()) act(*paths[k]), any = true;
    return any;
  };
  while (each([](auto& path) { path.find(); })) {
    each([](auto& path) { path.fetch(); });
    each([](auto& path) { path.shade(); });
  }
  for (size_t k = 0; k < samples.size(); ++k) finish(*paths[k], samples[k], rays);
}

template <size_t... features>
constexpr std::array<PathFunction, sizeof...(features)> table(std::index_sequence<features...>) {
  return {&trace<unsigned(features)>...};
}

}  // namespace

PathFunction path_function(unsigned features) {
  static constexpr auto functions = table(std::make_index_sequence<kFeatureCount>{});
  if (features & kMattes) return &trace<kMattes | (kFeatureCount - 1)>;
  return functions[features % kFeatureCount];
}

}  // namespace drench

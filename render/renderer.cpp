#include "render/renderer.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <bit>
#include <ctime>
#include <mutex>

#include "pipeline/contract/error.h"
#include "render/filter.h"
#include "render/layers.h"
#include "render/options.h"
#include "render/path.h"
#include "render/photons.h"
#include "render/pixel_sum.h"

namespace drench {

namespace {

constexpr int kTile = 16;  // pixels a side

double process_cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

void check_settings(const RenderSettings& r) {
  constexpr int kLargest = 32768, kMostSamples = 1 << 20;
  if (r.width < 1 || r.height < 1 || r.width > kLargest || r.height > kLargest)
    throw Error(fmt::format("render: a picture of {} x {} pixels; each must lie in 1..{}", r.width,
                            r.height, kLargest));
  if (r.samples < 1 || r.samples > kMostSamples)
    throw Error(fmt::format("render.samples is {}; it must lie in 1..{}", r.samples, kMostSamples));
  if (r.depth < 0) throw Error(fmt::format("render.depth is {}; it must not be negative", r.depth));
}

uint32_t photon_count(const RenderSettings& r) {
  constexpr double kMost = 1e7;  // 1.5 GB while they are sorted
  return uint32_t(std::min(r.photons * r.samples * r.width * r.height, kMost));
}

/// What every tile reads.
struct Job {
  const Scene& scene;
  PathSettings path;
  PathFunction trace;
  PixelFilter filter;
  PixelOrder order;
  uint32_t seed, slots_log2;
  int width, height, samples;
};

/// What the samples of a picture have added up to.
struct Sums {
  std::vector<PixelSum> pixel;
  LayerFilm layers;
};

/// One more camera sample of a pixel, the next in its order.
void add_sample(const Job& job, int x, int y, PixelSum& sum, uint64_t& rays, PathRecord* record) {
  const Sampler sampler(job.order, job.seed, uint32_t(x), uint32_t(y), job.slots_log2,
                        uint32_t(sum.samples()));
  const V2f film =
      V2f(float(x) + 0.5f, float(y) + 0.5f) + job.filter.offset(sampler.two(kFilterDimension));
  const PathSample sample = job.trace(job.scene, job.path, sampler, film, rays, record);
  sum.add(sample.radiance, sample.alpha);
}

/// Calls back with the finished share, one tile at a time.
class Progress {
 public:
  Progress(const std::function<void(double)>& report, int tiles) : report_(report), tiles_(tiles) {}
  void tile_done() {
    if (!report_) return;
    const std::lock_guard lock(mutex_);
    report_(double(++done_) / tiles_);
  }

 private:
  const std::function<void(double)>& report_;
  std::mutex mutex_;
  int tiles_, done_ = 0;
};

uint64_t render_tiles(const Job& job, Sums& sums, Progress& progress, int columns, int rows) {
  std::atomic<uint64_t> rays{0};
  const auto one_tile = [&](int tile) {
    const FlushDenormals flush;
    uint64_t tile_rays = 0;
    PathRecord record = sums.layers.blank();
    PathRecord* const recorded = sums.layers.records() ? &record : nullptr;
    const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
    for (int y = y0; y < std::min(y0 + kTile, job.height); ++y)
      for (int x = x0; x < std::min(x0 + kTile, job.width); ++x) {
        const size_t pixel = size_t(y) * job.width + x;
        for (int s = 0; s < job.samples; ++s) {
          add_sample(job, x, y, sums.pixel[pixel], tile_rays, recorded);
          if (!recorded) continue;
          sums.layers.add(pixel, record);
          sums.layers.clear(record);
        }
      }
    rays += tile_rays;
    progress.tile_done();
  };
  tbb::parallel_for(
      tbb::blocked_range<int>(0, columns * rows, 1),
      [&](const tbb::blocked_range<int>& range) {
        for (int tile = range.begin(); tile < range.end(); ++tile) one_tile(tile);
      },
      tbb::simple_partitioner{});
  return rays;
}

Film developed(const Job& job, const Sums& sums) {
  Film film{job.width, job.height, std::vector<float>(4 * sums.pixel.size())};
  for (size_t p = 0; p < sums.pixel.size(); ++p)
    for (int c = 0; c < 4; ++c) film.rgba[4 * p + size_t(c)] = sums.pixel[p].mean(c);
  film.layer = sums.layers.finish(sums.pixel);
  film.header = sums.layers.header();
  return film;
}

}  // namespace

PixelFilter::PixelFilter() {
  constexpr int kSteps = 4096;
  std::array<double, kSteps + 1> cdf{};
  for (int k = 0; k < kSteps; ++k) {
    const double t = 2 * std::numbers::pi * (k + 0.5) / kSteps;
    cdf[k + 1] = cdf[k] + 0.35875 - 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) -
                 0.01168 * std::cos(3 * t);
  }
  int k = 0;
  for (int q = 0; q <= kSize; ++q) {
    const double target = cdf[kSteps] * q / kSize;
    while (k + 1 < kSteps && cdf[k + 1] < target) ++k;
    const double within = (target - cdf[k]) / (cdf[k + 1] - cdf[k]);
    inverse_[q] = float(((k + std::clamp(within, 0., 1.)) / kSteps - 0.5) * kWidth);
  }
}

Film render_frame(const Shot& shot, int frame, const FrameGeometry& geometry,
                  const RenderOptions& options, RenderStats* stats,
                  const std::function<void(double)>& progress) {
  check_settings(shot.render);
  const double cpu_start = process_cpu_seconds();
  const Scene scene(shot, frame, geometry, options);
  PathSettings path;
  path.depth = shot.render.depth;
  path.estimator = options.estimator;
  path.first_interface = options.first_interface;
  path.water_guide = options.water_guide;
  path.camera_in = scene.bodies_at(scene.camera().open().position, 0);
  const uint32_t samples = uint32_t(shot.render.samples);
  const uint32_t seed = hash_bits(shot.render.seed ^ hash_bits(uint32_t(frame)));
  uint64_t photon_rays = 0;
  PhotonMap photons;
  if (shot.render.photons > 0 && can_trace_photons(scene)) {
    photons = trace_photons(scene, seed, photon_count(shot.render), photon_rays);
    path.photons = &photons;
  }
  const Job job{scene,
                path,
                path_function(scene.features() | options.force_features),
                PixelFilter(),
                options.pixel_order,
                seed,
                uint32_t(std::bit_width(samples - 1)),
                shot.render.width,
                shot.render.height,
                int(samples)};
  Sums sums{std::vector<PixelSum>(size_t(job.width) * job.height), LayerFilm(shot, frame, scene)};
  const int columns = (job.width + kTile - 1) / kTile, rows = (job.height + kTile - 1) / kTile;
  Progress report(progress, columns * rows);
  const uint64_t rays = render_tiles(job, sums, report, columns, rows);
  if (stats) {
    stats->camera_samples = uint64_t(job.width) * job.height * samples;
    stats->rays = rays + photon_rays;
    stats->cpu_s = process_cpu_seconds() - cpu_start;
  }
  return developed(job, sums);
}

Film render_frame(const Shot& shot, int frame, const FrameGeometry& geometry, RenderStats* stats,
                  const std::function<void(double)>& progress) {
  return render_frame(shot, frame, geometry, RenderOptions{}, stats, progress);
}

}  // namespace drench

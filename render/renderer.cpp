#include "render/renderer.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <ctime>
#include <mutex>

#include "pipeline/contract/error.h"
#include "render/denoise/noisy_frame.h"
#include "render/film/filter.h"
#include "render/frame_checkpoint.h"
#include "render/integrator/path.h"
#include "render/integrator/photons.h"
#include "render/options.h"
#include "render/sampler.h"

namespace drench::render {

namespace {

constexpr int tile_size = 16;  // pixels a side

double process_cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

void check_settings(const RenderSettings& r) {
  constexpr int max_size = 32768, max_samples = 1 << 20;
  if (r.width < 1 || r.height < 1 || r.width > max_size || r.height > max_size)
    throw Error(fmt::format("render: a picture of {} x {} pixels; each must lie in 1..{}", r.width,
                            r.height, max_size));
  if (r.samples < 1 || r.samples > max_samples)
    throw Error(fmt::format("render.samples is {}; it must lie in 1..{}", r.samples, max_samples));
  if (r.crop_max != V2i(0, 0) &&
      !(r.crop_min.x >= 0 && r.crop_min.y >= 0 && r.crop_min.x < r.crop_max.x &&
        r.crop_min.y < r.crop_max.y && r.crop_max.x <= r.width && r.crop_max.y <= r.height))
    throw Error("render: crop_min and crop_max give no part of the picture; mend them");
  if (r.denoise && r.samples < 2 * PixelSum::smallest_batch)
    throw Error(fmt::format("render.denoise needs at least {} samples, render.samples is {}",
                            2 * PixelSum::smallest_batch, r.samples));
  if (r.depth < 0) throw Error(fmt::format("render.depth is {}; it must not be negative", r.depth));
}

/// What every tile reads.
struct Job {
  const Scene& scene;
  PathSettings path;
  PathFunction trace;
  PixelFilter filter;
  PixelOrder order;
  uint32_t seed, slots_log2;
  FilmWindow window;
  int width, height;  // pixels, of the window

  int columns() const { return (width + tile_size - 1) / tile_size; }  // of tiles
  int rows() const { return (height + tile_size - 1) / tile_size; }
};

/// Where on the film the samples of a pixel lie: known for eight at a time, long before each is
/// traced.
class FilmPoints {
 public:
  FilmPoints(const Job& job, int x, int y)
      : job_(job),
        center_(float(x) + 0.5f, float(y) + 0.5f),
        first_(job.order, job.seed, uint32_t(x), uint32_t(y), job.slots_log2, 0) {}

  Sampler sampler(int sample) const { return first_.at(uint32_t(sample)); }
  V2f operator[](int sample) {
    const int k = sample % samples_at_once;
    if (sample - k != from_) fill(sample - k);
    return point_[size_t(k)];
  }

 private:
  static constexpr int samples_at_once = 8;

  void fill(int from) {
    from_ = from;
    point_ = first_.two_of_eight(uint32_t(from), filter_dimension);
    for (V2f& p : point_) p = center_ + job_.filter.offset(p);
  }

  const Job& job_;
  V2f center_;
  Sampler first_;
  int from_ = -1;
  std::array<V2f, samples_at_once> point_;
};

/// Calls back with the finished fraction of the samples that are expected, one tile at a time.
class Progress {
 public:
  explicit Progress(const std::function<void(double)>& report) : report_(report) {}
  void expect(double samples) { expected_ = samples; }
  /// Samples that were there before.
  void had(const std::vector<PixelSum>& pixels) {
    for (const PixelSum& pixel : pixels) done_ += uint64_t(pixel.samples());
  }
  void done(uint64_t samples) {
    const std::lock_guard lock(mutex_);
    done_ += samples;
    // What is expected may grow; what has been reported does not fall.
    fraction_ = std::max(fraction_, std::min(double(done_) / expected_, 1.));
    if (report_) report_(fraction_);
  }
  uint64_t samples() const { return done_; }

 private:
  const std::function<void(double)>& report_;
  std::mutex mutex_;
  uint64_t done_ = 0;
  double expected_ = 1, fraction_ = 0;
};

void add_sample(const CameraSample& sample, size_t pixel, Sums& sums) {
  sums.pixel[pixel].add(sample.found.radiance, sample.found.alpha);
  if (!sums.split.empty()) sums.split[pixel].add(sample.found.split, 0);
  if (!sample.record) return;
  sums.layers.add(pixel, *sample.record);
  sums.plate.add(pixel, sample.record->matte);
  sums.layers.clear(*sample.record);
}

/// Samples that a pixel shall have: as planned until the end of a round, but no more than `most`.
struct Goal {
  int round, most;
  int operator()(const Sums& sums, size_t pixel) const {
    return std::min(sums.wanted(pixel, round), most);
  }
};

/// Brings the pixels of a tile to the goal. @return samples added
uint64_t render_tile(const Job& job, int tile, Goal goal, Sums& sums, uint64_t& rays) {
  const FlushDenormals flush;
  std::vector<PathRecord> record(paths_in_flight, sums.layers.blank());
  const bool records = sums.layers.records();
  std::vector<CameraSample> samples;
  uint64_t added = 0;
  const int x0 = tile % job.columns() * tile_size, y0 = tile / job.columns() * tile_size;
  for (int y = y0; y < std::min(y0 + tile_size, job.height); ++y)
    for (int x = x0; x < std::min(x0 + tile_size, job.width); ++x) {
      const size_t pixel = size_t(y) * job.width + x;
      FilmPoints film(job, x + job.window.x, y + job.window.y);
      const int wanted = goal(sums, pixel);
      for (int s = sums.pixel[pixel].samples(); s < wanted; s = sums.pixel[pixel].samples()) {
        samples.clear();
        for (size_t k = 0; k < paths_in_flight && s + int(k) < wanted; ++k)
          samples.push_back(
              {film.sampler(s + int(k)), film[s + int(k)], records ? &record[k] : nullptr, {}});
        job.trace(job.scene, job.path, samples, rays);
        for (const CameraSample& sample : samples) add_sample(sample, pixel, sums);
        added += samples.size();
      }
    }
  return added;
}

using Clock = std::chrono::steady_clock;

/// Brings all tiles to the goal, but breaks off between two of them at `until`. Samples are whole
/// then, and the same call goes on. @return whether the goal is reached
bool render_tiles(const Job& job, Goal goal, Sums& sums, Clock::time_point until, uint64_t& rays,
                  Progress& progress) {
  std::atomic<uint64_t> traced{0};
  std::atomic<bool> through{true};
  tbb::parallel_for(
      tbb::blocked_range<int>(0, job.columns() * job.rows(), 1),
      [&](const tbb::blocked_range<int>& range) {
        if (Clock::now() >= until) {
          through = false;
          return;
        }
        uint64_t here = 0;
        for (int tile = range.begin(); tile < range.end(); ++tile)
          progress.done(render_tile(job, tile, goal, sums, here));
        traced += here;
      },
      tbb::simple_partitioner{});
  rays += traced;
  return through;
}

/// Colours and alpha of the samples so far.
Film beauty_film(const Job& job, const Sums& sums) {
  const std::vector<PixelSum>& pixels = sums.beauty();
  Film film{.width = job.width,
            .height = job.height,
            .rgba = std::vector<float>(4 * pixels.size()),
            .window = job.window};
  for (size_t p = 0; p < pixels.size(); ++p) {
    for (int c = 0; c < 3; ++c) film.rgba[4 * p + size_t(c)] = pixels[p].mean(c);
    const V3f seen = sums.plate.seen(p);
    const float alpha = pixels[p].mean(3) - (seen.x + seen.y + seen.z) / 3;
    film.rgba[4 * p + 3] = std::clamp(alpha, 0.f, 1.f);
  }
  return film;
}

/// Renders the rounds of every pass, shows them as they refine, and keeps checkpoints.
class Passes {
 public:
  Passes(Job& job, const RenderOptions& options, FramePhotons& photons, Sums& sums, uint64_t& rays,
         Progress& progress)
      : job_(job),
        options_(options),
        photons_(photons),
        sums_(sums),
        rays_(rays),
        progress_(progress),
        every_(std::chrono::duration_cast<Clock::duration>(
            std::chrono::duration<double>(std::min(options.checkpoint.every_s, 1e6)))) {}

  void render() {
    bool more = read_checkpoint(options_.checkpoint, sums_) || sums_.begin_pass(0);
    progress_.had(sums_.pixel);
    while (most_ < sums_.pixel.front().samples()) most_ *= 2;
    try {
      while (more) {
        progress_.expect(sums_.plan.expected());
        for (int round = sums_.rounds.first(); round < sums_.rounds.end(); ++round) {
          const bool last = round + 1 == sums_.rounds.end();  // whose photons are told of
          if (!last && sums_.is_through(round)) continue;
          photons_.trace_round(round, sums_.rounds, rays_);
          job_.path.walks = photons_.caustics().walks;
          render_round(round);
        }
        sums_.settle();
        more = sums_.begin_pass(photon_error(sums_.beauty(), sums_.split));
      }
    } catch (...) {
      if (keeps()) write_checkpoint(options_.checkpoint, sums_);
      throw;
    }
  }

 private:
  bool keeps() const { return !options_.checkpoint.file.empty(); }

  void render_round(int round) {
    const int most = sums_.most_wanted(round);
    for (; options_.refined && most_ < most; most_ *= 2) {
      render_tiles_to({round, most_});
      sums_.settle();
      options_.refined(beauty_film(job_, sums_));
    }
    render_tiles_to({round, most});
  }

  void render_tiles_to(Goal goal) {
    const auto until = [&] { return keeps() ? Clock::now() + every_ : Clock::time_point::max(); };
    while (!render_tiles(job_, goal, sums_, until(), rays_, progress_))
      write_checkpoint(options_.checkpoint, sums_);
  }

  Job& job_;
  const RenderOptions& options_;
  FramePhotons& photons_;
  Sums& sums_;
  uint64_t& rays_;
  Progress& progress_;
  const Clock::duration every_;
  int most_ = 1;  // samples of a pixel when the frame is shown next
};

double picture_error(const std::vector<PixelSum>& pixels) {
  double sum = 0;
  for (const PixelSum& pixel : pixels) sum += relative_error(pixel);
  return sum / double(pixels.size());
}

FilmWindow window_of(const RenderSettings& r) {
  if (r.crop_max == V2i(0, 0)) return {};
  return {r.crop_min.x, r.crop_min.y, r.width, r.height};
}

/// Denoises the beauty, or adds what that takes.
void denoise_film(const Sums& sums, Denoised denoised, Denoiser denoiser, Film& film) {
  NoisyPicture picture = noisy_picture(sums.beauty());
  picture.width = film.width;
  picture.height = film.height;
  sums.layers.add_features(picture, sums.pixel);
  round_as_stored(picture);
  if (denoised == Denoised::alone) {
    return put_clean(film, denoised_by(denoiser, std::move(picture)));
  }
  sums.layers.add_motion(picture);
  add_picture(film, std::move(picture));
}

/// Denoises what makes alpha, before anything is made of it; by this frame only.
void denoise_plate(const Job& job, Sums& sums) {
  const auto clean = [&](NoisyPicture picture) {
    sums.layers.add_features(picture, sums.pixel);
    return denoise(std::move(picture));
  };
  if (sums.plate.has_catchers())
    sums.plate.smooth_shadows(clean(sums.plate.shadows(job.width, job.height)));
  if (sums.plate.has_coverage())
    sums.plate.smooth_coverage(clean(sums.plate.coverage(job.width, job.height)),
                               [&](size_t p) { return sums.layers.saw_something(p); });
  sums.settle();
}

Film developed(const Job& job, const Sums& sums) {
  Film film = beauty_film(job, sums);
  film.layer = sums.layers.finish(sums.beauty(), sums.plate);
  film.header = sums.layers.header();
  return film;
}

PlateFilm plate_film(const Shot& shot, const Scene& scene, size_t pixels) {
  const bool see_through = shot.render.refraction_alpha == RefractionAlpha::transparent &&
                           (scene.features() & Feature::mattes) && !scene.bodies().empty();
  return {scene.has_catchers() ? pixels : 0, shot.render.denoise && see_through ? pixels : 0};
}

}  // namespace

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
  path.background = shot.render.background;
  path.refraction_alpha = shot.render.refraction_alpha;
  path.camera_in = scene.bodies_at(scene.camera().open().position, 0);
  const uint32_t seed = hash_bits(shot.render.seed ^ hash_bits(uint32_t(frame)));
  FramePhotons photons(scene, shot.render, options.walks, seed);
  if (photons.any()) path.photons = &photons.caustics().photons;
  const FilmWindow window = window_of(shot.render);
  const bool whole = window.frame_width == 0;
  Job job{.scene = scene,
          .path = path,
          .trace = path_function(scene.features() | options.force_features),
          .filter = PixelFilter(),
          .order = options.pixel_order,
          .seed = seed,
          .slots_log2 = uint32_t(std::bit_width(uint32_t(shot.render.samples) - 1)),
          .window = window,
          .width = whole ? shot.render.width : shot.render.crop_max.x - window.x,
          .height = whole ? shot.render.height : shot.render.crop_max.y - window.y};
  const size_t pixels = size_t(job.width) * job.height;
  Sums sums{.pixel = std::vector<PixelSum>(pixels),
            .layers = LayerFilm(shot, frame, scene, job.width, job.height),
            .plate = plate_film(shot, scene, pixels),
            .plan = SamplePlan(job.width, job.height, shot.render.samples, shot.render.error),
            .rounds = photons.rounds(shot.render, options.most_photons),
            .split = std::vector<PixelSum>(photons.any() ? pixels : 0)};
  Progress report(progress);
  uint64_t rays = 0;
  Passes(job, options, photons, sums, rays, report).render();
  if (shot.render.denoise) denoise_plate(job, sums);
  Film film = developed(job, sums);
  if (shot.render.denoise) denoise_film(sums, options.denoised, shot.render.denoiser, film);
  if (stats) {
    const double by_photons = photon_error(sums.beauty(), sums.split);
    *stats = {.camera_samples = report.samples(),
              .rays = rays,
              .relative_mse = picture_error(sums.beauty()) + by_photons,
              .photon_error = by_photons,
              .cpu_s = process_cpu_seconds() - cpu_start,
              .photon_radius = sums.rounds.radius(photons.caustics().photons.radius()),
              .walked = photons.caustics().walked};
  }
  return film;
}

Film render_frame(const Shot& shot, int frame, const FrameGeometry& geometry, RenderStats* stats,
                  const std::function<void(double)>& progress) {
  return render_frame(shot, frame, geometry, RenderOptions{}, stats, progress);
}

}  // namespace drench::render

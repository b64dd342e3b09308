// What the path tracer's rays cost bare, what a frame costs before its first ray, and rays that
// must not leave a closed body.
//
// The program is linked so that every ray of the path tracer comes by here (--wrap): it is written
// down and asked again of Embree, with nothing of the path tracer around it.

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/contract/files/mesh_file.h"
#include "render/sampler.h"
#include "render/sampling.h"
#include "render/scene/scene.h"
#include "tests/bench/render_scenes.h"
#include "tests/render/closed_body.h"

namespace drench::bench {

namespace {

struct Query {
  RTCRayHit ray;
  bool occlusion;
  render::Coherence coherence;
};

struct Recording {
  std::vector<Query> queries;
  const render::Scene* scene = nullptr;
};
Recording* recording = nullptr;

RTCRayHit embree_query(const render::Ray& ray, float reach) {
  const V3f &o = ray.origin, &d = ray.direction;
  return {{o.x, o.y, o.z, 0, d.x, d.y, d.z, ray.time, reach, 0xffffffffu, 0, 0}, {}};
}

}  // namespace

// Scene::intersect and Scene::occluded as the linker calls them, `this` first.
#define DRENCH_INTERSECT "_ZNK6drench6render5Scene9intersectERKNS0_3RayENS0_9CoherenceENS0_5WorldE"
#define DRENCH_OCCLUDED \
  "_ZNK6drench6render5Scene8occludedERKNS0_3RayERKNS1_6TargetENS0_5WorldENS1_4GapsE"
render::Hit real_intersect(const render::Scene*, const render::Ray&, render::Coherence,
                           render::World) asm("__real_" DRENCH_INTERSECT);
bool real_occluded(const render::Scene*, const render::Ray&, const render::Scene::Target&,
                   render::World, render::Scene::Gaps) asm("__real_" DRENCH_OCCLUDED);
render::Hit wrapped_intersect(const render::Scene*, const render::Ray&, render::Coherence,
                              render::World) asm("__wrap_" DRENCH_INTERSECT);
bool wrapped_occluded(const render::Scene*, const render::Ray&, const render::Scene::Target&,
                      render::World, render::Scene::Gaps) asm("__wrap_" DRENCH_OCCLUDED);

render::Hit wrapped_intersect(const render::Scene* scene, const render::Ray& ray,
                              render::Coherence coherence, render::World world) {
  if (recording) {
    recording->scene = scene;
    recording->queries.push_back(
        {embree_query(ray, std::numeric_limits<float>::infinity()), false, coherence});
  }
  return real_intersect(scene, ray, coherence, world);
}

bool wrapped_occluded(const render::Scene* scene, const render::Ray& ray,
                      const render::Scene::Target& target, render::World world,
                      render::Scene::Gaps gaps) {
  if (recording)
    recording->queries.push_back({embree_query(ray, target.distance * (1 - 1e-4f)), true, {}});
  return real_occluded(scene, ray, target, world, gaps);
}

namespace {

double thread_cpu_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// All that a frame's rays can meet as one Embree scene, the ground and rectangular lamps too.
class BareScene {
 public:
  BareScene(const render::Scene& scene, const Shot& shot)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_.get())) {
    bool robust = false;
    for (uint32_t k = 0; k < scene.object_count(); ++k) {
      const render::SceneObject& object = scene.object(k);
      add(object.position, object.position_close, object.triangle);
      robust |= object.body != 0;
    }
    const float half = float(shot.ground.half_size), y = float(shot.ground.height);
    quad({-half, y, -half}, {2 * half, 0, 0}, {0, 0, 2 * half});
    for (const render::ShapeLight& lamp : scene.lights().shapes())
      quad(lamp.center - lamp.u - lamp.v, lamp.u * 2.f, lamp.v * 2.f);
    if (robust) rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_.get());
  }
  RTCScene get() const { return scene_.get(); }

 private:
  void quad(const V3f& corner, const V3f& u, const V3f& v) {
    add({corner, corner + u, corner + u + v, corner + v, V3f(0)}, {}, {{0, 1, 2}, {0, 2, 3}});
  }
  /// The last position is padding.
  void add(const std::vector<V3f>& open, const std::vector<V3f>& close,
           const std::vector<Imath::Vec3<uint32_t>>& triangle) {
    const render::EmbreeGeometry geometry(
        rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    rtcSetGeometryTimeStepCount(geometry.get(), close.empty() ? 1 : 2);
    unsigned step = 0;
    for (const std::vector<V3f>* position : {&open, &close}) {
      if (position->empty()) continue;
      void* to = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, step++,
                                         RTC_FORMAT_FLOAT3, sizeof(V3f), position->size() - 1);
      std::copy(position->begin(), position->end() - 1, static_cast<V3f*>(to));
    }
    void* to = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                       sizeof(triangle[0]), triangle.size());
    std::copy(triangle.begin(), triangle.end(), static_cast<Imath::Vec3<uint32_t>*>(to));
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene_.get(), geometry.get());
  }

  render::EmbreeDevice device_;
  render::EmbreeScene scene_;
};

/// CPU seconds of the queries, asked in their order.
double replay(std::vector<Query>& queries, const BareScene& scene) {
  const render::FlushDenormals flush;
  const double start = thread_cpu_s();
  for (Query& query : queries) {
    query.ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    if (query.occlusion)
      render::embree_occluded(scene.get(), query.ray.ray);
    else
      render::embree_intersect(scene.get(), query.ray, query.coherence);
  }
  return thread_cpu_s() - start;
}

/// Of all tiles but the first, on one thread.
struct TileTime {
  double traced = 0;  // CPU s by the path tracer
  double bare = 0;    // CPU s of the same queries alone
  size_t queries = 0;
};

TileTime measure_tiles(const Shot& shot, const render::FrameGeometry& geometry) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  TileTime out;
  double start = 0;
  const auto time = [&](double share) {
    if (start == 0) start = thread_cpu_s();
    if (share == 1) out.traced = thread_cpu_s() - start;
  };
  render::render_frame(shot, shot.timeline.first, geometry, nullptr, time);
  Recording record;
  bool first = true;
  const auto end = [&](double share) {
    if (first) record.queries.clear();
    first = false;
    if (share < 1) return;
    recording = nullptr;
    out.queries = record.queries.size();
    out.bare = replay(record.queries, BareScene(*record.scene, shot));
  };
  recording = &record;
  render::render_frame(shot, shot.timeline.first, geometry, nullptr, end);
  return out;
}

void emit_share(const Emit& emit, const std::string& name, Shot shot,
                const render::FrameGeometry& geometry, double needed) {
  constexpr int run_count = 11;
  shot.render.width = 192;
  shot.render.height = 108;
  shot.render.samples = 16;
  std::vector<TileTime> runs;
  for (int run = 0; run < run_count; ++run) runs.push_back(measure_tiles(shot, geometry));
  const auto share = [](const TileTime& t) { return t.bare / t.traced; };
  std::nth_element(runs.begin(), runs.begin() + run_count / 2, runs.end(),
                   [&](const TileTime& a, const TileTime& b) { return share(a) < share(b); });
  const TileTime& median = runs[run_count / 2];
  Line line;
  line.method = name;
  line.resolution = "192 x 108 pixels, 16 samples";
  line.threads = 1;
  line.error = needed / share(median);
  line.error_of = "share needed over the share of the time that the rays take bare";
  line.gate = 1;
  line.more["share"] = share(median);
  line.more["queries"] = median.queries;
  line.more["queries_per_cpu_s"] = double(median.queries) / median.traced;
  line.more["bare_queries_per_cpu_s"] = double(median.queries) / median.bare;
  emit(line);
}

void render_rays(const Emit& emit) {
  emit_share(emit, "cloth", cloth_shot(), {{}, {{"cloth", pleated_sheet(256)}}}, 0.6);
  Shot sky = pool_shot();
  sky.light.erase(sky.light.begin());
  emit_share(emit, "pool under the sky", sky, {wavy_pool(256), {}}, 0.5);
  emit_share(emit, "pool, small lamp", pool_shot(), {wavy_pool(256), {}}, 0.5);
}

const Registration render_rays_case{
    "render_rays", "share of the time that the path tracer's rays take bare", render_rays};

/// From the file of a mesh of a million triangles to the picture of one pixel.
void render_load(const Emit& emit) {
  constexpr int run_count = 3;
  const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                     ("drench_render_load." + std::to_string(getpid()) + ".ply");
  for (const bool moving : {false, true}) {
    TriangleMesh pool = wavy_pool(500);
    if (moving)
      for (size_t k = 0; k < pool.velocity.size(); ++k)
        pool.velocity[k] = {std::sin(float(k)), 1, std::cos(float(k))};
    write_mesh(file, pool);
    Shot shot = pool_shot();
    shot.render.width = shot.render.height = shot.render.samples = 1;
    shot.render.photons = 0;
    std::vector<double> read, whole;
    for (int run = 0; run < run_count; ++run) {
      render::FrameGeometry geometry;
      read.push_back(measure([&] { geometry.fluid = read_mesh(file); }).cpu_s);
      whole.push_back(read.back() + render(shot, geometry, 1, 1).cost.cpu_s);
    }
    std::nth_element(read.begin(), read.begin() + run_count / 2, read.end());
    std::nth_element(whole.begin(), whole.begin() + run_count / 2, whole.end());
    Line line;
    line.method = moving ? "mesh that moves" : "mesh that stands";
    line.resolution = std::to_string(pool.triangle.size()) + " triangles";
    line.threads = hardware_threads();
    line.error = whole[run_count / 2] / (1e-6 * double(pool.triangle.size()));
    line.error_of = "CPU s per million triangles, from the file to the first ray";
    line.gate = 1.2;
    line.more["read_cpu_s"] = read[run_count / 2];
    emit(line);
  }
  std::filesystem::remove(file);
}

const Registration render_load_case{
    "render_load", "a frame of a million triangles, from the file to the first ray", render_load};

void render_leaks(const Emit& emit) {
  constexpr uint32_t chains = 1u << 20;
  constexpr int length = 100;
  for (const bool waves : {false, true}) {
    Shot shot = pool_shot();
    shot.ground.present = false;
    TriangleMesh body = wavy_pool(waves ? 128 : 1);
    const render::Scene scene(shot, shot.timeline.first, {body, {}}, {});
    std::atomic<uint64_t> lost{0};
    Line line;
    line.cost = measure([&] {
      tbb::parallel_for(0u, chains, [&](uint32_t chain) {
        const float x = render::unit_float(render::hash_bits(chain)) - 0.5f;
        lost += render::test::loses_ray(scene, {3.9f * x, 0.1f, 0.3f}, chain, length);
      });
    });
    line.method = waves ? "slab with waves" : "box";
    line.resolution = std::to_string(uint64_t(chains) * length) + " rays, " +
                      std::to_string(body.triangle.size()) + " triangles";
    line.threads = hardware_threads();
    line.error = double(lost);
    line.error_of = "chains of rays that left the body";
    line.gate = 0;
    emit(line);
  }
}

const Registration render_leaks_case{
    "render_leaks", "a hundred million rays in a closed body: none leaves it", render_leaks};

}  // namespace

}  // namespace drench::bench

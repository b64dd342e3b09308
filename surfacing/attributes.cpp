#include "surfacing/attributes.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace drench::surfacing {
namespace {

/// Weighted sums of the particles around eight vertices, and the nearest of them.
struct Around {
  Pack weight{}, age{}, wetness{};
  Pack least = pack(1e30f), nearest = pack(-1);  // distance^2 in reaches; index in NearParticles

  void add(Pack distance2, float index, float age_there, float wetness_there) {
    const Pack close = larger(1.f - distance2, Pack{});
    const Pack w = close * close * close;
    weight += w;
    age = multiply_add(w, pack(age_there), age);
    wetness = multiply_add(w, pack(wetness_there), wetness);
    nearest = distance2 < least ? pack(index) : nearest;
    least = smaller(least, distance2);
  }
};

class Columns {
 public:
  Columns(const BinnedParticles& particles, const ParticleFrame& frame, float reach,
          TriangleMesh& result)
      : particles_(particles), frame_(frame), reach_(reach), result_(result) {}

  void fill(const std::vector<V3f>& position, uint32_t begin, uint32_t count, V3f corner,
            const NearParticles& near) {
    const PointPack points = points_of(position, begin, count, corner);
    const Pack x = load(points.x.data()), y = load(points.y.data()), z = load(points.z.data());
    const Pack step = pack(1 / reach_);
    Around around;
    for_each_close(near, points, reach_, [&](size_t j) {
      const Pack dx = (near.x[j] - x) * step, dy = (near.y[j] - y) * step,
                 dz = (near.z[j] - z) * step;
      around.add(multiply_add(dx, dx, multiply_add(dy, dy, dz * dz)), static_cast<float>(j),
                 value(frame_.age, near, j), value(frame_.wetness, near, j));
    });
    std::array<float, pack_width> weight, age, wetness, nearest;
    store(weight.data(), around.weight), store(nearest.data(), around.nearest);
    store(age.data(), around.age / around.weight);
    store(wetness.data(), around.wetness / around.weight);
    for (uint32_t k = 0; k < count; ++k) {
      const bool met = weight[k] > 1e-12f;
      const size_t j = met ? static_cast<size_t>(nearest[k])
                           : nearest_of(near, {points.x[k], points.y[k], points.z[k]});
      if (!frame_.source.empty())
        result_.source[begin + k] = frame_.source[particles_.source[near.index[j]]];
      if (!frame_.age.empty()) result_.age[begin + k] = met ? age[k] : value(frame_.age, near, j);
      if (!frame_.wetness.empty())
        result_.wetness[begin + k] = met ? wetness[k] : value(frame_.wetness, near, j);
    }
  }

 private:
  float value(const std::vector<float>& column, const NearParticles& near, size_t j) const {
    return column.empty() ? 0 : column[particles_.source[near.index[j]]];
  }

  const BinnedParticles& particles_;
  const ParticleFrame& frame_;
  float reach_;
  TriangleMesh& result_;
};

}  // namespace

void add_attributes(const LatticeMesh& mesh, const BinnedParticles& particles,
                    const ParticleFrame& frame, float reach, TriangleMesh& result) {
  if (frame.source.empty() && frame.age.empty() && frame.wetness.empty()) return;
  const size_t n = mesh.position.size();
  result.source.resize(frame.source.empty() ? 0 : n);
  result.age.resize(frame.age.empty() ? 0 : n);
  result.wetness.resize(frame.wetness.empty() ? 0 : n);
  Columns columns(particles, frame, reach, result);
  tbb::enumerable_thread_specific<NearParticles> nears;
  tbb::parallel_for(size_t{0}, mesh.block.size(), [&](size_t b) {
    const BlockVertices& block = mesh.block[b];
    NearParticles& near = nears.local();
    gather_near(particles, block.block, block_edge, particles.lattice.reach, near);
    if (near.size() == 0) return;  // cannot be: the field here comes from particles in reach
    for (uint32_t v = block.begin; v < block.end; v += pack_width)
      columns.fill(mesh.position, v, std::min<uint32_t>(pack_width, block.end - v),
                   V3f(block.block * block_edge), near);
  });
}

}  // namespace drench::surfacing

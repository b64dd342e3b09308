#include "surfacing/foam_source.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "pipeline/contract/shot/gravity.h"

namespace drench::surfacing {
namespace {

constexpr float full_at = 5;  // times the threshold: from here on all air is caught
/// Kinetic energy over that at the breaking speed: none below the first, all above the second.
constexpr float energy_low = 1, energy_high = 10;
constexpr float crest_low = 0.1f, crest_high = 0.4f;  // curvature of crests
/// Weighted sums over a full neighbourhood: the integral of 1 - r / h over its ball.
constexpr float full_weight = 3.14159265f / 3 * foam_support * foam_support * foam_support;
/// Who has fewer neighbours than this fraction sees air; who has a smaller offset has no normal.
constexpr float airy_fullness = 0.85f, least_offset = 0.2f;

float ramp(float value, float low, float high) {
  return std::clamp((value - low) / (high - low), 0.f, 1.f);
}

/// A particle as its block sees it: voxels from the corner, m/s from the block's base.
struct Seen {
  V3f position, velocity;
};

struct Sums {
  Pack weight{}, x{}, y{}, z{}, u{}, v{}, w{}, closing{};
};

/// The sums over all neighbours, itself among them.
Potential sum_up(const NearFluid& fluid, const Seen& me) {
  const Pack x = pack(me.position.x), y = pack(me.position.y), z = pack(me.position.z);
  const Pack u = pack(me.velocity.x), v = pack(me.velocity.y), w = pack(me.velocity.z);
  const Pack scale = pack(1 / foam_reach), reach2 = pack(foam_reach * foam_reach);
  Sums sum;
  for (size_t j = 0; j < fluid.near.size(); j += pack_width) {
    const Pack dx = load(fluid.near.x.data() + j) - x, dy = load(fluid.near.y.data() + j) - y,
               dz = load(fluid.near.z.data() + j) - z;
    const Pack distance2 = multiply_add(dx, dx, multiply_add(dy, dy, dz * dz));
    if (less_bits(distance2, reach2) == 0) continue;
    const Pack distance = square_root(distance2);
    const Pack weight = larger(subtract_product(pack(1), distance, scale), Pack{});
    const Pack du = load(fluid.u.data() + j) - u, dv = load(fluid.v.data() + j) - v,
               dw = load(fluid.w.data() + j) - w;
    const Pack along = multiply_add(du, dx, multiply_add(dv, dy, dw * dz));
    const Pack closing = larger(-along, Pack{}) / larger(distance, pack(1e-6f));
    sum.weight += weight;
    sum.x = multiply_add(weight, dx, sum.x);
    sum.y = multiply_add(weight, dy, sum.y);
    sum.z = multiply_add(weight, dz, sum.z);
    sum.u = multiply_add(weight, du, sum.u);
    sum.v = multiply_add(weight, dv, sum.v);
    sum.w = multiply_add(weight, dw, sum.w);
    sum.closing = multiply_add(weight, closing, sum.closing);
  }
  Potential p;
  const float weight = sum_of(sum.weight);
  p.fullness = weight / full_weight;
  p.closing = sum_of(sum.closing) / full_weight;
  p.offset =
      V3f(sum_of(sum.x), sum_of(sum.y), sum_of(sum.z)) * (-1 / (weight * foam_voxels_per_spacing));
  const V3f relative = V3f(sum_of(sum.u), sum_of(sum.v), sum_of(sum.w)) * (-1 / weight);
  const float length = p.offset.length();
  const float ahead = length > least_offset ? relative.dot(p.offset) / length : 0;
  if (ahead > 0.6f * relative.length()) p.ahead = ahead;
  return p;
}

/// Curvature of a crest: over the neighbours with normals that lie behind it.
float crest_curvature(const NearFluid& fluid, const FluidMoment& all, const Seen& me,
                      const V3f& offset, const std::vector<Potential>& potential) {
  const V3f normal = offset.normalized();
  double sum = 0, weights = 0;
  for (size_t j = 0; j < fluid.near.size(); ++j) {
    const V3f d = V3f(fluid.near.x[j], fluid.near.y[j], fluid.near.z[j]) - me.position;
    const float distance = d.length();
    if (distance >= foam_reach || d.dot(normal) >= 0) continue;
    const uint32_t source = all.bins.source[fluid.near.index[j]];
    if (source >= all.real) continue;
    const V3f& other = potential[source].offset;
    const float length = other.length();
    if (length < least_offset) continue;
    const float weight = 1 - distance / foam_reach;
    sum += weight * (1 - normal.dot(other) / length);
    weights += weight;
  }
  return weights > 0 ? float(sum / weights) : 0;
}

/// Calls f(near, particle's index, as seen) for every particle of the chosen blocks that is no
/// image.
template <class F>
void for_each_particle(const FluidMoment& fluid, const std::vector<uint8_t>& chosen, const F& f) {
  const BinnedParticles& bins = fluid.bins;
  tbb::enumerable_thread_specific<NearFluid> scratch;
  tbb::parallel_for(size_t{0}, bins.block.size(), [&](size_t b) {
    if (!chosen[b]) return;
    NearFluid& near = scratch.local();
    near.gather(fluid, block_of(bins.block[b]));
    for (uint32_t k = bins.first[b]; k < bins.first[b + 1]; ++k) {
      const uint32_t i = bins.source[k];
      if (i >= fluid.real) continue;
      f(near, i, Seen{{bins.x[k], bins.y[k], bins.z[k]}, fluid.velocity[i] - near.base});
    }
  });
}

float energy(const V3f& velocity, float breaking) {
  return velocity.length2() / (breaking * breaking);
}

/// Blocks with particles fast enough to make foam, and, for their normals, those around them.
std::pair<std::vector<uint8_t>, std::vector<uint8_t>> fast_blocks(const FluidMoment& fluid,
                                                                  float breaking) {
  const BinnedParticles& bins = fluid.bins;
  std::vector<uint8_t> fast(bins.block.size(), 0), around(bins.block.size(), 0);
  for (size_t b = 0; b < bins.block.size(); ++b)
    for (uint32_t k = bins.first[b]; k < bins.first[b + 1] && !fast[b]; ++k)
      fast[b] = bins.source[k] < fluid.real &&
                energy(fluid.velocity[bins.source[k]], breaking) > energy_low;
  for (size_t b = 0; b < bins.block.size(); ++b) {
    if (!fast[b]) continue;
    V3i step;
    for (step.z = -1; step.z <= 1; ++step.z)
      for (step.y = -1; step.y <= 1; ++step.y)
        for (step.x = -1; step.x <= 1; ++step.x) {
          const uint32_t other = bins.map.find(block_of(bins.block[b]) + step);
          if (other != BlockMap::none) around[other] = 1;
        }
  }
  return {fast, around};
}

}  // namespace

float breaking_speed(const Shot& shot) {
  const double spacing = shot.fluid.spacing;
  const double tension = shot.fluid.surface_tension > 0 ? shot.fluid.surface_tension : 0.072;
  return float(
      std::sqrt(largest_gravity(shot) * spacing + tension / (shot.fluid.rest_density * spacing)));
}

std::vector<Potential> potentials(const FluidMoment& fluid, float breaking) {
  std::vector<Potential> result(fluid.real);
  const auto [fast, around] = fast_blocks(fluid, breaking);
  for_each_particle(fluid, around, [&](const NearFluid& near, uint32_t i, const Seen& me) {
    result[i] = sum_up(near, me);
  });
  for_each_particle(fluid, fast, [&](const NearFluid& near, uint32_t i, const Seen& me) {
    Potential& p = result[i];
    if (p.ahead > 0 && p.fullness < airy_fullness)
      p.curvature = crest_curvature(near, fluid, me, p.offset, result);
  });
  return result;
}

std::vector<float> birth_rates(const FluidMoment& fluid, const Shot& shot) {
  const float breaking = breaking_speed(shot), spacing = float(shot.fluid.spacing);
  const float low = float(shot.foam.threshold) * breaking, high = full_at * low;
  const float air = float(shot.foam.trapped_air), crest = float(shot.foam.wave_crest);
  const std::vector<Potential> potential = potentials(fluid, breaking);
  std::vector<float> rate(fluid.real);
  for (size_t i = 0; i < fluid.real; ++i) {
    const Potential& p = potential[i];
    if (!(p.fullness < airy_fullness)) continue;
    const float trapped = air * ramp(p.closing, low, high) * p.closing;
    const float thrown =
        crest * ramp(p.curvature, crest_low, crest_high) * ramp(p.ahead, low, high) * p.ahead;
    rate[i] = ramp(energy(fluid.velocity[i], breaking), energy_low, energy_high) *
              (trapped + thrown) / spacing;
  }
  return rate;
}

float random_number(uint32_t seed, uint32_t frame, uint32_t id, uint32_t draw) {
  // The finaliser of splitmix64, twice: all bits of both words depend on all of the key.
  const auto mixed = [](uint64_t x) {
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ x >> 27) * 0x94d049bb133111ebull;
    return x ^ x >> 31;
  };
  const uint64_t key = mixed(uint64_t(seed) << 32 | frame) ^ (uint64_t(id) << 32 | draw);
  return float(mixed(key) >> 40) * 0x1p-24f;
}

}  // namespace drench::surfacing

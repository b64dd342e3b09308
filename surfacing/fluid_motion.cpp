#include "surfacing/fluid_motion.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

#include "pipeline/contract/error.h"

namespace drench::surfacing {
namespace {

/// d less whole periods: the shortest displacement between two points.
V3f shortest(V3f d, const Domain& domain) {
  for (int axis = 0; axis < 3; ++axis) {
    if (domain.axis[axis] != Axis::periodic) continue;
    const float period = float(domain.max[axis] - domain.min[axis]);
    d[axis] -= period * std::round(d[axis] / period);
  }
  return d;
}

/// Appends what stands beyond one axis' ends and is seen from within: positions and velocities.
void add_images(int axis, const Domain& domain, float reach, std::vector<V3f>& position,
                std::vector<V3f>& velocity) {
  if (domain.axis[axis] == Axis::open) return;
  const float low = float(domain.min[axis]), high = float(domain.max[axis]);
  const bool mirrors = domain.axis[axis] == Axis::walls;
  const auto add = [&](size_t i, float image) {
    V3f p = position[i], v = velocity[i];
    p[axis] = image;
    if (mirrors) v[axis] = -v[axis];
    position.push_back(p);
    velocity.push_back(v);
  };
  for (size_t i = 0, n = position.size(); i < n; ++i) {
    const float x = position[i][axis];
    if (x - low < reach) add(i, mirrors ? 2 * low - x : x + (high - low));
    if (high - x < reach) add(i, mirrors ? 2 * high - x : x - (high - low));
  }
}

Lattice lattice_around(const std::vector<V3f>& fluid, const std::vector<V3f>& points,
                       float spacing) {
  Lattice lattice;
  lattice.voxel = double(spacing) / foam_voxels_per_spacing;
  lattice.reach = foam_reach;
  lattice.voxels_per_spacing = foam_voxels_per_spacing;
  V3f low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
  for (const std::vector<V3f>* column : {&fluid, &points})
    for (const V3f& p : *column)
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
      }
  if (const int axis = lattice.fit(low, high); axis >= 0) {
    throw Error(fmt::format(
        "foam: fluid and foam are spread over {:.4g} m along {}, more than 2^24 voxels of {:.4g} "
        "m. Make the domain smaller, or simulate again if the fluid blew up",
        high[axis] - low[axis], "xyz"[axis], lattice.voxel));
  }
  return lattice;
}

struct Sum {
  Pack weight{}, u{}, v{}, w{};
};

Around around_point(const NearFluid& fluid, V3f point) {
  const Pack x = pack(point.x), y = pack(point.y), z = pack(point.z);
  const Pack reach2 = pack(foam_reach * foam_reach), scale = pack(1 / (foam_reach * foam_reach));
  Sum sum;
  uint32_t count = 0;
  for (size_t j = 0; j < fluid.near.size(); j += pack_width) {
    const Pack dx = load(fluid.near.x.data() + j) - x, dy = load(fluid.near.y.data() + j) - y,
               dz = load(fluid.near.z.data() + j) - z;
    const Pack distance2 = multiply_add(dx, dx, multiply_add(dy, dy, dz * dz));
    const unsigned inside = less_bits(distance2, reach2);
    if (inside == 0) continue;
    count += unsigned(std::popcount(inside));
    const Pack near = larger(subtract_product(pack(1), distance2, scale), Pack{});
    const Pack weight = near * near * near;
    sum.weight += weight;
    sum.u = multiply_add(weight, load(fluid.u.data() + j), sum.u);
    sum.v = multiply_add(weight, load(fluid.v.data() + j), sum.v);
    sum.w = multiply_add(weight, load(fluid.w.data() + j), sum.w);
  }
  const float weight = sum_of(sum.weight);
  if (!(weight > 0)) return {count, V3f(0)};
  return {count, fluid.base + V3f(sum_of(sum.u), sum_of(sum.v), sum_of(sum.w)) / weight};
}

}  // namespace

FluidMotion::FluidMotion(const ParticleFrame& before, const ParticleFrame& after,
                         const Domain& domain, float dt)
    : position_(after.position), velocity_(after.velocity), dt_(dt) {
  const size_t n = position_.size();
  displacement_.resize(n);
  start_velocity_.resize(n);
  const bool named = after.id.size() == n && before.id.size() == before.position.size();
  for (size_t i = 0, k = 0; i < n; ++i) {
    while (named && k < before.id.size() && before.id[k] < after.id[i]) ++k;
    const bool known = named && k < before.id.size() && before.id[k] == after.id[i];
    displacement_[i] =
        known ? shortest(position_[i] - before.position[k], domain) : velocity_[i] * dt;
    start_velocity_[i] = known ? before.velocity[k] : velocity_[i];
    const float speed2 = std::max({velocity_[i].length2(), start_velocity_[i].length2(),
                                   displacement_[i].length2() / (dt * dt)});
    largest_speed_ = std::max(largest_speed_, std::sqrt(speed2));
  }
}

V3f FluidMotion::position(size_t i, float s) const {
  const float left = 1 - s;
  const float end = s * s * (3 - 2 * s), from = s * left * left, to = -s * s * left;
  return position_[i] - displacement_[i] * (1 - end) +
         (start_velocity_[i] * from + velocity_[i] * to) * dt_;
}

V3f FluidMotion::velocity(size_t i, float s) const {
  const float from = (3 * s - 4) * s + 1, to = (3 * s - 2) * s;
  return displacement_[i] * (6 * s * (1 - s) / dt_) + start_velocity_[i] * from + velocity_[i] * to;
}

V3f wrapped(V3f position, const Domain& domain) {
  for (int axis = 0; axis < 3; ++axis) {
    if (domain.axis[axis] != Axis::periodic) continue;
    const float low = float(domain.min[axis]), period = float(domain.max[axis] - domain.min[axis]);
    position[axis] -= period * std::floor((position[axis] - low) / period);
  }
  return position;
}

FluidMoment fluid_at(const FluidMotion& motion, float s, const Domain& domain, float spacing,
                     const std::vector<V3f>& points) {
  FluidMoment fluid;
  fluid.real = motion.size();
  std::vector<V3f> position(motion.size());
  fluid.velocity.resize(motion.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, motion.size(), 4096), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) {
      position[i] = wrapped(motion.position(i, s), domain);
      fluid.velocity[i] = motion.velocity(i, s);
    }
  });
  for (int axis = 0; axis < 3; ++axis)
    add_images(axis, domain, foam_support * spacing, position, fluid.velocity);
  fluid.bins = bin_particles(position, lattice_around(position, points, spacing));
  return fluid;
}

void NearFluid::gather(const FluidMoment& fluid, V3i block) {
  gather_near(fluid.bins, block, block_edge, foam_reach, near);
  for (std::vector<float>* column : {&u, &v, &w}) column->assign(near.size() + pack_width, 0.f);
  if (near.size() == 0) return;
  base = fluid.velocity[fluid.bins.source[near.index[0]]];
  for (size_t j = 0; j < near.size(); ++j) {
    const V3f d = fluid.velocity[fluid.bins.source[near.index[j]]] - base;
    u[j] = d.x, v[j] = d.y, w[j] = d.z;
  }
}

std::vector<Around> fluid_around(const FluidMoment& fluid, const std::vector<V3f>& points) {
  std::vector<Around> result(points.size());
  const BinnedParticles binned = bin_particles(points, fluid.bins.lattice);
  tbb::enumerable_thread_specific<NearFluid> scratch;
  tbb::parallel_for(size_t{0}, binned.block.size(), [&](size_t b) {
    NearFluid& near = scratch.local();
    near.gather(fluid, block_of(binned.block[b]));
    if (near.near.size() == 0) return;
    for (uint32_t k = binned.first[b]; k < binned.first[b + 1]; ++k)
      result[binned.source[k]] = around_point(near, {binned.x[k], binned.y[k], binned.z[k]});
  });
  return result;
}

}  // namespace drench::surfacing

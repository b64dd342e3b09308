#include "surfacing/field.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/error.h"
#include "surfacing/anisotropy.h"
#include "surfacing/cloth_solid.h"
#include "surfacing/pack.h"
#include "surfacing/spline.h"

namespace drench::surfacing {
namespace {

constexpr int rows = block_edge * block_edge;
constexpr float bulk = 0.95f;  // weight of a particle with all its neighbours

/// Radius of the iso surface, spacings, that the mesh of a lone particle needs for the volume
/// spacing^3: chords cut about 0.63 (voxel / radius)^2 off a ball (measured: 0.40 and 0.11 of it at
/// voxels of 0.5 and 0.25 spacings and a radius of 0.62).
float lone_radius(float voxel, float support) {
  constexpr float cubed =
      3 / (4 * std::numbers::pi_v<float>);  // radius^3 of a ball of one spacing^3
  float radius = 0.7f;
  for (int step = 0; step < 8; ++step)  // radius^3 (1 - 0.63 (voxel / radius)^2) = cubed
    radius = std::cbrt(cubed + 0.63f * voxel * voxel * radius);
  return std::min(radius, 0.5f * support);  // on coarser lattices drops get smaller
}

template <class F>
void for_each_neighbour(F f) {
  V3i step;
  for (step.z = -1; step.z <= 1; ++step.z)
    for (step.y = -1; step.y <= 1; ++step.y)
      for (step.x = -1; step.x <= 1; ++step.x)
        if (step != V3i(0)) f(step);
}

/// Adds one particle to every row of the block that it reaches. p in supports from lattice point 0.
void splat(const V3f p, float weight, float step, BlockValues& value) {
  const auto away = [&](float v) { return std::max({-v, v - (block_edge - 1) * step, 0.f}); };
  const Pack dx = lanes() * step - p.x;
  const Pack dx2 = dx * dx;
  const Pack weight2 = pack(2 * weight), weight8 = pack(8 * weight);
  const float free_x = 1 - away(p.x) * away(p.x);
  for (int z = 0; z < block_edge; ++z) {
    const float dz = z * step - p.z;
    const float free_z = free_x - dz * dz;
    if (free_z <= 0) continue;
    float* row = value.data() + z * rows;
    for (int y = 0; y < block_edge; ++y, row += block_edge) {
      const float dy = y * step - p.y;
      if (dy * dy >= free_z) continue;
      store(row, add_spline(load(row), dx2 + (dy * dy + dz * dz), weight2, weight8));
    }
  }
}

void evaluate_block(const BinnedParticles& particles, const ColourKernel& kernel,
                    const ClothSolids& cloth, FieldBlock& field, BlockValues& value,
                    NearParticles& near) {
  value.fill(0.f);
  const float reach = particles.lattice.reach;
  gather_near(particles, field.block, block_edge - 1, reach, near);
  const float step = 1 / reach, scale = kernel.scale();
  for (size_t j = 0; j < near.size(); ++j) {
    const V3f p = V3f(near.x[j], near.y[j], near.z[j]) * step;
    if (const Ellipsoid* shape = particles.ellipsoids.find(near.index[j]))
      splat_ellipsoid(p, *shape, scale, step, value);
    else
      splat(p, near.weight[j] * scale, step, value);
  }
  if (cloth.near(field.block)) cloth.cut(field.block, value, kernel.iso_value);
  for (int row = 0; row < rows; ++row)
    field.inside[row] = static_cast<uint8_t>(
        not_less_bits(load(value.data() + row * block_edge), pack(kernel.iso_value)));
}

struct ColourPack {
  std::array<float, pack_width> c, offset;  // as ColourKernel::weight takes them
};

/// The unweighted colour at particles [begin, begin + count) of one block, count <= 8.
ColourPack colours_of(const BinnedParticles& particles, uint32_t begin, uint32_t count,
                      const ColourKernel& kernel, const NearParticles& near) {
  const float reach = particles.lattice.reach, step = 1 / reach;
  PointPack points;
  for (uint32_t k = 0; k < pack_width; ++k) {
    const uint32_t i = begin + std::min(k, count - 1);
    points.x[k] = particles.x[i], points.y[k] = particles.y[i], points.z[k] = particles.z[i];
  }
  const Pack x = load(points.x.data()), y = load(points.y.data()), z = load(points.z.data());
  const Pack two = pack(2.f), eight = pack(8.f);
  Pack sum{}, sum_x{}, sum_y{}, sum_z{};
  for_each_close(near, points, reach, [&](size_t j) {
    const Pack dx = (x - near.x[j]) * step, dy = (y - near.y[j]) * step,
               dz = (z - near.z[j]) * step;
    const Pack w =
        add_spline(Pack{}, multiply_add(dx, dx, multiply_add(dy, dy, dz * dz)), two, eight);
    sum += w;
    sum_x = multiply_add(w, dx, sum_x);
    sum_y = multiply_add(w, dy, sum_y);
    sum_z = multiply_add(w, dz, sum_z);
  });
  ColourPack result;
  store(result.c.data(), sum * kernel.scale());
  store(result.offset.data(), square_root(sum_x * sum_x + sum_y * sum_y + sum_z * sum_z) / sum);
  return result;
}

/// Blocks and what is known of them while the set grows. Occupied blocks come first, in the order
/// of the particles' blocks; then empty ones in reach of a particle; then those added by the
/// closure.
struct BlockSet {
  std::vector<BlockKey> key;
  BlockMap map;
  std::vector<uint32_t> slot;  // evaluated: index into the blocks; interior or waiting: none
};

/// Bounding box of a block's particles, voxels from its corner.
void bounds_of(const BinnedParticles& particles, size_t b, V3f& low, V3f& high) {
  low = V3f(block_edge);
  high = V3f(0);
  for (uint32_t i = particles.first[b]; i < particles.first[b + 1]; ++i) {
    const V3f p(particles.x[i], particles.y[i], particles.z[i]);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
}

BlockSet blocks_in_reach(const BinnedParticles& particles) {
  const int ring = particles.lattice.ring();
  const float reach = particles.lattice.reach;
  tbb::enumerable_thread_specific<std::vector<BlockKey>> found;
  tbb::parallel_for(size_t{0}, particles.block.size(), [&](size_t b) {
    const V3i block = block_of(particles.block[b]);
    V3f low, high;
    bounds_of(particles, b, low, high);
    const auto gap = [&](int axis, int step) {  // between the particles' box and the block's cells
      const float from = static_cast<float>(step * block_edge);
      return std::max({from - high[axis], low[axis] - from - block_edge, 0.f});
    };
    V3i step;
    for (step.z = -ring; step.z <= ring; ++step.z)
      for (step.y = -ring; step.y <= ring; ++step.y)
        for (step.x = -ring; step.x <= ring; ++step.x)
          if (V3f(gap(0, step.x), gap(1, step.y), gap(2, step.z)).length2() < reach * reach &&
              particles.map.find(block + step) == BlockMap::none)
            found.local().push_back(key_of(block + step));
  });
  BlockSet set{particles.block, particles.map, {}};
  std::vector<BlockKey> empty;
  for (const auto& part : found) empty.insert(empty.end(), part.begin(), part.end());
  tbb::parallel_sort(empty.begin(), empty.end());
  empty.erase(std::unique(empty.begin(), empty.end()), empty.end());
  for (const BlockKey key : empty) {
    set.map.insert(key, static_cast<uint32_t>(set.key.size()));
    set.key.push_back(key);
  }
  set.slot.assign(set.key.size(), BlockMap::none);
  return set;
}

enum class Side { outside, inside };

/// Whether the layer of points of `field` that shares cells with the block at `step` is wholly on
/// that side.
bool border_is(const FieldBlock& field, V3i step, Side side) {
  const auto first = [](int s) { return s > 0 ? block_edge - 1 : 0; };
  const auto last = [](int s) { return s < 0 ? 0 : block_edge - 1; };
  const uint8_t mask = step.x > 0 ? 0x80 : step.x < 0 ? 0x01 : 0xff;
  const uint8_t wanted = side == Side::inside ? mask : 0;
  for (int z = first(step.z); z <= last(step.z); ++z)
    for (int y = first(step.y); y <= last(step.y); ++y)
      if ((field.inside[z * block_edge + y] & mask) != wanted) return false;
  return true;
}

/// Blocks not yet evaluated whose side the border of an evaluated neighbour contradicts, and
/// interior blocks with a neighbour outside the set.
std::vector<BlockKey> contradicted(const BlockSet& set, const std::vector<FieldBlock>& fields,
                                   size_t first_new) {
  tbb::enumerable_thread_specific<std::vector<BlockKey>> found;
  tbb::parallel_for(first_new, fields.size(), [&](size_t f) {
    for_each_neighbour([&](V3i step) {
      const V3i block = fields[f].block + step;
      const uint32_t b = set.map.find(block);
      if (b != BlockMap::none && set.slot[b] != BlockMap::none) return;
      const Side side = b != BlockMap::none ? Side::inside : Side::outside;
      if (!border_is(fields[f], step, side)) found.local().push_back(key_of(block));
    });
  });
  if (first_new == 0)
    tbb::parallel_for(size_t{0}, set.key.size(), [&](size_t b) {
      if (set.slot[b] != BlockMap::none) return;
      const V3i block = block_of(set.key[b]);
      bool closed = true;
      for_each_neighbour([&](V3i step) { closed &= set.map.find(block + step) != BlockMap::none; });
      if (!closed) found.local().push_back(set.key[b]);
    });
  std::vector<BlockKey> keys;
  for (const auto& part : found) keys.insert(keys.end(), part.begin(), part.end());
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

void check_memory(size_t blocks, double max_bytes) {
  const double bytes = static_cast<double>(blocks) * bytes_a_block;
  if (bytes <= max_bytes) return;
  throw Error(
      fmt::format("surfacing: {} lattice blocks need {:.3g} GiB, more than the {:.3g} GiB left of "
                  "surface.memory_gib; raise surface.memory_gib or surface.voxel",
                  blocks, bytes / (1 << 30), max_bytes / (1 << 30)));
}

}  // namespace

ColourKernel::ColourKernel(float support_, float voxel, float iso_value_)
    : support(support_), iso_value(iso_value_) {
  lone_weight = iso_value / (bulk * scale() * shape(lone_radius(voxel, support) / support));
}

float ColourKernel::scale() const {
  return static_cast<float>(8 / (std::numbers::pi * support * support * support));
}

float ColourKernel::shape(float q) {
  const float a = std::max(1 - q, 0.f), b = std::max(0.5f - q, 0.f);
  return 2 * a * a * a - 8 * b * b * b;
}

float ColourKernel::weight(float c, float offset) const {
  constexpr float film_colour = 0.66f, surface_colour = 0.78f, one_sided = 0.12f;
  // At supports below 1.6 a particle's own part is above the film's colour, and nothing is
  // missing.
  const float alone = std::max(1 / scale() - 1 / film_colour, 1e-3f);
  const float missing = std::max(0.f, 1 / c - 1 / film_colour) / alone;
  const float thin = 1 + (lone_weight - 1) * missing * (0.5f + 0.5f * missing);
  const float surface = std::min(surface_colour / c, 1.3f) - 1;
  return bulk * std::max(thin, 1 + surface * std::min(offset / one_sided, 1.f));
}

float ColourKernel::bulk_weight() const { return bulk; }

std::vector<uint8_t> count_interior(const BinnedParticles& particles) {
  const int bins = particles.lattice.bins, padded = bins + 2;
  const float bin_spacings =
      block_edge / (particles.lattice.voxels_per_spacing * static_cast<float>(bins));
  const float full = bin_spacings * bin_spacings * bin_spacings;  // particles in a full bin
  constexpr float enough = 0.65f;
  std::vector<uint8_t> interior(particles.block.size());
  tbb::parallel_for(size_t{0}, interior.size(), [&](size_t b) {
    const size_t count = particles.first[b + 1] - particles.first[b];
    if (static_cast<float>(count) < enough * full * static_cast<float>(particles.bin_stride() - 1))
      return;
    const V3i block = block_of(particles.block[b]);
    std::vector<float> cell(static_cast<size_t>(padded) * padded * padded);
    size_t at = 0;
    for (int z = -1; z <= bins; ++z)
      for (int y = -1; y <= bins; ++y)
        for (int x = -1; x <= bins; ++x, ++at) {
          const auto side = [&](int v) { return v < 0 ? -1 : v == bins ? 1 : 0; };
          const uint32_t other = particles.map.find(block + V3i(side(x), side(y), side(z)));
          if (other == BlockMap::none) continue;
          const auto wrap = [&](int v) { return (v + bins) % bins; };
          const uint32_t* bin_first = particles.bins_of(other);
          const int bin = (wrap(z) * bins + wrap(y)) * bins + wrap(x);
          cell[at] = static_cast<float>(bin_first[bin + 1] - bin_first[bin]);
        }
    // Weights 1/4, 1/2, 1/4 along each axis in turn: a count that varies as smoothly as the field.
    for (const size_t stride : {size_t{1}, size_t(padded), size_t(padded) * padded})
      for (size_t k = 0, end = cell.size() - 2 * stride; k < end; ++k)
        cell[k] = 0.25f * cell[k] + 0.5f * cell[k + stride] + 0.25f * cell[k + 2 * stride];
    for (int z = 0; z < bins; ++z)
      for (int y = 0; y < bins; ++y)
        for (int x = 0; x < bins; ++x)
          if (cell[(static_cast<size_t>(z) * padded + y) * padded + x] < enough * full) return;
    interior[b] = 1;
  });
  return interior;
}

void weigh_particles(BinnedParticles& particles, const ColourKernel& kernel,
                     const std::vector<uint8_t>& interior, SurfaceKernel shape) {
  struct Scratch {
    NearParticles near;
    std::vector<uint32_t> thin;
  };
  std::vector<float> weight(particles.weight.size(), kernel.bulk_weight());
  std::vector<std::vector<FoundEllipsoid>> found(particles.block.size());
  tbb::enumerable_thread_specific<Scratch> scratches;
  tbb::parallel_for(size_t{0}, particles.block.size(), [&](size_t b) {
    if (interior[b]) return;
    auto& [near, thin] = scratches.local();
    gather_near(particles, block_of(particles.block[b]), block_edge, particles.lattice.reach, near);
    thin.clear();
    for (uint32_t begin = particles.first[b]; begin < particles.first[b + 1]; begin += pack_width) {
      const uint32_t count = std::min<uint32_t>(pack_width, particles.first[b + 1] - begin);
      const ColourPack colour = colours_of(particles, begin, count, kernel, near);
      for (uint32_t k = 0; k < count; ++k) {
        weight[begin + k] = kernel.weight(colour.c[k], colour.offset[k]);
        if (weight[begin + k] > kernel.bulk_weight()) thin.push_back(begin + k);
      }
    }
    if (shape == SurfaceKernel::anisotropic)
      add_ellipsoids(particles, weight, kernel, near, thin, found[b]);
  });
  particles.weight = std::move(weight);
  if (shape == SurfaceKernel::anisotropic)
    particles.ellipsoids = collected(found, particles.source.size());
}

ColourField evaluate_field(const BinnedParticles& particles, const ColourKernel& kernel,
                           const std::vector<uint8_t>& interior, const ClothSolids& cloth,
                           InteriorBlocks mode, double max_bytes) {
  BlockSet set = blocks_in_reach(particles);
  std::vector<BlockKey> wanted;
  for (size_t b = 0; b < set.key.size(); ++b)
    if (mode == InteriorBlocks::evaluate || b >= interior.size() || !interior[b] ||
        cloth.near(block_of(set.key[b])))
      wanted.push_back(set.key[b]);
  ColourField field;
  field.stats.candidates = set.key.size();
  field.stats.interior = set.key.size() - wanted.size();
  tbb::enumerable_thread_specific<NearParticles> nears;
  while (!wanted.empty()) {
    const size_t first_new = field.block.size();
    check_memory(first_new + wanted.size(), max_bytes);
    // Growing would copy them all and keep both; the closure adds a hundredth.
    if (first_new == 0) field.value.reserve(wanted.size() + wanted.size() / 16 + 64);
    field.block.resize(first_new + wanted.size());
    field.value.resize(first_new + wanted.size());
    for (size_t k = 0; k < wanted.size(); ++k) {
      if (set.map.insert(wanted[k], static_cast<uint32_t>(set.key.size()))) {
        set.key.push_back(wanted[k]);
        set.slot.push_back(BlockMap::none);
      }
      set.slot[set.map.find(wanted[k])] = static_cast<uint32_t>(first_new + k);
      field.block[first_new + k].block = block_of(wanted[k]);
    }
    tbb::parallel_for(first_new, field.block.size(), [&](size_t f) {
      evaluate_block(particles, kernel, cloth, field.block[f], field.value[f], nears.local());
    });
    wanted = contradicted(set, field.block, first_new);
    field.stats.grown += wanted.size();
    field.stats.closure_rounds += !wanted.empty();
  }
  field.stats.evaluated = field.block.size();
  field.map = BlockMap(field.block.size());
  field.order.resize(field.block.size());
  for (uint32_t f = 0; f < field.block.size(); ++f) {
    field.order[f] = f;
    field.map.insert(key_of(field.block[f].block), f);
  }
  tbb::parallel_sort(field.order.begin(), field.order.end(), [&](uint32_t a, uint32_t b) {
    return key_of(field.block[a].block) < key_of(field.block[b].block);
  });
  return field;
}

}  // namespace drench::surfacing

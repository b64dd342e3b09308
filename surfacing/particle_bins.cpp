#include "surfacing/particle_bins.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace drench::surfacing {
namespace {

constexpr size_t chunk_size =
    16384;  // particles; fixed, so that the order never depends on threads

struct Located {
  V3i block;
  V3f local;  // voxels from the block's corner
};

Located locate(const Lattice& lattice, V3f position) {
  Located at;
  for (int axis = 0; axis < 3; ++axis) {
    const double voxels = lattice.to_voxels(position[axis], axis);
    at.block[axis] = static_cast<int>(voxels / block_edge);
    at.local[axis] = static_cast<float>(voxels - block_edge * static_cast<double>(at.block[axis]));
  }
  return at;
}

size_t chunks_of(size_t n) { return (n + chunk_size - 1) / chunk_size; }

template <class F>
void for_each_chunk(size_t n, F f) {
  tbb::parallel_for(size_t{0}, chunks_of(n), [&](size_t chunk) {
    f(chunk, chunk * chunk_size, std::min(n, (chunk + 1) * chunk_size));
  });
}

/// Sorted keys of the occupied blocks. Neighbours in the input mostly share a block, so every chunk
/// first removes its own repetitions.
std::vector<BlockKey> occupied_blocks(const std::vector<V3f>& position, const Lattice& lattice) {
  std::vector<std::vector<BlockKey>> found(chunks_of(position.size()));
  for_each_chunk(position.size(), [&](size_t chunk, size_t begin, size_t end) {
    BlockMap seen(512);
    BlockKey last = ~BlockKey{0};
    for (size_t i = begin; i < end; ++i) {
      const BlockKey key = key_of(locate(lattice, position[i]).block);
      if (key != last && seen.insert(key, 0)) found[chunk].push_back(key);
      last = key;
    }
  });
  std::vector<BlockKey> keys;
  for (const auto& part : found) keys.insert(keys.end(), part.begin(), part.end());
  tbb::parallel_sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

/// Stable counting sort of particle indices by block: source and first.
void sort_by_block(const std::vector<V3f>& position, BinnedParticles& sorted) {
  const size_t n = position.size(), blocks = sorted.block.size();
  std::vector<uint32_t> block_index(n);
  for_each_chunk(n, [&](size_t, size_t begin, size_t end) {
    BlockKey last = ~BlockKey{0};
    uint32_t index = 0;
    for (size_t i = begin; i < end; ++i) {
      const BlockKey key = key_of(locate(sorted.lattice, position[i]).block);
      if (key != last) index = sorted.map.find(key);
      block_index[i] = index;
      last = key;
    }
  });
  // Slices share out the scatter; few enough that their counters stay small beside the particles.
  const size_t slices = std::clamp<size_t>(2 * n / (blocks + 1), 1, 64);
  const auto slice_begin = [&](size_t slice) { return n * slice / slices; };
  std::vector<uint32_t> cursor(slices * blocks, 0);
  tbb::parallel_for(size_t{0}, slices, [&](size_t slice) {
    uint32_t* count = cursor.data() + slice * blocks;
    for (size_t i = slice_begin(slice); i < slice_begin(slice + 1); ++i) ++count[block_index[i]];
  });
  sorted.first.resize(blocks + 1);
  uint32_t total = 0;
  for (size_t b = 0; b < blocks; ++b) {
    sorted.first[b] = total;
    for (size_t slice = 0; slice < slices; ++slice)
      total += std::exchange(cursor[slice * blocks + b], total);
  }
  sorted.first[blocks] = total;
  sorted.source.resize(n);
  tbb::parallel_for(size_t{0}, slices, [&](size_t slice) {
    uint32_t* next = cursor.data() + slice * blocks;
    for (size_t i = slice_begin(slice); i < slice_begin(slice + 1); ++i)
      sorted.source[next[block_index[i]]++] = static_cast<uint32_t>(i);
  });
}

/// Stable counting sort of one block's particles by bin; writes their local positions.
void sort_block(const std::vector<V3f>& position, BinnedParticles& sorted, size_t b) {
  const int bins = sorted.lattice.bins;
  const uint32_t begin = sorted.first[b], count = sorted.first[b + 1] - begin;
  const float bins_per_voxel = static_cast<float>(bins) / block_edge;
  std::vector<V3f> local(count);
  std::vector<uint32_t> source(sorted.source.begin() + begin,
                               sorted.source.begin() + begin + count);
  std::vector<uint32_t> bin(count);
  uint32_t* bin_first = sorted.bin_first.data() + b * sorted.bin_stride();
  for (uint32_t k = 0; k < count; ++k) {
    local[k] = locate(sorted.lattice, position[source[k]]).local;
    // Rounding to float may have put a particle on the far face.
    const auto of = [&](float v) {
      return std::min(static_cast<int>(v * bins_per_voxel), bins - 1);
    };
    bin[k] =
        static_cast<uint32_t>((of(local[k].z) * bins + of(local[k].y)) * bins + of(local[k].x));
    ++bin_first[bin[k] + 1];
  }
  for (size_t k = 1; k < sorted.bin_stride(); ++k) bin_first[k] += bin_first[k - 1];
  std::vector<uint32_t> next(bin_first, bin_first + sorted.bin_stride());
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t to = begin + next[bin[k]]++;
    sorted.x[to] = local[k].x;
    sorted.y[to] = local[k].y;
    sorted.z[to] = local[k].z;
    sorted.source[to] = source[k];
  }
}

}  // namespace

BinnedParticles bin_particles(const std::vector<V3f>& position, const Lattice& lattice) {
  BinnedParticles sorted;
  sorted.lattice = lattice;
  sorted.block = occupied_blocks(position, lattice);
  sorted.map = BlockMap(sorted.block.size());
  for (size_t b = 0; b < sorted.block.size(); ++b)
    sorted.map.insert(sorted.block[b], static_cast<uint32_t>(b));
  sort_by_block(position, sorted);
  sorted.x.resize(position.size());
  sorted.y.resize(position.size());
  sorted.z.resize(position.size());
  sorted.weight.assign(position.size(), 1.f);
  sorted.bin_first.assign(sorted.block.size() * sorted.bin_stride(), 0);
  tbb::parallel_for(size_t{0}, sorted.block.size(),
                    [&](size_t b) { sort_block(position, sorted, b); });
  return sorted;
}

void NearParticles::clear() {
  x.clear();
  y.clear();
  z.clear();
  weight.clear();
  index.clear();
}

void NearParticles::pad() {
  const size_t padded = (size() + 7) / 8 * 8;
  x.resize(padded, 1e9f);
  y.resize(padded, 1e9f);
  z.resize(padded, 1e9f);
  weight.resize(padded, 0.f);
}

namespace {

/// Adds the particles of occupied block b, whose corner lies `corner` voxels from the gathering
/// block's, and of its bins `low` to `high`.
void gather_bins(const BinnedParticles& particles, uint32_t b, V3f corner, V3i low, V3i high,
                 float edge, float reach, NearParticles& near) {
  const int bins = particles.lattice.bins;
  const uint32_t* bin_first = particles.bins_of(b);
  const uint32_t first = particles.first[b];
  const auto outside = [&](float v) { return std::max({-v, v - edge, 0.f}); };
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y) {
      const int row = (z * bins + y) * bins;
      const uint32_t end = first + bin_first[row + high.x + 1];
      for (uint32_t i = first + bin_first[row + low.x]; i < end; ++i) {
        const V3f p = corner + V3f(particles.x[i], particles.y[i], particles.z[i]);
        if (V3f(outside(p.x), outside(p.y), outside(p.z)).length2() >= reach * reach) continue;
        near.x.push_back(p.x);
        near.y.push_back(p.y);
        near.z.push_back(p.z);
        near.weight.push_back(particles.weight[i]);
        near.index.push_back(i);
      }
    }
}

}  // namespace

void gather_near(const BinnedParticles& particles, V3i block, float edge, float reach,
                 NearParticles& near) {
  near.clear();
  const int bins = particles.lattice.bins;
  const float bins_per_voxel = static_cast<float>(bins) / block_edge;
  const int low =
      static_cast<int>(std::floor(-reach * bins_per_voxel));  // bins from this block's own
  const int high = static_cast<int>(std::floor((edge + reach) * bins_per_voxel));
  const auto block_of_bin = [&](int bin) { return (bin + 1024 * bins) / bins - 1024; };
  V3i step;
  for (step.z = block_of_bin(low); step.z <= block_of_bin(high); ++step.z)
    for (step.y = block_of_bin(low); step.y <= block_of_bin(high); ++step.y)
      for (step.x = block_of_bin(low); step.x <= block_of_bin(high); ++step.x) {
        const uint32_t b = particles.map.find(block + step);
        if (b == BlockMap::none) continue;
        V3i from, to;
        for (int axis = 0; axis < 3; ++axis) {
          from[axis] = std::max(low - step[axis] * bins, 0);
          to[axis] = std::min(high - step[axis] * bins, bins - 1);
        }
        gather_bins(particles, b, V3f(step * block_edge), from, to, edge, reach, near);
      }
  near.pad();
}

PointPack points_of(const std::vector<V3f>& position, uint32_t begin, uint32_t count,
                    const V3f& corner) {
  PointPack points;
  for (uint32_t k = 0; k < pack_width; ++k) {
    const V3f p = position[begin + std::min(k, count - 1)] - corner;
    points.x[k] = p.x, points.y[k] = p.y, points.z[k] = p.z;
  }
  return points;
}

size_t nearest_of(const NearParticles& near, const V3f& p) {
  size_t best = 0;
  float least = std::numeric_limits<float>::max();
  for (size_t j = 0; j < near.size(); ++j) {
    const float square = (V3f(near.x[j], near.y[j], near.z[j]) - p).length2();
    if (square < least) least = square, best = j;
  }
  return best;
}

}  // namespace drench::surfacing

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
  for (std::vector<float>* column : {&sorted.x, &sorted.y, &sorted.z})
    column->resize(position.size() + pack_width);
  sorted.weight.assign(position.size() + pack_width, 1.f);
  sorted.bin_first.assign(sorted.block.size() * sorted.bin_stride(), 0);
  tbb::parallel_for(size_t{0}, sorted.block.size(),
                    [&](size_t b) { sort_block(position, sorted, b); });
  return sorted;
}

void NearParticles::make_room(size_t more) {
  const size_t needed = count_ + more + pack_width;  // the last pack may write more than it has
  if (needed <= index.size()) return;
  for (std::vector<float>* column : {&x, &y, &z, &weight}) column->resize(2 * needed);
  index.resize(2 * needed);
}

void NearParticles::pad() {
  make_room(0);
  const auto end = static_cast<ptrdiff_t>(count_);
  for (std::vector<float>* column : {&x, &y, &z})
    std::fill_n(column->begin() + end, pack_width, 1e9f);
  std::fill_n(weight.begin() + end, pack_width, 0.f);
}

void NearParticles::add(const BinnedParticles& particles, uint32_t begin, uint32_t end, V3f corner,
                        float edge, float reach) {
  make_room(end - begin);
  const auto outside = [edge](Pack v) { return larger(larger(-v, v - edge), Pack{}); };
  for (uint32_t i = begin; i < end; i += pack_width) {
    const Pack at[3] = {corner.x + load(particles.x.data() + i),
                        corner.y + load(particles.y.data() + i),
                        corner.z + load(particles.z.data() + i)};
    const Pack dx = outside(at[0]), dy = outside(at[1]), dz = outside(at[2]);
    unsigned chosen = less_bits(dx * dx + dy * dy + dz * dz, pack(reach * reach));
    if (end - i < pack_width) chosen &= (1u << (end - i)) - 1;
    const LaneIndices lanes = set_lanes(chosen);
    store(x.data() + count_, picked(at[0], lanes));
    store(y.data() + count_, picked(at[1], lanes));
    store(z.data() + count_, picked(at[2], lanes));
    store(weight.data() + count_, picked(load(particles.weight.data() + i), lanes));
    store(index.data() + count_, lanes, i);
    count_ += static_cast<size_t>(std::popcount(chosen));
  }
}

void gather_near(const BinnedParticles& particles, V3i block, float edge, float reach,
                 NearParticles& near) {
  near.clear();
  const int bins = particles.lattice.bins;
  const float bins_per_voxel = static_cast<float>(bins) / block_edge;
  const int low =
      static_cast<int>(std::floor(-reach * bins_per_voxel));  // bins from this block's own
  const int high = static_cast<int>(std::floor((edge + reach) * bins_per_voxel));
  const auto block_of_bin = [&](int bin) { return (bin + 1024 * bins) / bins - 1024; };
  const auto from = [&](int step) { return std::max(low - step * bins, 0); };
  const auto to = [&](int step) { return std::min(high - step * bins, bins - 1); };
  V3i step;
  for (step.z = block_of_bin(low); step.z <= block_of_bin(high); ++step.z)
    for (step.y = block_of_bin(low); step.y <= block_of_bin(high); ++step.y)
      for (step.x = block_of_bin(low); step.x <= block_of_bin(high); ++step.x) {
        const uint32_t b = particles.map.find(block + step);
        if (b == BlockMap::none) continue;
        const uint32_t* bin_first = particles.bins_of(b);
        for (int z = from(step.z); z <= to(step.z); ++z)  // whole rows lie side by side
          near.add(particles, particles.first[b] + bin_first[(z * bins + from(step.y)) * bins],
                   particles.first[b] + bin_first[(z * bins + to(step.y) + 1) * bins],
                   V3f(step * block_edge), edge, reach);
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

#pragma once
// Neighbour lists on CPU cores: see neighbours.h.

namespace drench::sim::cpu {

/// Moves the chosen lanes to the front: entry b lists the lanes whose bit is set in b.
struct LaneOrders {
  alignas(32) int lane[256][8];
  constexpr LaneOrders() : lane{} {
    for (int bits = 0; bits < 256; ++bits) {
      int at = 0;
      for (int k = 0; k < 8; ++k) {
        if (bits >> k & 1) lane[bits][at++] = k;
      }
    }
  }
};
inline constexpr LaneOrders lane_orders{};

/// Room for lists, given to threads piece by piece. Where a list stands depends on the
/// threads, what stands in it does not.
class ListStore {
 public:
  explicit ListStore(NeighbourLists& lists) : lists_(lists) {}

  struct Piece {
    size_t at = 0, end = 0;  // blocks
  };
  /// At least `blocks` blocks; false if the columns are full: the demand is counted all the same.
  bool reserve(Piece& piece, size_t blocks) {
    if (piece.end - piece.at < blocks) {
      const size_t size = std::max(piece_blocks, blocks);
      piece.at = used_.fetch_add(size, std::memory_order_relaxed);
      piece.end = piece.at + size;
    }
    return piece.end <= lists_.block.size();
  }
  /// Makes room for all of the demand and a sixteenth more; false if there was enough.
  bool grow() {
    if (used_ <= lists_.block.size()) return false;
    if (used_ > std::numeric_limits<unsigned>::max()) {
      throw Error(
          "the fluid has more than 34 billion pairs of neighbours. Use a larger "
          "fluid.spacing or a smaller fluid.support_ratio");
    }
    const size_t blocks = used_ + used_ / 16;
    lists_.block.renew(blocks), lists_.base.renew(blocks);
    used_ = 0;
    return true;
  }

 private:
  static constexpr size_t piece_blocks = 256;
  NeighbourLists& lists_;
  std::atomic<size_t> used_{0};
};

/// The neighbours of one particle out of a tile.
class Found {
 public:
  int count = 0;
  std::vector<int> index;
  std::vector<float> distance2;  // then closeness
  int blocks = 0;
  std::vector<NeighbourBlock> block;
  std::vector<int> base;

  template <class Filter>
  void search(const Tile& tile, int i, float h, const Filter& filter) {
    const float *x = tile.column(0), *y = tile.column(1), *z = tile.column(2);
    const int own = tile.index_of(i);
    const Vec3<Pack> p{Pack(x[own]), Pack(y[own]), Pack(z[own])};
    const Pack h2(h * h);
    [[maybe_unused]] const float* columns[7];
    [[maybe_unused]] auto hidden_from = [&] {
      if constexpr (Filter::columns > 0) {
        for (int c = 0; c < 7; ++c) columns[c] = tile.column(3 + c);
        return filter.template self<3>(columns, own);
      } else {
        return 0;
      }
    }();
    // in locals: members would be stored and read again for every pack
    const int size = tile.size(), *const particle = particle_.data();
    int *const to_index = index.data(), found = 0;
    float* const to_distance2 = distance2.data();
    for (int k = 0; k < size; k += Pack::size) {
      const Pack r2 =
          length2(Vec3<Pack>{Pack::load(x + k), Pack::load(y + k), Pack::load(z + k)} - p);
      int hits = (r2 < h2).bits();
      if constexpr (Filter::columns > 0) {
        const auto at = [&](int c) { return Pack::load(columns[c] + k); };
        if (hits)
          hits &= ~filter.template hidden<3>(hidden_from, columns, k, {at(0), at(1), at(2)}).bits();
      }
      const __m256i order =
          _mm256_load_si256(reinterpret_cast<const __m256i*>(lane_orders.lane[hits]));
      const __m256i particles = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(particle + k));
      _mm256_storeu_ps(to_distance2 + found, _mm256_permutevar8x32_ps(r2.v, order));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to_index + found),
                          _mm256_permutevar8x32_epi32(particles, order));
      found += __builtin_popcount(unsigned(hits));
    }
    for (int k = found; k < found + Pack::size; ++k) to_index[k] = i, to_distance2[k] = h * h;
    count = found;
  }
  /// Closeness in place of distances, and the sum of Kernel::value over it.
  template <class Kernel>
  float close(float h) {
    Pack sum(0.f);
    for (int k = 0; k < count; k += Pack::size) {
      float* at = distance2.data() + k;
      const Pack u = max0(Pack(1.f) - square_root(Pack::load(at)) * Pack(1.f / h));
      sum = sum + Kernel::value(u);
      u.store(at);
    }
    return sum_of_lanes(sum);
  }
  /// Blocks as BlockFiller makes them.
  void pack_blocks() {
    const __m256i most = _mm256_set1_epi32(NeighbourBlock::most_offset);
    const __m256 unit = _mm256_set1_ps(NeighbourBlock::unit);
    blocks = 0;
    for (int k = 0, taken; k < count; k += taken, ++blocks) {
      const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(index.data() + k));
      __m256i offset = _mm256_sub_epi32(all, _mm256_set1_epi32(index[k]));
      const __m256i near = _mm256_cmpeq_epi32(_mm256_min_epu32(offset, most), offset);
      const unsigned far = ~unsigned(_mm256_movemask_ps(_mm256_castsi256_ps(near)));
      taken = std::min(std::countr_zero(far), count - k);
      const __m256i keep = reinterpret_cast<__m256i>(first_lanes(taken).v);
      offset = _mm256_slli_epi32(_mm256_and_si256(offset, keep), 1);
      const __m256 u = _mm256_mul_ps(_mm256_loadu_ps(distance2.data() + k), unit);
      const __m256i closeness = _mm256_and_si256(_mm256_cvtps_epi32(u), keep);
      // lanes 0-3 of either, then 4-7 of either
      const __m256i packed = _mm256_packus_epi32(offset, closeness);
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(&block[blocks]),
                          _mm256_permute4x64_epi64(packed, 0xd8));
      base[blocks] = index[k];
    }
  }
  void set_tile(const Tile& tile) {
    tile.particles(particle_);
    if (index.size() < size_t(tile.size()) + 16)
      for (const size_t room = size_t(tile.size()) + 64; index.size() < room;)
        index.resize(room), distance2.resize(room), block.resize(room), base.resize(room);
  }

 private:
  std::vector<int> particle_;  // at each index of the tile
};

/// Particles in strips a few rows wide, plane after plane: the planes before and behind are still
/// in the cache when their neighbours come. Without strips an iteration takes a fifth longer
/// (docs/benchmarks, fluid_scaling).
inline void order_visits(const GridView& grid, std::vector<NeighbourLists::Range>& visits) {
  constexpr int strip_cells = 320, least_rows = 4, most_particles = 512;
  const GridShape& g = grid.shape;
  const int rows = std::max(least_rows, strip_cells / g.nx);
  visits.clear();
  for (int y = 0; y < g.ny; y += rows) {
    for (int z = 0; z < g.nz; ++z) {
      const int plane = z * g.ny, end = grid.cell_start[(plane + std::min(y + rows, g.ny)) * g.nx];
      for (int i = grid.cell_start[(plane + y) * g.nx]; i < end; i += most_particles)
        visits.push_back({i, std::min(i + most_particles, end)});
    }
  }
}

/// Lists of all particles. density(i, sum) gets the sum of Kernel::value over the neighbours.
template <class Kernel, class Density, class Filter = NoFilter>
void build_neighbour_lists(Queue&, const GridView& grid, int n, const ConstVecView& position,
                           float h, NeighbourLists& lists, const Density& density,
                           const Filter& filter = {}) {
  lists.begin.resize(n), lists.blocks.resize(n);
  order_visits(grid, lists.visits);
  ListStore store(lists);
  const GridShape& g = grid.shape;
  const auto build_rows = [&](const auto& range) {
    Tile& tile = of_this_thread<Tile>();
    Found& found = of_this_thread<Found>();
    ListStore::Piece piece;
    for (int row = range.begin(); row < range.end(); ++row) {
      for (int cx = 0; cx < g.nx; ++cx) {
        const int cell = row * g.nx + cx, begin = grid.cell_start[cell],
                  end = grid.cell_start[cell + 1];
        if (begin == end) continue;
        const Inputs<3> positions{{position.x, position.y, position.z}};
        bool filtered = false;
        if constexpr (Filter::columns > 0) {
          for (int i = begin; i < end; ++i) filtered |= filter.tests(i);
          if (filtered) {
            tile.fill(grid, cx, row % g.ny, row / g.ny,
                      join(positions, filter.inputs_with_position().column), 10);
            tile.carry_planes(3);
          }
        }
        if (!filtered) tile.fill(grid, cx, row % g.ny, row / g.ny, positions, 3);
        found.set_tile(tile);
        for (int i = begin; i < end; ++i) {
          if (filtered)
            found.search(tile, i, h, filter);
          else
            found.search(tile, i, h, NoFilter{});
          density(i, found.close<Kernel>(h));
          found.pack_blocks();
          lists.blocks.data()[i] = found.blocks;
          if (store.reserve(piece, size_t(found.blocks))) {
            std::copy_n(found.block.data(), found.blocks, lists.block.data() + piece.at);
            std::copy_n(found.base.data(), found.blocks, lists.base.data() + piece.at);
          }
          lists.begin.data()[i] = unsigned(piece.at);
          piece.at += size_t(found.blocks);
        }
      }
    }
  };
  do {
    ::tbb::parallel_for(::tbb::blocked_range<int>(0, g.ny * g.nz, 4), build_rows);
  } while (store.grow());
}

/// An address takes a factor of 8 for nothing, and a Float4 is 16 bytes long.
DRENCH_HD const Float4& at_offset(const Float4* from, int doubled) {
  return *reinterpret_cast<const Float4*>(reinterpret_cast<const char*>(from) +
                                          size_t(unsigned(doubled)) * (sizeof(Float4) / 2));
}
/// In a lattice lists end there: without the test an iteration takes 3 % longer.
DRENCH_HD bool half_empty(const NeighbourBlock& block) {
  uint64_t last;
  std::memcpy(&last, block.closeness + NeighbourBlock::size / 2, sizeof last);
  return last == 0;
}
DRENCH_HD Pack closeness_of(const NeighbourBlock& block) {
  const __m128i* of = reinterpret_cast<const __m128i*>(block.closeness);
  const __m256i all = _mm256_cvtepu16_epi32(_mm_load_si128(of));
  return Pack(Pack::Native(_mm256_cvtepi32_ps(all))) * Pack(1.f / NeighbourBlock::unit);
}

/// All neighbours of particle i, two at a time.
template <class Physics>
DRENCH_HD void visit_neighbours(const NeighbourView& list, const Float4* const* column, int i,
                                const Physics& physics) {
  constexpr int N = Physics::columns;
  using P = typename Physics::template Particle<Quad>;
  using S = typename Physics::template Sum<Quad>;
  Members<P, Quad, N> own;
  for (int c = 0; c < N; ++c) own.value[c] = both(column[c][i]);
  const P self = own.as();
  S sum[2];  // two chains of additions run at once
  const NeighbourBlock* block = list.block + list.begin[i];
  const int* base = list.base + list.begin[i];
  for (const NeighbourBlock* end = block + list.blocks[i]; block < end; ++block, ++base) {
    const Pack weight = physics.weight(closeness_of(*block));
    const Float4* from[N];
    for (int c = 0; c < N; ++c) from[c] = column[c] + *base;
    const auto two = [&](int k, S& to) {
      const int a = block->offset[2 * k], b = block->offset[2 * k + 1];
      Members<P, Quad, N> m;
      for (int c = 0; c < N; ++c)
        m.value[c] = side_by_side(at_offset(from[c], a), at_offset(from[c], b));
      physics.pair(self, m.as(), spread_two(weight, k), to);
    };
    two(0, sum[0]), two(1, sum[1]);
    if (half_empty(*block)) continue;
    two(2, sum[0]), two(3, sum[1]);
  }
  constexpr int M = sizeof(S) / sizeof(Quad);
  typename Physics::template Sum<Float4> out;
  const Quad* lane = reinterpret_cast<const Quad*>(sum);
  Float4* to = reinterpret_cast<Float4*>(&out);
  for (int m = 0; m < M; ++m) to[m] = add_both(lane[m] + lane[M + m]);
  physics.finish(i, out);
}

template <class Physics>
void for_each_neighbour(Queue&, const char*, const NeighbourLists& lists, int,
                        const Physics& physics) {
  if (physics.idle()) return;
  const NeighbourView list = view_of(lists);
  const auto inputs = physics.inputs();
  ::tbb::parallel_for(size_t(0), lists.visits.size(), [&](size_t k) {
    const NeighbourLists::Range range = lists.visits[k];
    for (int i = range.begin; i < range.end; ++i) visit_neighbours(list, inputs.column, i, physics);
  });
}

}  // namespace drench::sim::cpu

#pragma once
// for_each_pair: one physics functor over all neighbours of every particle. The functor names
// columns and says what one pair does; the traversal owns cells, layout and hardware. On a CPU core
// the neighbours of a cell are copied side by side once and read eight at a time; on the GPU every
// thread traverses the 27 cells of its particle. A particle is its own neighbour too (distance 0).
//
// clang-format off
// Physics:  static constexpr int columns;        number of float columns read
//           static constexpr bool costly;        more than to see that all eight are out of reach
//           Inputs<columns> inputs() const;      their pointers, in the order of Particle's members
//           template <class T> struct Particle;  position first; members of type T or Vec3<T> only
//           template <class T> struct Sum;       members of type T or Vec3<T>, zero to start with
//           template <class T> void pair(i, j, sum) const;
//           void finish(int i, const Sum<float>&) const;
//           float support_radius;
// clang-format on
// Filter:   hides neighbours behind a sheet (passes/coupling/cloth_filter.h); NoFilter hides none.

#include <bit>
#include <numeric>

#include "sim/backend/parallel.h"
#include "sim/neighbours/grid.h"

namespace drench::sim::DRENCH_BACKEND {

template <int N>
struct Inputs {
  const float* column[N];
};

struct NoFilter {
  static constexpr int columns = 0;
  DRENCH_HD Inputs<1> inputs() const { return {{nullptr}}; }
};

template <class P, class T, int N>
struct Members {
  T value[N];
  DRENCH_HD P as() const {
    static_assert(sizeof(P) == sizeof(T) * N, "columns and Particle disagree");
#if defined(__CUDACC__)
    P p;
    memcpy(&p, value, sizeof p);
    return p;
#else
    return std::bit_cast<P>(*this);
#endif
  }
};

#if defined(__CUDACC__)

template <class Physics, class Filter>
__global__ void launch_pairs(GridView grid, int n, Physics physics, Filter filter) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= n) return;
  constexpr int N = Physics::columns;
  using P = typename Physics::template Particle<float>;
  const auto in = physics.inputs();
  const auto load = [&](int k) {
    Members<P, float, N> m;
    for (int c = 0; c < N; ++c) m.value[c] = __ldg(in.column[c] + k);
    return m.as();
  };
  const P self = load(i);
  typename Physics::template Sum<float> sum{};
  [[maybe_unused]] bool any_hidden = false;
  [[maybe_unused]] bool tested = false;
  if constexpr (Filter::columns > 0) tested = filter.tests(i);
  const GridShape& g = grid.shape;
  const Vec3<float> p = self.position;
  for_each_run(grid, g.cell_x(p.x), g.cell_y(p.y), g.cell_z(p.z),
               [&](int begin, int end, Vec3<float> shift) {
                 P seen = self;  // from where they are
                 seen.position = p - shift;
                 for (int j = begin; j < end; ++j) {
                   const P other = load(j);
                   if constexpr (Filter::columns > 0) {
                     if (tested && filter.hides(i, j, shift)) {
                       any_hidden = true;
                       continue;
                     }
                   }
                   physics.pair(seen, other, sum);
                 }
               });
  physics.finish(i, sum);
  if constexpr (Filter::columns > 0) {
    if (tested) filter.finish(i, any_hidden);
  }
}

template <class Physics, class Filter = NoFilter>
void for_each_pair(Queue& queue, const char* name, const GridView& grid, int n,
                   const Physics& physics, const Filter& filter = {}) {
  if (n <= 0) return;
  launch_pairs<<<(n + 127) / 128, 128, 0, queue.stream()>>>(grid, n, physics, filter);
  check_cuda(cudaGetLastError(), name);
}

#else

/// The columns of all particles in the 27 cells around one, side by side, padded with particles far
/// outside any support so that the last pack needs no mask.
class Tile {
 public:
  static constexpr float far_away = 1e15f;

  template <int N>
  void fill(const GridView& grid, int cx, int cy, int cz, const Inputs<N>& in, int columns) {
    const int self = grid.cell_start[grid.shape.index(cx, cy, cz)];
    int rows = 0;
    size_ = 0;
    for_each_run(grid, cx, cy, cz, [&](int begin, int end, Vec3<float> shift) {
      begin_[rows] = begin, count_[rows] = end - begin;
      shift_[rows][0] = shift.x, shift_[rows][1] = shift.y, shift_[rows][2] = shift.z;
      const bool straight = shift.x == 0.f && shift.y == 0.f && shift.z == 0.f;
      if (straight && begin <= self && self < end) centre_ = size_ - begin;
      size_ += count_[rows++];
    });
    rows_ = rows;
    stride_ = (size_ + 15) / 8 * 8;
    if (data_.size() < size_t(stride_) * columns) data_.resize(size_t(stride_) * columns);
    for (int c = 0; c < columns; ++c) {
      float* to = data_.data() + size_t(c) * stride_;
      for (int r = 0; r < rows; to += count_[r++]) {
        // Whole packs, past the end of the row too: what comes next overwrites that.
        for (int k = 0; k < count_[r]; k += Pack::size)
          Pack::load(in.column[c] + begin_[r] + k).store(to + k);
        if (c < 3 && shift_[r][c] != 0.f) {
          for (int k = 0; k < count_[r]; ++k) to[k] += shift_[r][c];
        }
      }
      // Far away in position; the last column may be the plane of a sheet, which must be far as
      // well.
      std::fill_n(to, stride_ - size_, c < 3 || c == columns - 1 ? far_away : 0.f);
    }
  }
  int size() const { return size_; }
  /// What a sheet filter reads of the particles from beyond a seam, seen from this side of it:
  /// three columns of positions and, after three of normals, the planes.
  void carry_planes(int first_column) {
    float* to = data_.data() + size_t(first_column) * stride_;
    const auto column = [&](int c) { return to + size_t(c) * stride_; };
    for (int r = 0; r < rows_; to += count_[r++]) {
      const float* s = shift_[r];
      if (s[0] == 0.f && s[1] == 0.f && s[2] == 0.f) continue;
      for (int k = 0; k < count_[r]; ++k) {
        for (int c = 0; c < 3; ++c) {
          column(c)[k] += s[c];
          column(6)[k] -= column(3 + c)[k] * s[c];
        }
      }
    }
  }
  /// The particle at each index of the tile, and anything in the padding.
  void particles(std::vector<int>& particle) const {
    if (particle.size() < size_t(stride_)) particle.resize(stride_);
    int* to = particle.data();
    for (int r = 0; r < rows_; to += count_[r++]) std::iota(to, to + count_[r], begin_[r]);
  }
  /// Up to eight particles that follow each other.
  struct Run {
    int particle, count;
  };
  /// Looks for those of the tile for which any has less than the limit in a column of particles.
  void find_packs(const float* column, float limit) {
    packs_.clear();
    for (int r = 0; r < rows_; ++r) {
      for (int k = 0; k < count_[r]; k += Pack::size) {
        const Run run{begin_[r] + k, std::min(count_[r] - k, Pack::size)};
        const Mask below = Pack::load(column + run.particle) < Pack(limit);
        if ((below & first_lanes(run.count)).bits()) packs_.push_back(run);
      }
    }
  }
  const std::vector<Run>& packs() const { return packs_; }
  /// Is any of it seen across the seam of a periodic axis?
  bool seam() const {
    const auto across = [](const float* s) { return s[0] != 0.f || s[1] != 0.f || s[2] != 0.f; };
    return std::any_of(shift_, shift_ + rows_, across);
  }
  int index_of(int particle) const { return particle + centre_; }  // of the centre row's particles
  const float* column(int c) const { return data_.data() + size_t(c) * stride_; }

 private:
  std::vector<float> data_;
  std::vector<Run> packs_;
  static constexpr int most_rows = 18;       // nine, and each in two at the seam of a periodic x
  int begin_[most_rows], count_[most_rows];  // the runs of particles that a tile is made of
  float shift_[most_rows][3];                // m, from beyond the seam of a periodic axis
  int rows_ = 0;
  int size_ = 0, stride_ = 0, centre_ = 0;
};

/// One T a thread. Not inlined: where a thread's storage is would be asked anew in inner loops.
template <class T>
[[gnu::noinline]] T& of_this_thread() {
  static thread_local T t;
  return t;
}

template <int N, int M>
Inputs<N + M> join(const Inputs<N>& a, const float* const (&b)[M]) {
  Inputs<N + M> all;
  std::copy_n(a.column, N, all.column);
  std::copy_n(b, M, all.column + N);
  return all;
}

/// Is a sheet to be looked for between any of the particles of a cell and their neighbours?
template <class Filter>
bool any_tested(int begin, int end, const Filter& filter) {
  bool tested = false;
  for (int i = begin; i < end; ++i) tested |= filter.tests(i);
  return tested;
}
/// The same when those have been left out from which nothing is hidden, and this has been noted.
template <class Filter>
bool any_hidden(Tile& tile, int begin, int end, const Filter& filter) {
  if (tile.seam()) return true;
  filter.find_near(tile);
  for (int i = begin; i < end; ++i) {
    if (filter.tests(i) && filter.sees_all(tile, i)) filter.finish(i, false);
  }
  return any_tested(begin, end, filter);
}

/// All neighbours of particle i, eight at a time.
template <class Physics, class Filter>
DRENCH_HD auto sum_over_tile(const Tile& tile, int particle, const Physics& physics,
                             const Filter& filter) {
  const int own = tile.index_of(particle);
  constexpr int N = Physics::columns;
  using P = typename Physics::template Particle<Pack>;
  typename Physics::template Sum<Pack> sum{};
  Members<P, Pack, N> self;
  const float* column[N + Filter::columns];
  for (int c = 0; c < N + Filter::columns; ++c) column[c] = tile.column(c);
  for (int c = 0; c < N; ++c) self.value[c] = Pack(column[c][own]);
  const P i = self.as();
  [[maybe_unused]] const Pack reach2(physics.support_radius * physics.support_radius);
  auto hidden_from = [&] {
    if constexpr (Filter::columns > 0)
      return filter.template self<N>(column, own);
    else
      return 0;
  }();
  for (int k = 0; k < tile.size(); k += Pack::size) {
    Members<P, Pack, N> m;
    for (int c = 0; c < N; ++c) m.value[c] = Pack::load(column[c] + k);
    if constexpr (Filter::columns > 0) {
      const Mask hidden =
          filter.template hidden<N>(hidden_from, column, k, {m.value[0], m.value[1], m.value[2]});
      m.value[0] = select(hidden, Pack(Tile::far_away), m.value[0]);
    }
    const P j = m.as();
    if constexpr (Physics::costly) {
      if ((length2(i.position - j.position) < reach2).bits() == 0) continue;
    }
    physics.pair(i, j, sum);
  }
  if constexpr (Filter::columns > 0) filter.finish(particle, hidden_from.any);
  return sum;
}

/// The lanes of a pack sum, added up.
template <class Physics>
typename Physics::template Sum<float> add_lanes(const typename Physics::template Sum<Pack>& sum) {
  using S = typename Physics::template Sum<float>;
  constexpr int M = sizeof(S) / sizeof(float);
  Members<S, float, M> out;
  const Pack* lane = reinterpret_cast<const Pack*>(&sum);
  for (int m = 0; m < M; ++m) out.value[m] = sum_of_lanes(lane[m]);
  return out.as();
}

template <class Physics, class Filter = NoFilter>
void for_each_pair(Queue&, const char*, const GridView& grid, int, const Physics& physics,
                   const Filter& filter = {}) {
  const GridShape& g = grid.shape;
  ::tbb::parallel_for(::tbb::blocked_range<int>(0, g.ny * g.nz, 4), [&](const auto& range) {
    Tile& tile = of_this_thread<Tile>();
    for (int row = range.begin(); row < range.end(); ++row) {
      const int cy = row % g.ny, cz = row / g.ny;
      for (int cx = 0; cx < g.nx; ++cx) {
        const int cell = g.index(cx, cy, cz);
        const int begin = grid.cell_start[cell], end = grid.cell_start[cell + 1];
        if (begin == end) continue;
        bool filtered = false, filled = false;
        if constexpr (Filter::columns > 0) {
          filtered = any_tested(begin, end, filter);
          if (filtered && filter.nothing_known) {
            tile.fill(grid, cx, cy, cz, physics.inputs(), Physics::columns);
            filtered = any_hidden(tile, begin, end, filter);
            filled = !filtered;
          }
          if (filtered) {
            tile.fill(grid, cx, cy, cz, join(physics.inputs(), filter.inputs().column),
                      Physics::columns + Filter::columns);
            filled = true;
          }
        }
        if (!filled) tile.fill(grid, cx, cy, cz, physics.inputs(), Physics::columns);
        for (int i = begin; i < end; ++i) {
          if constexpr (Filter::columns > 0) {
            if (filtered && filter.tests(i)) {
              physics.finish(i, add_lanes<Physics>(sum_over_tile(tile, i, physics, filter)));
              continue;
            }
          }
          physics.finish(i, add_lanes<Physics>(sum_over_tile(tile, i, physics, NoFilter{})));
        }
      }
    }
  });
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND

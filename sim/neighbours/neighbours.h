#pragma once
// Neighbour lists for iterative solvers, and for_each_neighbour over them: one physics functor over
// the listed neighbours of every particle. A list holds a neighbour's index and closeness
// u = 1 - r / h, from which a kernel follows without a root, so that an iteration only gathers: on
// a CPU core two neighbours at a time, four floats each. A particle is its own neighbour too.
// Bytes are time: both are kept in 16 bits, indices from one base for eight. Closeness is rounded
// by 2^-17 at most, the same for either particle of a pair, so that momentum is kept; densities are
// summed before that.
//
// clang-format off
// Physics:  static constexpr int columns;        number of Float4 columns read
//           Columns<columns> inputs() const;
//           template <class Q> struct Particle;  `columns` members of type Q
//           template <class Q> struct Sum;       members of type Q, zero to start with
//           template <class T> T weight(T u) const;    of float or Pack
//           template <class Q> void pair(i, j, Q weight, sum) const;   weight in all components
//           void finish(int i, const Sum<Float4>&) const;
//           bool idle() const;                   true: nothing is to be done
// clang-format on

#include <cstdint>
#include <limits>
#include <vector>

#include "pipeline/contract/error.h"
#include "sim/backend/quad.h"
#include "sim/backend/sort.h"
#include "sim/neighbours/pairs.h"

namespace drench::sim::DRENCH_BACKEND {

template <int N>
struct Columns {
  const Float4* column[N];
};

/// Eight neighbours. What no neighbour fills has offset and closeness 0, and no other has this
/// closeness but neighbours too far to matter.
struct alignas(16) NeighbourBlock {
  static constexpr int size = 8, most_offset = 32767;
  static constexpr float unit = 65535.f;  // closeness 1
  uint16_t offset[size];                  // twice the index less the block's base
  uint16_t closeness[size];
};

/// Where neighbours go, one after the other: a block ends when it is full or an index too far off.
struct BlockFiller {
  int base = 0, used = NeighbourBlock::size, blocks = 0;
  /// True: j is the first of a new block.
  DRENCH_HD bool opens(int j) {
    const bool fits =
        used < NeighbourBlock::size && j >= base && j - base <= NeighbourBlock::most_offset;
    if (!fits) base = j, used = 0, ++blocks;
    ++used;
    return !fits;
  }
};

struct NeighbourLists {
  Column<NeighbourBlock> block;
  Column<int> base;        // of a block: the index of its first neighbour
  Column<unsigned> begin;  // first block of a particle; on the GPU one past the last one too
  Column<int> blocks;
  struct Range {
    int begin, end;
  };
  std::vector<Range> visits;  // on the CPU: particles in the order in which passes go over them
};

struct NeighbourView {
  const NeighbourBlock* block;
  const int* base;
  const unsigned* begin;
  const int* blocks;

  /// Slots of the neighbours of particle i are first(i) .. end(i) - 1, filled or not.
  DRENCH_HD size_t first(int i) const { return size_t(begin[i]) * NeighbourBlock::size; }
  DRENCH_HD size_t end(int i) const {
    return (size_t(begin[i]) + size_t(blocks[i])) * NeighbourBlock::size;
  }
  DRENCH_HD int index(size_t k) const {
    return base[k / NeighbourBlock::size] +
           block[k / NeighbourBlock::size].offset[k % NeighbourBlock::size] / 2;
  }
  DRENCH_HD float closeness(size_t k) const {
    const NeighbourBlock& b = block[k / NeighbourBlock::size];
    return float(b.closeness[k % NeighbourBlock::size]) / NeighbourBlock::unit;
  }
};

inline NeighbourView view_of(const NeighbourLists& lists) {
  return {lists.block.data(), lists.base.data(), lists.begin.data(), lists.blocks.data()};
}

}  // namespace drench::sim::DRENCH_BACKEND

#if defined(__CUDACC__)
#include "sim/neighbours/neighbours_cuda.h"
#else
#include "sim/neighbours/neighbours_cpu.h"
#endif

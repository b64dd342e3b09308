#pragma once
// Neighbour lists for iterative solvers, and for_each_neighbour over them: one physics functor over
// the listed neighbours of every particle. A list holds a neighbour's index and closeness
// u = 1 - r / h, from which a kernel follows without a root, so that an iteration only gathers: on
// a CPU core two neighbours at a time, four floats each. A particle is its own neighbour too.
//
// clang-format off
// Physics:  static constexpr int columns;        number of Float4 columns read
//           Columns<columns> inputs() const;
//           template <class Q> struct Particle;  `columns` members of type Q
//           template <class Q> struct Sum;       members of type Q, zero to start with
//           template <class T> T weight(T u) const;
//           template <class Q> void pair(i, j, Q weight, sum) const;   weight in all four places
//           void finish(int i, const Sum<Float4>&) const;
//           bool idle() const;                   true: nothing is to be done
// clang-format on

#include <limits>
#include <vector>

#include "pipeline/contract/error.h"
#include "sim/pairs.h"
#include "sim/quad.h"
#include "sim/sort.h"

namespace drench::sim::DRENCH_BACKEND {

template <int N>
struct Columns {
  const Float4* column[N];
};

/// Blocks of four; the last one is filled up with the particle itself and a closeness of 0.
struct NeighbourLists {
  Column<int> index;
  Column<float> closeness;
  Column<unsigned> begin;  // first block of a particle; on the GPU one past the last one too
  Column<int> blocks;
  struct Range {
    int begin, end;
  };
  std::vector<Range> visits;  // on the CPU: particles in the order in which passes go over them
};

struct NeighbourView {
  const int* index;
  const float* closeness;
  const unsigned* begin;
  const int* blocks;
};

inline NeighbourView view_of(const NeighbourLists& lists) {
  return {lists.index.data(), lists.closeness.data(), lists.begin.data(), lists.blocks.data()};
}

}  // namespace drench::sim::DRENCH_BACKEND

#if defined(__CUDACC__)
#include "sim/neighbours_cuda.h"
#else
#include "sim/neighbours_cpu.h"
#endif

// Counting sort in parallel: a histogram a chunk, one scan over (key, chunk), one scatter.

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "sim/sort.h"

namespace drench::sim::cpu {

void stable_sort_keys(const Column<int>& keys, int n, int key_count, Column<int>& order,
                      Column<int>& start, SortScratch& scratch) {
  const int threads = ::tbb::this_task_arena::max_concurrency();
  // A histogram a chunk costs key_count integers: no more of them than the points pay for.
  int chunks = n / (key_count + 1) + 1;
  if (chunks > threads) chunks = threads;
  if (n > 16384 && chunks < 2 && threads > 1 && key_count < 8 * n) chunks = 2;
  const size_t stride = size_t(key_count) + 1;
  order.resize(n);
  start.resize(stride);
  scratch.histogram.resize(stride * chunks);
  scratch.histogram.clear_bytes(0);
  int* histogram = scratch.histogram.data();
  const int* key = keys.data();
  const auto begin = [=](int c) { return int(int64_t(n) * c / chunks); };

  ::tbb::parallel_for(0, chunks, [&](int c) {
    int* own = histogram + c * stride;
    for (int i = begin(c); i < begin(c + 1); ++i) ++own[key[i]];
  });
  int running = 0;
  int* first = start.data();
  for (size_t k = 0; k < stride; ++k) {
    first[k] = running;
    for (int c = 0; c < chunks; ++c) {
      int& slot = histogram[c * stride + k];
      const int count = slot;
      slot = running;
      running += count;
    }
  }
  int* sorted = order.data();
  ::tbb::parallel_for(0, chunks, [&](int c) {
    int* own = histogram + c * stride;
    for (int i = begin(c); i < begin(c + 1); ++i) sorted[own[key[i]]++] = i;
  });
}

}  // namespace drench::sim::cpu

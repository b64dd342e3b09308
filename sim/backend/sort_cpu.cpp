// Counting sort in parallel: a histogram a chunk, one scan over (key, chunk), one scatter.

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "sim/backend/sort.h"

namespace drench::sim::cpu {

void stable_sort_keys(Queue& queue, const Column<int>& keys, int n, int key_count,
                      Column<int>& order, Column<int>& start) {
  const int threads = ::tbb::this_task_arena::max_concurrency();
  // A histogram a chunk costs key_count integers: no more of them than the points pay for.
  int chunks = n / (key_count + 1) + 1;
  if (chunks > threads) chunks = threads;
  if (n > 16384 && chunks < 2 && threads > 1 && key_count < 8 * n) chunks = 2;
  // Chunks count on cache lines of their own: two on one line wait for each other at every key.
  const size_t keys_and_out = size_t(key_count) + 1, stride = (keys_and_out + 31) / 32 * 32;
  order.resize(n);
  start.resize(keys_and_out);
  Column<int>& counts = queue.sort.histogram;
  counts.resize(stride * chunks);
  counts.clear_bytes(queue, 0);
  int* histogram = counts.data();
  const int* key = keys.data();
  const auto begin = [=](int c) { return int(int64_t(n) * c / chunks); };

  ::tbb::parallel_for(0, chunks, [&](int c) {
    int *own = histogram + c * stride, out = 0;
    for (int i = begin(c); i < begin(c + 1); ++i) {
      if (key[i] == key_count)
        ++out;  // apart: often most of them, and each count would wait for the one before
      else
        ++own[key[i]];
    }
    own[key_count] = out;
  });
  int running = 0;
  int* first = start.data();
  for (size_t k = 0; k < keys_and_out; ++k) {
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
    int *own = histogram + c * stride, out = own[key_count];
    for (int i = begin(c); i < begin(c + 1); ++i) {
      const int to = key[i] == key_count ? out++ : own[key[i]]++;
      sorted[to] = i;
    }
  });
}

}  // namespace drench::sim::cpu

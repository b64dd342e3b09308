#pragma once
// Stable sort of small integer keys. Stable sorting has one result, so it does not depend on
// threads.

#include "sim/backend/queue.h"

namespace drench::sim::DRENCH_BACKEND {

/// Fills order[0..n) with the indices of keys[0..n) in ascending, stable order and start[0..keys]
/// with where each key begins (start[key_count] is the number of keys below key_count). Keys equal
/// to key_count mean "leave out": they stand at the end of order.
void stable_sort_keys(Queue& queue, const Column<int>& keys, int n, int key_count,
                      Column<int>& order, Column<int>& start);

#if defined(__CUDACC__)
/// first[i] is the sum of counts[0..i), for i up to n.
void exclusive_scan(Queue& queue, const Column<int>& counts, int n, Column<unsigned>& first);
#endif

}  // namespace drench::sim::DRENCH_BACKEND

// CUB's radix sort is stable, and a sum of integers has one result. The heavy headers stay in this
// one file.

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "sim/backend/parallel.h"
#include "sim/backend/sort.h"

namespace drench::sim::cuda {

void stable_sort_keys(Queue& queue, const Column<int>& keys, int n, int key_count,
                      Column<int>& order, Column<int>& start) {
  SortScratch& scratch = queue.sort;
  order.resize(n);
  start.resize(size_t(key_count) + 1);
  if (scratch.order_in.size() < size_t(n)) scratch.order_in.resize(n), scratch.key_out.resize(n);
  int* iota = scratch.order_in.data();
  parallel_for(queue, "sort: iota", n, [=] __device__(int i) { iota[i] = i; });
  int bits = 1;
  while ((int64_t(1) << bits) <= key_count) ++bits;
  size_t bytes = 0;
  check_cuda(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys.data(), scratch.key_out.data(),
                                             iota, order.data(), n, 0, bits, queue.stream()),
             "sizing a sort");
  if (scratch.bytes.size() < bytes) scratch.bytes.resize(bytes);
  check_cuda(cub::DeviceRadixSort::SortPairs(scratch.bytes.data(), bytes, keys.data(),
                                             scratch.key_out.data(), iota, order.data(), n, 0, bits,
                                             queue.stream()),
             "sorting");
  // Where key k begins is the first sorted index whose key is not below k.
  const int* sorted = scratch.key_out.data();
  int* first = start.data();
  parallel_for(queue, "sort: key starts", key_count + 1, [=] __device__(int k) {
    int low = 0, high = n;
    while (low < high) {
      const int middle = (low + high) / 2;
      if (sorted[middle] < k)
        low = middle + 1;
      else
        high = middle;
    }
    first[k] = low;
  });
}

void exclusive_scan(Queue& queue, const Column<int>& counts, int n, Column<unsigned>& first) {
  SortScratch& scratch = queue.sort;
  size_t bytes = 0;
  check_cuda(
      cub::DeviceScan::ExclusiveSum(nullptr, bytes, counts.data(), first.data(), n, queue.stream()),
      "sizing a scan");
  if (scratch.bytes.size() < bytes) scratch.bytes.resize(bytes);
  check_cuda(cub::DeviceScan::ExclusiveSum(scratch.bytes.data(), bytes, counts.data(), first.data(),
                                           n, queue.stream()),
             "scanning");
  const int* count = counts.data();
  unsigned* sum = first.data();
  parallel_for(queue, "scan: total", 1,
               [=] __device__(int) { sum[n] = n > 0 ? sum[n - 1] + unsigned(count[n - 1]) : 0u; });
}

}  // namespace drench::sim::cuda

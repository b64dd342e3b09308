#pragma once
// Launches: the same text for both backends, named so that a profile reads like the algorithm.
// Results never depend on the number of threads: every index writes its own element, and the only
// reductions are maxima and minima (order-free) or sums over fixed chunks.

#include "sim/backend/pack.h"
#include "sim/backend/queue.h"

#if defined(__CUDACC__)
#else
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#endif

#include <algorithm>
#include <atomic>

namespace drench::sim::DRENCH_BACKEND {

#if defined(__CUDACC__)

template <class F>
__global__ void launch_for(int n, F f) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n) f(i);
}

/// f(0..n-1), each index by a thread of its own. @param name  of the launch, in errors and profiles
template <class F>
void parallel_for(Queue& queue, const char* name, int n, const F& f) {
  if (n <= 0) return;
  launch_for<<<(n + 127) / 128, 128, 0, queue.stream()>>>(n, f);
  check_cuda(cudaGetLastError(), name);
}

/// A launch whose index is eight consecutive ones at once on a CPU core.
template <class F>
void for_each_lane(Queue& queue, const char* name, int n, const F& f) {
  parallel_for(queue, name, n, f);
}

constexpr int reduce_block = 256, reduce_blocks = 128;

template <class T, class F, class Combine>
__global__ void launch_reduce(int n, T start, F f, Combine combine, T* out) {
  __shared__ alignas(16) char raw[reduce_block * sizeof(T)];
  T* shared = reinterpret_cast<T*>(raw);
  T value = start;
  for (int i = blockIdx.x * reduce_block + threadIdx.x; i < n; i += gridDim.x * reduce_block) {
    value = combine(value, f(i));
  }
  shared[threadIdx.x] = value;
  for (int half = reduce_block / 2; half > 0; half /= 2) {
    __syncthreads();
    if (threadIdx.x < half) {
      shared[threadIdx.x] = combine(shared[threadIdx.x], shared[threadIdx.x + half]);
    }
  }
  if (threadIdx.x == 0) out[blockIdx.x] = shared[0];
}

/// combine over f(0..n-1) by a fixed tree; waits for the device.
template <class T, class F, class Combine>
T parallel_reduce(Queue& queue, const char* name, int n, T start, const F& f,
                  const Combine& combine) {
  if (n <= 0) return start;
  T* partial = queue.partial<T>(reduce_blocks);
  const int blocks = std::min(reduce_blocks, (n + reduce_block - 1) / reduce_block);
  launch_reduce<<<blocks, reduce_block, 0, queue.stream()>>>(n, start, f, combine, partial);
  check_cuda(cudaGetLastError(), name);
  T value = start;
  std::vector<T> parts(blocks);
  check_cuda(cudaMemcpy(parts.data(), partial, blocks * sizeof(T), cudaMemcpyDeviceToHost), name);
  for (const T& part : parts) value = combine(value, part);
  return value;
}

template <class T, class Combine, class Then>
__global__ void launch_then(int blocks, T value, const T* partial, Combine combine, Then then) {
  for (int b = 0; b < blocks; ++b) value = combine(value, partial[b]);
  then(value);
}

/// As parallel_reduce, but the result goes to `then` on the device: the host does not wait.
template <class T, class F, class Combine, class Then>
void reduce_then(Queue& queue, const char* name, int n, T start, const F& f, const Combine& combine,
                 const Then& then) {
  T* partial = queue.partial<T>(reduce_blocks);
  const int blocks = std::min(reduce_blocks, (n + reduce_block - 1) / reduce_block);
  if (n > 0)
    launch_reduce<<<blocks, reduce_block, 0, queue.stream()>>>(n, start, f, combine, partial);
  launch_then<<<1, 1, 0, queue.stream()>>>(blocks, start, partial, combine, then);
  check_cuda(cudaGetLastError(), name);
}

#else

/// f(0..n-1) on all cores.
template <class F>
void parallel_for(Queue&, const char*, int n, const F& f) {
  constexpr int grain = 256;
  if (n <= grain) {
    for (int i = 0; i < n; ++i) f(i);
    return;
  }
  ::tbb::parallel_for(::tbb::blocked_range<int>(0, n, grain), [&](const auto& range) {
    for (int i = range.begin(); i < range.end(); ++i) f(i);
  });
}

/// A launch whose index is eight consecutive ones at once; columns are padded to a multiple of
/// eight.
template <class F>
void for_each_lane(Queue& queue, const char* name, int n, const F& f) {
  parallel_for(queue, name, (n + 7) / 8, [&](int block) { f(Lanes{8 * block}); });
}

/// combine over f(0..n-1), chunk by chunk of fixed size, chunks in order.
template <class T, class F, class Combine>
T parallel_reduce(Queue&, const char*, int n, T start, const F& f, const Combine& combine) {
  constexpr int chunk = 4096;
  const int chunks = (n + chunk - 1) / chunk;
  std::vector<T> partial(chunks, start);
  ::tbb::parallel_for(0, chunks, [&](int c) {
    T value = start;
    for (int i = c * chunk; i < std::min(n, (c + 1) * chunk); ++i) value = combine(value, f(i));
    partial[c] = value;
  });
  T value = start;
  for (const T& part : partial) value = combine(value, part);
  return value;
}

/// As parallel_reduce, but the result goes to `then` where the data are.
template <class T, class F, class Combine, class Then>
void reduce_then(Queue& queue, const char* name, int n, T start, const F& f, const Combine& combine,
                 const Then& then) {
  then(parallel_reduce(queue, name, n, start, f, combine));
}

#endif

struct Either {
  DRENCH_HD int operator()(int a, int b) const { return a | b; }
};

/// Is f true in any lane? f is called for all of them.
template <class F>
bool any_lane(Queue& queue, const char* name, int n, const F& f) {
#if defined(__CUDACC__)
  return parallel_reduce(
             queue, name, n, 0, [=] __device__(int i) { return int(f(i)); }, Either{}) != 0;
#else
  std::atomic<int> any{0};
  for_each_lane(queue, name, n, [&](Lanes i) {
    if ((f(i) & below(i, n)).bits()) any.store(1, std::memory_order_relaxed);
  });
  return any != 0;
#endif
}

/// Combines sums.
struct Plus {
  template <class T>
  DRENCH_HD T operator()(const T& a, const T& b) const {
    return a + b;
  }
};

struct Larger {
  template <class T>
  DRENCH_HD T operator()(T a, T b) const {
    return a > b ? a : b;
  }
};

/// Two sums at once, of floats, doubles or packs.
template <class T>
struct Two {
  T a, b;
  DRENCH_HD Two operator+(const Two& other) const { return {a + other.a, b + other.b}; }
};

#if defined(__CUDACC__)

/// f of all lanes returns Two; their sums go to then(a, b) where the data are.
template <class F, class Then>
void sum_lanes_then(Queue& queue, const char* name, int n, const F& f, const Then& then) {
  reduce_then(
      queue, name, n, Two<double>{0., 0.},
      [=] __device__(int i) {
        const Two<float> one = f(i);
        return Two<double>{one.a, one.b};
      },
      Plus{}, [=] __device__(const Two<double>& sum) { then(sum.a, sum.b); });
}

#else

/// f of all lanes returns Two; their sums, in float within fixed chunks, in double over these, go
/// to then(a, b) where the data are. Columns are padded to a multiple of eight, with zeros.
template <class F, class Then>
void sum_lanes_then(Queue&, const char*, int n, const F& f, const Then& then) {
  constexpr int chunk = 64;
  const int packs = (n + 7) / 8, chunks = (packs + chunk - 1) / chunk;
  std::vector<Two<double>> partial(chunks);
  ::tbb::parallel_for(0, chunks, [&](int c) {
    Two<Pack> sum{Pack(0.f), Pack(0.f)};
    for (int k = c * chunk; k < std::min(packs, (c + 1) * chunk); ++k) {
      const Two<Pack> one = f(Lanes{8 * k});
      sum = sum + one;
    }
    partial[c] = {sum_of_lanes(sum.a), sum_of_lanes(sum.b)};
  });
  Two<double> total{0., 0.};
  for (const Two<double>& part : partial) total = total + part;
  then(total.a, total.b);
}

#endif

/// Integer sums do not depend on order: the only atomics there are.
DRENCH_HD void add_atomic(long long* sum, long long value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(reinterpret_cast<unsigned long long*>(sum), static_cast<unsigned long long>(value));
#elif !defined(__CUDACC__)
  std::atomic_ref<long long>(*sum).fetch_add(value, std::memory_order_relaxed);
#endif
}

}  // namespace drench::sim::DRENCH_BACKEND

// What must work: each kernel's result is compared with the host's. Built and run by selftest/run.

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>

#include "tests/gpu/emulator/selftest/test.h"

namespace {

struct Numbers {
  float f[12];
  int i[14];
  double d[4];
  __host__ __device__ Numbers() {}
  __host__ __device__ Numbers(float a, float b, int k, int m) {
    const float fs[12] = {a * b + a,       a / b,     sqrtf(fabsf(a)), fminf(a, b),
                          fmaxf(a, b),     floorf(a), rintf(b),        truncf(a * 8),
                          copysignf(a, b), ceilf(b),  float(k) / 3,    float(unsigned(k))};
    const int is[14] = {k * m,
                        k / m,
                        k % m,
                        k >> 3,
                        int(unsigned(k) >> 5),
                        k << 4,
                        int(a * 100),
                        int(short(k)),
                        (signed char)m,
                        k & m,
                        k | m,
                        k ^ m,
                        min(k, m),
                        int(unsigned(a * a))};
    const double ds[4] = {double(a) * b, double(a) / b, sqrt(double(k) * k),
                          double((long long)k * m)};
    for (int n = 0; n < 12; ++n) f[n] = fs[n];
    for (int n = 0; n < 14; ++n) i[n] = is[n];
    for (int n = 0; n < 4; ++n) d[n] = ds[n];
  }
};
__global__ void calculate(const float* a, const float* b, const int* k, const int* m, int n,
                          Numbers* out) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n) out[i] = Numbers(a[i], b[i], k[i], m[i]);
}

__global__ void special(const float* a, int n, float* out) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n)
    out[4 * i] = expf(a[i]), out[4 * i + 1] = sinf(a[i]), out[4 * i + 2] = powf(fabsf(a[i]), 1.3f),
            out[4 * i + 3] = atan2f(a[i], 2.f);
}

__global__ void block_sum(const int* in, int n, int* out) {
  __shared__ int part[32];
  const int i = blockIdx.x * blockDim.x + threadIdx.x, lane = threadIdx.x % 32,
            warp = threadIdx.x / 32;
  int value = i < n ? in[i] : 0;
  for (int by = 16; by > 0; by /= 2) value += __shfl_down_sync(~0u, value, by);
  if (lane == 0) part[warp] = value;
  __syncthreads();
  if (warp == 0) {
    value = lane < blockDim.x / 32 ? part[lane] : 0;
    for (int by = 16; by > 0; by /= 2) value += __shfl_xor_sync(~0u, value, by);
    if (lane == 0) atomicAdd(out, value);
  }
}

__global__ void warp_words(unsigned* out) {
  const unsigned lane = threadIdx.x;
  out[lane] = __ballot_sync(~0u, lane % 3 == 0);
  out[32 + lane] = __shfl_up_sync(~0u, lane, 1);
  out[64 + lane] = __reduce_add_sync(~0u, lane);
  out[96 + lane] = __match_any_sync(~0u, lane / 8);
  out[128 + lane] = __any_sync(~0u, lane == 31) + 2 * __all_sync(~0u, lane < 31);
  out[160 + lane] = __popc(lane) + 100 * __clz(lane) + 10000 * __ffs(lane);
  out[192 + lane] = __byte_perm(0x01020304, 0x05060708, lane);
  out[224 + lane] = __funnelshift_l(lane, 0x80000001u, 4);
}

__device__ __noinline__ void fill(int* a, int n) {
  for (int k = 0; k < n; ++k) a[k] = k * k;
}
__global__ void local_memory(int* out, const int* at) {
  int a[40];
  fill(a, 40);
  out[threadIdx.x] = a[at[threadIdx.x]];
}
__constant__ int table[4];
__device__ int counter;
__global__ void variables(int* out) {
  out[threadIdx.x] = table[threadIdx.x % 4];
  atomicAdd(&counter, 1);
}

}  // namespace

int main() {
  std::mt19937 random(1);
  const int n = 5000;
  std::vector<float> a(n), b(n);
  std::vector<int> k(n), m(n);
  for (int i = 0; i < n; ++i) {
    a[i] = std::uniform_real_distribution<float>(-50, 50)(random),
    b[i] = std::uniform_real_distribution<float>(-9, 9)(random);
    k[i] = int(random()), m[i] = int(random() % 2000) - 1000;
    if (m[i] == 0) m[i] = 7;
  }
  {
    Device<float> da(a), db(b);
    Device<int> dk(k), dm(m);
    const std::vector<Numbers> none(n);
    Device<Numbers> out(none);
    calculate<<<(n + 127) / 128, 128>>>(da.data, db.data, dk.data, dm.data, n, out.data);
    bool fine = true;
    const auto got = out.host();
    for (int i = 0; i < n; ++i) {
      Numbers want(a[i], b[i], k[i], m[i]);
      want.f[0] = std::fma(a[i], b[i], a[i]);  // nvcc contracts
      for (int q = 0; q < 12; ++q) fine &= got[i].f[q] == want.f[q];
      for (int q = 0; q < 14; ++q) fine &= got[i].i[q] == want.i[q];
      for (int q = 0; q < 4; ++q) fine &= got[i].d[q] == want.d[q];
    }
    expect(fine, "arithmetic and conversions");
    Device<float> words(std::vector<float>(4 * size_t(n), 0.f));
    special<<<(n + 127) / 128, 128>>>(da.data, n, words.data);
    const auto w = words.host();
    fine = true;
    for (int i = 0; i < n; ++i) {
      const double want[4] = {std::exp(double(a[i])), std::sin(double(a[i])),
                              std::pow(std::abs(double(a[i])), double(1.3f)),
                              std::atan2(double(a[i]), 2.)};
      for (int q = 0; q < 4; ++q)
        fine &= std::abs(w[4 * i + q] - want[q]) <= 3e-6 * std::abs(want[q]) + 1e-7;
    }
    expect(fine, "exp, sin, pow, atan2");
    Device<int> sum(std::vector<int>{0});
    block_sum<<<(n + 255) / 256, 256>>>(dm.data, n, sum.data);
    expect(sum.host()[0] == std::accumulate(m.begin(), m.end(), 0),
           "shuffles, a barrier, an atomic");
  }
  {
    Device<unsigned> out(std::vector<unsigned>(256, 0u));
    warp_words<<<1, 32>>>(out.data);
    const auto w = out.host();
    bool fine = true;
    for (unsigned l = 0; l < 32; ++l) {
      unsigned ballot = 0, ffs = 0;
      for (int q = 0; q < 32; q += 3) ballot |= 1u << q;
      for (unsigned q = 0; q < 32 && !ffs; ++q) ffs = l >> q & 1 ? q + 1 : 0;
      const unsigned clz = l ? 31 - unsigned(std::log2(l)) : 32;
      unsigned perm = 0;
      const unsigned long long bytes = 0x0506070801020304ull;
      for (int q = 0; q < 4; ++q)
        perm |= unsigned(bytes >> (8 * ((l >> (4 * q)) & 7)) & 255) << (8 * q);
      fine &= w[l] == ballot && w[32 + l] == (l ? l - 1 : 0) && w[64 + l] == 496 &&
              w[96 + l] == 255u << (l / 8 * 8) && w[128 + l] == 1;
      fine &= w[160 + l] == unsigned(std::popcount(l)) + 100 * clz + 10000 * ffs &&
              w[192 + l] == perm && w[224 + l] == 16;
    }
    expect(fine, "warp instructions and bits");
  }
  {
    std::vector<int> at(64);
    for (int q = 0; q < 64; ++q) at[q] = (q * 7) % 40;
    Device<int> out(std::vector<int>(64, 0)), dat(at);
    local_memory<<<1, 64>>>(out.data, dat.data);
    bool fine = true;
    const auto got = out.host();
    for (int q = 0; q < 64; ++q) fine &= got[q] == at[q] * at[q];
    expect(fine, "local memory and a call");
    const int values[4] = {5, 6, 7, 8};
    cudaMemcpyToSymbol(table, values, sizeof values);
    variables<<<1, 64>>>(out.data);
    int count = 0;
    cudaMemcpyFromSymbol(&count, counter, sizeof count);
    expect(count == 64 && out.host()[6] == 7, "variables of the module");
  }
  for (const int size : {1, 100, 3000, 70000, 300000}) {
    std::vector<int> keys(size), values(size), counts(size);
    for (int i = 0; i < size; ++i)
      keys[i] = int(random() % 5000), values[i] = i, counts[i] = int(random() % 9);
    Device<int> dk(keys), dv(values), ko(keys), vo(values), dc(counts), dsum(counts);
    size_t bytes = 0, more = 0;
    cub::DeviceRadixSort::SortPairs(nullptr, bytes, dk.data, ko.data, dv.data, vo.data, size, 0,
                                    13);
    cub::DeviceScan::ExclusiveSum(nullptr, more, dc.data, dsum.data, size);
    Device<char> scratch(std::vector<char>(std::max(bytes, more), 0));
    // Twice: at once, and as a graph that is launched when its work has been undone.
    cudaStream_t stream;
    cudaGraph_t graph;
    cudaGraphExec_t exec;
    cudaStreamCreate(&stream);
    for (const bool captures : {false, true}) {
      if (captures) cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal);
      cub::DeviceRadixSort::SortPairs(scratch.data, bytes, dk.data, ko.data, dv.data, vo.data, size,
                                      0, 13, stream);
      cub::DeviceScan::ExclusiveSum(scratch.data, more, dc.data, dsum.data, size, stream);
      if (captures) cudaStreamEndCapture(stream, &graph);
    }
    if (size % 1000 == 0) {
      cudaMemset(vo.data, 0, size * sizeof(int)), cudaMemset(dsum.data, 0, size * sizeof(int));
      cudaGraphInstantiate(&exec, graph, 0), cudaGraphLaunch(exec, stream);
    }
    std::stable_sort(values.begin(), values.end(), [&](int x, int y) { return keys[x] < keys[y]; });
    std::vector<int> sums(size);
    std::exclusive_scan(counts.begin(), counts.end(), sums.begin(), 0);
    char what[60];
    std::snprintf(what, sizeof what, "CUB sort and scan of %d", size);
    expect(vo.host() == values && dsum.host() == sums, what);
  }
  expect(cudaGetLastError() == cudaSuccess, "no error");
  return failures != 0;
}

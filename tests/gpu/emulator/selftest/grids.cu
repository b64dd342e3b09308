// Grids whose blocks meet, cooperative launches, copies to shared memory: see test.h.

#include <cooperative_groups.h>
#include <cooperative_groups/memcpy_async.h>
#include <cuda_pipeline.h>

#include <cstdlib>

#include "tests/gpu/emulator/selftest/test.h"

namespace cg = cooperative_groups;

namespace {

/// A ring of neighbours, step after step: needs all of the step before.
template <class Barrier>
__device__ void step(int* from, int* to, int n, int steps, Barrier meet) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  for (int k = 0; k < steps; ++k) {
    if (i < n) to[i] = from[(i + 1) % n] + from[(i + n - 1) % n];
    meet();
    int* const other = from;
    from = to, to = other;
  }
}
__global__ void cooperative(int* a, int* b, int n, int steps) {
  cg::grid_group grid = cg::this_grid();
  step(a, b, n, steps, [&] { grid.sync(); });
}
__global__ void without_meeting(int* a, int* b, int n, int steps) {
  step(a, b, n, steps, [&] { __syncthreads(); });
}
enum Mistake { none, no_fence, no_syncthreads };
template <Mistake mistake>
__global__ void own_barrier(int* a, int* b, int n, int steps, unsigned* came) {
  unsigned round = 0;
  step(a, b, n, steps, [&] {
    if (mistake != no_syncthreads) __syncthreads();
    if (threadIdx.x == 0) {
      if (mistake != no_fence) __threadfence();
      atomicAdd(came, 1u);
      const unsigned all = ++round * gridDim.x;
      while (*static_cast<volatile unsigned*>(came) < all) {
      }
      __threadfence();
    }
    __syncthreads();
  });
}
/// The last block adds what the others have left.
template <Mistake mistake>
__global__ void sum(const int* in, int* parts, unsigned* came, int* out) {
  __shared__ bool last;
  parts[blockIdx.x * blockDim.x + threadIdx.x] = in[blockIdx.x * blockDim.x + threadIdx.x];
  if (mistake != no_syncthreads) __syncthreads();
  if (threadIdx.x == 0) {
    if (mistake != no_fence) __threadfence();
    last = atomicAdd(came, 1u) == gridDim.x - 1;
    __threadfence();
  }
  __syncthreads();
  if (!last || threadIdx.x > 0) return;
  int all = 0;
  for (unsigned k = 0; k < gridDim.x * blockDim.x; ++k) all += parts[k];
  *out = all;
}
/// Each block waits for the next one.
__global__ void backwards(unsigned* done, int how) {
  if (blockIdx.x + 1 < gridDim.x) {
    unsigned* const next = &done[blockIdx.x + 1];
    while ((how == 2 ? __ldcg(next) : atomicAdd(next, 0u)) == 0)
      if (how == 1) __nanosleep(100);
  }
  atomicExch(&done[blockIdx.x], 1u);
}
__global__ void locked(int* lock, int* value) {
  for (bool done = false; !done;) {
    if (atomicCAS(lock, 0, 1) != 0) continue;
    __threadfence();
    atomicAdd(value, 1);
    __threadfence();
    atomicExch(lock, 0), done = true;
  }
}
__global__ void staged(const int4* in, int4* out, bool wait) {
  __shared__ int4 s[64];
  __pipeline_memcpy_async(&s[threadIdx.x], &in[threadIdx.x], 16);
  __pipeline_commit();
  if (wait) __pipeline_wait_prior(0);
  __syncthreads();
  out[threadIdx.x] = s[63 - threadIdx.x];
}
__global__ void grouped(const int* in, int* out) {
  extern __shared__ int many[];
  const cg::thread_block block = cg::this_thread_block();
  cg::memcpy_async(block, many, in, 256 * sizeof(int));
  cg::wait(block);
  out[threadIdx.x] = many[255 - threadIdx.x] + __ldg(&in[threadIdx.x]);
}
__global__ void heavy(double* p) {
  double a[32];
#pragma unroll
  for (int k = 0; k < 32; ++k) a[k] = p[k * 512 + threadIdx.x];
#pragma unroll
  for (int k = 1; k < 32; ++k) a[k] = a[k] * a[k - 1] + a[31 - k];
#pragma unroll
  for (int k = 0; k < 32; ++k) p[k * 512 + threadIdx.x] = a[k];
}

constexpr int n = 1000, block = 128, blocks = (n + block - 1) / block, steps = 5;
std::vector<int> ring() {
  std::vector<int> a(n);
  for (int k = 0; k < n; ++k) a[k] = k % 17;
  return a;
}
std::vector<int> wanted() {
  std::vector<int> a = ring(), b(n);
  for (int s = 0; s < steps; ++s, a = b)
    for (int i = 0; i < n; ++i) b[i] = a[(i + 1) % n] + a[(i + n - 1) % n];
  return a;
}
cudaError_t launch_cooperative(int count, int* a, int* b, int steps) {
  int size = n;
  void* arguments[] = {&a, &b, &size, &steps};
  return cudaLaunchCooperativeKernel(cooperative, count, block, arguments, 0, nullptr);
}

void right() {
  Device<int> a(ring()), b(std::vector<int>(n, 0));
  Device<unsigned> came(std::vector<unsigned>(300, 0u));
  launch_cooperative(blocks, a.data, b.data, steps);
  expect(b.host() == wanted(), "a cooperative launch");
  int per_sm = 0;
  cudaOccupancyMaxActiveBlocksPerMultiprocessor(&per_sm, cooperative, block, 0);
  expect(per_sm == 16, "as many blocks as threads allow");
  expect(launch_cooperative(132 * 16, a.data, b.data, 2) == cudaSuccess, "a full device");
  expect(launch_cooperative(132 * 16 + 1, a.data, b.data, 1) == cudaErrorCooperativeLaunchTooLarge,
         "one block too many");
  cudaGetLastError();
  cudaFuncAttributes attributes;
  cudaFuncGetAttributes(&attributes, heavy);
  cudaOccupancyMaxActiveBlocksPerMultiprocessor(&per_sm, heavy, 512, 0);
  const int of_warp = (attributes.numRegs + 7) / 8 * 8 * 32;  // a quarter of the warps each
  expect(attributes.numRegs > 40 && per_sm == 16384 / of_warp * 4 / 16, "as registers allow");
  cudaOccupancyMaxActiveBlocksPerMultiprocessor(&per_sm, cooperative, block, 60 << 10);
  expect(per_sm == 3, "as shared memory allows");
  {
    Device<int> c(ring()), d(std::vector<int>(n, 0));
    own_barrier<none><<<blocks, block>>>(c.data, d.data, n, steps, came.data);
    expect(d.host() == wanted(), "a barrier of the program's own");
  }
  {
    Device<unsigned> done(std::vector<unsigned>(60, 0u));
    const bool races = std::getenv("GPUEMU_CHECK") != nullptr;
    Device<int> in(std::vector<int>(300 * 64, 2)), parts(std::vector<int>(300 * 64, 0)),
        out({0, 0});
    backwards<<<20, 32>>>(done.data, 0), backwards<<<20, 1>>>(done.data + 20, 1);
    if (!races) backwards<<<20, 1>>>(done.data + 40, 2);  // a load that is not atomic
    cudaMemset(came.data, 0, 4);
    sum<none><<<300, 64>>>(in.data, parts.data, came.data, out.data);
    expect(done.host()[0] == 1 && done.host()[20] == 1 && (races || done.host()[40] == 1) &&
               out.host()[0] == 300 * 64 * 2,
           "blocks that wait for later ones, a last block");
    cudaMemset(out.data, 0, 8);
    locked<<<5, 64>>>(out.data, out.data + 1);
    expect(out.host()[1] == 5 * 64, "a lock");
  }
  Device<int> in(ring()), out(std::vector<int>(n, 0));
  staged<<<1, 64>>>(reinterpret_cast<int4*>(in.data), reinterpret_cast<int4*>(out.data), true);
  expect(out.host()[5] == in.host()[249], "an asynchronous copy to shared memory");
  cudaFuncSetAttribute(grouped, cudaFuncAttributeMaxDynamicSharedMemorySize, 100 << 10);
  grouped<<<1, 256, 100 << 10>>>(in.data, out.data);
  expect(out.host()[3] == in.host()[252] + in.host()[3], "the same by a group, much shared memory");
  expect(cudaGetLastError() == cudaSuccess, "no error");
}

void wrong() {
  Device<int> a(ring()), b(std::vector<int>(n, 0)), parts(std::vector<int>(300 * 64, 0));
  Device<unsigned> came(std::vector<unsigned>(5000, 0u));
  if (is("no_workspace")) cooperative<<<blocks, block>>>(a.data, b.data, n, steps);
  if (is("no_meeting")) without_meeting<<<blocks, block>>>(a.data, b.data, n, steps);
  if (is("no_fence")) own_barrier<no_fence><<<blocks, block>>>(a.data, b.data, n, steps, came.data);
  if (is("no_syncthreads"))
    own_barrier<no_syncthreads><<<blocks, block>>>(a.data, b.data, n, steps, came.data);
  if (is("last_no_fence")) sum<no_fence><<<10, 64>>>(a.data, parts.data, came.data, b.data);
  if (is("last_no_syncthreads"))
    sum<no_syncthreads><<<10, 64>>>(a.data, parts.data, came.data, b.data);
  if (is("too_many_to_meet")) own_barrier<none><<<2113, block>>>(a.data, b.data, n, 1, came.data);
  if (is("never_set")) {
    cudaMemset(came.data, 0, 4);
    backwards<<<dim3(3), 1>>>(came.data, 0);  // well so far
    cudaMemset(came.data, 0, 16);
    locked<<<1, 1>>>(reinterpret_cast<int*>(came.data) + 4, b.data);
    cudaMemset(came.data, 1, 4);
    locked<<<1, 1>>>(reinterpret_cast<int*>(came.data), b.data);  // a lock that is never free
  }
  if (is("no_wait"))
    staged<<<1, 64>>>(reinterpret_cast<int4*>(a.data), reinterpret_cast<int4*>(b.data), false);
  if (is("no_wait") && b.host()[0] == 0x7f7f7f7f) std::printf("nothing has come yet\n");
  if (is("much_shared")) grouped<<<1, 256, 100 << 10>>>(a.data, b.data);
  std::printf("%s\n", cudaGetErrorString(cudaGetLastError()));
}

}  // namespace

int main(int count, char** arguments) {
  if (count > 1) return mistake = arguments[1], wrong(), 0;
  return right(), failures != 0;
}

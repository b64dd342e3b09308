// What must be found: `faults NAME` makes one mistake. Run by selftest/run.

#include <cstdio>
#include <cstring>

namespace {

__global__ void write_at(int* p, long at) { p[at] = 1; }
__global__ void read_at(const int* p, long at, int* out) { *out = p[at]; }
__global__ void neighbour(int* p) {
  p[threadIdx.x] = int(threadIdx.x);
  if (threadIdx.x + 1 < blockDim.x) p[threadIdx.x + 1] += 1;
}
__global__ void shared_without_barrier(int* out) {
  __shared__ int s[64];
  s[threadIdx.x] = int(threadIdx.x);
  out[threadIdx.x] = s[63 - threadIdx.x];
}
__global__ void shared_with_barrier(int* out) {
  __shared__ int s[64];
  s[threadIdx.x] = int(threadIdx.x);
  __syncthreads();
  out[threadIdx.x] = s[63 - threadIdx.x];
}
__global__ void shared_beyond(int* out, int at) {
  __shared__ int s[64];
  s[threadIdx.x] = 1;
  __syncthreads();
  out[threadIdx.x] = s[threadIdx.x + at];
}
__global__ void half_a_barrier(int* out) {
  if (threadIdx.x < 16) __shfl_sync(~0u, 1, 0);
  __syncthreads();
  out[threadIdx.x] = 1;
}

}  // namespace

int main(int, char** argument) {
  const auto is = [&](const char* name) { return std::strcmp(argument[1], name) == 0; };
  int *p, *q, host = 0;
  cudaMalloc(&p, 4 * 65), cudaMalloc(&q, 4 * 64);
  if (is("beyond")) write_at<<<1, 1>>>(p, 65);
  if (is("before")) write_at<<<1, 1>>>(p, -1);
  if (is("read_beyond")) read_at<<<1, 1>>>(p, 65, q);
  if (is("null")) write_at<<<1, 1>>>(nullptr, 0);
  if (is("host_pointer")) write_at<<<1, 1>>>(&host, 0);
  if (is("misaligned"))
    write_at<<<1, 1>>>(reinterpret_cast<int*>(reinterpret_cast<char*>(p) + 2), 0);
  if (is("freed")) cudaFree(p), read_at<<<1, 1>>>(p, 0, q);
  if (is("uninitialised")) read_at<<<1, 1>>>(p, 3, q);
  if (is("race")) cudaMemset(p, 0, 4 * 65), neighbour<<<1, 64>>>(p);
  if (is("race_in_shared")) shared_without_barrier<<<1, 64>>>(p);
  if (is("no_race")) shared_with_barrier<<<1, 64>>>(p);
  if (is("shared_beyond")) shared_beyond<<<1, 64>>>(p, 1);
  if (is("deadlock")) half_a_barrier<<<1, 64>>>(p);
  if (is("copy_beyond")) cudaMemset(p, 0, 4 * 66);
  if (is("too_many_threads")) write_at<<<1, 2048>>>(p, 0);
  if (is("host_dereference")) host = *p;
  const cudaError_t error = cudaGetLastError();
  std::printf("%s\n", cudaGetErrorString(error));
  return error != cudaSuccess;
}

// Streams, events, pinned memory: see test.h.

#include "tests/gpu/emulator/selftest/test.h"

namespace {

__global__ void set(int* p, int value) { p[threadIdx.x] = value; }
__global__ void add(int* p, const int* q) { p[threadIdx.x] += q[threadIdx.x]; }
void call_back(void* data) { ++*static_cast<int*>(data); }
void call_runtime(void*) { cudaDeviceSynchronize(), cudaMemset(nullptr, 0, 1); }

struct Streams {
  cudaStream_t a, b, blocking;
  cudaEvent_t event;
  Streams() {
    cudaStreamCreateWithFlags(&a, cudaStreamNonBlocking);
    cudaStreamCreateWithFlags(&b, cudaStreamNonBlocking);
    cudaStreamCreate(&blocking);
    cudaEventCreateWithFlags(&event, cudaEventDisableTiming);
  }
  void b_waits_for_a() { cudaEventRecord(event, a), cudaStreamWaitEvent(b, event, 0); }
};

void right() {
  Streams s;
  Device<int> p(std::vector<int>(32, 1)), q(std::vector<int>(32, 2));
  set<<<1, 32, 0, s.a>>>(p.data, 5);
  s.b_waits_for_a();
  add<<<1, 32, 0, s.b>>>(q.data, p.data);
  cudaStreamSynchronize(s.b);
  add<<<1, 32, 0, s.a>>>(p.data, q.data);  // b is known to be over
  expect(q.host()[3] == 7 && p.host()[3] == 12, "two streams with an event");

  set<<<1, 32, 0, s.blocking>>>(p.data, 1);
  set<<<1, 32>>>(q.data, 2);  // waits for the blocking stream
  add<<<1, 32>>>(q.data, p.data);
  add<<<1, 32, 0, s.blocking>>>(p.data, q.data);  // waits for the default stream
  expect(p.host()[0] == 4, "the default stream and a blocking one");

  int *mapped, *seen, calls = 0;
  cudaHostAlloc(&mapped, 32 * sizeof(int), cudaHostAllocMapped);
  cudaHostGetDevicePointer(&seen, mapped, 0);
  for (int k = 0; k < 32; ++k) mapped[k] = k;
  add<<<1, 32, 0, s.a>>>(seen, p.data);
  cudaLaunchHostFunc(s.a, call_back, &calls);
  cudaStreamSynchronize(s.a);
  cudaPointerAttributes attributes;
  cudaPointerGetAttributes(&attributes, mapped);
  expect(mapped[9] == 13 && calls == 1 && attributes.type == cudaMemoryTypeHost,
         "pinned memory in a kernel, a host function");
  cudaMemcpyAsync(q.data, mapped, 128, cudaMemcpyDefault, s.a);
  add<<<1, 32, 0, s.a>>>(q.data, q.data);
  cudaMemcpyAsync(mapped, q.data, 128, cudaMemcpyDeviceToHost, s.a);
  cudaStreamSynchronize(s.a);
  expect(mapped[9] == 26, "copies of pinned memory");
  cudaFreeHost(mapped);

  int* pool;
  cudaMallocAsync(&pool, 128, s.a);
  cudaMemsetAsync(pool, 0, 128, s.a);
  add<<<1, 32, 0, s.a>>>(pool, p.data);
  s.b_waits_for_a();
  add<<<1, 32, 0, s.b>>>(p.data, pool);
  cudaFreeAsync(pool, s.b);
  cudaDeviceSynchronize();
  expect(p.host()[1] == 8, "memory of a stream");
  cudaStreamDestroy(s.a), cudaStreamDestroy(s.b), cudaStreamDestroy(s.blocking);
  expect(cudaStreamSynchronize(s.a) == cudaErrorInvalidResourceHandle, "a stream that is no more");
  cudaGetLastError();
  expect(cudaGetLastError() == cudaSuccess, "no error");
}

void wrong() {
  Streams s;
  Device<int> p(std::vector<int>(32, 1)), q(std::vector<int>(32, 2));
  std::vector<int> host(32, 3);
  int* pool;
  set<<<1, 32, 0, s.a>>>(p.data, 5);
  if (is("unordered")) add<<<1, 32, 0, s.b>>>(q.data, p.data);
  if (is("unordered_writes")) set<<<1, 32, 0, s.b>>>(p.data, 6);
  if (is("early_event")) {
    s.b_waits_for_a();
    add<<<1, 32, 0, s.a>>>(p.data, q.data);  // after the event
    add<<<1, 32, 0, s.b>>>(q.data, p.data);
  }
  if (is("two_readers")) {  // one of them is not waited for
    cudaDeviceSynchronize();
    add<<<1, 32, 0, s.b>>>(q.data, p.data);
    add<<<1, 32, 0, s.blocking>>>(q.data + 0, p.data);
    cudaStreamSynchronize(s.blocking);
    set<<<1, 32, 0, s.a>>>(p.data, 1);
  }
  if (is("non_blocking")) add<<<1, 32>>>(q.data, p.data);
  if (is("unordered_copy")) cudaMemcpyAsync(q.data, p.data, 128, cudaMemcpyDeviceToDevice, s.b);
  if (is("unordered_memset")) cudaMemsetAsync(p.data, 0, 128, s.b);
  if (is("staged")) {  // cudaMemcpy from pageable memory may end before the copy does
    cudaMemcpy(q.data, host.data(), 128, cudaMemcpyHostToDevice);
    add<<<1, 32, 0, s.a>>>(p.data, q.data);
  }
  if (is("early_use")) cudaMallocAsync(&pool, 128, s.a), set<<<1, 32, 0, s.b>>>(pool, 1);
  if (is("early_free")) {
    cudaMallocAsync(&pool, 128, s.a), set<<<1, 32, 0, s.a>>>(pool, 1);
    cudaFreeAsync(pool, s.b);
  }
  if (is("read_early") || is("write_early")) {
    int* pinned;
    cudaMallocHost(&pinned, 128), std::memset(pinned, 0, 128);
    cudaMemcpyAsync(is("read_early") ? pinned : p.data, is("read_early") ? p.data : pinned, 128,
                    cudaMemcpyDefault, s.a);
    if (*pinned != 5 && is("read_early")) std::printf("nothing has come yet\n");
    if (is("write_early")) *pinned = 6;
    cudaStreamSynchronize(s.a);
    if (*pinned == 5) std::printf("now it has\n");
  }
  if (is("host_calls")) cudaLaunchHostFunc(s.a, call_runtime, nullptr);
}

}  // namespace

int main(int count, char** arguments) {
  if (count > 1) return mistake = arguments[1], wrong(), 0;
  return right(), failures != 0;
}

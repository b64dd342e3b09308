// Graphs, captured and made by hand, with conditional nodes: see test.h.

#include <cooperative_groups.h>
#include <cuda_profiler_api.h>

#include "tests/gpu/emulator/selftest/test.h"

namespace {

__global__ void set(int* p, int value) { p[threadIdx.x] = value; }
__global__ void add(int* p, const int* q) { p[threadIdx.x] += q[threadIdx.x]; }
__global__ void count_down(int* left, cudaGraphConditionalHandle h) {
  cudaGraphSetConditional(h, --*left > 0);
}
__global__ void choose(const int* value, cudaGraphConditionalHandle h) {
  cudaGraphSetConditional(h, *value);
}
__global__ void disagree(cudaGraphConditionalHandle h) { cudaGraphSetConditional(h, threadIdx.x); }
__global__ void meet(int* p) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  p[i] = i;
  cooperative_groups::this_grid().sync();
  atomicAdd(&p[32 * gridDim.x], p[32 * gridDim.x - 1 - i]);
}
void call_back(void* data) { ++*static_cast<int*>(data); }

struct Setting {
  cudaStream_t a, b, c;
  cudaEvent_t forked, joined;
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t exec = nullptr;
  int* pinned;
  Device<int> p, q, r;
  Setting()
      : p(std::vector<int>(32, 1)), q(std::vector<int>(32, 2)), r(std::vector<int>(32 * 8 + 1, 0)) {
    cudaStreamCreate(&a), cudaStreamCreateWithFlags(&b, cudaStreamNonBlocking),
        cudaStreamCreate(&c);
    cudaEventCreate(&forked), cudaEventCreate(&joined), cudaMallocHost(&pinned, 128);
  }
  void begin(cudaStreamCaptureMode mode = cudaStreamCaptureModeGlobal) {
    cudaStreamBeginCapture(a, mode);
  }
  cudaError_t end() { return cudaStreamEndCapture(a, &graph); }
  cudaError_t run(int times = 1) {
    cudaError_t error = exec ? cudaSuccess : cudaGraphInstantiate(&exec, graph, 0);
    for (int k = 0; !error && k < times; ++k) error = cudaGraphLaunch(exec, a);
    if (!error) error = cudaStreamSynchronize(a);
    return error;
  }
  void fork() { cudaEventRecord(forked, a), cudaStreamWaitEvent(b, forked, 0); }
  void join() { cudaEventRecord(joined, b), cudaStreamWaitEvent(a, joined, 0); }
  /// A conditional node that the stream's capture goes on from.
  cudaGraph_t* conditional(cudaGraphConditionalHandle h, cudaGraphConditionalNodeType type,
                           unsigned size, bool capturing = true) {
    cudaStreamCaptureStatus status;
    const cudaGraphNode_t* before = nullptr;
    size_t count = 0;
    if (capturing) cudaStreamGetCaptureInfo(a, &status, nullptr, &graph, &before, nullptr, &count);
    cudaGraphNodeParams params = {cudaGraphNodeTypeConditional};
    params.conditional.handle = h, params.conditional.type = type, params.conditional.size = size;
    cudaGraphNode_t node;
    if (cudaGraphAddNode(&node, graph, before, nullptr, count, &params)) return nullptr;
    if (capturing)
      cudaStreamUpdateCaptureDependencies(a, &node, nullptr, 1, cudaStreamSetCaptureDependencies);
    return params.conditional.phGraph_out;
  }
  template <class Work>
  void body(cudaGraph_t graph, Work work) {
    cudaStreamBeginCaptureToGraph(c, graph, nullptr, nullptr, 0, cudaStreamCaptureModeRelaxed);
    work();
    cudaStreamEndCapture(c, nullptr);
  }
};

void captured() {
  Setting s;
  int value = 3;
  s.begin();
  set<<<1, 32, 0, s.a>>>(s.p.data, value);
  value = 99;  // arguments are copied when captured
  s.fork();
  add<<<1, 32, 0, s.a>>>(s.q.data, s.p.data);
  cudaMemsetAsync(s.r.data, 0, 128, s.b);
  add<<<1, 32, 0, s.b>>>(s.r.data, s.p.data);
  s.join();
  add<<<1, 32, 0, s.a>>>(s.q.data, s.r.data);
  cudaMemcpyAsync(s.pinned, s.q.data, 128, cudaMemcpyDeviceToHost, s.a);
  int calls = 0;
  cudaLaunchHostFunc(s.a, call_back, &calls);
  expect(s.end() == cudaSuccess && s.p.host()[0] == 1, "a capture executes nothing");
  size_t nodes = 0;
  cudaGraphGetNodes(s.graph, nullptr, &nodes);
  expect(s.run(2) == cudaSuccess && nodes == 7 && s.pinned[5] == 2 + 6 + 6 && calls == 2,
         "a captured graph with a branch, launched twice");
  cudaGraph_t other;
  cudaGraphCreate(&other, 0);
  cudaGraphNode_t first, second;
  cudaGraphAddChildGraphNode(&first, other, nullptr, 0, s.graph);
  cudaGraphAddChildGraphNode(&second, other, &first, 1, s.graph);
  cudaGraphExec_t nested;
  cudaGraphInstantiate(&nested, other, 0);
  cudaGraphLaunch(nested, s.a), cudaStreamSynchronize(s.a);
  expect(s.pinned[5] == 14 + 12 && calls == 4, "a graph in a graph");
}

void changed() {
  Setting s;
  const auto capture = [&](int value) {
    s.begin();
    set<<<1, 32, 0, s.a>>>(s.p.data, value);
    add<<<1, 32, 0, s.a>>>(s.q.data, s.p.data);
    s.end();
  };
  capture(3), s.run();
  const cudaGraph_t first = s.graph;
  capture(4);
  cudaGraphExecUpdateResultInfo info;
  expect(cudaGraphExecUpdate(s.exec, s.graph, &info) == cudaSuccess, "an update");
  s.run();
  expect(s.q.host()[0] == 2 + 3 + 4, "what was updated runs");
  cudaGraphNode_t nodes[2];
  size_t count = 2;
  cudaGraphGetNodes(first, nodes, &count);
  int* p = s.p.data;
  int value = 10;
  void* arguments[] = {&p, &value};
  cudaKernelNodeParams params = {};
  params.func = reinterpret_cast<void*>(set), params.gridDim = dim3(1), params.blockDim = dim3(32);
  params.kernelParams = arguments;
  expect(cudaGraphExecKernelNodeSetParams(s.exec, nodes[0], &params) == cudaSuccess, "a node set");
  s.run();
  expect(s.q.host()[0] == 9 + 10, "the node that was set runs");
  cudaGraphNodeSetEnabled(s.exec, nodes[1], 0), s.run();
  expect(s.q.host()[0] == 19, "a node that is off");
  s.begin(), set<<<1, 32, 0, s.a>>>(s.p.data, 1), s.end();
  expect(cudaGraphExecUpdate(s.exec, s.graph, &info) == cudaErrorGraphExecUpdateFailure &&
             info.result == cudaGraphExecUpdateErrorTopologyChanged,
         "another topology");
  cudaGraphExecDestroy(s.exec), cudaGraphDestroy(first), cudaGraphDestroy(s.graph);

  cudaGraphCreate(&s.graph, 0);
  cudaGraphNode_t fill, run, copy;
  cudaMemsetParams set_params = {};
  set_params.dst = s.p.data, set_params.elementSize = 4, set_params.value = 7;
  set_params.width = 32, set_params.height = 1;
  cudaGraphAddMemsetNode(&fill, s.graph, nullptr, 0, &set_params);
  int* q = s.q.data;
  void* of_add[] = {&q, &p};
  params.func = reinterpret_cast<void*>(add), params.kernelParams = of_add;
  cudaGraphAddKernelNode(&run, s.graph, &fill, 1, &params);
  cudaMemcpy3DParms copy_params = {};
  copy_params.srcPtr = make_cudaPitchedPtr(s.q.data, 128, 128, 1);
  copy_params.dstPtr = make_cudaPitchedPtr(s.pinned, 128, 128, 1);
  copy_params.extent = make_cudaExtent(128, 1, 1), copy_params.kind = cudaMemcpyDeviceToHost;
  cudaGraphAddMemcpyNode(&copy, s.graph, &run, 1, &copy_params);
  s.exec = nullptr;
  expect(s.run() == cudaSuccess && s.pinned[31] == 19 + 7, "a graph made by hand");
}

void conditional() {
  for (const int turns : {1, 5}) {
    Setting s;
    cudaGraphConditionalHandle h;
    cudaMemset(s.r.data, 0, 128);
    set<<<1, 1>>>(s.r.data, turns), cudaDeviceSynchronize();
    cudaGraphCreate(&s.graph, 0);
    cudaGraphConditionalHandleCreate(&h, s.graph, 1, cudaGraphCondAssignDefault);
    s.body(s.conditional(h, cudaGraphCondTypeWhile, 1, false)[0], [&] {
      add<<<1, 32, 0, s.c>>>(s.q.data, s.p.data);
      count_down<<<1, 1, 0, s.c>>>(s.r.data, h);
    });
    expect(s.run() == cudaSuccess && s.q.host()[4] == 2 + turns, "a WHILE node");
  }
  for (const int value : {0, 1, 2, 3}) {
    Setting s;
    cudaGraphConditionalHandle h, other;
    cudaMemset(s.r.data, 0, 128), set<<<1, 1>>>(s.r.data, value), cudaDeviceSynchronize();
    s.begin();
    cudaStreamCaptureStatus status;
    cudaStreamGetCaptureInfo(s.a, &status, nullptr, &s.graph);
    cudaGraphConditionalHandleCreate(&h, s.graph),
        cudaGraphConditionalHandleCreate(&other, s.graph);
    choose<<<1, 1, 0, s.a>>>(s.r.data, h);
    cudaGraph_t* const either = s.conditional(h, cudaGraphCondTypeIf, 2);
    choose<<<1, 1, 0, s.a>>>(s.r.data, other);
    cudaGraph_t* const cases = s.conditional(other, cudaGraphCondTypeSwitch, 3);
    add<<<1, 32, 0, s.a>>>(s.q.data, s.p.data);
    s.end();
    s.body(either[0], [&] { set<<<1, 32, 0, s.c>>>(s.p.data, 100); });
    s.body(either[1], [&] { set<<<1, 32, 0, s.c>>>(s.p.data, 200); });
    for (const int k : {0, 1, 2})
      s.body(cases[k], [&] { set<<<1, 32, 0, s.c>>>(s.q.data, 10 * k); });
    const int want = (value ? 100 : 200) + (value < 3 ? 10 * value : 2);
    expect(s.run() == cudaSuccess && s.q.host()[4] == want, "IF, ELSE and SWITCH in a capture");
  }
  Setting s;
  int* r = s.r.data;
  void* arguments[] = {&r};
  s.begin();
  cudaLaunchCooperativeKernel(meet, 8, 32, arguments, 0, s.a);
  s.end();
  expect(s.run() == cudaSuccess && s.r.host()[256] == 255 * 128, "a cooperative launch in a graph");
}

/// Each mistake's error, and that the capture is no more.
void refused() {
  const auto gives = [](cudaError_t error, const char* what, auto mistake,
                        cudaStreamCaptureMode mode = cudaStreamCaptureModeGlobal,
                        bool ends = true) {
    Setting s;
    s.begin(mode);
    set<<<1, 32, 0, s.a>>>(s.p.data, 3);
    const cudaError_t got = mistake(s), end = s.end();
    expect(got == error && (end == cudaErrorStreamCaptureInvalidated || !ends), what);
    cudaGetLastError();
  };
  const auto unsupported = cudaErrorStreamCaptureUnsupported;
  gives(unsupported, "waiting for the stream", [](auto& s) { return cudaStreamSynchronize(s.a); });
  gives(unsupported, "waiting for the device", [](auto&) { return cudaDeviceSynchronize(); });
  void* p;
  gives(unsupported, "cudaMalloc", [&](auto&) { return cudaMalloc(&p, 4); });
  gives(
      cudaSuccess, "cudaMalloc, relaxed", [&](auto&) { return cudaMalloc(&p, 4); },
      cudaStreamCaptureModeRelaxed, false);
  gives(cudaErrorStreamCaptureImplicit, "the default stream", [](auto& s) {
    set<<<1, 32>>>(s.p.data, 3);
    return cudaGetLastError();
  });
  gives(cudaErrorStreamCaptureImplicit, "cudaMemcpy",
        [](auto& s) { return cudaMemcpy(s.p.data, s.q.data, 4, cudaMemcpyDeviceToDevice); });
  gives(cudaErrorCapturedEvent, "waiting for a captured event", [](auto& s) {
    cudaEventRecord(s.forked, s.a);
    return cudaEventSynchronize(s.forked);
  });
  gives(cudaErrorStreamCaptureIsolation, "an event from outside", [](auto& s) {
    cudaEventRecord(s.joined, s.b);
    return cudaStreamWaitEvent(s.a, s.joined, 0);
  });
  gives(cudaErrorStreamCaptureMerge, "two captures", [](auto& s) {
    cudaStreamBeginCapture(s.c, cudaStreamCaptureModeGlobal);
    cudaEventRecord(s.forked, s.c);
    const cudaError_t error = cudaStreamWaitEvent(s.a, s.forked, 0);
    return cudaStreamEndCapture(s.c, &s.graph), error;
  });
  gives(cudaErrorStreamCaptureUnmatched, "an end in another stream", [](auto& s) {
    s.fork();
    cudaGraph_t none;
    return cudaStreamEndCapture(s.b, &none);
  });
  gives(
      cudaErrorStreamCaptureUnjoined, "a fork that is not joined",
      [](auto& s) {
        s.fork();
        set<<<1, 32, 0, s.b>>>(s.q.data, 3);
        return s.end();
      },
      cudaStreamCaptureModeGlobal, false);
  gives(cudaErrorStreamCaptureInvalidated, "a launch after a mistake", [](auto& s) {
    cudaStreamSynchronize(s.a);
    set<<<1, 32, 0, s.a>>>(s.p.data, 3);
    return cudaGetLastError();
  });
}

void wrong() {
  Setting s;
  cudaGraphConditionalHandle h;
  if (is("parallel_writes")) {
    s.begin();
    set<<<1, 32, 0, s.a>>>(s.p.data, 3);
    s.fork();
    set<<<1, 32, 0, s.a>>>(s.q.data, 3), add<<<1, 32, 0, s.b>>>(s.r.data, s.q.data);
    s.join();
    s.end(), s.run();
  }
  if (is("freed_since")) {
    int* gone;
    cudaMalloc(&gone, 128);
    s.begin(), set<<<1, 32, 0, s.a>>>(gone, 3), s.end();
    cudaFree(gone), s.run();
  }
  if (is("unordered_launch")) {
    s.begin(), set<<<1, 32, 0, s.a>>>(s.p.data, 3), s.end();
    s.run();
    cudaGraphLaunch(s.exec, s.b), add<<<1, 32, 0, s.a>>>(s.q.data, s.p.data);
  }
  if (is("undefined_condition") || is("endless") || is("disagree") || is("host_in_body")) {
    cudaGraphCreate(&s.graph, 0);
    cudaGraphConditionalHandleCreate(&h, s.graph, 1,
                                     is("undefined_condition") ? 0 : cudaGraphCondAssignDefault);
    s.body(s.conditional(h, cudaGraphCondTypeWhile, 1, false)[0], [&] {
      if (is("host_in_body")) cudaLaunchHostFunc(s.c, call_back, s.pinned);
      if (is("disagree")) disagree<<<1, 2, 0, s.c>>>(h), choose<<<1, 1, 0, s.c>>>(s.r.data, h);
    });
    s.run();
  }
  if (is("branches")) {  // for the profile: no mistake
    s.begin(), s.fork();
    for (int k = 0; k < 10; ++k)
      set<<<1, 32, 0, s.a>>>(s.p.data, k), set<<<1, 32, 0, s.b>>>(s.q.data, k);
    s.join(), add<<<1, 32, 0, s.a>>>(s.p.data, s.q.data), s.end();
    cudaGraphInstantiate(&s.exec, s.graph, 0);
    cudaProfilerStart(), s.run(), cudaProfilerStop();
  }
  if (is("foreign_handle")) {
    cudaGraphCreate(&s.graph, 0);
    cudaGraphConditionalHandleCreate(&h, s.graph), choose<<<1, 1>>>(s.p.data, h);
  }
  std::printf("%s\n", cudaGetErrorString(cudaGetLastError()));
}

}  // namespace

int main(int count, char** arguments) {
  if (count > 1) return mistake = arguments[1], wrong(), 0;
  captured(), changed(), conditional();
  cudaGetLastError();  // of the update
  expect(cudaDeviceSynchronize() == cudaSuccess, "no error");
  refused();
  return failures != 0;
}

#pragma once
// Streams, events, graphs, and what they are given to do. Everything happens at the call that asks
// for it, in an order that is right; which other orders there might have been, order.cpp knows.

#include <cuda_runtime_api.h>

#include <memory>

#include "tests/gpu/emulator/runtime.h"

namespace gpu_emulator {

/// What a stream does, or a node of a graph.
struct Task {
  enum class Kind { nothing, kernel, copy, fill, call, claim } kind = Kind::nothing;
  const char* name = "";  // of the runtime's function that asks for it
  void* to = nullptr;     // of a copy, of a fill, of memory that is allocated or freed
  const void* from = nullptr;
  size_t size = 0;
  cudaMemcpyKind direction = cudaMemcpyDefault;
  u32 value = 0, element = 1;  // of a fill; bytes that are set to the value
  cudaHostFn_t function = nullptr;
  void* data = nullptr;
  Kernel* kernel = nullptr;
  Dim grid{}, block{};
  size_t shared = 0;
  bool cooperative = false;
  std::vector<char> arguments;
};
Task kernel_task(const void* function, dim3 grid, dim3 block, void** arguments, size_t shared,
                 bool cooperative = false);
/// Is it one that could be done? The reason why not has been said.
cudaError_t check(const Task& task);
/// Does it, after all that the clock tells.
cudaError_t perform(const Task& task, u32 timeline, Clock& clock, const char* via);

cudaError_t fail(cudaError_t error);
cudaError_t refuse(const char* call, cudaError_t error, const std::string& why = "");
extern u64 just_allocated;  // by the call before

enum class Wait { no, yes };  // of the host, until it is done
/// Gives a stream something to do, or its capture a node.
cudaError_t submit(cudaStream_t stream, const Task& task, Wait wait = Wait::no);
/// The host waits for what a clock tells, or for all streams.
void host_waits(const char* call, const Clock& clock);
void host_waits_for_all(const char* call);
/// For functions that are no part of what a stream captures, and so must not be called meanwhile.
cudaError_t not_while_capturing(const char* call);
/// Handles: of things that exist.
bool exists(const void* handle);
void remember(const void* handle, bool there);
/// The stream of a handle, also of a default stream; null if there is none.
cudaStream_t stream_of(cudaStream_t handle);
/// Before and after a stream is given something: the default stream waits for others, they for it.
cudaError_t enter(const char* call, cudaStream_t stream);
void leave(cudaStream_t stream);

struct Capture {
  cudaGraph_t graph = nullptr;
  cudaStream_t origin = nullptr;
  cudaStreamCaptureMode mode{};
  u64 id = 0;
  bool own_graph = true, valid = true;
  std::vector<cudaStream_t> streams;
};
cudaGraphNode_t add_node(cudaGraph_t graph, cudaGraphNodeType type, const Task& task,
                         const std::vector<cudaGraphNode_t>& needs);
cudaGraphNodeType type_of(const Task& task);
/// With GPUEMU_DIGEST, of all that copies have brought the host: other orders must not change it.
void say_digest();

}  // namespace gpu_emulator

struct CUstream_st {
  gpu_emulator::u32 timeline = 0;
  bool blocking = true;  // waits for the legacy default stream, and it for this
  gpu_emulator::Clock clock;
  gpu_emulator::Capture* capture = nullptr;
  std::vector<cudaGraphNode_t> latest;  // of its capture: what the next node comes after
};
struct CUevent_st {
  gpu_emulator::Clock clock;
  bool recorded = false, timed = true;
  gpu_emulator::u64 capture = 0;
  std::vector<cudaGraphNode_t> nodes;
};
struct CUgraphNode_st {
  cudaGraphNodeType type{};
  gpu_emulator::Task task;
  std::vector<cudaGraphNode_t> needs;
  bool enabled = true;
  std::vector<std::unique_ptr<CUgraph_st>> bodies;  // of a child graph or a conditional node
  std::vector<cudaGraph_t> bodies_out;
  cudaGraphConditionalHandle handle = 0;
  cudaGraphConditionalNodeType condition{};
  gpu_emulator::u32 timeline = 0;  // in an executable graph
  gpu_emulator::Clock over;
};
struct CUgraph_st {
  std::vector<std::unique_ptr<CUgraphNode_st>> nodes;
  std::vector<cudaGraphConditionalHandle> handles;
  int instances = 0;
};
struct CUgraphExec_st {
  CUgraph_st graph;
  cudaGraph_t source = nullptr;
  std::map<cudaGraphNode_t, cudaGraphNode_t> nodes;  // of the source to those here
  std::vector<gpu_emulator::u32> timelines;
  gpu_emulator::Clock over;
};

// Streams and events, what streams do, and what they capture instead.

#include <algorithm>
#include <set>

#include "tests/gpu/emulator/streams.h"

namespace gpu_emulator {

u64 just_allocated = 0;

namespace {

std::set<const void*> handles;
std::vector<cudaStream_t> streams;  // the first is the legacy default stream
std::vector<Capture*> captures;
cudaStreamCaptureMode thread_mode = cudaStreamCaptureModeGlobal;
Clock host;  // what it knows to be over
bool in_host_function = false;

u64 received = 0xcbf29ce484222325;  // FNV-1a of what copies have brought the host

u64 address_of(const void* p) { return reinterpret_cast<u64>(p); }

/// Pinned memory that, as far as the host knows, a copy is still filling or reading. With racecheck
/// the host finds nonsense there until it has waited, and must not have changed it.
struct Late {
  char* at;
  std::vector<char> bytes;  // what will be there, or what must be
  bool arrives;
  Clock over;
};
std::vector<Late> late;

void settle(const auto& is_due) {
  for (const Late& l : late) {
    if (!is_due(l)) continue;
    if (l.arrives) std::memcpy(l.at, l.bytes.data(), l.bytes.size());
    if (!l.arrives && covers(host, l.over) &&
        std::memcmp(l.at, l.bytes.data(), l.bytes.size()) != 0)
      say("RACE, the host has changed pinned memory that a copy may still have read: %s",
          describe(address_of(l.at)).c_str());
  }
  std::erase_if(late, is_due);
}
void settle(const void* p, size_t size) {
  const char* const begin = static_cast<const char*>(p);
  settle([&](const Late& l) { return begin < l.at + l.bytes.size() && l.at < begin + size; });
}
void make_late(const void* p, size_t size, bool arrives, const Clock& over) {
  if (!settings().race || !is_pinned(address_of(p))) return;
  char* const at = static_cast<char*>(const_cast<void*>(p));
  late.push_back({at, {at, at + size}, arrives, over});
  if (arrives) std::memset(at, 0xa5, size);
}

cudaStream_t new_stream(bool blocking) {
  auto* s = new CUstream_st{new_timeline(), blocking};
  if (blocking && !streams.empty()) s->clock = streams[0]->clock;
  streams.push_back(s), remember(s, true);
  return s;
}
cudaStream_t legacy() { return streams.empty() ? new_stream(true) : streams[0]; }
bool any_blocking(const Capture& c) {
  return std::any_of(c.streams.begin(), c.streams.end(), [](auto s) { return s->blocking; });
}

bool to_device(const Task& t) {
  if (t.direction == cudaMemcpyDefault) return on_device(address_of(t.to));
  return t.direction == cudaMemcpyHostToDevice || t.direction == cudaMemcpyDeviceToDevice;
}
bool from_device(const Task& t) {
  if (t.direction == cudaMemcpyDefault) return on_device(address_of(t.from));
  return t.direction == cudaMemcpyDeviceToHost || t.direction == cudaMemcpyDeviceToDevice;
}
const char* what_of(const Task& t) {
  if (t.kind == Task::Kind::kernel) return "kernel";
  if (t.kind == Task::Kind::fill) return "memset";
  if (t.kind == Task::Kind::call) return "host function";
  if (t.kind == Task::Kind::claim) return t.name;
  if (to_device(t)) return from_device(t) ? "copy device to device" : "copy host to device";
  return from_device(t) ? "copy device to host" : "copy host to host";
}

/// Are these bytes where they are said to be? Pinned memory is in both places.
bool is_there(const void* p, size_t size, bool device) {
  const u64 a = address_of(p);
  if (is_pinned(a) || (on_device(a) && device)) return all_allocated(as_device(a), size);
  return p && !device && !on_device(a);
}

cudaError_t check_kernel(const Task& t) {
  if (!t.kernel) return fail(cudaErrorInvalidDeviceFunction);
  Kernel& k = *t.kernel;
  const u64 threads = t.block.count();
  const auto cannot = [&](const std::string& why, cudaError_t error) {
    say("%s cannot be launched with %u x %u x %u blocks of %llu threads and %zu bytes of shared "
        "memory%s",
        k.pretty.c_str(), t.grid.x, t.grid.y, t.grid.z, static_cast<unsigned long long>(threads),
        k.shared + t.shared, why.c_str());
    return fail(error);
  };
  if (threads == 0 || threads > k.most_threads || t.block.z > 64 || t.grid.count() == 0 ||
      t.grid.x > 0x7fffffff || t.grid.y > 65535 || t.grid.z > 65535)
    return cannot("", cudaErrorInvalidConfiguration);
  if (t.shared > k.most_dynamic)
    return cannot(
        ": more than " + std::to_string(k.most_dynamic) + " dynamic ones, see cudaFuncSetAttribute",
        cudaErrorInvalidValue);
  if (k.registers > 0 && blocks_per_sm(k, u32(threads), t.shared) == 0)
    return cannot(": too many registers", cudaErrorLaunchOutOfResources);
  const int room = t.cooperative ? sms * blocks_per_sm(k, u32(threads), t.shared) : 0;
  if (t.cooperative && t.grid.count() > u64(room))
    return cannot(", cooperatively: the device holds " + std::to_string(room) + " blocks at once",
                  cudaErrorCooperativeLaunchTooLarge);
  return cudaSuccess;
}

void move_bytes(const Task& t, const Clock& clock) {
  const u64 to = address_of(t.to), from = address_of(t.from);
  const auto bytes = [](u64 a) { return on_device(a) ? contents(a) : reinterpret_cast<char*>(a); };
  // Clearing what has just been allocated is no statement about its contents.
  const bool clears_new = t.kind == Task::Kind::fill && just_allocated == to;
  check_range(to, t.size, store_);
  if (t.kind == Task::Kind::claim) return;
  settle(t.to, t.size);
  if (t.kind == Task::Kind::fill) {
    for (size_t k = 0; k < t.size; k += t.element) std::memcpy(bytes(to) + k, &t.value, t.element);
    if (!(clears_new && settings().strict)) mark_written(as_device(to), t.size);
    return profile_event(clears_new ? "memset of new memory" : "memset", t.size);
  }
  check_range(from, t.size, load);
  settle(t.from, t.size);
  std::memmove(bytes(to), bytes(from), t.size);
  if (settings().digest && from_device(t) && !to_device(t))
    for (u64 k = 0; k < t.size; ++k) received = (received ^ u8(bytes(to)[k])) * 0x100000001b3;
  make_late(t.to, t.size, true, clock), make_late(t.from, t.size, false, clock);
  if (to_device(t) && from_device(t) && settings().init)
    std::memcpy(reinterpret_cast<void*>(as_device(to) - device_base + written_base),
                reinterpret_cast<void*>(as_device(from) - device_base + written_base), t.size);
  else if (to_device(t))
    mark_written(as_device(to), t.size);
  profile_event(what_of(t), t.size);
}

Capture* capture_of(u64 id) {
  const auto found =
      std::find_if(captures.begin(), captures.end(), [&](const Capture* c) { return c->id == id; });
  return found == captures.end() ? nullptr : *found;
}
/// The capture is no more; what made it so is refused.
cudaError_t invalidate(Capture* c, const char* call, cudaError_t error) {
  c->valid = false;
  return refuse(call, error);
}
cudaError_t end_capture(Capture* c, cudaError_t error, cudaGraph_t* graph) {
  for (const cudaStream_t s : c->streams) s->capture = nullptr, s->latest.clear();
  std::erase(captures, c);
  if (error && c->own_graph) cudaGraphDestroy(c->graph);
  if (graph) *graph = error ? nullptr : c->graph;
  delete c;
  return error ? refuse("cudaStreamEndCapture", error) : cudaSuccess;
}

/// Is a node among those that others come after, or one of them?
bool is_before(cudaGraphNode_t node, const std::vector<cudaGraphNode_t>& others) {
  std::vector<cudaGraphNode_t> todo = others;
  std::set<cudaGraphNode_t> seen;
  while (!todo.empty()) {
    const cudaGraphNode_t n = todo.back();
    todo.pop_back();
    if (n == node) return true;
    if (seen.insert(n).second) todo.insert(todo.end(), n->needs.begin(), n->needs.end());
  }
  return false;
}
void add_all(std::vector<cudaGraphNode_t>& nodes, const std::vector<cudaGraphNode_t>& more) {
  for (const cudaGraphNode_t n : more)
    if (std::find(nodes.begin(), nodes.end(), n) == nodes.end()) nodes.push_back(n);
}

Clock of_all_streams() {
  Clock all;
  for (const cudaStream_t s : streams) join(all, s->clock);
  return all;
}
/// What waiting for the device returns: of errors those of kernels.
cudaError_t waited(const char* call, const Clock& clock) {
  host_waits(call, clock);
  const cudaError_t error = cudaPeekAtLastError();
  return error == cudaErrorIllegalAddress ? error : cudaSuccess;
}
cudaError_t wait_for_stream(const char* call, cudaStream_t handle) {
  const cudaStream_t s = stream_of(handle);
  if (!s) return refuse(call, cudaErrorInvalidResourceHandle);
  if (s->capture) return invalidate(s->capture, call, cudaErrorStreamCaptureUnsupported);
  if (const cudaError_t error = enter(call, s)) return error;
  if (const cudaError_t error = not_while_capturing(call)) return error;
  return waited(call, s->clock);
}
cudaError_t wait_for_event(const char* call, cudaEvent_t e) {
  if (!exists(e)) return refuse(call, cudaErrorInvalidResourceHandle);
  if (Capture* const c = capture_of(e->capture)) c->valid = false;
  if (e->capture) return refuse(call, cudaErrorCapturedEvent);
  if (const cudaError_t error = not_while_capturing(call)) return error;
  return waited(call, e->clock);
}

}  // namespace

void say_digest() {
  if (settings().digest)
    say("the host has received %016llx", static_cast<unsigned long long>(received));
}

void touch_pinned() {
  settle([](const Late&) { return true; });
}

void remember(const void* handle, bool there) {
  there ? void(handles.insert(handle)) : void(handles.erase(handle));
}
bool exists(const void* handle) { return handles.count(handle) > 0; }

cudaStream_t stream_of(cudaStream_t handle) {
  static cudaStream_t per_thread = nullptr;
  const cudaStream_t first = legacy();
  if (handle == nullptr || handle == cudaStreamLegacy) return first;
  if (handle == cudaStreamPerThread) return per_thread ? per_thread : per_thread = new_stream(true);
  return exists(handle) ? handle : nullptr;
}

cudaError_t check(const Task& t) {
  if (t.kind == Task::Kind::kernel) return check_kernel(t);
  if (t.kind != Task::Kind::copy && t.kind != Task::Kind::fill) return cudaSuccess;
  const bool copies = t.kind == Task::Kind::copy;
  const bool fine = is_there(t.to, t.size, !copies || to_device(t)),
             both = fine && (!copies || is_there(t.from, t.size, from_device(t)));
  return both ? cudaSuccess
              : refuse(t.name, cudaErrorInvalidValue,
                       (copies ? "copies " : "sets ") + std::to_string(t.size) + " bytes, but " +
                           describe(address_of(fine ? t.from : t.to)));
}

cudaError_t perform(const Task& t, u32 timeline, Clock& clock, const char* via) {
  if (t.kind == Task::Kind::nothing) return cudaSuccess;
  if (const cudaError_t error = check(t)) return error;
  cudaError_t error = cudaSuccess;
  begin_operation(timeline, clock, via, what_of(t), t.kernel);
  if (t.kind == Task::Kind::kernel) {
    if (!launch(*t.kernel, t.grid, t.block, u32(t.shared), t.arguments, t.cooperative))
      error = fail(cudaErrorIllegalAddress);
  } else if (t.kind == Task::Kind::call) {
    touch_pinned();
    in_host_function = true;
    t.function(t.data);
    in_host_function = false;
  } else {
    move_bytes(t, clock);
  }
  end_operation(clock);
  return error;
}

cudaError_t enter(const char* call, cudaStream_t s) {
  if (in_host_function) return refuse(call, cudaErrorNotPermitted, "is called by a host function");
  for (Capture* c : captures)
    if (s == legacy() && any_blocking(*c))
      return invalidate(c, call, cudaErrorStreamCaptureImplicit);
  for (const cudaStream_t other : streams)
    if (s == legacy() && other->blocking) join(s->clock, other->clock);
  join(s->clock, host);
  return cudaSuccess;
}
void leave(cudaStream_t s) {
  for (const cudaStream_t other : streams)
    if (s == legacy() && other->blocking) join(other->clock, s->clock);
}

cudaError_t submit(cudaStream_t handle, const Task& task, Wait wait) {
  const cudaStream_t s = stream_of(handle);
  if (!s) return refuse(task.name, cudaErrorInvalidResourceHandle);
  if (Capture* const c = s->capture) {
    if (!c->valid) return fail(cudaErrorStreamCaptureInvalidated);
    if (task.kind == Task::Kind::claim) return invalidate(c, task.name, cudaErrorNotSupported);
    if (const cudaError_t error = check(task)) return error;
    if (task.kind != Task::Kind::nothing)
      s->latest = {add_node(c->graph, type_of(task), task, s->latest)};
    return cudaSuccess;
  }
  if (const cudaError_t error = enter(task.name, s)) return error;
  const cudaError_t error = perform(task, s->timeline, s->clock, "stream");
  just_allocated = 0;
  leave(s);
  if (wait == Wait::yes && task.kind != Task::Kind::nothing) host_waits(task.name, s->clock);
  return error;
}

void host_waits(const char* call, const Clock& clock) {
  if (covers(host, clock)) return profile_event("a wait for what is over", 0);
  join(host, clock);
  settle([](const Late& l) { return covers(host, l.over); });
  begin_operation(host_timeline, host, "host", call);
  profile_event(call, 0);
}
void host_waits_for_all(const char* call) { host_waits(call, of_all_streams()); }

cudaError_t not_while_capturing(const char* call) {
  bool bad = false;
  for (Capture* c : captures) {
    if (c->mode == cudaStreamCaptureModeRelaxed || thread_mode == cudaStreamCaptureModeRelaxed)
      continue;
    c->valid = false, bad = true;
  }
  return bad ? refuse(call, cudaErrorStreamCaptureUnsupported) : cudaSuccess;
}

}  // namespace gpu_emulator

using namespace gpu_emulator;

extern "C" {

// Streams
// -------------------------------------------------------------------------------------------

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* s, unsigned flags) {
  legacy();
  return *s = new_stream(!(flags & cudaStreamNonBlocking)), cudaSuccess;
}
cudaError_t cudaStreamCreate(cudaStream_t* s) { return cudaStreamCreateWithFlags(s, 0); }
cudaError_t cudaStreamCreateWithPriority(cudaStream_t* s, unsigned flags, int) {
  return cudaStreamCreateWithFlags(s, flags);
}
cudaError_t cudaStreamDestroy(cudaStream_t s) {
  if (!exists(s) || s == legacy())
    return refuse("cudaStreamDestroy", cudaErrorInvalidResourceHandle);
  if (s->capture) s->capture->valid = false, std::erase(s->capture->streams, s);
  if (s->blocking) join(legacy()->clock, s->clock);  // what it still does
  std::erase(streams, s), remember(s, false), free_timeline(s->timeline);
  return cudaSuccess;  // the handle is never used again
}
cudaError_t cudaStreamSynchronize(cudaStream_t s) {
  return wait_for_stream("cudaStreamSynchronize", s);
}
cudaError_t cudaStreamQuery(cudaStream_t s) { return wait_for_stream("cudaStreamQuery", s); }
cudaError_t cudaDeviceSynchronize() {
  const char* const call = "cudaDeviceSynchronize";
  for (Capture* c : captures) c->valid = false;
  if (!captures.empty()) return refuse(call, cudaErrorStreamCaptureUnsupported);
  return waited(call, of_all_streams());
}
cudaError_t cudaStreamWaitEvent(cudaStream_t handle, cudaEvent_t e, unsigned flags) {
  const char* const call = "cudaStreamWaitEvent";
  const cudaStream_t s = stream_of(handle);
  if (!s || !exists(e)) return refuse(call, cudaErrorInvalidResourceHandle);
  if (flags) return refuse(call, cudaErrorNotSupported);
  if (e->capture == 0) {
    if (s->capture) return invalidate(s->capture, call, cudaErrorStreamCaptureIsolation);
    if (const cudaError_t error = enter(call, s)) return error;
    join(s->clock, e->clock);
    return leave(s), cudaSuccess;
  }
  Capture* const c = capture_of(e->capture);
  if (!c) return refuse(call, cudaErrorCapturedEvent);
  if (s == legacy()) return refuse(call, cudaErrorStreamCaptureImplicit);
  if (s->capture && s->capture != c) {
    s->capture->valid = false;
    return invalidate(c, call, cudaErrorStreamCaptureMerge);
  }
  if (!s->capture) s->capture = c, c->streams.push_back(s), s->latest.clear();
  add_all(s->latest, e->nodes);
  return c->valid ? cudaSuccess : fail(cudaErrorStreamCaptureInvalidated);
}
cudaError_t cudaLaunchHostFunc(cudaStream_t s, cudaHostFn_t function, void* data) {
  return submit(
      s,
      {.kind = Task::Kind::call, .name = "cudaLaunchHostFunc", .function = function, .data = data});
}
/// Of L2 persistence and the like: accepted, of no effect.
cudaError_t cudaStreamSetAttribute(cudaStream_t, cudaStreamAttrID, const cudaStreamAttrValue*) {
  return cudaSuccess;
}

// Capture
// -------------------------------------------------------------------------------------------

cudaError_t cudaStreamBeginCaptureToGraph(cudaStream_t handle, cudaGraph_t graph,
                                          const cudaGraphNode_t* needs, const cudaGraphEdgeData*,
                                          size_t count, cudaStreamCaptureMode mode) {
  const char* const call = "cudaStreamBeginCapture";
  static u64 ids = 0;
  const cudaStream_t s = stream_of(handle);
  if (!s || (graph && !exists(graph))) return refuse(call, cudaErrorInvalidResourceHandle);
  if (s == legacy()) return refuse(call, cudaErrorStreamCaptureUnsupported);
  if (s->capture) return refuse(call, cudaErrorIllegalState);
  captures.push_back(new Capture{graph, s, mode, ++ids, graph == nullptr, true, {s}});
  s->capture = captures.back(), s->latest.assign(needs, needs + count);
  return graph ? cudaSuccess : cudaGraphCreate(&s->capture->graph, 0);
}
cudaError_t cudaStreamBeginCapture(cudaStream_t s, cudaStreamCaptureMode mode) {
  return cudaStreamBeginCaptureToGraph(s, nullptr, nullptr, nullptr, 0, mode);
}
cudaError_t cudaStreamEndCapture(cudaStream_t handle, cudaGraph_t* graph) {
  const cudaStream_t s = stream_of(handle);
  if (graph) *graph = nullptr;
  Capture* const c = s ? s->capture : nullptr;
  if (!c) return refuse("cudaStreamEndCapture", cudaErrorIllegalState);
  if (c->origin != s) return invalidate(c, "cudaStreamEndCapture", cudaErrorStreamCaptureUnmatched);
  if (!c->valid) return end_capture(c, cudaErrorStreamCaptureInvalidated, graph);
  for (const cudaStream_t other : c->streams)
    for (const cudaGraphNode_t n : other->latest)
      if (!is_before(n, s->latest)) return end_capture(c, cudaErrorStreamCaptureUnjoined, graph);
  return end_capture(c, cudaSuccess, graph);
}
cudaError_t cudaStreamGetCaptureInfo(cudaStream_t handle, cudaStreamCaptureStatus* status,
                                     unsigned long long* id, cudaGraph_t* graph,
                                     const cudaGraphNode_t** nodes, const cudaGraphEdgeData** edges,
                                     size_t* count) {
  const cudaStream_t s = stream_of(handle);
  if (!s) return refuse("cudaStreamGetCaptureInfo", cudaErrorInvalidResourceHandle);
  for (const Capture* c : captures)
    if (s == legacy() && any_blocking(*c)) return fail(cudaErrorStreamCaptureImplicit);
  const Capture* const c = s->capture;
  *status = !c         ? cudaStreamCaptureStatusNone
            : c->valid ? cudaStreamCaptureStatusActive
                       : cudaStreamCaptureStatusInvalidated;
  if (!c) return cudaSuccess;
  if (id) *id = c->id;
  if (graph) *graph = c->graph;
  if (nodes) *nodes = s->latest.data();
  if (edges) *edges = nullptr;
  if (count) *count = s->latest.size();
  return cudaSuccess;
}
cudaError_t cudaStreamIsCapturing(cudaStream_t s, cudaStreamCaptureStatus* status) {
  return cudaStreamGetCaptureInfo(s, status, nullptr, nullptr, nullptr, nullptr, nullptr);
}
cudaError_t cudaStreamUpdateCaptureDependencies(cudaStream_t handle, cudaGraphNode_t* nodes,
                                                const cudaGraphEdgeData*, size_t count,
                                                unsigned flags) {
  const cudaStream_t s = stream_of(handle);
  if (!s || !s->capture) return fail(cudaErrorIllegalState);
  if (flags == cudaStreamSetCaptureDependencies) s->latest.clear();
  add_all(s->latest, {nodes, nodes + count});
  return cudaSuccess;
}
cudaError_t cudaThreadExchangeStreamCaptureMode(cudaStreamCaptureMode* mode) {
  return std::swap(*mode, thread_mode), cudaSuccess;
}

// Events
// -------------------------------------------------------------------------------------------

cudaError_t cudaEventCreateWithFlags(cudaEvent_t* e, unsigned flags) {
  *e = new CUevent_st{.timed = !(flags & cudaEventDisableTiming)};
  return remember(*e, true), cudaSuccess;
}
cudaError_t cudaEventCreate(cudaEvent_t* e) { return cudaEventCreateWithFlags(e, 0); }
cudaError_t cudaEventDestroy(cudaEvent_t e) { return remember(e, false), cudaSuccess; }
cudaError_t cudaEventRecordWithFlags(cudaEvent_t e, cudaStream_t handle, unsigned flags) {
  const char* const call = "cudaEventRecord";
  const cudaStream_t s = stream_of(handle);
  if (!s || !exists(e)) return refuse(call, cudaErrorInvalidResourceHandle);
  if (flags) return refuse(call, cudaErrorNotSupported);
  if (s->capture && !s->capture->valid) return fail(cudaErrorStreamCaptureInvalidated);
  if (const cudaError_t error = s->capture ? cudaSuccess : enter(call, s)) return error;
  e->capture = s->capture ? s->capture->id : 0, e->nodes = s->latest;
  e->clock = s->clock, e->recorded = true;
  return cudaSuccess;
}
cudaError_t cudaEventRecord(cudaEvent_t e, cudaStream_t s) {
  return cudaEventRecordWithFlags(e, s, 0);
}
cudaError_t cudaEventSynchronize(cudaEvent_t e) {
  return wait_for_event("cudaEventSynchronize", e);
}
cudaError_t cudaEventQuery(cudaEvent_t e) { return wait_for_event("cudaEventQuery", e); }
cudaError_t cudaEventElapsedTime(float* ms, cudaEvent_t a, cudaEvent_t b) {
  for (const cudaEvent_t e : {a, b})
    if (!exists(e) || !e->timed || !e->recorded)
      return refuse("cudaEventElapsedTime", cudaErrorInvalidResourceHandle);
  return *ms = 0, cudaSuccess;
}

}  // extern "C"

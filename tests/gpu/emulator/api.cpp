// The CUDA runtime's functions, for one device: kernels, memory, the device itself.

#include <cuda_runtime_api.h>

#include <cstdio>
#include <cstdlib>

#include "tests/gpu/emulator/streams.h"

using namespace gpu_emulator;

namespace {

struct Registry {
  std::map<const void*, Kernel*> kernels;                // by the host's function
  std::map<const void*, std::pair<u64, u64>> variables;  // by the host's variable
};
Registry& registry() {
  static Registry* one = new Registry;
  return *one;
}

cudaError_t last_error = cudaSuccess;
struct Configuration {
  dim3 grid, block;
  size_t shared;
  cudaStream_t stream;
};
std::vector<Configuration> configurations;

u64 address_of(const void* p) { return reinterpret_cast<u64>(p); }

Kernel* kernel_of(const void* function) {
  const auto found = registry().kernels.find(function);
  return found == registry().kernels.end() ? nullptr : found->second;
}

/// A copy between host and device ends before the call does, unless it is from pageable memory:
/// then only what was before it.
cudaError_t copy_now(const char* name, void* to, const void* from, size_t size,
                     cudaMemcpyKind kind) {
  const cudaStream_t stream = stream_of(nullptr);
  if (const cudaError_t error = enter(name, stream)) return error;
  if (const cudaError_t error = not_while_capturing(name)) return error;
  const bool between = on_device(address_of(to)) != on_device(address_of(from)),
             staged = !on_device(address_of(from)) && !is_pinned(address_of(from));
  if (between && staged) host_waits(name, stream->clock);
  return submit(stream, {Task::Kind::copy, name, to, from, size, kind},
                between && !staged ? Wait::yes : Wait::no);
}
cudaError_t fill(const char* name, void* to, int byte, size_t size, cudaStream_t stream) {
  return submit(stream, {Task::Kind::fill, name, to, nullptr, size, {}, u32(byte)});
}
cudaError_t allocate_pinned(const char* name, void** p, size_t size) {
  if (const cudaError_t error = not_while_capturing(name)) return error;
  const u64 address = allocate(size, std::string(name) + " " + after_launch(), Place::host);
  mark_written(address, size);  // the host's writes are not seen
  *p = address ? contents(address) : nullptr;
  return address ? cudaSuccess : fail(cudaErrorMemoryAllocation);
}

void at_exit() {
  summarise_checks();
  profile_write();
  say_digest();
}

}  // namespace

namespace gpu_emulator {
cudaError_t fail(cudaError_t error) { return last_error = error; }
cudaError_t refuse(const char* call, cudaError_t error, const std::string& why) {
  say("%s %s: %s %s", call, after_launch().c_str(), cudaGetErrorName(error), why.c_str());
  if (settings().abort) std::abort();
  return fail(error);
}
Task kernel_task(const void* function, dim3 grid, dim3 block, void** arguments, size_t shared,
                 bool cooperative) {
  Kernel* const kernel = kernel_of(function);
  return {.kind = Task::Kind::kernel,
          .name = "a launch",
          .kernel = kernel,
          .grid = {grid.x, grid.y, grid.z},
          .block = {block.x, block.y, block.z},
          .shared = shared,
          .cooperative = cooperative,
          .arguments = kernel ? packed(*kernel, arguments) : std::vector<char>()};
}
}  // namespace gpu_emulator

extern "C" {

// What nvcc's host code calls
// ----------------------------------------------------------------------

void** __cudaRegisterFatBinary(void* fat_binary) {
  static const int once = std::atexit(at_exit);
  (void)once;
  return reinterpret_cast<void**>(load_module(fat_binary));
}
void __cudaRegisterFatBinaryEnd(void**) {}
void __cudaUnregisterFatBinary(void**) {}
char __cudaInitModule(void**) { return 0; }
void __cudaRegisterFunction(void** module, const char* host, char*, const char* name, int, uint3*,
                            uint3*, dim3*, dim3*, int*) {
  auto& kernels = reinterpret_cast<Module*>(module)->kernels;
  const auto found = kernels.find(name);
  if (found != kernels.end()) registry().kernels[host] = &found->second;
}
void __cudaRegisterVar(void** module, char* host, char*, const char* name, int, size_t, int, int) {
  auto& variables = reinterpret_cast<Module*>(module)->variables;
  const auto found = variables.find(name);
  if (found != variables.end()) registry().variables[host] = found->second;
}
unsigned __cudaPushCallConfiguration(dim3 grid, dim3 block, size_t shared, cudaStream_t stream) {
  configurations.push_back({grid, block, shared, stream});
  return 0;
}
cudaError_t __cudaPopCallConfiguration(dim3* grid, dim3* block, size_t* shared, void* stream) {
  if (configurations.empty()) return fail(cudaErrorMissingConfiguration);
  const Configuration c = configurations.back();
  configurations.pop_back();
  *grid = c.grid, *block = c.block, *shared = c.shared,
  *static_cast<cudaStream_t*>(stream) = c.stream;
  return cudaSuccess;
}
cudaError_t __cudaGetKernel(cudaKernel_t* kernel, const void* function) {
  *kernel = reinterpret_cast<cudaKernel_t>(const_cast<void*>(function));
  return kernel_of(function) ? cudaSuccess : fail(cudaErrorInvalidDeviceFunction);
}

// Kernels
// --------------------------------------------------------------------------------------------

cudaError_t cudaLaunchKernel(const void* function, dim3 grid, dim3 block, void** arguments,
                             size_t shared, cudaStream_t stream) {
  return submit(stream, kernel_task(function, grid, block, arguments, shared, false));
}
cudaError_t __cudaLaunchKernel(cudaKernel_t kernel, dim3 grid, dim3 block, void** arguments,
                               size_t shared, cudaStream_t stream) {
  return cudaLaunchKernel(kernel, grid, block, arguments, shared, stream);
}
cudaError_t cudaLaunchCooperativeKernel(const void* function, dim3 grid, dim3 block,
                                        void** arguments, size_t shared, cudaStream_t stream) {
  return submit(stream, kernel_task(function, grid, block, arguments, shared, true));
}
cudaError_t cudaLaunchKernelExC(const cudaLaunchConfig_t* config, const void* function,
                                void** arguments) {
  bool cooperative = false, clusters = false;
  for (unsigned k = 0; k < config->numAttrs; ++k) {
    const cudaLaunchAttribute& a = config->attrs[k];
    if (a.id == cudaLaunchAttributeCooperative) cooperative = a.val.cooperative;
    clusters |= a.id == cudaLaunchAttributeClusterDimension;
  }
  if (clusters) return refuse("cudaLaunchKernelEx", cudaErrorNotSupported, "clusters");
  return submit(config->stream, kernel_task(function, config->gridDim, config->blockDim, arguments,
                                            config->dynamicSmemBytes, cooperative));
}
cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, const void* function) {
  Kernel* const k = kernel_of(function);
  if (!k) return fail(cudaErrorInvalidDeviceFunction);
  resources_of(*k);
  *attributes = {};
  attributes->sharedSizeBytes = k->shared, attributes->localSizeBytes = k->stack;
  attributes->numRegs = k->registers, attributes->maxThreadsPerBlock = int(k->most_threads);
  while (blocks_per_sm(*k, attributes->maxThreadsPerBlock, 0) == 0)
    attributes->maxThreadsPerBlock -= 32;
  attributes->ptxVersion = attributes->binaryVersion = k->module->architecture;
  attributes->maxDynamicSharedSizeBytes = int(k->most_dynamic);
  return cudaSuccess;
}
cudaError_t cudaFuncSetAttribute(const void* function, cudaFuncAttribute attribute, int value) {
  Kernel* const k = kernel_of(function);
  if (!k) return fail(cudaErrorInvalidDeviceFunction);
  if (attribute != cudaFuncAttributeMaxDynamicSharedMemorySize) return cudaSuccess;
  if (value < 0 || value + int(k->shared) > most_shared)
    return refuse("cudaFuncSetAttribute", cudaErrorInvalidValue,
                  "more shared memory than there is");
  return k->most_dynamic = u32(value), cudaSuccess;
}
cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(int* blocks,
                                                                   const void* function,
                                                                   int threads, size_t shared,
                                                                   unsigned) {
  Kernel* const k = kernel_of(function);
  if (!k) return fail(cudaErrorInvalidDeviceFunction);
  return *blocks = blocks_per_sm(*k, u32(threads), shared), cudaSuccess;
}
cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessor(int* blocks, const void* function,
                                                          int threads, size_t shared) {
  return cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(blocks, function, threads, shared,
                                                                0);
}

// Memory
// ---------------------------------------------------------------------------------------------

cudaError_t cudaMalloc(void** p, size_t size) {
  *p = nullptr, just_allocated = 0;
  if (const cudaError_t error = not_while_capturing("cudaMalloc")) return error;
  if (size == 0) return cudaSuccess;
  const u64 address = allocate(size, "cudaMalloc " + after_launch());
  if (address == 0) return fail(cudaErrorMemoryAllocation);
  *p = reinterpret_cast<void*>(address), just_allocated = address;
  profile_event("cudaMalloc", size);
  return cudaSuccess;
}
cudaError_t cudaFree(void* p) {
  just_allocated = 0;
  if (!p) return cudaSuccess;
  if (const cudaError_t error = not_while_capturing("cudaFree")) return error;
  const Allocation* const a = allocation_at(as_device(address_of(p)));
  if (!a) return refuse("cudaFree", cudaErrorInvalidValue, describe(address_of(p)));
  host_waits_for_all("cudaFree");
  return release(*a), cudaSuccess;
}
cudaError_t cudaFreeHost(void* p) { return cudaFree(p); }
/// What others must not touch before; see cudaFreeAsync for after.
cudaError_t cudaMallocAsync(void** p, size_t size, cudaStream_t stream) {
  const u64 address = allocate(size, "cudaMallocAsync " + after_launch());
  if (address == 0) return fail(cudaErrorMemoryAllocation);
  *p = reinterpret_cast<void*>(address);
  return submit(stream, {Task::Kind::claim, "cudaMallocAsync", *p, nullptr, size});
}
cudaError_t cudaFreeAsync(void* p, cudaStream_t stream) {
  const Allocation* const a = allocation_at(address_of(p));
  if (!a) return refuse("cudaFreeAsync", cudaErrorInvalidValue, describe(address_of(p)));
  const cudaError_t error =
      submit(stream, {Task::Kind::claim, "cudaFreeAsync", p, nullptr, a->size});
  if (!error) release(*a);
  return error;
}
cudaError_t cudaMallocHost(void** p, size_t size) {
  return allocate_pinned("cudaMallocHost", p, size);
}
cudaError_t cudaHostAlloc(void** p, size_t size, unsigned) {
  return allocate_pinned("cudaHostAlloc", p, size);
}
cudaError_t cudaMallocManaged(void** p, size_t size, unsigned) {
  return allocate_pinned("cudaMallocManaged", p, size);
}
cudaError_t cudaHostGetDevicePointer(void** device, void* p, unsigned) {
  *device = p;
  return is_pinned(address_of(p)) ? cudaSuccess : fail(cudaErrorInvalidValue);
}
cudaError_t cudaMemGetInfo(size_t* free, size_t* total) {
  *total = size_t(141) << 30, *free = *total - bytes_allocated();
  return cudaSuccess;
}
cudaError_t cudaMemcpy(void* to, const void* from, size_t size, cudaMemcpyKind kind) {
  return copy_now("cudaMemcpy", to, from, size, kind);
}
cudaError_t cudaMemcpyAsync(void* to, const void* from, size_t size, cudaMemcpyKind kind,
                            cudaStream_t stream) {
  const bool waits = on_device(address_of(from)) && !on_device(address_of(to)) &&
                     !is_pinned(address_of(to));  // pageable memory is there when the call ends
  return submit(stream, {Task::Kind::copy, "cudaMemcpyAsync", to, from, size, kind},
                waits ? Wait::yes : Wait::no);
}
cudaError_t cudaMemset(void* p, int byte, size_t size) {
  return fill("cudaMemset", p, byte, size, nullptr);
}
cudaError_t cudaMemsetAsync(void* p, int byte, size_t size, cudaStream_t stream) {
  return fill("cudaMemsetAsync", p, byte, size, stream);
}
cudaError_t cudaGetSymbolAddress(void** p, const void* variable) {
  const auto found = registry().variables.find(variable);
  if (found == registry().variables.end()) return fail(cudaErrorInvalidSymbol);
  *p = reinterpret_cast<void*>(found->second.first);
  return cudaSuccess;
}
cudaError_t cudaMemcpyToSymbol(const void* variable, const void* from, size_t size, size_t at,
                               cudaMemcpyKind kind) {
  void* to;
  const cudaError_t status = cudaGetSymbolAddress(&to, variable);
  return status ? status
                : copy_now("cudaMemcpyToSymbol", static_cast<char*>(to) + at, from, size, kind);
}
cudaError_t cudaMemcpyFromSymbol(void* to, const void* variable, size_t size, size_t at,
                                 cudaMemcpyKind kind) {
  void* from;
  const cudaError_t status = cudaGetSymbolAddress(&from, variable);
  return status ? status
                : copy_now("cudaMemcpyFromSymbol", to, static_cast<char*>(from) + at, size, kind);
}
cudaError_t cudaPointerGetAttributes(cudaPointerAttributes* attributes, const void* p) {
  *attributes = {};
  attributes->type = on_device(address_of(p))   ? cudaMemoryTypeDevice
                     : is_pinned(address_of(p)) ? cudaMemoryTypeHost
                                                : cudaMemoryTypeUnregistered;
  attributes->devicePointer = attributes->hostPointer = const_cast<void*>(p);
  return cudaSuccess;
}

// The device
// -------------------------------------------------------------------------------------------

cudaError_t cudaGetDeviceCount(int* count) { return *count = 1, cudaSuccess; }
cudaError_t cudaGetDevice(int* device) { return *device = 0, cudaSuccess; }
cudaError_t cudaSetDevice(int device) {
  return device == 0 ? cudaSuccess : fail(cudaErrorInvalidDevice);
}
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* p, int) {
  *p = {};
  std::snprintf(p->name, sizeof p->name, "emulated GPU (no hardware)");
  p->major = 9, p->minor = 0, p->multiProcessorCount = sms, p->warpSize = 32,
  p->maxThreadsPerBlock = 1024;
  p->totalGlobalMem = size_t(141) << 30, p->l2CacheSize = 50 << 20,
  p->persistingL2CacheMaxSize = 32 << 20, p->accessPolicyMaxWindowSize = 128 << 20;
  p->regsPerBlock = p->regsPerMultiprocessor = 65536;
  p->sharedMemPerBlock = plain_shared, p->sharedMemPerMultiprocessor = shared_of_sm;
  p->sharedMemPerBlockOptin = most_shared, p->reservedSharedMemPerBlock = 1024;
  p->maxThreadsPerMultiProcessor = 2048, p->maxBlocksPerMultiProcessor = 32;
  p->maxGridSize[0] = 0x7fffffff, p->maxGridSize[1] = p->maxGridSize[2] = 65535;
  p->maxThreadsDim[0] = p->maxThreadsDim[1] = 1024, p->maxThreadsDim[2] = 64;
  p->cooperativeLaunch = p->concurrentKernels = p->canMapHostMemory = p->unifiedAddressing = 1;
  p->memoryPoolsSupported = 1, p->asyncEngineCount = 3;
  return cudaSuccess;
}
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int) {
  static const std::map<int, int> known = {
      {cudaDevAttrComputeCapabilityMajor, 9},
      {cudaDevAttrComputeCapabilityMinor, 0},
      {cudaDevAttrMultiProcessorCount, sms},
      {cudaDevAttrMaxThreadsPerBlock, 1024},
      {cudaDevAttrWarpSize, 32},
      {cudaDevAttrMaxSharedMemoryPerBlock, plain_shared},
      {cudaDevAttrMaxSharedMemoryPerBlockOptin, most_shared},
      {cudaDevAttrMaxSharedMemoryPerMultiprocessor, shared_of_sm},
      {cudaDevAttrMaxThreadsPerMultiProcessor, 2048},
      {cudaDevAttrMaxGridDimX, 0x7fffffff},
      {cudaDevAttrL2CacheSize, 50 << 20},
      {cudaDevAttrMaxPersistingL2CacheSize, 32 << 20},
      {cudaDevAttrCooperativeLaunch, 1},
      {cudaDevAttrConcurrentKernels, 1},
      {cudaDevAttrMemoryPoolsSupported, 1}};
  const auto found = known.find(attribute);
  *value = found == known.end() ? 0 : found->second;
  return cudaSuccess;
}
cudaError_t cudaDeviceSetLimit(cudaLimit, size_t) { return cudaSuccess; }
cudaError_t cudaCtxResetPersistingL2Cache() { return cudaSuccess; }
cudaError_t cudaDriverGetVersion(int* version) { return *version = 13000, cudaSuccess; }
cudaError_t cudaRuntimeGetVersion(int* version) { return *version = 13000, cudaSuccess; }
cudaError_t cudaDeviceReset() { return cudaSuccess; }
cudaError_t cudaGetLastError() {
  const cudaError_t error = last_error;
  last_error = cudaSuccess;  // unlike a real device after a fault, the next test can go on
  return error;
}
cudaError_t cudaPeekAtLastError() { return last_error; }
const char* cudaGetErrorName(cudaError_t error) {
#define NAME(error) \
  { error, #error }
  static const std::map<cudaError_t, const char*> names = {NAME(cudaErrorInvalidValue),
                                                           NAME(cudaErrorMemoryAllocation),
                                                           NAME(cudaErrorIllegalAddress),
                                                           NAME(cudaErrorInvalidConfiguration),
                                                           NAME(cudaErrorInvalidResourceHandle),
                                                           NAME(cudaErrorIllegalState),
                                                           NAME(cudaErrorCooperativeLaunchTooLarge),
                                                           NAME(cudaErrorNotPermitted),
                                                           NAME(cudaErrorNotSupported),
                                                           NAME(cudaErrorCapturedEvent),
                                                           NAME(cudaErrorStreamCaptureUnsupported),
                                                           NAME(cudaErrorStreamCaptureInvalidated),
                                                           NAME(cudaErrorStreamCaptureMerge),
                                                           NAME(cudaErrorStreamCaptureUnmatched),
                                                           NAME(cudaErrorStreamCaptureUnjoined),
                                                           NAME(cudaErrorStreamCaptureIsolation),
                                                           NAME(cudaErrorStreamCaptureImplicit),
                                                           NAME(cudaErrorGraphExecUpdateFailure)};
#undef NAME
  const auto found = names.find(error);
  return found != names.end() ? found->second : error ? "a CUDA error" : "no error";
}
const char* cudaGetErrorString(cudaError_t error) {
  return error == cudaErrorIllegalAddress
             ? "an illegal memory access was encountered (see stderr: gpu-emulator)"
             : cudaGetErrorName(error);
}

/// A profile is of what happens between these two, as for nsys and ncu.
cudaError_t cudaProfilerStart() { return profile_reset(), cudaSuccess; }
cudaError_t cudaProfilerStop() { return profile_write(), profile_reset(), cudaSuccess; }

}  // extern "C"

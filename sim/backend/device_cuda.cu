#include "sim/backend/cuda_check.h"
#include "sim/solver.h"

namespace drench::sim::cuda {

bool device_available(std::string& name_or_reason) {
  // Without a driver the first call fails; that means "no GPU", not an error.
  int count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  if (status != cudaSuccess || count == 0) {
    name_or_reason = status != cudaSuccess ? cudaGetErrorString(status) : "no CUDA device";
    return false;
  }
  cudaDeviceProp properties;
  check_cuda(cudaGetDeviceProperties(&properties, 0), "asking for the device's name");
  name_or_reason = properties.name;
  if (properties.major < 8) {  // cmake/cuda.cmake builds code for 8.0 and later
    name_or_reason += ": compute capability " + std::to_string(properties.major) + "." +
                      std::to_string(properties.minor) + " is below 8.0";
    return false;
  }
  return true;
}

}  // namespace drench::sim::cuda

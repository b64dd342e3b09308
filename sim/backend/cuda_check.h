#pragma once
#include <cuda_runtime.h>

#include <string>

#include "pipeline/contract/error.h"

namespace drench::sim::cuda {

/// @throws Error naming the operation and CUDA's reason.
inline void check_cuda(cudaError_t status, const char* operation) {
  if (status == cudaSuccess) return;
  throw Error(std::string("CUDA failed while ") + operation + ": " + cudaGetErrorString(status) +
              ". Free GPU memory or use --device cpu");
}

}  // namespace drench::sim::cuda

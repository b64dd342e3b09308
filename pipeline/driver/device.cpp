#include "pipeline/driver/device.h"

#include "sim/solver.h"

namespace drench {

std::string device_class([[maybe_unused]] Device device) {
#if defined(DRENCH_HAS_CUDA)
  std::string name;
  // A missing GPU is not this function's to report: the simulator says so when it is to start.
  if (device == Device::cuda) return "cuda";
  if (device == Device::automatic && sim::cuda::device_available(name)) return "cuda";
#endif
  return "cpu";
}

}  // namespace drench

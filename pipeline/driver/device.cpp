#include "pipeline/driver/device.h"

namespace drench {

std::string device_class(Device device) { return device == Device::cuda ? "cuda" : "cpu"; }

}  // namespace drench

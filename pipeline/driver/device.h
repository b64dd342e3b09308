#pragma once
// Which device simulates, told without building a simulator.

#include <string>

#include "sim/simulator.h"

namespace drench {

/// "cpu" or "cuda": automatic is CUDA when this build has it and a device is there.
std::string device_class(Device device);

}  // namespace drench

#pragma once
// What a column of each backend holds after it has shrunk and grown.

#include <cstddef>
#include <vector>

namespace drench::sim {
namespace cpu {
/// Of `first` ones, shrunk to `least` elements and grown to `last`.
std::vector<float> regrown(size_t first, size_t least, size_t last);
}  // namespace cpu
namespace cuda {
std::vector<float> regrown(size_t first, size_t least, size_t last);
}  // namespace cuda
}  // namespace drench::sim

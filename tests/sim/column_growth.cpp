// Compiled twice: as it is, and as CUDA.
#include "tests/sim/column_growth.h"

#include "sim/backend/column.h"

namespace drench::sim::DRENCH_BACKEND {

std::vector<float> regrown(size_t first, size_t least, size_t last) {
  Column<float> column;
  from_host(column, std::vector<float>(first, 1.f));
  column.resize(least), column.resize(last);
  return to_host(column, last);
}

}  // namespace drench::sim::DRENCH_BACKEND

// Columns of both backends: what a pass reads of a particle or contact that has come into being
// does not depend on what was there before.

#include <gtest/gtest.h>

#include <string>

#include "sim/solver.h"
#include "tests/sim/column_growth.h"

namespace drench {
namespace {

using Regrow = decltype(&sim::cpu::regrown);

// By less than a pack, by more, and beyond the memory that the column holds.
void expect_new_elements_are_zero(Regrow regrown) {
  constexpr size_t first = 100;
  for (const size_t least : {97, 50, 0})
    for (const size_t last : {99, 100, 160}) {
      std::vector<float> expected(last, 0.f);
      std::fill_n(expected.begin(), least, 1.f);
      EXPECT_EQ(regrown(first, least, last), expected) << least << " to " << last;
    }
}

TEST(Column, GrowsByZeros) { expect_new_elements_are_zero(sim::cpu::regrown); }

#if defined(DRENCH_HAS_CUDA)
TEST(ColumnOnCuda, GrowsByZeros) {
  std::string reason;
  if (!sim::cuda::device_available(reason)) GTEST_SKIP() << "no usable GPU: " << reason;
  expect_new_elements_are_zero(sim::cuda::regrown);
}
#endif

}  // namespace
}  // namespace drench

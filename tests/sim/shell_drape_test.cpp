// Cusick's drape test of the fabrics (tests/validation/fabric_drape.h).

#include <gtest/gtest.h>

#include "tests/validation/fabric_drape.h"

namespace drench::sim_tests {
namespace {

using validation::MeasuredDrape;

class Cusick : public testing::TestWithParam<MeasuredDrape> {};

// Ten-millimetre cells. Silk, whose folds are narrower, is left to the case fabric_drape.
TEST_P(Cusick, FabricsDrapeAsPublished) {
  const validation::Drape drape = validation::fabric_drape(GetParam().fabric, 15);
  EXPECT_EQ(drape.unsolved_loads, 0);
  EXPECT_EQ(drape.ways_to_fall, 0);
  EXPECT_GE(drape.coefficient, GetParam().least);
  EXPECT_LE(drape.coefficient, GetParam().most);
}

INSTANTIATE_TEST_SUITE_P(Sheets, Cusick,
                         testing::ValuesIn(validation::measured_drapes().begin(),
                                           validation::measured_drapes().end() - 1),
                         [](const auto& info) { return info.param.fabric; });

}  // namespace
}  // namespace drench::sim_tests

// Constants of fabrics: that they can be, and that they are of one another.

#include "pipeline/contract/shot/fabrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace drench {
namespace {

// Moduli and rigidities positive definite: D66 of the bias rigidity is what is left of it.
TEST(Fabrics, HavePositiveDefiniteMaterials) {
  for (const Fabric& f : fabrics) {
    EXPECT_GT(std::min({f.areal_density, f.thickness, f.young_warp, f.young_weft, f.shear,
                        f.bend_warp, f.bend_weft, f.damping_time}),
              0)
        << f.name;
    EXPECT_LT(std::abs(f.poisson), 1) << f.name;
    const double twist = f.poisson * std::sqrt(f.bend_warp * f.bend_weft);
    EXPECT_GT(f.bend_bias, (f.bend_warp + f.bend_weft + 2 * twist) / 4) << f.name;
    EXPECT_GT(f.stretch_limit, 1) << f.name;
    EXPECT_GE(f.water_capacity, 0) << f.name;
    EXPECT_LT(f.water_capacity, 1000 * f.thickness) << f.name;
    EXPECT_GE(f.soak_time, 0) << f.name;
    EXPECT_GT(f.wet_modulus_ratio, 0) << f.name;
    EXPECT_LE(f.wet_modulus_ratio, 1) << f.name;
    EXPECT_FALSE(f.source.empty()) << f.name;
  }
}

// Sheets without a weave: G = E/2(1 + nu), and bending the same in all directions.
TEST(Fabrics, WithoutAWeaveAreIsotropic) {
  for (const char* name : {"leather", "felt", "rubber"}) {
    const Fabric& f = *find_fabric(name);
    EXPECT_EQ(f.young_warp, f.young_weft);
    EXPECT_NEAR(f.shear, f.young_warp / (2 * (1 + f.poisson)), 0.03 * f.shear) << name;
    EXPECT_EQ(f.bend_warp, f.bend_bias);
  }
  for (const char* name : {"felt", "rubber"}) {  // solid through their thickness
    const Fabric& f = *find_fabric(name);
    const double plate =
        f.young_warp * f.thickness * f.thickness / (12 * (1 - f.poisson * f.poisson));
    EXPECT_NEAR(f.bend_warp, plate, 0.02 * plate) << name;
  }
}

// As their drape coefficients are: silk 20-40 %, wool 40-70, leather 47-70, cotton 60-76, denim
// 70-90.
TEST(Fabrics, StandUpInTheOrderOfTheirDrape) {
  const char* order[] = {"silk", "wool", "leather", "cotton", "denim"};
  for (int k = 0; k < 4; ++k)
    EXPECT_LT(bending_length(*find_fabric(order[k])), bending_length(*find_fabric(order[k + 1])));
  EXPECT_NEAR(bending_length(*find_fabric("silk")), 0.0145, 0.001);
  EXPECT_NEAR(bending_length(*find_fabric("denim")), 0.030, 0.002);
}

TEST(Fabrics, AreFoundByName) {
  EXPECT_EQ(find_fabric("wool")->name, "wool");
  EXPECT_EQ(find_fabric("tin"), nullptr);
}

}  // namespace
}  // namespace drench

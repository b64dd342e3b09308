#include "pipeline/contract/shot/colour.h"

#include <gtest/gtest.h>

namespace drench {
namespace {

// White of one space is white of the other: both are defined as (1, 1, 1) after adaptation. 1e-12
// is rounding of a few 3 x 3 products in double.
TEST(Colour, KeepsWhiteWhite) {
  for (const auto& row : acescg_from_rec709()) EXPECT_NEAR(row[0] + row[1] + row[2], 1, 1e-12);
}

// The matrix that colour-science tools publish for linear sRGB to ACEScg with Bradford adaptation,
// six digits; half of the last digit.
TEST(Colour, MatchesThePublishedMatrix) {
  const Matrix3 published{{{0.613097, 0.339523, 0.047379},
                           {0.070194, 0.916354, 0.013452},
                           {0.020616, 0.109570, 0.869815}}};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(acescg_from_rec709()[i][j], published[i][j], 1.5e-6) << i << j;
    }
  }
}

// IEC 61966-2-1: code value 0.5 is linear ((0.5 + 0.055) / 1.055)^2.4 = 0.21404114; grey stays
// grey.
TEST(Colour, DecodesTheTransferCurve) {
  const Imath::V3f grey = acescg_from_srgb({0.5, 0.5, 0.5});
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(grey[i], 0.21404114f, 1e-7f);
  const Imath::V3f dark = acescg_from_srgb({0.02, 0.02, 0.02});  // below the knee: a line
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(dark[i], 0.02f / 12.92f, 1e-9f);
}

}  // namespace
}  // namespace drench

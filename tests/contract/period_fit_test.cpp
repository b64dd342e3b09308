// One file, many resolutions: a quality that changes fluid.spacing alone.

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/contract/shot/shot_file.h"
#include "tests/contract/shot_samples.h"

namespace drench {
namespace {

constexpr const char* slice = R"(
[domain]
min = [0, 0, 0.5]
max = [1, 1, 0.7]
z = "periodic"
[fluid]
spacing = 0.02
[[fluid.box]]
min = [0, 0, 0.5]
max = [0.4, 0.5, 0.7]
[[fluid.box]]
min = [0.6, 0, 0.55]
max = [0.8, 0.5, 0.65]
[[fluid.box]]
min = [0.9, 0, 0.6]
max = [1, 0.5, 0.7]
[[probe]]
type = "pressure"
position = [0, 0.25, 0.6]
normal = [1, 0, 0]
radius = 0.1
[quality.coarse.fluid]
spacing = 0.03
[quality.fine.fluid]
spacing = 0.01
[quality.coarser.fluid]
spacing = 0.06
)";

TEST(PeriodFit, MakesThePeriodAMultipleOfAnotherSpacing) {
  const Shot shot = parse_shot(slice, "slice.toml", {"coarse", {}});
  EXPECT_NEAR(shot.domain.max.z, 0.5 + 7 * 0.03, 1e-12);
  EXPECT_NEAR(shot.fluid.box[0].max.z, shot.domain.max.z, 1e-12);
  EXPECT_EQ(shot.fluid.box[1].max.z, 0.65);  // ends in the fluid, not at a seam
  EXPECT_NEAR(shot.fluid.box[2].max.z, shot.domain.max.z, 1e-12);
  EXPECT_NEAR(shot.probe[0].radius, 0.5 * 7 * 0.03, 1e-12);  // was as broad as the period
  EXPECT_EQ(shot.domain.max.x, 1);
  // The lock file holds what was made of it.
  EXPECT_EQ(parse_shot(shot_lock(shot), "lock.toml").domain.max.z, shot.domain.max.z);
}

// Two supports fit into a period of 5 spacings and no fewer; a disc is no wider than it.
TEST(PeriodFit, KeepsTwoSupportsAndDiscsWithinThePeriod) {
  const Shot shot = parse_shot(slice, "slice.toml", {"coarser", {}});
  EXPECT_NEAR(shot.domain.max.z, 0.5 + 5 * 0.06, 1e-12);
  const Shot set = parse_shot(slice, "slice.toml", {"final", {"fluid.spacing=0.027"}});
  EXPECT_NEAR(set.domain.max.z, 0.5 + 7 * 0.027, 1e-12);
  EXPECT_NEAR(set.probe[0].radius, 3.5 * 0.027, 1e-12);
}

TEST(PeriodFit, LeavesWhatFitsAndWhatIsAsWritten) {
  EXPECT_EQ(parse_shot(slice, "slice.toml").domain.max.z, 0.7);
  EXPECT_EQ(parse_shot(slice, "slice.toml", {"fine", {}}).domain.max.z, 0.7);
  std::string written = slice;
  written.replace(written.find("spacing = 0.02"), 14, "spacing = 0.03");
  const std::string error = test::error_of([&] { parse_shot(written, "slice.toml"); });
  EXPECT_NE(error.find("at the seam"), std::string::npos) << error;
}

}  // namespace
}  // namespace drench

// Lights and cameras that can show nothing, and those that only look so.

#include "pipeline/contract/shot/view_check.h"

#include <gtest/gtest.h>

#include "tests/contract/warned.h"

namespace drench {
namespace {

using test::tells;

std::string warned(const std::string& more) {
  return test::warned_of_pool(warn_of_empty_pictures, more);
}

constexpr const char* sky = "[[light]]\ntype = \"environment\"\n";
std::string camera(const char* position, const char* target) {
  return std::string("[camera]\nposition = ") + position + "\ntarget = " + target + "\n";
}

TEST(Views, OfAPoolUnderASkyAreFine) { EXPECT_EQ(warned(sky), ""); }

TEST(Views, WithoutAnyLightAreBlack) {
  EXPECT_TRUE(tells(warned(""), "there is no light"));
  EXPECT_EQ(warned("[[material]]\nname = \"lamp\"\nemission = [1, 1, 1]\n[[obstacle]]\ntype = "
                   "\"sphere\"\nradius = 0.1\nposition = [0.5, 0.7, 0.5]\nmaterial = \"lamp\"\n"),
            "");
}

// horizon and below multiply the radiance.
TEST(Lights, OfRadianceZeroAreBlackWhateverTheRestSays) {
  EXPECT_TRUE(tells(warned(std::string(sky) + "radiance = [0, 0, 0]\n"), "is black"));
}

TEST(Lights, ThatFaceTheCameraAloneAreInThePicture) {
  const std::string panel =
      std::string(sky) +
      "[[light]]\ntype = \"rectangle\"\ncenter = [0.5, 0.5, 2]\nu = [0.1, 0, 0]\nv = [0, 0.1, 0]\n";
  EXPECT_EQ(warned(panel + camera("[0.5, 0.5, 4]", "[0.5, 0.5, 0]")), "");
  EXPECT_TRUE(tells(warned(panel + camera("[0.5, 0.5, 1.5]", "[0.5, 0.5, 0]")), "shines away"));
}

// A low sun comes in beside a small ground, and not through a large one.
TEST(Lights, OfASunFromBelowAreHiddenByAGroundThatIsLargeEnough) {
  const std::string sun =
      "[[light]]\ntype = \"sun\"\ndirection = [1, 0.1, 0]\n[ground]\nheight = -0.1\nhalf_size = ";
  EXPECT_EQ(warned(sun + "5\n"), "");
  EXPECT_TRUE(tells(warned(sun + "50\n"), "from under the ground"));
}

TEST(Cameras, InASolidUnderTheGroundOrTurnedAwayAreSaid) {
  const std::string block = std::string(sky) +
                            "[[obstacle]]\ntype = \"box\"\nname = \"block\"\nposition = [0.5, 0.5, "
                            "3]\nsize = [1, 1, 1]\n";
  EXPECT_TRUE(
      tells(warned(block + camera("[0.5, 0.5, 2.9]", "[0.5, 0, 0.5]")), "stands in obstacle"));
  EXPECT_EQ(warned(block + camera("[0.5, 0.5, 2.4]", "[0.5, 0, 0.5]")), "");
  // It comes out before the shot ends.
  EXPECT_EQ(
      warned(block + camera("[[1001, [0.5, 0.5, 2.9]], [1048, [0.5, 0.5, 2.4]]]", "[0.5, 0, 0.5]")),
      "");
  EXPECT_TRUE(tells(warned(std::string(sky) + camera("[0.5, 0.5, 3]", "[0.5, 0.5, 9]")),
                    "looks away from all there is"));
  EXPECT_TRUE(tells(warned(std::string(sky) + "[ground]\nheight = -0.1\n" +
                           camera("[0.5, -0.2, 3]", "[0.5, 0.5, 0]")),
                    "under the ground"));
}

// With a sheet, which may be anywhere, too.
TEST(Cameras, ThatLookPastEverythingOrSeeADotAreSaid) {
  const std::string sheet = std::string(sky) + "[[cloth]]\ncorner = [0, 0.5, 0]\n",
                    past = camera("[0.5, 0.5, 4]", "[9, 0.5, 2]"),
                    ball =
                        "[[obstacle]]\ntype = \"sphere\"\nradius = 0.5\nposition = [9, 0.5, 2]\n";
  EXPECT_TRUE(tells(warned(sheet + past), "looks past all there is"));
  EXPECT_EQ(warned(sheet + ball + past), "") << "it sees the ball";
  EXPECT_EQ(warned(sheet + camera("[0.5, 0.5, 4]", "[1.5, 0.5, 2]")), "") << "at the edge";
  EXPECT_TRUE(
      tells(warned(sheet + camera("[900, 900, 1400]", "[0.5, 0.5, 0.5]")), "the domain is a dot"));
  EXPECT_EQ(warned(sheet + camera("[90, 90, 140]", "[0.5, 0.5, 0.5]")), "");
}

}  // namespace
}  // namespace drench

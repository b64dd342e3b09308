// Values that look as if they were meant in another unit.

#include "pipeline/contract/shot/unit_check.h"

#include <gtest/gtest.h>

#include "tests/contract/warned.h"

namespace drench {
namespace {

using test::tells;

std::string warned(const std::string& more) { return test::warned_of_pool(warn_of_units, more); }

TEST(Units, OfAPlainShotAreFine) { EXPECT_EQ(warned("[[cloth]]\n"), ""); }

TEST(Units, OfKeysInSecondsAreSaidOfAllThatMoves) {
  const std::string keys = " = [[0, [0.3, 0.7, 0.2]], [2, [0.3, 0.8, 0.2]]]\n",
                    pin = "[[cloth]]\nname = \"flag\"\n[[cloth.pin]]\nvertices = [0]\n";
  for (const std::string& moving :
       {"[camera]\nposition" + keys, "[camera]\ntarget" + keys, "[wind]\nvelocity" + keys,
        "[[fluid.emitter]]\nspeed = 1\nradius = 0.2\ncenter" + keys,
        "[[fluid.emitter]]\nspeed = 1\nradius = 0.2\ncenter = [0, 1, 0]\ndirection" + keys,
        "[[obstacle]]\ntype = \"box\"\nname = \"paddle\"\nposition" + keys,
        "[[obstacle]]\ntype = \"box\"\nname = \"paddle\"\nrotation_deg" + keys,
        "[[sink]]\ntype = \"box\"\nposition" + keys, pin + "position" + keys,
        pin + "rotation_deg" + keys}) {
    const std::string text = warned(moving);
    EXPECT_TRUE(tells(text, "the last key is at frame 2 and the simulation starts at 1001") &&
                tells(text, "1001 + 24 s"))
        << moving << text;
  }
  EXPECT_TRUE(tells(warned("[[obstacle]]\ntype = \"box\"\nname = \"paddle\"\nposition" + keys),
                    "pool.toml: obstacle \"paddle\": position"));
  EXPECT_EQ(warned("[shot]\nframes = [1, 48]\n[camera]\nposition" + keys), "");
  // A pre-roll starts earlier.
  EXPECT_EQ(warned("[shot]\nframes = [3, 48]\npreroll = 0.5\n[camera]\nposition" + keys), "");
}

TEST(Units, OfKeysOfWhatRacesAreSaid) {
  const std::string ball =
      "[[obstacle]]\ntype = \"box\"\nname = \"ball\"\nposition = [[1001, [0, 0, 0]], ";
  EXPECT_TRUE(tells(warned(ball + "[1002, [0, 50, 0]]]\n"),
                    "\"ball\": position: moves at 1.2e+03 m/s between frames 1001 and 1002"));
  EXPECT_EQ(warned(ball + "[1002, [0, 1, 0]]]\n"), "");
}

TEST(Units, OfMillimetresAndGramsAreSaidOfSheets) {
  EXPECT_TRUE(tells(warned("[[cloth]]\nthickness = 0.35\n"), "write thickness = 0.00035"));
  EXPECT_TRUE(tells(warned("[[cloth]]\nareal_density = 150\n"), "write areal_density = 0.15"));
  EXPECT_EQ(warned("[[cloth]]\nthickness = 0.01\nareal_density = 50\n"), "");
}

TEST(Units, OfSolidsThatTheFluidCannotFeelAreSaid) {
  const std::string ball = "[[obstacle]]\nname = \"ball\"\ntype = \"sphere\"\nradius = ",
                    box = "[[obstacle]]\ntype = \"box\"\nname = \"ball\"\nsize = ";
  EXPECT_TRUE(tells(warned(ball + "0.02\n"), "\"ball\" is 0.04 m wide"));
  EXPECT_TRUE(tells(warned(box + "[0.002, 0.002, 0.002]\n"), "0.002 m wide"));
  EXPECT_EQ(warned(ball + "0.05\n"), "");
  EXPECT_EQ(warned(box + "[0.002, 0.06, 1]\n"), "");
}

}  // namespace
}  // namespace drench

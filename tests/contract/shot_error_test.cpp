// Every mistake in a shot gives one message: place, key, value, limit or reason, remedy.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/contract/shot/shot_table.h"
#include "tests/contract/shot_samples.h"

namespace drench {
namespace {

using shot_table::Kind;
using shot_table::Parameter;
using shot_table::Section;
using test::error_of;
using test::TemporaryFolder;

/// Text of a mistake and the words that its message must hold.
struct Mistake {
  std::string text;
  std::vector<std::string> words;
};

constexpr const char* box = "[[fluid.box]]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.5]\n";  // 3 lines

class ShotError : public testing::Test {
 protected:
  void SetUp() override { test::write_shot_files(folder_); }

  /// Each text follows the three lines of a box of fluid, so that it starts on line 4.
  void expect_messages(const std::vector<Mistake>& mistakes) const {
    for (const Mistake& mistake : mistakes) {
      const std::string text =
          error_of([&] { parse_shot(box + mistake.text, folder_ / "scene.toml"); });
      for (const std::string& word : mistake.words) {
        EXPECT_NE(text.find(word), std::string::npos) << mistake.text << "\n-> " << text;
      }
    }
  }
  TemporaryFolder folder_;
};

TEST_F(ShotError, NamesTheNearestKey) {
  expect_messages({
      {"[fluid]\nspaceing = 0.01\n",
       {"scene.toml:5", "fluid.spaceing", "did you mean fluid.spacing"}},
      {"[camra]\nfov_deg = 40\n", {"scene.toml:4", "camra", "did you mean camera"}},
      {"[[clot]]\n", {"scene.toml:4", "did you mean cloth"}},
      {"[camera]\nfov = 40\n", {"scene.toml:5", "did you mean camera.fov_deg"}},
      {"[fluid]\nviscosity = 1\n", {"scene.toml:5", "did you mean fluid.kinematic_viscosity"}},
      {"[[cloth]]\nstiffness = 1\n", {"scene.toml:5", "did you mean cloth[0].adjacent_stiffness"}},
      {"[[obstacle]]\nrotation = [0, 0, 0]\n", {"scene.toml:5", "rotation_deg"}},
      {"[fluid.boxx]\n", {"scene.toml:4", "fluid.boxx", "fluid.box"}},
      {"[camera]\nspacing = 1\n", {"scene.toml:5", "camera.spacing", "[fluid]"}},
      {"[coupling]\nscheme = \"exat\"\n", {"scene.toml:5", "\"exat\"", "did you mean \"exact\""}},
      {"[domain]\nx = \"cyclic\"\n",
       {"scene.toml:5", "domain.x", "\"open\", \"walls\", \"periodic\""}},
  });
}

TEST_F(ShotError, NamesWrongTypes) {
  expect_messages({
      {"[fluid]\nspacing = \"small\"\n",
       {"scene.toml:5", "fluid.spacing", "\"small\"", "a number in m"}},
      {"[render]\nsamples = 3.5\n", {"scene.toml:5", "render.samples", "whole number"}},
      {"[shot]\nframes = 24\n", {"scene.toml:5", "shot.frames", "[1001, 1048]"}},
      {"[shot]\ngravity = [0, -9.81]\n", {"scene.toml:5", "shot.gravity", "3 numbers"}},
      {"[render]\nmotion_blur = 1\n", {"scene.toml:5", "true or false"}},
      {"[shot]\nseed = 1979-05-27\n", {"scene.toml:5", "a date"}},
      {"[[camera]]\n", {"scene.toml:4", "[camera]"}},
      {"[light]\ntype = \"sun\"\n", {"scene.toml:4", "[[light]]"}},
      {"[camera]\nfov_deg = [[1, 40], [1, 50]]\n", {"scene.toml:5", "must rise"}},
      {"[camera]\nposition = [[1, [0, 1]]]\n", {"scene.toml:5", "camera.position"}},
      {"[camera]\nfov_deg = []\n", {"scene.toml:5", "camera.fov_deg"}},
      {"[[light]]\ntype = \"sun\"\nradiance = \"srgb(1, 2)\"\n", {"scene.toml:6", "srgb(r, g, b)"}},
      {"[[light]]\ntype = \"sun\"\nradiance = \"#12345g\"\n", {"scene.toml:6", "#rrggbb"}},
      {"[shot]\nname = \"../x\"\n", {"scene.toml:5", "'/'"}},
      {"[[cloth]]\nname = \"a/b\"\n", {"scene.toml:5", "letters, digits"}},
      {"spacing 3\n", {"scene.toml:4", "not valid TOML"}},
      {"[fluid]\nspacing = 0.01\nspacing = 0.02\n", {"scene.toml:6", "not valid TOML"}},
  });
}

TEST_F(ShotError, NamesPeriodicAxesThatDoNotFit) {
  expect_messages({
      {"[domain]\nx = \"periodic\"\n[fluid]\nsolver = \"weakly_compressible\"\n"
       "[[cloth]]\n",
       {"scene.toml:5", "domain.x", "cloth", "seam", "incompressible"}},
      {"[domain]\nx = \"periodic\"\n[[obstacle]]\ntype = \"plane\"\nnormal = [0.1, 1, 0]\n",
       {"scene.toml:8", "obstacle[0].normal", "along x by 0.0995", "domain.x", "use a box"}},
      {"[domain]\nmin = [0, 0, 0]\nmax = [2, 2, 0.5]\nz = \"periodic\"\n[[obstacle]]\ntype = "
       "\"box\"\nsize = [0.1, 0.1, 0.6]\nrotation_deg = [0, 1, 0]\n",
       {"scene.toml:10", "obstacle[0].size", "overlaps its own image", "z axis", "0.5 m on"}},
      // A stirrer longer than the period is caught in the frame in which it lies along it.
      {"[domain]\nmin = [0, 0, 0]\nmax = [2, 2, 0.5]\nz = \"periodic\"\n[[obstacle]]\ntype = "
       "\"box\"\nsize = [0.1, 0.1, 0.6]\nrotation_deg = [[1001, [0, 90, 0]], [1031, [0, 0, 0]]]\n",
       {"scene.toml:10", "obstacle[0].size", "overlaps its own image"}},
      {"[fluid]\nsolver = \"weakly_compressible\"\n[[cloth]]\nretardation_time = 0.01\n",
       {"scene.toml", "cloth[0].retardation_time", "Use 0"}},
      {"[fluid]\nsolver = \"weakly_compressible\"\nsurface_tension = 0.072\n",
       {"scene.toml", "fluid.surface_tension", "weakly compressible", "incompressible"}},
      {"[fluid]\nsurface_tension = 0.072\nsupport_ratio = 3\n",
       {"scene.toml:5", "fluid.surface_tension", "support_ratio is 3", "Leave"}},
      {"[domain]\ncontact_angle_deg = 60\n",
       {"scene.toml:5", "domain.contact_angle_deg is 60", "fluid.surface_tension is 0", "0.072"}},
      {"[[obstacle]]\ntype = \"plane\"\ncontact_angle_deg = 120\n",
       {"scene.toml:6", "obstacle[0].contact_angle_deg is 120", "Set fluid.surface_tension"}},
      {"[fluid]\nsolver = \"incompressible\"\n[coupling]\nscheme = \"paper\"\n[[cloth]]\n",
       {"scene.toml:5", "fluid.solver", "paper", "weakly_compressible"}},
      // 0.08 m are less than two supports of 2.15 spacings.
      {"[fluid]\nspacing = 0.02\n[domain]\nmin = [-1, 0, 0.42]\nmax = [1, 2, 0.5]\nz = "
       "\"periodic\"\n",
       {"scene.toml:9", "domain.z", "0.08 m", "two support radii, 0.086 m"}},
      // 0.5 m are 16.67 layers of 0.03 m.
      {"[fluid]\nspacing = 0.03\n[domain]\nmin = [0, 0, 0]\nmax = [2, 2, 0.5]\nz = \"periodic\"\n",
       {"scene.toml:1", "fluid.box[0]", "part by 0.02 m", "spacing = 0.0294117647 m",
        "domain of 0.51 m"}},
      {"[domain]\nmin = [0, 0, 0]\nmax = [2, 2, 0.48]\nz = \"periodic\"\n",
       {"scene.toml:1", "fluid.box[0]", "overlap by 0.02 m"}},
      {"[domain]\ny = \"periodic\"\n[[fluid.sphere]]\ncenter = [0, 0, 0]\nradius = 1\n",
       {"scene.toml:6", "fluid.sphere[0].radius", "across the seam", "0.995 m"}},
  });
  const std::string around = "[domain]\nmin = [0, 0, 0]\nmax = [2, 2, 0.5]\nz = \"periodic\"\n";
  EXPECT_EQ(parse_shot(box + around, folder_ / "scene.toml").domain.axis[2], Axis::periodic);
  const auto fits = [&](const std::string& obstacle) {
    const std::string text = box + around + "[[obstacle]]\n" + obstacle;
    return parse_shot(text, folder_ / "scene.toml").obstacle.size() == 1;
  };
  EXPECT_TRUE(fits("type = \"plane\"\nnormal = [1, 1, 0]\n"));
  EXPECT_TRUE(fits("type = \"box\"\nsize = [0.1, 0.1, 0.5]\nrotation_deg = [0, 0, 30]\n"));
  EXPECT_TRUE(fits("type = \"box\"\nsize = [0.1, 3, 0.1]\nrotation_deg = [90, 0, 0]\n"));
  EXPECT_TRUE(fits("type = \"box\"\nsize = [0.1, 0.2, 2]\nrotation_deg = [45, 0, 0]\n"));  // louver
  EXPECT_TRUE(fits("type = \"sphere\"\nradius = 0.3\n"));
}

// Letters beyond ASCII belong into strings and comments; toml++ must not see them anywhere else.
TEST_F(ShotError, NamesCharactersBeyondAsciiOutsideQuotes) {
  expect_messages({
      {"# caf\u00e9\n\u00e9 = 1\n", {"scene.toml:5", "beyond ASCII"}},
      {"[shot]\nname = \u00e9\n", {"scene.toml:5", "beyond ASCII"}},
      {"[shot]\nname = \"a\" \u00e9\n", {"scene.toml:5", "beyond ASCII"}},
      {"[shot]\nname = \"\"\"\na\\\n \u00e9\"\"\"\n", {"scene.toml:7", "beyond ASCII"}},
      {"[shot]\nname = \"\\\u00e9\"\n", {"scene.toml:5", "beyond ASCII"}},
      {"[shot]\nname = \"caf\u00e9\n\u00e9 = 1\n", {"scene.toml:5", "not valid TOML"}},
  });
  const std::string fine = "# caf\u00e9 \"\n[shot]\nname = \"caf\u00e9 \\\" #\" # \u00e9\n";
  EXPECT_EQ(parse_shot(box + fine, folder_ / "scene.toml").name, "caf\u00e9 \" #");
  const std::string literal = "[shot]\nname = 'caf\u00e9 \\'\n[camera] # '\n";
  EXPECT_EQ(parse_shot(box + literal, folder_ / "scene.toml").name, "caf\u00e9 \\");
}

TEST_F(ShotError, NamesImpossibleValues) {
  expect_messages({
      {"[fluid]\nspacing = -0.01\n",
       {"scene.toml:5", "fluid.spacing is -0.01", "between 1e-05 and 10 m"}},
      {"[fluid]\nspacing = 0.005\nsupport_ratio = 0.8\n",
       {"scene.toml:6", "0.004 m", "0.005 m", "no neighbours", "support_ratio = 2"}},
      {"[shot]\nframes = [1048, 1001]\n", {"scene.toml:5", "[1048, 1001]", "Write [1001, 1048]"}},
      {"[shot]\nframes = [0, 2147483647]\n", {"scene.toml:5", "9999999"}},
      {"[shot]\ntime_step = 1e-18\n", {"scene.toml:5", "time_step is 1e-18", "would not end"}},
      {"[shot]\nframes = [0, 5000000]\n", {"scene.toml:5", "at most 1000000"}},
      {"[camera]\nshutter_open = 0.5\nshutter_close = 0.1\n",
       {"scene.toml:5", "0.5", "0.1", "close before"}},
      {"[domain]\nmin = [0, 3, 0]\n", {"scene.toml:5", "domain.min", "in y"}},
      {"[fluid]\nspacing = 1e-5\n", {"scene.toml:5", "particles", "at most 2e+08"}},
      {"[fluid]\nspacing = 1e-5\n[domain]\nmax = [1000, 2, 1]\n", {"scene.toml:5", "spacings"}},
      {"[[fluid.box]]\nmin = [0, 0, 0]\nmax = [0.5, 9, 0.5]\n",
       {"fluid.box[1]", "scene.toml:4", "walls at 0 and 2"}},
      {"[[fluid.box]]\nmin = [0, 0, 0]\nmax = [0.5, 0.001, 0.5]\n",
       {"scene.toml:4", "no particle"}},
      {"[[fluid.box]]\nmin = [0, 0, 0]\n", {"scene.toml:4", "fluid.box[1] has no max"}},
      {"[[fluid.sphere]]\ncenter = [0, 1, 0]\nradius = 0\n", {"scene.toml:6", "radius", "above 0"}},
      {"[[fluid.emitter]]\ncenter = [0, 1, 0]\nradius = 0\nspeed = 1\n",
       {"scene.toml:6", "no area"}},
      {"[[fluid.emitter]]\ncenter = [0, 1, 0]\nradius = 0.1\nspeed = 1\nstart = 2\nstop = 1\n",
       {"scene.toml:8", "before it starts"}},
      {"[[fluid.emitter]]\ncenter = [0, 1, 0]\nradius = 0.1\nspeed = 1\ndirection = [0, 0, 0]\n",
       {"scene.toml:8", "no direction"}},
      {"[[fluid.emitter]]\ntype = \"rectangle\"\ncenter = [0, 1, 0]\nspeed = 1\nv = [1, 0, 1]\n",
       {"scene.toml:4", "right angles"}},
      {"[[fluid.emitter]]\ntype = \"rectangle\"\ncenter = [0, 1, 0]\nspeed = 1\nradius = 1\n",
       {"scene.toml:8", "type disc", "is a rectangle"}},
      {"[[fluid.emitter]]\ncenter = [[1, [0, 1, 0]], [9, [0, 3, 0]]]\nspeed = 1\n",
       {"scene.toml:5", "3 m in y", "beyond the domain's walls"}},
      {"[[fluid.emitter]]\ncenter = [0, nan, 0]\nspeed = 1\n", {"scene.toml:5", "nan"}},
      {"[[fluid.emitter]]\ncenter = [0, 1, 0]\n",
       {"scene.toml:4", "fluid.emitter[0] has no speed"}},
      {"[[fluid.emitter]]\ntype = \"mesh\"\ncenter = [0, 1, 0]\n",
       {"scene.toml:4", "fluid.emitter[0] has no mesh"}},
      {"[[fluid.emitter]]\ntype = \"mesh\"\ncenter = [0, 1, 0]\nmesh = \"none.ply\"\n",
       {"scene.toml:7", "none.ply does not exist"}},
      {"[[fluid.emitter]]\ntype = \"mesh\"\ncenter = [0, 1, 0]\nmesh = \"flag.obj\"\nspeed = 1\n",
       {"scene.toml:8", "type disc or rectangle", "is a mesh"}},
      {"[[fluid.emitter]]\ntype = \"mesh\"\ncenter = [0, 1, 0]\nmesh = \"flag.obj\"\nscale = 0\n",
       {"scene.toml:8", "scale"}},
      {"[[fluid.emitter]]\ntype = \"mesh\"\ncenter = [0, 1, 0]\nmesh = \"flag.obj\"\nstart = 2\n"
       "stop = 1\n",
       {"scene.toml:8", "before it starts"}},
      {"[[fluid.volume]]\n", {"scene.toml:4", "fluid.volume[0] has no mesh"}},
      {"[[fluid.volume]]\nmesh = \"none.ply\"\n", {"scene.toml:5", "none.ply does not exist"}},
      {"[[fluid.volume]]\nmesh = \"flag.obj\"\nscale = 0\n", {"scene.toml:6", "scale"}},
      {"[wind]\n[fluid]\nsolver = \"weakly_compressible\"\n",
       {"scene.toml:4", "wind.fluid_drag", "feels no wind"}},
      {"[wind]\nvelocity = [0, nan, 0]\n", {"scene.toml:5", "nan"}},
      {"[wind]\nair_density = -1\n", {"scene.toml:5", "air_density"}},
      {"[[sink]]\n", {"scene.toml:4", "sink[0] has no type"}},
      {"[[sink]]\ntype = \"mesh\"\n", {"scene.toml:4", "mesh is missing"}},
      {"[[sink]]\ntype = \"sphere\"\nradius = 0\n", {"scene.toml:6", "no volume"}},
      {"[[sink]]\ntype = \"plane\"\nnormal = [0, 0, 0]\n", {"scene.toml:6", "no direction"}},
      {"[[sink]]\ntype = \"plane\"\nsize = [1, 1, 1]\n", {"scene.toml:6", "type box"}},
      {"[[sink]]\ntype = \"box\"\nstart = 3\nstop = 2\n", {"scene.toml:6", "before it starts"}},
      {"[[sink]]\ntype = \"box\"\nname = \"a\"\n[[sink]]\ntype = \"box\"\nname = \"a\"\n",
       {"scene.toml:9", "\"a\"", "scene.toml:6"}},
      {"[[fluid.drops]]\nmin = [0, 1, 0]\nmax = [0.1, 0.5, 0.1]\nradius = 0.1\ncount = 3\n",
       {"scene.toml:5", "in y"}},
  });
}

TEST_F(ShotError, NamesPinsAndSeamsThatCannotBe) {
  const std::string explicit_fluid = "[fluid]\nsolver = \"weakly_compressible\"\n";
  const std::string pin = "[[cloth]]\ncells = [2, 2]\n[[cloth.pin]]\nvertices = [0]\n";
  const std::string seam = "[[cloth]]\ncells = [2, 3]\n[[cloth.seam]]\n";
  expect_messages({
      {pin + "on = \"hand\"\n", {"scene.toml:8", "cloth[0].pin[0].on", "\"hand\"", "none"}},
      {pin + "on = \"hand\"\nposition = [[1, [0, 0, 0]], [2, [1, 0, 0]]]\n[[obstacle]]\nname = "
             "\"hand\"\ntype = \"sphere\"\n",
       {"scene.toml:8", "carries the group", "Remove one"}},
      {pin + "position = [0, 1, 0]\n",
       {"scene.toml:8", "cloth[0].pin[0].position is [0, 1, 0]", "Use [[frame, value], ...]"}},
      {pin + "rotation_deg = [0, 90, 0]\n", {"scene.toml:8", "one value for all time"}},
      {pin + "release = 0\n", {"scene.toml:8", "let go before it is held"}},
      {pin + "release = -1\n", {"scene.toml:8", "between 0 and"}},
      {pin + "release = 1\n" + explicit_fluid,
       {"scene.toml:8", "weakly compressible", "Use fluid.solver = \"incompressible\""}},
      {pin + "stiffness = 10\n" + explicit_fluid, {"scene.toml:8", "explicit steps"}},
      {pin + "position = [[1, [0, 0, 0]], [2, [1, 0, 0]]]\n[coupling]\nscheme = \"paper\"\n",
       {"scene.toml:8", "coupling.scheme = \"exact\""}},
      {seam + "edge = \"u0\"\n",
       {"scene.toml:6", "cloth[0].seam[0] needs either to_edge", "to_vertices = [...]"}},
      {seam + "edge = \"u0\"\nvertices = [1]\nto_edge = \"u1\"\n",
       {"scene.toml:6", "needs either edge", "not both"}},
      {seam + "edge = \"u0\"\nto_edge = \"u0\"\n", {"scene.toml:6", "to themselves"}},
      {seam + "edge = \"u0\"\nto_edge = \"v0\"\n",
       {"scene.toml:6", "sews 4 vertices of \"cloth\" to 3", "as many cells"}},
      {seam + "edge = \"u0\"\nto = \"cloht\"\nto_edge = \"u1\"\n",
       {"scene.toml:8", "\"cloht\"", "the sheets of this shot: cloth"}},
      {seam + "vertices = [12]\nto_vertices = [0]\n", {"scene.toml:7", "12", "0 to 11"}},
      {seam + "edge = \"u0\"\nto_edge = \"u1\"\nrest_length = -0.5\n",
       {"scene.toml:9", "-0.5 m", "-1 for what contact"}},
      {seam + "edge = \"u0\"\nto = \"flag\"\nto_edge = \"u0\"\n[[cloth]]\nname = \"flag\"\nmesh = "
              "\"flag.obj\"\n",
       {"scene.toml:9", "\"flag\" is a mesh", "to_vertices"}},
      {seam + "edge = \"u0\"\nto_edge = \"u1\"\n" + explicit_fluid,
       {"scene.toml:6", "sews sheets", "explicit"}},
  });
}

TEST_F(ShotError, NamesBadClothLightsAndMaterials) {
  expect_messages({
      {"[[cloth]]\nmodel = \"springs\"\nsoaks = true\n",
       {"scene.toml:6", "cloth[0].soaks", "shell"}},
      {"[[cloth]]\nwetness = 1.5\n", {"scene.toml:5", "cloth[0].wetness", "between 0 and 1"}},
      {"[[cloth]]\nfabric = \"rubber\"\nwetness = 1\n",
       {"scene.toml:6", "cloth[0].wetness", "rubber takes up no water", "Give water_capacity"}},
      {"[[cloth]]\nfabric = \"felt\"\nsoaks = true\nwater_capacity = 0\n",
       {"scene.toml:6", "cloth[0].soaks", "water_capacity is 0"}},
      {"[[cloth]]\nmesh = \"none.ply\"\n",
       {"scene.toml:5", "cloth[0].mesh", "none.ply does not exist"}},
      {"[[cloth]]\nmesh = \".\"\n", {"scene.toml:5", "not a regular file"}},
      {"[[cloth]]\nu = [1, 0, 0]\nv = [2, 0, 0]\n", {"scene.toml:5", "no area"}},
      {"[[cloth]]\ncells = [4096, 4096]\n", {"scene.toml:5", "vertices"}},
      {"[[cloth]]\nmesh = \"flag.obj\"\npins = \"corners\"\n", {"scene.toml:6", "is a mesh"}},
      {"[[cloth]]\n[[cloth.pin]]\n", {"scene.toml:5", "cloth[0].pin[0]", "either vertices"}},
      {"[[cloth]]\ncells = [2, 2]\n[[cloth.pin]]\nvertices = [9]\n",
       {"scene.toml:7", "9", "0 to 8"}},
      {"[[cloth]]\nname = \"a\"\n[[cloth]]\nname = \"a\"\n",
       {"scene.toml:7", "\"a\"", "scene.toml:5"}},
      {"[[light]]\ntype = \"sun\"\nname = \"k\"\n[[light]]\ntype = \"sun\"\nname = \"k\"\n",
       {"scene.toml:9", "scene.toml:6"}},
      {"[[light]]\nname = \"k\"\n", {"scene.toml:4", "has no type"}},
      {"[[light]]\ntype = \"sun\"\ngroup = \"caustics\"\n", {"scene.toml:6", "another name"}},
      {"[[light]]\ntype = \"sun\"\nangle_deg = 0\n", {"scene.toml:6", "no disc"}},
      {"[[light]]\ntype = \"environment\"\n[[light]]\ntype = \"environment\"\nname = \"b\"\n",
       {"scene.toml:7", "\"b\"", "one sky"}},
      {"[[material]]\nname = \"lava\"\nemission = [9, 2, 1]\n[[obstacle]]\nname = \"caustics\"\n"
       "type = \"sphere\"\nmaterial = \"lava\"\n",
       {"scene.toml:8", "another name"}},
      {"[layers]\ncryptomatte = true\n[[cloth]]\nname = \"a\"\n[[obstacle]]\nname = \"a\"\n"
       "type = \"sphere\"\n",
       {"scene.toml:9", "\"a\"", "[[cloth]]"}},
      {"[layers]\ncryptomatte = true\n[[obstacle]]\nname = \"ground\"\ntype = \"sphere\"\n",
       {"scene.toml:7", "the ground"}},
      {"[render]\nwidth = 64\ncrop_min = [8, 8]\ncrop_max = [65, 9]\n",
       {"scene.toml:7", "[65, 9]", "64 x"}},
      {"[render]\nsamples = 8\ndenoise = true\n", {"scene.toml:6", "at least 16"}},
      {"[[light]]\ntype = \"rectangle\"\nu = [0, 0, 1]\n", {"scene.toml:4", "no area"}},
      {"[[light]]\ntype = \"sun\"\nradius = 2\n", {"scene.toml:6", "type sphere", "is a sun"}},
      {"[[light]]\ntype = \"disk\"\nradius = 0\n", {"scene.toml:6", "no area"}},
      {"[[light]]\ntype = \"disk\"\ndirection = [0, 0, 0]\n", {"scene.toml:6", "no direction"}},
      {"[[light]]\ntype = \"environment\"\nmap = \"none.exr\"\n",
       {"scene.toml:6", "does not exist"}},
      {"[[cloth]]\nmaterial = \"silk\"\n", {"scene.toml:5", "\"silk\"", "water, cotton, ground"}},
      {"[[cloth]]\nmaterial = \"water\"\n", {"scene.toml:5", "open sheet"}},
      {"[[material]]\nname = \"cotton\"\nreflectance = [0.9, 0.5, 0.5]\n",
       {"scene.toml:6", "0.9", "0.2", "at most 1", "red"}},
      {"[[material]]\nname = \"silk\"\ntype = \"cloth\"\nsheen = [0.5, 0.2, 0.2]\n"
       "yarn_specular = [0.2, 0.2, 0.9]\n",
       {"scene.toml:8", "\"silk\"", "0.2", "0.9", "at most 1", "blue"}},
      {"[[material]]\nname = \"silk\"\nsheen = [0.5, 0.2, 0.2]\n", {"scene.toml:6", "type cloth"}},
      {"[[material]]\nname = \"net\"\ntype = \"cloth\"\ngap = 1\n", {"scene.toml:7", "0.99"}},
      {"[[material]]\nname = \"net\"\ntype = \"cloth\"\ngap = 0.5\n[ground]\n"
       "material = \"net\"\n",
       {"scene.toml:9", "0.5", "below the ground"}},
      {"[[material]]\nname = \"silk\"\n[[material]]\nname = \"silk\"\n",
       {"scene.toml:6", "scene.toml:4"}},
      {"[camera]\nposition = [0, 0.5, 0]\ntarget = [0, 0.5, 0]\n",
       {"scene.toml:6", "looks nowhere"}},
      {"[camera]\nup = [0, 0, 0]\n", {"scene.toml:5", "no direction"}},
      {"[camera]\nblades = 2\n", {"scene.toml:5", "no opening", "3 and more"}},
      {"[camera]\nshutter_opening = 0.6\nshutter_closing = 0.5\n",
       {"scene.toml:5", "0.6", "0.5", "at most 1"}},
      {"[[material]]\nname = \"glow\"\nemission = [1, 1, 1]\n[[cloth]]\nmaterial = \"glow\"\n",
       {"scene.toml:8", "cloth", "does not shine"}},
      {"[[material]]\nname = \"glow\"\nemission = [1, 1, 1]\n[ground]\nmaterial = \"glow\"\n",
       {"scene.toml:8", "the ground", "does not shine"}},
      {"[[obstacle]]\ntype = \"box\"\nmaterial = \"water\"\nmatte = \"shadow_catcher\"\n",
       {"scene.toml:6", "a shadow catcher cannot have", "metal"}},
      {"[ground]\nmatte = \"hole\"\n", {"scene.toml:5", "holdout", "shadow_catcher"}},
      {"[camera]\nposition = [0, 3, 0]\ntarget = [0, 0, 0]\n", {"along the view"}},
  });
}

// Box and domain have walls at -1 and 1 m, a floor at 0 m.
TEST_F(ShotError, NamesBadProbes) {
  expect_messages({
      {"[[probe]]\nposition = [0, 0, 0]\n", {"scene.toml:4", "probe[0] has no type"}},
      {"[[probe]]\ntype = \"depth\"\n", {"scene.toml:5", "\"height\", \"pressure\""}},
      {"[[probe]]\ntype = \"height\"\nradius = 1\n",
       {"scene.toml:6", "radius", "type pressure", "Remove it"}},
      {"[[probe]]\ntype = \"height\"\nposition = [1.2, 0, 0]\n",
       {"scene.toml:6", "\"probe\"", "1.2", "in x", "beyond the domain's walls"}},
      {"[[probe]]\ntype = \"pressure\"\nposition = [0.95, 0, 0]\nradius = 0.1\n",
       {"scene.toml:6", "1.05", "in x", "Move it"}},
      {"[[probe]]\ntype = \"pressure\"\nnormal = [0, 0, 0]\n",
       {"scene.toml:6", "normal", "no direction"}},
      {"[domain]\nx = \"periodic\"\n[[probe]]\ntype = \"pressure\"\nradius = 1.2\n",
       {"scene.toml:8", "2.4 m wide in x", "period of 2 m", "at most 1 m"}},
      {"[domain]\nx = \"open\"\n[[probe]]\ntype = \"height\"\nposition = [5, 0, 0]\n",
       {"scene.toml:8", "beyond the domain's open sides", "dropped"}},
      {"[domain]\nx = \"periodic\"\n[[probe]]\ntype = \"force\"\ntarget = \"x_low\"\n",
       {"scene.toml:8", "domain.x is \"periodic\"", "no wall"}},
      {"[[obstacle]]\ntype = \"sphere\"\nname = \"y_low\"\n[[probe]]\ntype = \"force\"\n"
       "target = \"y_low\"\n",
       {"scene.toml:9", "a wall of the domain and the name of an obstacle", "rename"}},
      {"[[probe]]\ntype = \"front\"\ndirection = [0, 0, 0]\n",
       {"scene.toml:6", "direction", "no direction"}},
      {"[[obstacle]]\ntype = \"sphere\"\nname = \"ball\"\n[[probe]]\ntype = \"velocity\"\n"
       "on = \"bal\"\n",
       {"scene.toml:9", "\"bal\"", "not an obstacle", "ball"}},
      {"[[probe]]\ntype = \"force\"\non = \"ball\"\n", {"scene.toml:6", "on", "type height"}},
      {"[[probe]]\ntype = \"pressure\"\nwindow = -1\n", {"scene.toml:6", "window", "0 and 1"}},
      {"[[probe]]\ntype = \"force\"\ntarget = \"left\"\n",
       {"scene.toml:6", "\"left\"", "x_low", "this shot has none"}},
      {"[[obstacle]]\ntype = \"sphere\"\nname = \"a\"\n[[cloth]]\nname = \"a\"\n[[probe]]\n"
       "type = \"force\"\ntarget = \"a\"\n",
       {"\"a\"", "obstacle 1 and of a sheet", "rename"}},
      {"[domain]\ny = \"open\"\n[[probe]]\ntype = \"force\"\n",
       {"scene.toml:6", "\"y_low\"", "domain.y is \"open\""}},
      {"[[cloth]]\nname = \"flag\"\n[[probe]]\ntype = \"tip\"\n",
       {"scene.toml:6", "\"cloth\"", "flag"}},
      {"[[cloth]]\ncells = [2, 2]\n[[probe]]\ntype = \"tip\"\nvertex = 9\n",
       {"scene.toml:8", "vertex is 9", "0 to 8"}},
      {"[[probe]]\ntype = \"volume\"\nname = \"a\"\n[[probe]]\ntype = \"energy\"\n"
       "name = \"a\"\n",
       {"scene.toml:9", "[[probe]]", "\"a\"", "its own name"}},
  });
  const std::string dry = error_of(
      [&] { parse_shot("[[cloth]]\n[[probe]]\ntype = \"height\"\n", folder_ / "scene.toml"); });
  EXPECT_NE(dry.find("scene.toml:3"), std::string::npos) << dry;
  EXPECT_NE(dry.find("measures fluid"), std::string::npos) << dry;
}

TEST_F(ShotError, NamesAShotWithoutAnythingToSimulate) {
  const std::string text =
      error_of([&] { parse_shot("[render]\nwidth = 64\n", folder_ / "scene.toml"); });
  EXPECT_NE(text.find("neither fluid nor cloth"), std::string::npos) << text;
}

TEST_F(ShotError, NamesMistakesInQualities) {
  expect_messages({
      {"[quality.fast.render]\nwidht = 3\n", {"scene.toml:5", "did you mean render.width"}},
      {"[quality.fast.render]\nwidth = 0\n",
       {"scene.toml:5", "render.width is 0", "between 1 and 16384"}},
      {"[quality.final.render]\nwidth = 3\n", {"scene.toml:4", "final is the shot as written"}},
      {"[quality]\nfast = 3\n", {"scene.toml:5", "quality.fast"}},
      {"[[quality]]\n", {"scene.toml:4", "quality must be a table"}},
      {"[quality.fast.cloth.none]\ncells = [3, 3]\n", {"scene.toml:4", "no cloth.none"}},
  });
  const ShotOptions unknown{.quality = "fast", .set = {}};
  const std::string text = error_of([&] { parse_shot(box, folder_ / "scene.toml", unknown); });
  EXPECT_NE(text.find("no quality \"fast\""), std::string::npos) << text;
}

TEST_F(ShotError, NamesTheOverride) {
  const auto message = [&](const std::string& set) {
    return error_of([&] {
      parse_shot(test::full_shot(), folder_ / "scene.toml", {.quality = "final", .set = {set}});
    });
  };
  for (const auto& [set, word] : std::vector<std::pair<std::string, std::string>>{
           {"fluid.spacing=-1", "between 1e-05 and 10 m"},
           {"fluid.spacng=1", "did you mean fluid.spacing"},
           {"fluid.support_ratio=0.5", "no neighbours"},
           {"shot.frames=[5, 1]", "Write [1, 5]"},
           {"fluid", "section.key=value"},
           {"fluid.spacing", "section.key=value"},
           {"=1", "section.key=value"},
           {"fluid.spacing=", "TOML"},
           {"fluid.spacing=1\nfluid.material=\"x\"", "line break"},
           {"cloth.cells=[1, 2]", "no cloth.cells"},
           {"cloth.7.cells=[1, 2]", "there is no cloth.7"},
           {"cloth.sheet.name=\"other\"", "cannot be overridden"},
           {"cloth.flag.cells=[9, 9]", "another grid"},
           {"quality.fast.render.width=3", "quality"}}) {
    const std::string text = message(set);
    EXPECT_TRUE(text.starts_with("--set " + set.substr(0, set.find('\n')))) << text;
    EXPECT_NE(text.find(word), std::string::npos) << set << "\n-> " << text;
  }
}

/// Whether the row holds numbers that its limits bind.
bool is_numeric(const Parameter& p) {
  switch (p.kind) {
    case Kind::integer:
    case Kind::natural:
    case Kind::number:
    case Kind::vector:
    case Kind::colour:
    case Kind::spectrum:
    case Kind::cells:
    case Kind::frames:
    case Kind::number_track:
    case Kind::vector_track:
      return true;
    default:
      return false;
  }
}

std::string array_for(Kind kind, const std::string& x) {
  if (kind == Kind::cells || kind == Kind::frames) return fmt::format("[{0}, {0}]", x);
  if (kind == Kind::vector || kind == Kind::colour || kind == Kind::spectrum ||
      kind == Kind::vector_track) {
    return fmt::format("[{0}, {0}, {0}]", x);
  }
  return x;
}

// 10 extremes on every numeric key: each must be refused with key and limit, never taken.
TEST_F(ShotError, RefusesExtremesOfEveryNumericKey) {
  Shot shot = parse_shot(test::full_shot(), folder_ / "scene.toml");
  size_t keys = 0;
  shot_table::for_each_object(shot, [&](const Section& section, void* object,
                                        const std::string& path) {
    if (section.name == "cloth.pin") return;  // lists and boxes
    for (const Parameter* p : shot_table::parameters_of(section.name)) {
      if (!is_numeric(*p) || !shot_table::applies(*p, section, object)) continue;
      ++keys;
      std::string place = path;
      std::replace(place.begin(), place.end(), '[', '.');
      place.erase(std::remove(place.begin(), place.end(), ']'), place.end());
      for (const char* extreme :
           {"nan", "-nan", "inf", "-inf", "1e30", "-1e30", "9223372036854775807",
            "-9223372036854775808", "1e308", "-1e12"}) {
        const std::string set = fmt::format("{}.{}={}", place, p->key, array_for(p->kind, extreme));
        const std::string text = error_of([&] {
          parse_shot(test::full_shot(), folder_ / "scene.toml", {.quality = "final", .set = {set}});
        });
        EXPECT_NE(text.find(fmt::format("{}.{} is", path, p->key)), std::string::npos) << text;
      }
    }
  });
  EXPECT_GT(keys, 60u);
}

TEST_F(ShotError, OfAnotherEncodingOrAQuotientSaysWhatToWrite) {
  const std::string utf16 = error_of([&] { parse_shot("\xff\xfe[\0s", folder_ / "scene.toml"); });
  EXPECT_NE(utf16.find("UTF-8"), std::string::npos) << utf16;
  expect_messages({{"[shot]\nfps = 24000/1001\n", {"scene.toml:5", "23.976"}}});
}

}  // namespace
}  // namespace drench

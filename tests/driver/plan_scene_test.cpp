// What `drench plan` says of a scene before anything runs, and what warnings become.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "pipeline/contract/files/files.h"
#include "tests/contract/box_mesh.h"
#include "tests/driver/tiny_shot.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::TinyShot;

/// The tiny shot with more of a shot file behind it.
test::Ended run_with(const TinyShot& shot, const std::string& command, const std::string& more,
                     const std::vector<std::string>& words = {}) {
  std::string text = read_text(shot.file());
  write_file_whole(shot.file(), text + more);
  test::Ended ended = shot.run(command, words);
  write_file_whole(shot.file(), text);
  return ended;
}

constexpr const char* dark_light =
    "[[light]]\ntype = \"rectangle\"\nname = \"lamp\"\nradiance = [0, 0, 0]\n";

TEST(PlanScene, CountsParticlesTrianglesMemoryAndSteps) {
  const TinyShot shot;
  const test::Ended ended = shot.run("plan", {"--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const nlohmann::json scene = nlohmann::json::parse(ended.out).at("scene");
  EXPECT_GT(scene.at("particles").get<int>(), 0);
  EXPECT_GT(scene.at("cloth_triangles").get<int>(), 0);
  EXPECT_EQ(scene.at("cloth")[0].at("model"), "shell");
  EXPECT_TRUE(shot.run("plan").out.find("  cloth.flag  72 triangles, shell of cotton\n") !=
              std::string::npos);
  EXPECT_GT(scene.at("memory_bytes").get<double>(), 1e4);
  EXPECT_GT(scene.at("steps_a_frame").get<double>(), 0);
  // As many as the simulation then says it has.
  ASSERT_EQ(shot.run("simulate", {"--frames", "1001"}).code, 0);
  const test::Ended simulated = shot.run("simulate", {"--frames", "1002"});
  EXPECT_NE((simulated.out + simulated.err)
                .find("particles=" + std::to_string(scene.at("particles").get<int>())),
            std::string::npos)
      << simulated.err;
}

// A box of 4.5 x 4 x 4 spacings of 0.05 m, of which a block keeps a layer: 9 litres asked for, 8 on
// the lattice, 2 in the block.
TEST(PlanScene, SaysInLitresWhatRoundingAndObstaclesTake) {
  const test::TemporaryFolder folder;
  write_file_whole(folder / "box.toml", R"(
[domain]
min = [-1, -1, -1]
max = [1, 1, 1]
[fluid]
spacing = 0.05
[[fluid.box]]
min = [0, 0, 0]
max = [0.225, 0.2, 0.2]
[[obstacle]]
type = "box"
name = "block"
position = [0, -0.05, 0]
size = [1.9, 0.15, 1.9]
)");
  const test::Ended json = test::run_program(
      DRENCH_PROGRAM, {"plan", (folder / "box.toml").string(), "--json"}, folder.path());
  ASSERT_EQ(json.code, 0) << json.err;
  const nlohmann::json source = nlohmann::json::parse(json.out).at("scene").at("source").at(0);
  EXPECT_NEAR(source.at("asked_litres").get<double>(), 9, 1e-9);
  EXPECT_NEAR(source.at("litres").get<double>(), 6, 1e-9);
  const test::Ended ended =
      test::run_program(DRENCH_PROGRAM, {"plan", (folder / "box.toml").string()}, folder.path());
  EXPECT_NE(ended.out.find("48 particles, 6 of 9 litres: rounding -11.1 %, obstacles -22.2 %"),
            std::string::npos)
      << ended.out;
}

// A picture that cannot be read, or is read with a warning, is known before hours of simulation.
TEST(PlanScene, ReadsThePicturesThatAreUsed) {
  const TinyShot shot;
  const auto planned = [&](const std::string& used, const std::string& header) {
    write_file_whole(shot.folder() / "dark.hdr",
                     header + "\n\n-Y 1 +X 1\n" + std::string("\x10\x20\x30\x80", 4));
    return run_with(shot, "plan",
                    "[[material]]\nname = \"paint\"\ntype = \"diffuse\"\ntexture = \"dark.hdr\"\n",
                    {"--strict", "--set", "ground.material=\"" + used + "\""});
  };
  EXPECT_EQ(planned("paint", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe").code, 0);
  const test::Ended warned = planned("paint", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nGAMMA=2");
  EXPECT_EQ(warned.code, 1);
  EXPECT_NE(warned.err.find("GAMMA"), std::string::npos) << warned.err;
  const test::Ended refused = planned("paint", "no picture");
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("dark.hdr"), std::string::npos) << refused.err;
  EXPECT_EQ(planned("ground", "no picture").code, 0);
}

// What only a later frame or the picture would meet.
TEST(PlanScene, ReadsTheMeshesOfAllFrames) {
  const TinyShot shot;
  const auto planned = [&](int frame, const std::string& corner) {
    for (int k = 1001; k <= 1004; ++k)
      test::write_box(shot.folder() / ("box." + std::to_string(k) + ".obj"), Imath::V3f(0.01f));
    const std::filesystem::path file = shot.folder() / ("box." + std::to_string(frame) + ".obj");
    std::string text = read_text(file);
    write_file_whole(file, text.replace(text.find("f 1 "), 4, "f " + corner + " "));
    return run_with(shot, "plan",
                    "[[obstacle]]\ntype = \"mesh\"\nmesh = \"box.%04d.obj\"\n"
                    "position = [0, 50, 0]\n",
                    {"--strict", "--set", "shot.frames=[1001, 1004]"});
  };
  EXPECT_EQ(planned(1001, "1").code, 0);
  const test::Ended open = planned(1003, "2");
  EXPECT_EQ(open.code, 1);
  EXPECT_NE(open.err.find("box.1003.obj"), std::string::npos) << open.err;
  const test::Ended lost = planned(1004, "1/9");
  EXPECT_EQ(lost.code, 1);
  EXPECT_NE(lost.err.find("texture coordinate"), std::string::npos) << lost.err;
}

TEST(PlanScene, RefusesAFluidThatIsAllInAnObstacle) {
  const TinyShot shot;
  const std::string block = "[[obstacle]]\ntype = \"box\"\nname = \"block\"\nsize = [9, 9, 9]\n";
  const test::Ended ended = run_with(shot, "plan", block);
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("block"), std::string::npos) << ended.err;
}

TEST(PlanScene, RefusesATipProbeOffItsSheet) {
  const TinyShot shot;
  const std::string tip = "[[probe]]\ntype = \"tip\"\nname = \"tip\"\ncloth = \"flag\"\n";
  EXPECT_EQ(run_with(shot, "plan", tip + "vertex = 0\n").code, 0);
  const test::Ended ended = run_with(shot, "plan", tip + "position = [0, 3, 0]\n");
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("m off sheet"), std::string::npos) << ended.err;
}

TEST(Strict, MakesWarningsErrors) {
  const TinyShot shot;
  const test::Ended lenient = run_with(shot, "plan", dark_light, {"--json"});
  EXPECT_EQ(lenient.code, 0) << lenient.err;
  EXPECT_EQ(nlohmann::json::parse(lenient.out).at("warnings").size(), 1u);
  const test::Ended strict = run_with(shot, "plan", dark_light, {"--strict"});
  EXPECT_EQ(strict.code, 1);
  EXPECT_NE(strict.err.find("lamp"), std::string::npos) << strict.err;
}

TEST(Strict, WarningsStandInTheLastLinesInStatsAndInJson) {
  const TinyShot shot(2);
  const test::Ended ended = run_with(shot, "simulate", dark_light, {"--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const size_t first = ended.err.find("is black"), last = ended.err.rfind("is black");
  EXPECT_NE(first, last) << ended.err;
  EXPECT_GT(last, ended.err.find("done:")) << ended.err;
  const nlohmann::json object = nlohmann::json::parse(ended.out);
  EXPECT_EQ(object.at("warnings"), 1);
  EXPECT_NE(object.at("warning")[0].get<std::string>().find("lamp"), std::string::npos);
  EXPECT_NE(read_text(shot.out() / "stats.jsonl").find("\"step\":\"warning\""), std::string::npos);
}

}  // namespace
}  // namespace drench

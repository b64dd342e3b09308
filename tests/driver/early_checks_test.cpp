// What is said before hours are spent.

#include <gtest/gtest.h>

#include "pipeline/contract/files/files.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/shell_word.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;
namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// 137 thousand particles of 165 bytes at least in 10 MiB: refused by an estimate.
TEST(Early, FluidThatTheMachineCannotHoldIsRefusedBeforeItIsBuilt) {
  const TinyShot shot;
  for (const char* command : {"plan", "run"}) {
    const Ended ended = shot.run(command, {"--set", "fluid.spacing=0.0025", "--memory", "0.01"});
    EXPECT_EQ(ended.code, 1) << ended.out;
    EXPECT_TRUE(has(ended.err, "particles, which take") && has(ended.err, "--memory is 0.01") &&
                has(ended.err, "Use a spacing of"))
        << ended.err;
  }
  EXPECT_EQ(shot.run("plan", {"--memory", "0.5"}).code, 0);
}

TEST(Early, FramesBeyondTheShotAreSaid) {
  const TinyShot shot(2);
  const std::string said = "--frames goes on to 1004, beyond the shot's last frame 1002";
  EXPECT_TRUE(has(shot.run("plan", {"--frames", "1001-1004"}).err, said));
  EXPECT_FALSE(has(shot.run("plan", {"--frames", "1001-1002"}).err, "beyond"));
}

TEST(Early, APrerollAndAStepOfNonsenseAreSaidByThePlan) {
  const TinyShot shot(2);
  EXPECT_TRUE(has(shot.run("plan", {"--set", "shot.preroll=24"}).out, "a pre-roll of 24 s, some "));
  EXPECT_FALSE(has(shot.run("plan").out, "pre-roll"));
  const Ended ended = shot.run("plan", {"--set", "shot.time_step=1e-8"});
  EXPECT_TRUE(has(ended.err, "4166667 steps a frame; without it there are some ")) << ended.err;
}

// Two files of one shot.name.
TEST(Early, AFolderOfAnotherShotIsSaid) {
  const TinyShot shot(2);
  ASSERT_EQ(shot.run("simulate").code, 0);
  EXPECT_FALSE(has(shot.run("run").err, "holds frames of")) << "its own";
  const fs::path copy = shot.folder() / "copy.toml";
  fs::copy_file(shot.file(), copy);
  const auto run_copy = [&] {
    return run_program(
        DRENCH_PROGRAM,
        {"run", copy.string(), "--out", shot.out().string(), "--set", "camera.fov_deg=33"},
        shot.folder());
  };
  const Ended ended = run_copy();
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_TRUE(has(ended.err, "holds frames of " + shot.file().string()) &&
              has(ended.err, "its own shot.name"))
      << ended.err;
  fs::remove(shot.file());  // a shot that was renamed is no other one
  EXPECT_FALSE(has(run_copy().err, "holds frames of"));
}

// ---- a damaged manifest ----

TEST(Manifest, ThatIsDamagedIsToldByVerifyAndMendedOnceByARun) {
  const TinyShot shot(2);
  ASSERT_EQ(shot.run("run").code, 0);
  const fs::path manifest = shot.out() / layout::manifest;
  std::string text = read_text(manifest);
  text.replace(text.find("\"size\":"), 8, "\"size\":9");
  write_file_whole(manifest, text + "{\"file\":\"x\"}\n");
  const auto verify = [&] {
    return run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder());
  };
  const Ended told = verify();
  EXPECT_EQ(told.code, 1);
  EXPECT_TRUE(has(told.err, "manifest.jsonl: 2 of its lines are damaged")) << told.err;
  EXPECT_TRUE(has(shot.run("run").err, "2 damaged lines dropped"));
  EXPECT_FALSE(has(shot.run("run").err, "damaged"));
  EXPECT_EQ(verify().code, 0);
  // As a run beside it leaves it for a moment.
  write_file_whole(manifest, read_text(manifest) + "{\"file\":");
  EXPECT_EQ(verify().code, 0);
}

TEST(Manifest, ThatListsNothingIsToldByVerify) {
  const TinyShot shot(2);
  ASSERT_EQ(shot.run("run").code, 0);
  write_file_whole(shot.out() / layout::manifest, std::string());
  const Ended ended = run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder());
  EXPECT_EQ(ended.code, 1);
  EXPECT_TRUE(has(ended.err, "lists none of the ")) << ended.err;
}

// ---- words ----

TEST(Words, ThatAreNoneAreGuessed) {
  const TinyShot shot(2);
  const auto said = [&](const std::vector<std::string>& words) {
    const Ended ended = run_program(DRENCH_PROGRAM, words, shot.folder());
    EXPECT_EQ(ended.code, 1);
    return ended.err;
  };
  const std::string file = shot.file().string();
  EXPECT_TRUE(has(said({"rnu", file}), "rnu is no command; did you mean run?"));
  EXPECT_TRUE(has(said({"run", file, "--qualty", "preview"}),
                  "--qualty is no option; did you mean --quality?"));
  EXPECT_TRUE(has(said({"run", file, "--qualty=preview"}), "did you mean --quality?"));
  EXPECT_TRUE(has(said({"run", file, "--device", "gpu"}), "gpu not in {auto,cpu,cuda}"));
  EXPECT_TRUE(has(said({"run", file, "--steps", "mehs"}), "mehs not in {"));
  for (const char* size : {"8GB", "nan", "0", "-1", ""})
    EXPECT_TRUE(has(said({"run", file, "--memory", size}), "no number of GiB")) << size;
  EXPECT_TRUE(has(said({"run", file, "--set", "quality.preview.render.samples=9"}),
                  "--quality NAME chooses one"));
}

TEST(ShellWord, IsTheWordAgain) {
  const TemporaryFolder folder;
  for (const std::string word :
       {"plain-1.toml", "a b", "it's", "$HOME `x` \"y\"", "", "K\xc3\xbc"}) {
    const Ended ended =
        run_program("/bin/sh", {"-c", "printf %s " + shell_word(word)}, folder.path());
    EXPECT_EQ(ended.out, word);
  }
  EXPECT_EQ(shell_word("plain-1.toml"), "plain-1.toml");
}

}  // namespace
}  // namespace drench

// Simulations that really diverge, through the program: what a user sees, and what is left on disk.

#include <gtest/gtest.h>

#include <regex>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/output_folder.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;

constexpr double fps = 240;

std::vector<std::string> with(const std::vector<std::string>& settings) {
  // Of the weakly compressible fluid, which follows sound and can be asked for too much.
  std::vector<std::string> words{"--set", "shot.fps=240",
                                 "--set", "fluid.solver=weakly_compressible",
                                 "--set", "fluid.sphere.0.velocity=[0, -1, 0]"};
  for (const std::string& setting : settings) words.insert(words.end(), {"--set", setting});
  return words;
}

struct BlowUp {
  int frame = 0;        // last whole one
  double time = 0;      // s
  std::string culprit;  // "particle" or "cloth vertex"
  std::string checkpoint;
};

/// The parts of the message; any other message fails the test.
BlowUp read_message(const std::string& text) {
  static const std::regex form(
      R"(blew up after frame (\d+), t = ([\d.]+) s, step \d+: (particle|cloth vertex) \d+ at )"
      R"(\([^)]*\) m has speed \S+ m/s\. [^;]*; last good checkpoint: (\S+)\. (?:Try|Cloth))");
  std::smatch part;
  if (!std::regex_search(text, part, form)) {
    ADD_FAILURE() << text;
    return {};
  }
  return {std::stoi(part[1]), std::stod(part[2]), part[3], part[4]};
}

/// Every listed file has its recorded bytes, nothing is unlisted, and no cache is later than
/// `last`.
void expect_only_whole_files(const TinyShot& shot, int last) {
  const Manifest manifest(shot.out() / layout::manifest);
  for (const auto& [file, record] : manifest.records()) {
    EXPECT_TRUE(has_recorded_digest(shot.out(), record)) << file;
    EXPECT_LE(record.frame, last) << file;
  }
  for (int frame = 1001; frame <= last; ++frame) {
    EXPECT_TRUE(manifest.find(layout::particles(frame))) << frame;
    EXPECT_TRUE(manifest.find(layout::cloth("flag", frame))) << frame;
  }
  EXPECT_EQ(unlisted_files(shot.out(), manifest), std::vector<std::string>{});
  const Ended verified =
      run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder());
  EXPECT_EQ(verified.code, 0) << verified.out << verified.err;
}

void expect_blow_up(const std::vector<std::string>& settings, const std::string& culprit) {
  const TinyShot shot(40);
  const Ended ended = shot.run("run", with(settings));
  EXPECT_EQ(ended.code, 1);
  const BlowUp blow_up = read_message(ended.err);
  EXPECT_EQ(blow_up.culprit, culprit);
  EXPECT_GE(blow_up.frame, 1011);  // so late that there is a checkpoint
  EXPECT_GT(blow_up.time, (blow_up.frame - 1001) / fps);
  EXPECT_LE(blow_up.time, (blow_up.frame + 1 - 1001) / fps + 1e-5);  // five digits are printed
  const int tenth = blow_up.frame - (blow_up.frame - 1001) % 10;     // one is due every ten frames
  EXPECT_EQ(blow_up.checkpoint, (shot.out() / layout::checkpoint(tenth)).string());
  expect_only_whole_files(shot, blow_up.frame);

  // Asked again it goes on from there, to the same end.
  const Ended again = shot.run("run", with(settings));
  EXPECT_EQ(again.code, 1);
  EXPECT_NE(again.err.find("continues from frame " + std::to_string(tenth)), std::string::npos);
  const BlowUp second = read_message(again.err);
  EXPECT_EQ(second.time, blow_up.time);
  EXPECT_EQ(second.checkpoint, blow_up.checkpoint);
  expect_only_whole_files(shot, blow_up.frame);
}

// The contact force of the published scheme, m (a - d) / dt^2 of a particle, on vertices that weigh
// a thousandth of one: 0.01 kg/m^2 x (0.05 m)^2 against 1000 kg/m^3 x (0.03 m)^3.
TEST(BlowUp, OfAFeatherSheetInThePublishedCouplingNamesTheVertex) {
  expect_blow_up({"coupling.scheme=paper", "cloth.flag.areal_density=0.01"}, "cloth vertex");
}

// Water too soft to be a fluid at its own speed: after falling for 0.07 s it passes twenty times
// its speed of sound, 1 m/s + 9.81 m/s^2 x 0.07 s = 20 x 0.085 m/s, still 8 cm above the sheet.
TEST(BlowUp, OfWaterTooSoftForItsSpeedNamesTheParticle) {
  expect_blow_up({"fluid.sound_speed=0.085", "cloth.flag.corner=[-0.15, 0.05, -0.15]"}, "particle");
}

// Without a checkpoint it says so; with the cause removed the same folder is finished.
TEST(BlowUp, BeforeTheFirstCheckpointIsReportedAndMended) {
  const TinyShot shot(15);
  const Ended ended = shot.run("run", with({"fluid.sound_speed=0.0525"}));  // 1.05 m/s after 5 ms
  EXPECT_EQ(ended.code, 1);
  const BlowUp blow_up = read_message(ended.err);
  EXPECT_EQ(blow_up.checkpoint, "none");
  EXPECT_LT(blow_up.frame, 1011);
  expect_only_whole_files(shot, blow_up.frame);
  const Ended mended = shot.run("run", with({}));
  EXPECT_EQ(mended.code, 0) << mended.err;
  EXPECT_EQ(run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder()).code, 0);
}

}  // namespace
}  // namespace drench

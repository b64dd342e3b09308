// The real program as a child process: what a user sees.
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/hash.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/output_folder.h"
#include "tests/driver/child.h"
#include "tests/driver/tiny_shot.h"
#include "tests/same_bits.h"

namespace drench {
namespace {

using namespace std::chrono_literals;
using namespace test;
namespace fs = std::filesystem;
using nlohmann::json;

constexpr int done = 0, user_error = 1, stopped = 75;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Ended drench(const std::vector<std::string>& words) {
  const TemporaryFolder folder;
  return run_program(DRENCH_PROGRAM, words, folder.path());
}

/// Steps in stats.jsonl: those that really ran.
std::map<std::string, int> steps_run(const fs::path& out) {
  std::map<std::string, int> steps;
  std::istringstream lines(text_of(out / layout::stats));
  for (std::string line; std::getline(lines, line);) {
    ++steps[json::parse(line).at("step").get<std::string>()];
  }
  return steps;
}

std::map<std::string, int> steps_run_by(const TinyShot& shot,
                                        const std::vector<std::string>& more = {}) {
  fs::remove(shot.out() / layout::stats);
  const Ended ended = shot.run("run", more);
  EXPECT_EQ(ended.code, done) << ended.err;
  if (!fs::exists(shot.out() / layout::stats)) return {};
  std::map<std::string, int> steps = steps_run(shot.out());
  EXPECT_EQ(steps["run"], 1);  // what made them
  steps.erase("run");
  return steps;
}

TEST(Program, ShowsOneExampleInTheHelpOfEachCommand) {
  for (const char* command : {"run", "simulate", "mesh", "render", "plan", "verify", "init",
                              "clean", "fabrics", "farm", "report", "view"}) {
    const Ended ended = drench({command, "--help"});
    EXPECT_EQ(ended.code, done) << command;
    const std::string example = "Example: drench " + std::string(command);
    EXPECT_TRUE(has(ended.out, example)) << ended.out;
  }
}

TEST(Program, ListsFabricsByLines) {
  const Ended ended = drench({"fabrics"});
  EXPECT_EQ(ended.code, done) << ended.err;
  std::istringstream lines(ended.out);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    EXPECT_EQ(std::count(line.begin(), line.end(), '\t'), 18) << line;
  EXPECT_EQ(count, 9);
  EXPECT_TRUE(has(ended.out, "fabric\tareal_density [kg/m2]\t")) << ended.out;
  const json all = json::parse(drench({"fabrics", "--json"}).out);
  EXPECT_EQ(all.at("fabrics").at("denim").at("areal_density"), 0.324);
}

TEST(Program, RefusesBadCommandLinesWithExitCode1) {
  const TinyShot shot;
  const std::string file = shot.file().string();
  const std::vector<std::vector<std::string>> bad{{},
                                                  {"fly"},
                                                  {"run"},
                                                  {"run", file, "extra"},
                                                  {"run", file, "--device", "tpu"},
                                                  {"run", file, "--threads", "0"},
                                                  {"run", file, "--threads", "many"},
                                                  {"run", file, "--memory", "-1"},
                                                  {"run", file, "--frames", "1009-1001"},
                                                  {"run", file, "--frames", "soon"},
                                                  {"run", file, "--frames", "1000"},
                                                  {"run", file, "--quality", "unheard"},
                                                  {"run", file, "--set", "fluid.spacin=0.02"},
                                                  {"run", file, "--set", "fluid.spacing=-1"},
                                                  {"run", file, "--set", "nothing"},
                                                  {"run", "no-such-shot.toml"},
                                                  {"verify", "/nowhere"},
                                                  {"clean", file, "--out", "/nowhere"}};
  for (const std::vector<std::string>& words : bad) {
    const Ended ended = drench(words);
    std::string line;
    for (const std::string& word : words) line += word + " ";
    EXPECT_EQ(ended.code, user_error) << line << ended.err;
    EXPECT_FALSE(ended.err.empty()) << line;
    EXPECT_FALSE(has(ended.err, "bug")) << line << ended.err;
  }
  EXPECT_FALSE(fs::exists(shot.out()));
}

TEST(Program, MakesEveryFileTheDesignNames) {
  const TinyShot shot;
  const Ended ended = shot.run("run");
  ASSERT_EQ(ended.code, done) << ended.err;
  std::vector<std::string> files{"manifest.jsonl", "stats.jsonl", "shot.lock.toml",
                                 "contact_sheet.png"};
  for (int frame = 1001; frame <= 1012; ++frame) {
    const std::string number = std::to_string(frame);
    for (const std::string& file :
         {"sim/particles." + number + ".vdb", "sim/cloth.flag." + number + ".ply",
          "mesh/fluid." + number + ".ply", "render/tiny." + number + ".exr"}) {
      files.push_back(file);
    }
  }
  for (const std::string& file : files) EXPECT_TRUE(fs::exists(shot.out() / file)) << file;
  const Ended verified =
      run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder());
  EXPECT_EQ(verified.code, done) << verified.out;
}

// PLY is what rendering reads: OBJ and VDB asked for later are made without it.
TEST(Program, WritesObjAndLevelSetOnRequestOnly) {
  const TinyShot shot(3);
  ASSERT_EQ(shot.run("run").code, done);
  EXPECT_FALSE(fs::exists(shot.out() / layout::fluid_obj(1001)));
  EXPECT_FALSE(fs::exists(shot.out() / layout::level_set(1001)));
  std::vector<std::string> asked{"--set", "surface.obj=true", "--set", "surface.level_set=true"};
  EXPECT_EQ(steps_run_by(shot, asked), (std::map<std::string, int>{{"mesh", 3}}));
  EXPECT_EQ(steps_run_by(shot, asked), (std::map<std::string, int>{}));
  const TriangleMesh ply = read_mesh(shot.out() / layout::fluid_mesh(1003));
  const TriangleMesh obj = read_mesh(shot.out() / layout::fluid_obj(1003));
  EXPECT_TRUE(same_bits(ply.position, obj.position) && same_bits(ply.triangle, obj.triangle));
  const auto digests = shot.digests();
  for (const std::string& file : {layout::fluid_obj(1002), layout::level_set(1002)}) {
    flip_bit_quietly(shot.out() / file);
    EXPECT_EQ(run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder()).code,
              user_error);
    std::vector<std::string> verifying = asked;
    verifying.push_back("--verify");
    EXPECT_EQ(steps_run_by(shot, verifying),
              (std::map<std::string, int>{{"mesh", 1}, {"warning", 1}}))
        << file;
  }
  EXPECT_EQ(shot.digests(), digests);
  fs::remove_all(shot.out());
  asked.insert(asked.end(), {"--threads", "1"});
  ASSERT_EQ(shot.run("run", asked).code, done);
  EXPECT_EQ(shot.digests(), digests);
}

TEST(Program, SaysThatASecondRunHasNothingToDo) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  const std::string manifest = text_of(shot.out() / layout::manifest);
  const Ended ended = shot.run("run");
  EXPECT_EQ(ended.code, done);
  EXPECT_TRUE(has(ended.err, "nothing to do")) << ended.err;
  EXPECT_EQ(text_of(shot.out() / layout::manifest), manifest);
}

TEST(Program, PlansWithoutWriting) {
  const TinyShot shot;
  const Ended ended = shot.run("plan", {"--json"});
  EXPECT_EQ(ended.code, done) << ended.err;
  EXPECT_EQ(json::parse(ended.out)["tasks"].size(), 3 * 12u + 2);
  EXPECT_FALSE(fs::exists(shot.out()));
}

TEST(Program, RendersOnlyAfterACameraEdit) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  const Ended plan = shot.run("plan", {"--set", "camera.fov_deg=30"});
  EXPECT_TRUE(has(plan.out, "camera changed")) << plan.out;
  const auto steps = steps_run_by(shot, {"--set", "camera.fov_deg=30"});
  EXPECT_EQ(steps.count("simulate"), 0u);
  EXPECT_EQ(steps.count("mesh"), 0u);
  EXPECT_EQ(steps.at("render"), 12);
}

TEST(Program, NamesWhatAPlanSkipsAndWhy) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  EXPECT_TRUE(has(shot.run("plan").out, "key unchanged"));
  EXPECT_TRUE(has(shot.run("plan", {"--set", "fluid.spacing=0.04"}).out, "fluid changed"));
  EXPECT_TRUE(has(shot.run("plan", {"--set", "surface.smoothing=3"}).out, "surface changed"));
  std::string text = text_of(shot.file());
  const size_t from = text.find("[fluid]"), to = text.find("[[cloth]]");
  text.erase(from, to - from);
  const size_t probes = text.find("[[probe]]"), rest = text.find("[surface]");
  put_text(shot.file(), text.erase(probes, rest - probes));
  EXPECT_TRUE(has(shot.run("plan").out, "no fluid"));
}

// Stage by stage or all at once, for one core or two: the same files.
TEST(Program, GivesTheSameFilesStageByStageAndForAnyThreads) {
  const auto& expected = undisturbed_digests();
  const TinyShot staged;
  EXPECT_EQ(staged.run("mesh").code, user_error) << "meshed without caches";
  for (const char* command : {"simulate", "mesh", "render"}) {
    const Ended ended = staged.run(command, {"--threads", "1"});
    EXPECT_EQ(ended.code, done) << ended.err;
  }
  EXPECT_EQ(staged.digests(), expected);
  const TinyShot together;
  EXPECT_EQ(together.run("run", {"--threads", "3"}).code, done);
  EXPECT_EQ(together.digests(), expected);
}

TEST(Program, ContinuesALongerRangeFromTheLastCheckpoint) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  put_text(shot.file(),
           std::string(text_of(shot.file())).replace(text_of(shot.file()).find("1012"), 4, "1015"));
  EXPECT_EQ(steps_run_by(shot).at("simulate"), 3);
  auto digests = shot.digests(), expected = undisturbed_digests(15);
  // The shorter run kept a checkpoint at its own last frame.
  digests.erase(layout::checkpoint(1012));
  EXPECT_EQ(digests, expected);
}

TEST(Program, MakesOneMissingFileAlone) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  fs::remove(shot.out() / layout::image("tiny", 1005));
  EXPECT_EQ(steps_run_by(shot), (std::map<std::string, int>{{"render", 1}}));
  fs::remove(shot.out() / layout::fluid_mesh(1006));
  EXPECT_EQ(steps_run_by(shot), (std::map<std::string, int>{{"mesh", 1}}));
  EXPECT_EQ(shot.digests(), undisturbed_digests());
}

// A quietly flipped bit: verify finds it by digest and a run that verifies makes the file again.
TEST(Program, DetectsAndRebuildsADamagedCache) {
  for (const std::string& file :
       {layout::particles(1007), layout::cloth("flag", 1003), layout::fluid_mesh(1004),
        layout::image("tiny", 1009), layout::probe("gauge")}) {
    const TinyShot shot;
    ASSERT_EQ(shot.run("run").code, done);
    flip_bit_quietly(shot.out() / file);
    const Ended verified =
        run_program(DRENCH_PROGRAM, {"verify", shot.out().string(), "--json"}, shot.folder());
    EXPECT_EQ(verified.code, user_error);
    EXPECT_EQ(json::parse(verified.out)["bad"], json::array({file}));
    EXPECT_EQ(shot.run("run", {"--verify"}).code, done);
    EXPECT_EQ(shot.digests(), undisturbed_digests()) << file;
  }
}

// Without verify: the stage that reads the damaged file finds it.
TEST(Program, NeverRendersADamagedMesh) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  flip_bit_quietly(shot.out() / layout::fluid_mesh(1004));
  const auto steps = steps_run_by(shot, {"--set", "render.seed=2"});
  EXPECT_EQ(steps.at("mesh"), 1);
  EXPECT_EQ(steps.at("render"), 12);
  const Ended ended = shot.run("run");  // back to the first seed
  EXPECT_EQ(ended.code, done);
  EXPECT_EQ(shot.digests(), undisturbed_digests());
}

TEST(Program, RefusesASecondDriverAndSaysWho) {
  const TinyShot shot;
  const FolderLock lock(shot.out());
  const Ended ended = shot.run("run");
  EXPECT_EQ(ended.code, user_error);
  EXPECT_TRUE(has(ended.err, std::to_string(::getpid()))) << ended.err;
}

// Twelve drivers start at once: one works, the others say so or find everything done.
TEST(Program, SurvivesManyDriversAtOnce) {
  const TinyShot shot;
  std::vector<std::unique_ptr<Child>> drivers;
  for (int k = 0; k < 12; ++k) {
    drivers.push_back(std::make_unique<Child>(DRENCH_PROGRAM, shot.words("run"), shot.folder()));
  }
  int finished = 0;
  for (const auto& driver : drivers) {
    const Ended ended = driver->wait();
    EXPECT_TRUE(ended.code == done || ended.code == user_error) << ended.err;
    finished += ended.code == done;
  }
  EXPECT_GE(finished, 1);
  EXPECT_EQ(shot.digests(), undisturbed_digests());
}

TEST(Program, NamesAnOutputFolderItCannotWrite) {
  const TinyShot shot;
  put_text(shot.folder() / "file", "x");
  std::vector<fs::path> folders{shot.folder() / "file" / "out", "/proc/drench"};
  if (::geteuid() != 0) {  // permissions do not bind root
    fs::create_directory(shot.folder() / "closed");
    ::chmod((shot.folder() / "closed").c_str(), 0500);
    folders.push_back(shot.folder() / "closed");
  }
  for (const fs::path& folder : folders) {
    const Ended ended = run_program(
        DRENCH_PROGRAM, {"run", shot.file().string(), "--out", folder.string()}, shot.folder());
    EXPECT_EQ(ended.code, user_error);
    EXPECT_TRUE(has(ended.err, folder.string())) << ended.err;
  }
}

TEST(Program, ReportsFramesBeyondAShortenedRangeAndCleansThem) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  put_text(shot.file(),
           std::string(text_of(shot.file())).replace(text_of(shot.file()).find("1012"), 4, "1008"));
  const Ended ended = shot.run("run");
  EXPECT_TRUE(has(ended.err, "drench clean")) << ended.err;
  EXPECT_TRUE(fs::exists(shot.out() / layout::image("tiny", 1010)));
  const std::vector<fs::path> in_work{shot.out() / layout::frame_samples("tiny", 1010),
                                      shot.out() / layout::refining("tiny", 1010)};
  for (const fs::path& file : in_work) put_text(file, "of a stopped frame");
  EXPECT_EQ(shot.run("clean").code, done);
  for (const fs::path& file : in_work) EXPECT_FALSE(fs::exists(file)) << file;
  EXPECT_FALSE(fs::exists(shot.out() / layout::image("tiny", 1009)));
  EXPECT_FALSE(fs::exists(shot.out() / layout::particles(1012)));
  EXPECT_TRUE(fs::exists(shot.out() / layout::image("tiny", 1008)));
  EXPECT_EQ(run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder()).code, done);
}

// The caches of the simulation stay; what is meshed against the sheet and the picture of it do not.
TEST(Program, SubdividesSheetsAfterTheSimulation) {
  const TinyShot shot(3);
  ASSERT_EQ(shot.run("run").code, done);
  const auto smooth = shot.digests();
  const Ended flat = shot.run("run", {"--set", "cloth.0.subdivision=0"});
  ASSERT_EQ(flat.code, done) << flat.err;
  const auto now = shot.digests();
  for (const auto& [file, digest] : smooth) {
    if (file.rfind("sim/", 0) == 0) EXPECT_EQ(now.at(file), digest) << file;
    if (file.rfind("render/", 0) == 0) EXPECT_NE(now.at(file), digest) << file;
  }
  EXPECT_EQ(flat.err.find("sim frame="), std::string::npos) << flat.err;
}

TEST(Program, WritesAStartingShotAndNeverOverOne) {
  const TemporaryFolder folder;
  const std::string name = (folder.path() / "rain").string();
  for (const std::vector<std::string>& options : {std::vector<std::string>{}, {"--reference"}}) {
    fs::remove(name + ".toml");
    std::vector<std::string> words{"init", name};
    words.insert(words.end(), options.begin(), options.end());
    EXPECT_EQ(run_program(DRENCH_PROGRAM, words, folder.path()).code, done);
    const Ended plan = run_program(DRENCH_PROGRAM, {"plan", name + ".toml"}, folder.path());
    EXPECT_EQ(plan.code, done) << plan.err;
    EXPECT_EQ(has(text_of(name + ".toml"), "[[fluid.emitter]]"), !options.empty());
  }
  put_text(name + ".toml", "mine");
  EXPECT_EQ(run_program(DRENCH_PROGRAM, {"init", name}, folder.path()).code, user_error);
  EXPECT_EQ(text_of(name + ".toml"), "mine");
}

// The header's attributes are plain text in the file; nothing in it depends on the time.
TEST(Program, WritesItsProvenanceIntoEveryImage) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, done);
  const std::string header = text_of(shot.out() / layout::image("tiny", 1003)).substr(0, 4096);
  for (const char* name : {"shot", "frame", "seed", "samples", "photons", "version", "key.render",
                           "key.mesh/fluid.1003.ply", "key.sim/cloth.flag.1003.ply"}) {
    EXPECT_TRUE(has(header, std::string(name) + '\0' + "string")) << name;
  }
}

// Asked to stop, it ends within ten seconds with a checkpoint; continuing gives the same bits.
TEST(Program, StopsOnRequestWithinTenSecondsAndContinues) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const TinyShot shot(30);
    Child child(DRENCH_PROGRAM, shot.words("run"), shot.folder());
    while (child.running() && !fs::exists(shot.out() / layout::particles(1004))) {
      std::this_thread::sleep_for(1ms);
    }
    const auto start = std::chrono::steady_clock::now();
    child.send(signal);
    const Ended ended = child.wait();
    EXPECT_LT(std::chrono::steady_clock::now() - start, 10s);
    EXPECT_EQ(ended.code, stopped) << ended.err;
    EXPECT_TRUE(fs::exists(shot.out() / layout::stop_checkpoint));
    EXPECT_EQ(shot.run("run").code, done);
    EXPECT_EQ(shot.digests(), undisturbed_digests(30));
  }
}

// The picture of a frame in work changes while the frame is rendered, and is whole whenever read.
TEST(Program, ShowsFramesAsTheyRefine) {
  const TinyShot shot, plain;
  const std::vector<std::string> one{"--frames", "1003", "--set", "render.samples=64"};
  ASSERT_EQ(plain.run("run", one).code, done);
  ASSERT_EQ(shot.run("simulate", one).code, done);
  ASSERT_EQ(shot.run("mesh", one).code, done);
  std::vector<std::string> words = shot.words("render", one);
  words.push_back("--progressive");
  Child child(DRENCH_PROGRAM, words, shot.folder());
  std::set<std::string> pictures;
  const fs::path file = shot.out() / layout::refining("tiny", 1003);
  const auto look = [&] {
    if (const std::string bytes = text_of(file); !bytes.empty()) pictures.insert(bytes);
  };
  while (child.running()) look();
  look();
  EXPECT_EQ(child.wait().code, done);
  EXPECT_GE(pictures.size(), 3u);
  for (const std::string& bytes : pictures) {
    EXPECT_TRUE(bytes.starts_with("\x89PNG")) << bytes.size();
    EXPECT_TRUE(bytes.ends_with("IEND\xae\x42\x60\x82")) << bytes.size();
  }
  EXPECT_EQ(hash_file(shot.out() / layout::image("tiny", 1003)),
            hash_file(plain.out() / layout::image("tiny", 1003)));
  const Ended checked = run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder());
  EXPECT_EQ(checked.code, done) << checked.err;
}

// Stopped within a frame, it keeps the frame's samples; continuing gives the same bits.
TEST(Program, ContinuesWithinAFrame) {
  const std::vector<std::string> long_frame{"--frames",  "1003", "--set", "render.samples=8192",
                                            "--threads", "1"};
  const TinyShot undisturbed, shot;
  ASSERT_EQ(undisturbed.run("run", long_frame).code, done);
  const fs::path samples = shot.out() / layout::frame_samples("tiny", 1003);
  // Before its first samples a frame leaves none: on a busy machine half a second may be too short.
  for (auto wait = 500ms; !fs::exists(samples) && wait < 60s; wait *= 4) {
    Child child(DRENCH_PROGRAM, shot.words("run", long_frame), shot.folder());
    while (child.running() && !fs::exists(shot.out() / layout::fluid_mesh(1003))) {
      std::this_thread::sleep_for(1ms);
    }
    std::this_thread::sleep_for(wait);
    child.send(SIGTERM);
    const Ended ended = child.wait();
    ASSERT_EQ(ended.code, stopped) << ended.err;
  }
  EXPECT_TRUE(fs::exists(samples));
  EXPECT_EQ(shot.run("run", long_frame).code, done);
  EXPECT_FALSE(fs::exists(samples));
  EXPECT_EQ(hash_file(shot.out() / layout::image("tiny", 1003)),
            hash_file(undisturbed.out() / layout::image("tiny", 1003)));
}

// A pre-roll of 1000 s is stopped like any frame: nothing is written of the first one.
TEST(Program, StopsInThePreroll) {
  const TinyShot shot;
  Child child(DRENCH_PROGRAM, shot.words("run", {"--set", "shot.preroll=1000"}), shot.folder());
  while (child.running() && !has(child.err_so_far(), "pre-roll")) std::this_thread::sleep_for(1ms);
  child.send(SIGINT);
  const Ended ended = child.wait();
  EXPECT_EQ(ended.code, stopped) << ended.err;
  EXPECT_TRUE(has(ended.err, "pre-roll of 1000 s")) << ended.err;
  EXPECT_FALSE(fs::exists(shot.out() / layout::particles(1001)));
}

// A run that continues from a checkpoint has the pre-roll behind it.
TEST(Program, RunsThePrerollOnce) {
  const std::vector<std::string> preroll{"--set", "shot.preroll=0.1"};
  const TinyShot shot;
  const Ended first = shot.run("run", preroll);
  EXPECT_EQ(first.code, done) << first.err;
  EXPECT_TRUE(has(first.err, "pre-roll of 0.1 s")) << first.err;
  const auto expected = shot.digests();
  EXPECT_NE(expected, undisturbed_digests());
  fs::remove(shot.out() / layout::particles(1012));
  const Ended second = shot.run("run", preroll);
  EXPECT_EQ(second.code, done) << second.err;
  EXPECT_FALSE(has(second.err, "pre-roll")) << second.err;
  EXPECT_EQ(shot.digests(), expected);
}

/// What the picture of a frame says of itself; empty where it says nothing.
std::string header_of(const TinyShot& shot, int frame, const char* key) {
  const Imf::InputFile file((shot.out() / layout::image("tiny", frame)).c_str());
  const auto* text = file.header().findTypedAttribute<Imf::StringAttribute>(key);
  return text ? text->value() : "";
}

json stats_of(const TinyShot& shot, const std::string& step, int frame) {
  std::istringstream lines(text_of(shot.out() / layout::stats));
  json last;
  for (std::string line; std::getline(lines, line);) {
    const json entry = json::parse(line);
    if (entry.at("step") == step && entry.at("frame") == frame) last = entry;
  }
  return last;
}

// The header to its three digits, and only of what there is.
TEST(Program, TellsTheErrorAndThePhotonsBlurOfAFrame) {
  const TinyShot shot(2);
  put_text(shot.file(), text_of(shot.file()) + R"(
[[light]]
type = "sphere"
center = [0.2, 0.8, 0.2]
radius = 0.05
radiance = [20, 20, 20]
)");
  const Ended aimed =
      shot.run("run", {"--set", "render.samples=1024", "--set", "render.error=0.01"});
  ASSERT_EQ(aimed.code, done) << aimed.err;
  for (const int frame : {1001, 1002}) {
    const json stats = stats_of(shot, "render", frame);
    const double error = stats.at("relative_mse"), blur = stats.at("photon_radius");
    EXPECT_GT(error, 0.001) << "far more samples than asked for";
    EXPECT_LE(error, 0.0105);
    EXPECT_GT(blur, 1e-4);
    EXPECT_LT(blur, 0.08) << "m; wider than the ball of water";
    EXPECT_NEAR(std::stod(header_of(shot, frame, "relative_mse")), error, 0.005 * error);
    EXPECT_NEAR(std::stod(header_of(shot, frame, "photon_radius_m")), blur, 0.005 * blur);
  }
  ASSERT_EQ(shot.run("run", {"--set", "render.photons=0"}).code, done);
  EXPECT_EQ(header_of(shot, 1001, "relative_mse") + header_of(shot, 1001, "photon_radius_m"), "");
  EXPECT_EQ(stats_of(shot, "render", 1001).at("photon_radius"), 0);
}

}  // namespace
}  // namespace drench

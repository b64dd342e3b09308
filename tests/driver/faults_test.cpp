// Every kind of file a run writes, with its writes, syncs, closes and renames failing: the run says
// so, nothing cut is recorded, and the next run ends with the bits of one that was not disturbed.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <random>
#include <sstream>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/movie.h"
#include "pipeline/driver/mp4_check.h"
#include "pipeline/driver/output_folder.h"
#include "render/renderer.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;
namespace fs = std::filesystem;

constexpr int frames = 3;

/// A shot that writes every kind of file. Frames wide enough for more than one block of lines.
class EveryKind {
 public:
  EveryKind() : shot_(frames) {
    put_text(shot_.file(), with_every_kind_of_file(text_of(shot_.file())));
  }

  Ended run(const std::vector<std::string>& environment = {}) const {
    std::vector<std::string> words = shot_.words(
        "run", {"--set", "surface.obj=true", "--set", "surface.level_set=true", "--quiet"});
    return run_program(environment.empty() ? DRENCH_PROGRAM : DRENCH_FAULT_PROGRAM, words,
                       shot_.folder(), environment);
  }
  const TinyShot& shot() const { return shot_; }

 private:
  TinyShot shot_;
};

const std::map<std::string, std::string>& undisturbed() {
  static const std::map<std::string, std::string> digests = [] {
    const EveryKind whole;
    const Ended ended = whole.run();
    EXPECT_EQ(ended.code, 0) << ended.err;
    return whole.shot().digests();
  }();
  return digests;
}

/// Calls in an undisturbed run, "write.exr": 12.
std::map<std::string, int> calls_of_a_run() {
  const EveryKind whole;
  const fs::path counts = whole.shot().folder() / "counts";
  EXPECT_EQ(whole.run({"DRENCH_FAULT=count:" + counts.string()}).code, 0);
  std::map<std::string, int> calls;
  std::istringstream lines(text_of(counts));
  for (std::string name; lines >> name;) lines >> calls[name];
  return calls;
}

void expect_whole(const EveryKind& run, const std::string& what) {
  const Manifest manifest(run.shot().out() / layout::manifest);
  for (const auto& [file, record] : manifest.records())
    EXPECT_TRUE(has_recorded_digest(run.shot().out(), record)) << what << ' ' << file;
  const Ended ended = run.run();
  ASSERT_EQ(ended.code, 0) << what << ": " << ended.err;
  EXPECT_EQ(run.shot().digests(), undisturbed()) << what;
  const Manifest after(run.shot().out() / layout::manifest);
  EXPECT_EQ(unlisted_files(run.shot().out(), after), std::vector<std::string>{}) << what;
}

void expect_fault_is_reported(const std::string& fault, const std::string& kind,
                              const std::vector<std::string>& environment = {}) {
  const EveryKind run;
  std::vector<std::string> all{"DRENCH_FAULT=" + fault + ":" + kind};
  all.insert(all.end(), environment.begin(), environment.end());
  const Ended ended = run.run(all);
  EXPECT_EQ(ended.code, 1) << fault << ' ' << kind << ": " << ended.err;
  EXPECT_NE(ended.err.find(kind), std::string::npos) << fault << ' ' << kind << ": " << ended.err;
  expect_whole(run, fault + ":" + kind);
}

class OfAKind : public testing::TestWithParam<const char*> {};

// Writes at both ends of what a run writes, the others once; a write that comes back short is
// followed by none that works.
TEST_P(OfAKind, FaultsOfTheDiskLoseNothing) {
  static const std::map<std::string, int> calls = calls_of_a_run();
  const std::string file = GetParam(), kind = file.substr(file.find_first_not_of('.'));
  const auto last = [&](const std::string& call) {
    const auto count = calls.find(call + "." + kind);
    EXPECT_NE(count, calls.end()) << call << " is not seen: the test would prove nothing";
    return count == calls.end() ? 1 : count->second;
  };
  const std::string at_last = std::to_string(last("write"));
  for (const std::string& fault :
       {std::string("fail:write:1"), "fail:write:" + at_last, "short:write:" + at_last})
    expect_fault_is_reported(fault, file);
  if (kind == "stats.jsonl") return expect_fault_is_reported("fail:close:1", file);
  // Of the manifest every line is synced: what closing says comes too late to matter.
  if (kind == "manifest.jsonl") return expect_fault_is_reported("fail:fdatasync:2", file);
  for (const std::string& fault : {std::string("fail:fsync:1"), std::string("fail:close:1"),
                                   "fail:rename:" + std::to_string(last("rename"))})
    expect_fault_is_reported(fault, file);
}

INSTANTIATE_TEST_SUITE_P(Faults, OfAKind,
                         testing::Values(".exr", ".vdb", ".ply", ".obj", ".png", ".csv", ".ckpt",
                                         ".toml", "manifest.jsonl", "stats.jsonl"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase(name, '.');
                           return name;
                         });

/// A folder that holds an ffmpeg with the faults loaded before it.
std::string path_with_faulty_ffmpeg(const fs::path& folder) {
  const fs::path script = folder / "faulty" / "ffmpeg";
  put_text(script, "#!/bin/sh\nLD_PRELOAD=" DRENCH_FAULT_LIBRARY " exec " +
                       find_ffmpeg()->string() + " \"$@\"\n");
  ::chmod(script.c_str(), 0700);
  return "PATH=" + script.parent_path().string() + ":" + std::getenv("PATH");
}

// What ffmpeg itself writes: it ends well although its last writes failed.
TEST(Faults, OfTheEncodersDiskLoseNothing) {
  if (!find_ffmpeg()) GTEST_SKIP() << "needs ffmpeg";
  const TemporaryFolder folder;
  const std::string path = path_with_faulty_ffmpeg(folder.path());
  for (const std::string fault : {"fail:write:1", "fail:write:2", "fail:write:3", "short:write:1",
                                  "short:write:2", "fail:rename:1", "fail:fsync:1"})
    expect_fault_is_reported(fault, ".mp4", {path});
}

// Any end but the right one, and any number of pictures but the right one.
TEST(Mp4Check, FindsEveryCut) {
  if (!find_ffmpeg()) GTEST_SKIP() << "needs ffmpeg";
  const EveryKind whole;
  ASSERT_EQ(whole.run().code, 0);
  const std::string movie = text_of(whole.shot().out() / "tiny.mp4");
  const fs::path cut = whole.shot().folder() / "cut.mp4";
  ASSERT_GT(movie.size(), 200u);
  put_text(cut, movie);
  EXPECT_EQ(why_not_whole_mp4(cut, frames), "");
  EXPECT_NE(why_not_whole_mp4(cut, frames + 1), "");
  for (size_t size = 0; size < movie.size(); size += size < 64 ? 1 : 17) {
    write_quickly(cut, movie.substr(0, size));
    EXPECT_NE(why_not_whole_mp4(cut, frames), "") << size;
  }
  write_quickly(cut, movie.substr(0, movie.size() - 1));
  EXPECT_NE(why_not_whole_mp4(cut, frames), "");
}

// The kernel's own limit falls into the last bytes, which OpenEXR writes while it closes a file.
TEST(Faults, ALimitWithinTheLastBytesOfAnExrIsReported) {
  const TemporaryFolder folder;
  constexpr int width = 300, height = 200;
  render::Film film{width, height, std::vector<float>(4 * width * height)};
  std::mt19937 random(5);  // noise, which no codec makes small
  for (float& value : film.rgba) value = float(random() % 1000) / 1000;
  const uint64_t size = render::write_exr(folder / "whole.exr", film, {}).size;
  for (const uint64_t missing : {1u, 100u, 1000u, 9000u}) {
    const pid_t child = ::fork();
    if (child == 0) {
      const rlimit limit{size - missing, size - missing};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      ::signal(SIGXFSZ, SIG_IGN);
      int code = 1;
      try {
        render::write_exr(folder / "cut.exr", film, {});
      } catch (const Error&) {
        code = 0;
      }
      ::_exit(code);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << missing << " bytes are missing";
    EXPECT_FALSE(fs::exists(folder / "cut.exr")) << missing;
  }
}

}  // namespace
}  // namespace drench

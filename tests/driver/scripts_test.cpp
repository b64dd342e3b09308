// The scripts at the root: what they share is tested without installing anything.
#include <gtest/gtest.h>

#include "tests/driver/child.h"
#include "tests/driver/folder.h"

namespace drench {
namespace {

using namespace test;
const std::string root = DRENCH_SOURCE_DIR;

Ended bash(const std::string& text) {
  const TemporaryFolder folder;
  return run_program("/bin/bash", {"-c", "set -euo pipefail; root='" + root + "'; " + text},
                     folder.path());
}

TEST(Scripts, AreValidBashAndExecutable) {
  for (const char* name : {"run", "test", "bench", ".ci/run", "tests/blender/run"}) {
    EXPECT_EQ(bash("bash -n \"$root/" + std::string(name) + "\"").code, 0) << name;
    EXPECT_EQ(bash("test -x \"$root/" + std::string(name) + "\"").code, 0) << name;
  }
}

// This program was built, so every package it needs is there and nothing is to be installed.
TEST(Scripts, FindNothingMissingWhereTheBuildWorked) {
  const Ended ended = bash("source \"$root/cmake/setup.sh\"; drench_missing_packages");
  EXPECT_EQ(ended.code, 0) << ended.err;
  std::string missing = ended.out;
  if (missing == "ffmpeg\n") missing.clear();  // optional, and no test was built with it
  EXPECT_EQ(missing, "");
}

TEST(Scripts, NameAPackageWhoseFileIsMissing) {
  const Ended ended = bash(
      "source \"$root/cmake/setup.sh\"; "
      "drench_packages=('there:/bin/bash' 'one-of-two:/no/such /bin/bash' 'gone:/no/such'); "
      "drench_missing_packages");
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(ended.out, "gone\n");
}

// Without root, sudo and apt-get the script says what to install instead of failing half-way.
TEST(Scripts, SayWhatToInstallWhenTheyCannot) {
  const Ended ended = bash(
      "source \"$root/cmake/setup.sh\"; drench_packages=('gone:/no/such'); "
      "command() { return 1; }; drench_install");
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("gone"), std::string::npos) << ended.err;
}

// What cmake is called with, of a build that was configured with `before` or not yet.
std::string configured(const std::string& before, const std::string& wish) {
  const Ended ended = bash(
      "source '" + root +
      "/cmake/setup.sh'; root=$(mktemp -d); cd \"$root\"; trap 'rm -r \"$root\"' EXIT; "
      "mkdir build; before='" +
      before + "'; " +
      "if [[ -n $before ]]; then echo DRENCH_CUDA:STRING=$before > build/CMakeCache.txt; "
      "touch build/build.ninja; fi; "
      "cmake() { if [[ $1 == --preset ]]; then echo \"${@:5}\" > called; fi; }; touch called; " +
      wish + " drench_build drench; cat called");
  EXPECT_EQ(ended.code, 0) << ended.err;
  return ended.out;
}

// The CUDA simulator is left out by `./run` where no device is, and brought back by what needs it.
TEST(Scripts, BuildTheCudaSimulatorWhereItIsOfUse) {
  const std::string run = "drench_cuda=OFF;", test = "", forced = "DRENCH_CUDA=ON;";
  EXPECT_EQ(configured("", run), "-DDRENCH_CUDA=OFF\n");
  EXPECT_EQ(configured("", test), "-DDRENCH_CUDA=AUTO\n");
  EXPECT_EQ(configured("OFF", run), "");
  EXPECT_EQ(configured("OFF", test), "-DDRENCH_CUDA=AUTO\n");
  EXPECT_EQ(configured("AUTO", run), "");
  EXPECT_EQ(configured("AUTO", test), "");
  EXPECT_EQ(configured("OFF", forced), "-DDRENCH_CUDA=ON\n");
  EXPECT_EQ(configured("ON", run + forced), "");
}

TEST(Scripts, ExplainThemselvesWithoutAShot) {
  const Ended ended = bash("\"$root/run\"");
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("./run shots/"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace drench

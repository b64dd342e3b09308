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
  for (const char* name :
       {"run", "test", "bench", ".ci/run", "tests/blender/run", "tests/gpu/emulated",
        "tests/gpu/emulator/selftest/run", "tests/gpu/gather", "tests/tidy/run"}) {
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

/// drench_install with one package missing; apt-get and sudo are scripts that say what they are
/// called with, and make the missing file. `setup` goes before it.
Ended installing(const std::string& setup) {
  return bash(R"(
    source "$root/cmake/setup.sh"
    folder=$(mktemp -d); trap 'rm -r "$folder"' EXIT
    drench_packages=("gone:$folder/file")
    printf '#!/bin/sh\necho apt-get "$@"; touch %s\n' "$folder/file" > "$folder/apt-get"
    printf '#!/bin/sh\n"$@"\n' > "$folder/sudo"
    chmod +x "$folder"/*; PATH=$folder:$PATH
    )" + setup +
              "\ndrench_install");
}

TEST(Scripts, InstallWithoutAskingWhereNobodyIsThereToAnswer) {
  const Ended ended = installing("");
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_NE(ended.err.find("apt-get install -y"), std::string::npos) << ended.err;
  EXPECT_EQ(ended.err.find("[y/N]"), std::string::npos) << ended.err;
}

TEST(Scripts, AskOnATerminalBeforeTheyInstall) {
  const std::string terminal = "drench_on_terminal() { return 0; };";
  for (const char* answer : {"y", "yes", "Y"}) {
    const Ended ended = installing(terminal + "exec < <(echo " + answer + ");");
    EXPECT_EQ(ended.code, 0) << answer << ended.err;
    EXPECT_NE(ended.err.find("missing: gone\nInstall these packages"), std::string::npos)
        << ended.err;
    EXPECT_NE(ended.err.find("apt-get install -y"), std::string::npos) << ended.err;
  }
  for (const char* answer : {"echo n", "echo", "true"}) {  // no, the default, and an end of input
    const Ended ended = installing(terminal + "exec < <(" + answer + ");");
    EXPECT_EQ(ended.code, 1) << answer;
    EXPECT_EQ(ended.err.find("apt-get install -y"), std::string::npos) << ended.err;
    EXPECT_NE(ended.err.find("By hand: apt-get install gone"), std::string::npos) << ended.err;
  }
  const Ended yes = installing(terminal + "drench_yes=yes;");
  EXPECT_EQ(yes.code, 0) << yes.err;
  EXPECT_EQ(yes.err.find("[y/N]"), std::string::npos) << yes.err;
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
  const std::string run = "drench_cuda=OFF;", test, forced = "DRENCH_CUDA=ON;";
  EXPECT_EQ(configured("", run), "-DDRENCH_CUDA=OFF\n");
  EXPECT_EQ(configured("", test), "-DDRENCH_CUDA=AUTO\n");
  EXPECT_EQ(configured("OFF", run), "");
  EXPECT_EQ(configured("OFF", test), "-DDRENCH_CUDA=AUTO\n");
  EXPECT_EQ(configured("AUTO", run), "");
  EXPECT_EQ(configured("AUTO", test), "");
  EXPECT_EQ(configured("OFF", forced), "-DDRENCH_CUDA=ON\n");
  EXPECT_EQ(configured("ON", run + forced), "");
}

TEST(Scripts, SayHowTheyAreUsed) {
  for (const char* name : {"run", "test", "bench"}) {
    for (const char* option : {"-h", "--help"}) {
      const Ended ended = bash("\"$root/" + std::string(name) + "\" " + option);
      EXPECT_EQ(ended.code, 0) << name << ended.err;
      EXPECT_EQ(ended.out.find("usage: ./" + std::string(name)), 0u) << ended.out;
      EXPECT_NE(ended.out.find("--yes"), std::string::npos) << ended.out;
    }
  }
}

/// What a script hands on: a copy of it whose setup and programs say what they are called with.
std::string handed_on(const std::string& script) {
  const Ended ended = bash(R"(
    folder=$(mktemp -d); trap 'rm -r "$folder"' EXIT
    cd "$folder"; mkdir -p cmake build/bin; cp "$root"/{run,test} .
    printf '#!/bin/sh\necho "$@"\n' | tee ctest > build/bin/drench
    chmod +x ctest build/bin/drench; PATH=$folder:$PATH
    echo 'drench_install() { echo yes=${drench_yes:-no}; }
          drench_build() { :; }
          drench_try_optional() { :; }
          drench_has_device() { :; }
          nproc() { echo 3; }
          awk() { echo 8; }' > cmake/setup.sh
    )" + script + R"( | sed "s|$folder/||g")");
  EXPECT_EQ(ended.code, 0) << ended.err;
  return ended.out;
}

TEST(Scripts, HandOnWhatIsNotTheirs) {
  const std::string all = "--test-dir build --output-on-failure -j3";
  EXPECT_EQ(handed_on("./test"), "yes=no\n" + all + "\n");
  EXPECT_EQ(handed_on("./test -R cloth --quick --yes"),
            "yes=yes\n" + all + " -R cloth -L ^quick$\n");
  EXPECT_EQ(handed_on("./run a.toml"), "yes=no\nrun --quality preview a.toml\n");
  EXPECT_EQ(handed_on("./run --yes a.toml --quality final --frames 1"),
            "yes=yes\nrun a.toml --quality final --frames 1\n");
}

TEST(Scripts, ExplainThemselvesWithoutAShot) {
  const Ended ended = bash("\"$root/run\"");
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("./run shots/"), std::string::npos) << ended.err;
}

// What ./bench --record calls the state of the code: pages and rows do not change it, code does.
TEST(Scripts, NameTheLastCommitToTheCode) {
  const Ended ended = bash(R"sh(
    source "$root/cmake/setup.sh"
    root=$(mktemp -d); trap 'rm -r "$root"' EXIT
    git() { command git -c user.name=a -c user.email=a@a.example "$@"; }
    commit() { git -C "$root" add .; git -C "$root" commit -q -m "$1"; }
    git init -q "$root"; mkdir "$root/docs"
    echo 1 > "$root/code"; commit code; first=$(git -C "$root" log -1 --abbrev=7 --format=%h)
    echo 1 > "$root/docs/page"; echo 1 > "$root/README.md"; commit docs
    echo 2 > "$root/docs/page"; [[ $(drench_code_commit) == "$first" ]] || echo docs
    echo 2 > "$root/code"; [[ $(drench_code_commit) == "$first+" ]] || echo changed
    commit code; [[ $(drench_code_commit) == "$(git -C "$root" log -1 --abbrev=7 --format=%h)" ]] ||
      echo committed
    )sh");
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(ended.out, "");
}

}  // namespace
}  // namespace drench

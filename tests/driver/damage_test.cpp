// Damage that neither size nor time shows, files that cannot be read though they are what was
// recorded, and files that another user may not read.
//
// DRENCH_MUTATIONS=N (default 12) sets how often a file is damaged by chance.

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/output_folder.h"
#include "tests/driver/tiny_shot.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

using namespace test;
namespace fs = std::filesystem;
using nlohmann::json;

Ended verify(const fs::path& out) {
  const TemporaryFolder folder;
  return run_program(DRENCH_PROGRAM, {"verify", out.string(), "--json"}, folder.path());
}

/// A made shot with foam and noisy frames: one of every kind of file that a stage reads.
class Made {
 public:
  Made() : shot_(3) {
    put_text(shot_.file(), with_every_kind_of_file(text_of(shot_.file())));
    const Ended ended = shot_.run("run");
    EXPECT_EQ(ended.code, 0) << ended.err;
    before_ = shot_.digests();
  }
  const TinyShot& shot() const { return shot_; }
  fs::path path(const std::string& file) const { return shot_.out() / file; }
  const std::map<std::string, std::string>& before() const { return before_; }

  /// Puts other bytes in the place of a file and records them as what was made.
  void record(const std::string& file, const std::string& bytes) const {
    Manifest manifest(path(layout::manifest.data()));
    manifest.open_for_append();
    Record record = *manifest.find(file);
    const Record now = record_of_file(shot_.out(), write_file_whole(path(file), bytes));
    record.size = now.size, record.digest = now.digest, record.mtime_ns = now.mtime_ns;
    manifest.add(record);
  }

 private:
  TinyShot shot_;
  std::map<std::string, std::string> before_;
};

/// One file of each kind that a stage reads, in the order in which they are made.
const std::vector<std::vector<std::string>>& files_that_stages_read() {
  static const std::vector<std::vector<std::string>> files{
      {layout::particles(1002), layout::cloth("flag", 1002)},
      {layout::fluid_mesh(1002), layout::foam(1002)},
      {layout::noisy("tiny", 1002)},
      {layout::image("tiny", 1002)}};
  return files;
}

/// Removes all that is made of files of that level, so that a run must read them.
void forget_beyond(const Made& made, size_t level) {
  for (const int frame : {1001, 1002, 1003}) {
    const std::vector<std::vector<std::string>> levels{
        {layout::fluid_mesh(frame), layout::foam(frame)},
        {layout::noisy("tiny", frame)},
        {layout::image("tiny", frame)}};
    for (size_t k = level; k < levels.size(); ++k)
      for (const std::string& file : levels[k]) fs::remove(made.path(file));
  }
  fs::remove(made.path(std::string(layout::contact_sheet)));
}

template <class Test>
void for_each_file_that_stages_read(const Test& test) {
  for (size_t level = 0; level < files_that_stages_read().size(); ++level)
    for (const std::string& file : files_that_stages_read()[level]) test(file, level);
}

// Whatever reads it finds the damage: nothing is made from it, and one run mends all.
TEST(Damage, OfAnyFileThatIsReadSpreadsNowhere) {
  for_each_file_that_stages_read([](const std::string& file, size_t level) {
    const Made made;
    flip_bit_quietly(made.path(file));
    forget_beyond(made, level);
    const Ended ended = made.shot().run("run");
    EXPECT_EQ(ended.code, 0) << file << ended.err;
    EXPECT_EQ(made.shot().digests(), made.before()) << file;
  });
}

// A file cut by a writer that did not look, and recorded so: its digest is right and it is no use.
TEST(Damage, RecordedAsItIsIsDroppedAndMadeAgain) {
  for_each_file_that_stages_read([](const std::string& file, size_t level) {
    const Made made;
    const std::string bytes = text_of(made.path(file));
    made.record(file, bytes.substr(0, bytes.size() * 3 / 4));
    forget_beyond(made, level);
    const Ended ended = made.shot().run("run");
    EXPECT_EQ(ended.code, 0) << file << ended.err;
    EXPECT_EQ(made.shot().digests(), made.before()) << file;
  });
}

int wanted_mutations() {
  const char* text = std::getenv("DRENCH_MUTATIONS");
  return text ? std::atoi(text) : 12;
}

/// One of: a bit turned over, a run of bytes by chance, of zeros, or of another place, the end cut
/// off, bytes after it.
std::string mutated(std::string bytes, std::mt19937& random) {
  const auto below = [&](size_t n) { return size_t(random()) % std::max(n, size_t{1}); };
  const size_t at = below(bytes.size()),
               length = 1 + below(std::min<size_t>(64, bytes.size() - at));
  switch (random() % 6) {
    case 0:
      bytes[at] = char(bytes[at] ^ 1 << random() % 8);
      break;
    case 1:
      for (size_t k = at; k < at + length; ++k) bytes[k] = char(random());
      break;
    case 2:
      bytes.replace(at, length, length, '\0');
      break;
    case 3:
      bytes.replace(at, length, bytes.substr(below(bytes.size()), length));
      break;
    case 4:
      bytes.resize(at);
      break;
    default:
      bytes += bytes.substr(at);
  }
  return bytes;
}

/// As it was last written, to whom only looks at its time.
void damage(const fs::path& file, std::mt19937& random) {
  const auto time = fs::last_write_time(file);
  std::string bytes = text_of(file), other = bytes;
  while (other == bytes) other = mutated(bytes, random);
  put_text(file, other);
  fs::last_write_time(file, time);
}

/// Files of the first that are not the same in the second.
std::vector<std::string> changed(const std::map<std::string, std::string>& before,
                                 const std::map<std::string, std::string>& now) {
  std::vector<std::string> files;
  for (const auto& [file, digest] : before)
    if (!now.count(file) || now.at(file) != digest) files.push_back(file);
  return files;
}

// Whichever file of a folder is damaged, the manifest too, and however much is left of what is made
// of it: the next run ends well and nothing is made of the damage. A file that no step had to read
// may stay as it is, and verify says so.
TEST(Damage, ByChanceIsNeverUsed) {
  const Made made;
  std::vector<std::string> files{layout::manifest.data()};
  for (const auto& [file, digest] : made.before()) files.push_back(file);
  std::mt19937 random(11);
  for (int k = 0; k < wanted_mutations(); ++k) {
    const std::string file = files[random() % files.size()];
    const std::string what = std::to_string(k) + ": damage of " + file;
    const std::string sound = text_of(made.path(file));
    damage(made.path(file), random);
    forget_beyond(made, random() % 4);
    const Ended ended = made.shot().run("run");
    ASSERT_EQ(ended.code, 0) << what << ended.err;
    const std::vector<std::string> left = changed(made.before(), made.shot().digests());
    if (left.empty()) continue;
    ASSERT_EQ(left, std::vector{file}) << what;
    const Ended verified = verify(made.shot().out());
    ASSERT_NE(verified.code, 0) << what;
    ASSERT_NE(verified.out.find(file), std::string::npos) << what << verified.out;
    put_text(made.path(file), sound);
  }
}

TEST(Damage, OfARecordedCheckpointIsDroppedToo) {
  const Made made;
  const std::string file = layout::checkpoint(1003);
  made.record(file, text_of(made.path(file)).substr(0, 1000));
  fs::remove(made.path(layout::particles(1003)));
  const Ended ended = made.shot().run("run");
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(made.shot().digests(), made.before());
}

// More than any number of attempts: the first find looks at all that is read.
TEST(Damage, OfManyInputsIsMendedByOneRun) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, 0);
  for (int frame = 1002; frame <= 1011; ++frame) {
    flip_bit_quietly(shot.out() / layout::fluid_mesh(frame));
    flip_bit_quietly(shot.out() / layout::cloth("flag", frame));
    fs::remove(shot.out() / layout::image("tiny", frame));
  }
  const Ended ended = shot.run("run");
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(shot.digests(), undisturbed_digests());
}

// A disk that damages a file whenever it is written ends the run with a message, not never.
TEST(Damage, ThatComesAgainEndsTheRun) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages stages(settings);
  stages.hook = [&](Step step, int frame) {
    if (step == Step::render && frame == 3) throw Error("its mesh cannot be read");
  };
  stages.unreadable = layout::fluid_mesh(3);
  const std::string text = error_of([&] { make_toy(settings, stages, folder.path()); });
  EXPECT_NE(text.find(layout::fluid_mesh(3)), std::string::npos) << text;
  EXPECT_NE(text.find("check the disk"), std::string::npos) << text;
}

// A sheet at rest: the mesh of a frame is a copy of the one before, which no stage would notice to
// be damaged.
TEST(Damage, OfAHeldMeshIsNotCopied) {
  ToySettings settings;
  settings.growth = 0;  // the same state in every frame
  const TemporaryFolder undisturbed, folder;
  ToyStages first(settings), second(settings), third(settings);
  make_toy(settings, first, undisturbed.path());
  EXPECT_LT(first.count(Step::mesh), 5) << "nothing is held: the test would prove nothing";
  make_toy(settings, second, folder.path());
  flip_bit_quietly(folder.path() / layout::fluid_mesh(10));
  fs::remove(folder.path() / layout::fluid_mesh(11));
  make_toy(settings, third, folder.path());
  EXPECT_EQ(digests_in(folder.path()), digests_in(undisturbed.path()));
}

// ---- verify ----

// What verify says is what the next run does, for every kind of file there is.
TEST(Verify, PromisesWhatARunKeeps) {
  const Made whole;
  std::vector<std::string> kinds;
  for_each_file_that_stages_read([&](const std::string& file, size_t) { kinds.push_back(file); });
  kinds.insert(kinds.end(), {layout::checkpoint(1003), layout::probe("gauge"), "shot.lock.toml",
                             "contact_sheet.png"});
  if (whole.before().contains("tiny.mp4")) kinds.push_back("tiny.mp4");
  for (const std::string& file : kinds) {
    flip_bit_quietly(whole.path(file));
    const Ended found = verify(whole.shot().out());
    EXPECT_EQ(found.code, 1) << file;
    EXPECT_EQ(json::parse(found.out)["bad"], json::array({file}));
    EXPECT_NE(found.err.find("run SHOT --verify"), std::string::npos) << found.err;
    const Ended run = whole.shot().run("run", {"--verify"});
    EXPECT_EQ(run.code, 0) << file << run.err;
    EXPECT_EQ(verify(whole.shot().out()).code, 0) << file;
    auto expected = whole.before(), now = whole.shot().digests();
    if (file == layout::checkpoint(1003)) {  // nothing needs it any more
      EXPECT_FALSE(now.contains(file));
      fs::remove(whole.path(layout::particles(1003)));
      EXPECT_EQ(whole.shot().run("run").code, 0);
      now = whole.shot().digests();
    }
    EXPECT_EQ(now, expected) << file;
  }
}

TEST(Verify, OnlyReads) {
  const Made made;
  flip_bit_quietly(made.path(layout::image("tiny", 1002)));
  const std::string manifest = text_of(made.path("manifest.jsonl"));
  fs::remove(made.path(".lock"));
  EXPECT_EQ(verify(made.shot().out()).code, 1);
  EXPECT_EQ(text_of(made.path("manifest.jsonl")), manifest);
  EXPECT_FALSE(fs::exists(made.path(".lock")));
  const FolderLock lock(made.shot().out());  // as a run holds it
  const Ended beside = verify(made.shot().out());
  EXPECT_EQ(json::parse(beside.out)["bad"].size(), 1u) << beside.err;
}

/// As a user who owns nothing; the test's own user must be root.
Ended as_nobody(const std::vector<std::string>& words, const fs::path& folder) {
  std::vector<std::string> all{"--reuid=65534", "--regid=65534", "--clear-groups"};
  all.insert(all.end(), words.begin(), words.end());
  return run_program("/usr/bin/setpriv", all, folder);
}

bool nobody_can_run_it() {
  if (::geteuid() != 0 || !fs::exists("/usr/bin/setpriv")) return false;
  const TemporaryFolder folder;
  return as_nobody({DRENCH_PROGRAM, "--version"}, folder.path()).code == 0;
}

// Of a file that may not be read nothing is known: neither verify nor run takes it for damaged.
TEST(Verify, TakesFilesOfAnotherUserForNothing) {
  if (!nobody_can_run_it()) GTEST_SKIP() << "needs root, setpriv and a build that all may read";
  const Made made;
  ::chmod(made.shot().folder().c_str(), 0755);
  for (const auto& entry : fs::recursive_directory_iterator(made.shot().out()))
    ::chmod(entry.path().c_str(), entry.is_directory() ? 0777 : 0666);
  ::chmod(made.shot().out().c_str(), 0777);
  const fs::path closed = made.path(layout::particles(1002));
  ::chmod(closed.c_str(), 0);
  const std::string manifest = text_of(made.path("manifest.jsonl"));
  const TemporaryFolder folder;
  const Ended verified =
      as_nobody({DRENCH_PROGRAM, "verify", made.shot().out().string(), "--json"}, folder.path());
  EXPECT_EQ(verified.code, 1) << verified.err;
  EXPECT_EQ(json::parse(verified.out)["bad"], json::array());
  EXPECT_EQ(json::parse(verified.out)["unreadable"], json::array({layout::particles(1002)}));
  fs::remove(made.path(layout::fluid_mesh(1002)));
  std::vector<std::string> words{DRENCH_PROGRAM};
  for (const std::string& word : made.shot().words("run")) words.push_back(word);
  const Ended run = as_nobody(words, folder.path());
  EXPECT_EQ(run.code, 1) << run.err;
  EXPECT_NE(run.err.find(closed.string()), std::string::npos) << run.err;
  EXPECT_EQ(text_of(made.path("manifest.jsonl")), manifest);
  ::chmod(made.path("sim").c_str(), 0);  // the whole folder
  const Ended plan = as_nobody(
      {DRENCH_PROGRAM, "plan", made.shot().file().string(), "--out", made.shot().out().string()},
      folder.path());
  EXPECT_EQ(plan.code, 1) << plan.err;
  EXPECT_EQ(as_nobody({DRENCH_PROGRAM, "verify", made.shot().out().string()}, folder.path()).code,
            1);
  ::chmod(made.path("sim").c_str(), 0755);
  ::chmod(closed.c_str(), 0644);
  EXPECT_EQ(made.shot().run("run").code, 0);
  EXPECT_EQ(made.shot().digests(), made.before());
}

}  // namespace
}  // namespace drench

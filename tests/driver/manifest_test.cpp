#include "pipeline/driver/manifest.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pipeline/contract/error.h"
#include "pipeline/driver/process.h"
#include "tests/driver/folder.h"

namespace drench {
namespace {

using test::put_text;
using test::TemporaryFolder;
using test::text_of;

Record record_number(int number) {
  Record record;
  record.file = "sim/particles." + std::to_string(1000 + number) + ".vdb";
  record.step = "simulate";
  record.frame = 1000 + number;
  record.size = uint64_t(number) << 40;
  record.digest = hash_bytes(&number, sizeof number);
  record.mtime_ns = -number;
  record.key = hash_bytes("key", 3);
  record.parts = {{"fluid", "0123abcd"}, {"a \"quoted\"\nname", "x"}};
  return record;
}

TEST(Manifest, ReadsBackEveryFieldItWrote) {
  const Record record = record_number(7);
  const auto read = parse_manifest_line(manifest_line(record));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->file, record.file);
  EXPECT_EQ(read->step, record.step);
  EXPECT_EQ(read->frame, record.frame);
  EXPECT_EQ(read->size, record.size);
  EXPECT_EQ(read->digest, record.digest);
  EXPECT_EQ(read->mtime_ns, record.mtime_ns);
  EXPECT_EQ(read->key, record.key);
  EXPECT_EQ(read->parts, record.parts);
}

// A kill or a power cut may leave any prefix of the last line: all whole lines count, no part does,
// and the next record is not glued to the rest.
TEST(Manifest, DropsATornTailAtEveryPrefix) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "manifest.jsonl";
  const std::string whole =
      manifest_line(record_number(1)) + "\n" + manifest_line(record_number(2)) + "\n";
  const size_t first = manifest_line(record_number(1)).size() + 1;
  for (size_t size = 0; size <= whole.size(); ++size) {
    put_text(file, whole.substr(0, size));
    const size_t complete = size == whole.size() ? 2 : size >= first ? 1 : 0;
    {
      Manifest manifest(file);
      ASSERT_EQ(manifest.records().size(), complete) << size;
      manifest.open_for_append();
      manifest.add(record_number(3));
    }
    const Manifest again(file);
    ASSERT_EQ(again.records().size(), complete + 1) << size;
    ASSERT_EQ(again.damaged_lines(), 0) << size;
    ASSERT_TRUE(again.find(record_number(3).file).has_value()) << size;
  }
}

// Every single-bit flip of a line is noticed: XXH3-128 collides with probability 2^-128.
TEST(Manifest, DropsALineWithAnyBitFlipped) {
  const std::string line = manifest_line(record_number(1));
  for (size_t bit = 0; bit < 8 * line.size(); ++bit) {
    std::string damaged = line;
    damaged[bit / 8] = char(damaged[bit / 8] ^ (1 << bit % 8));
    ASSERT_FALSE(parse_manifest_line(damaged).has_value()) << bit;
  }
}

TEST(Manifest, KeepsTheLinesAfterADamagedOne) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "manifest.jsonl";
  std::string text =
      manifest_line(record_number(1)) + "\n" + manifest_line(record_number(2)) + "\n";
  text[20] ^= 1;
  put_text(file, text);
  const Manifest manifest(file);
  EXPECT_EQ(manifest.damaged_lines(), 1);
  EXPECT_FALSE(manifest.find(record_number(1).file).has_value());
  EXPECT_TRUE(manifest.find(record_number(2).file).has_value());
}

TEST(Manifest, ForgetsADroppedFileAcrossReading) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "manifest.jsonl";
  {
    Manifest manifest(file);
    manifest.open_for_append();
    manifest.add(record_number(1));
    manifest.add(record_number(2));
    manifest.drop(record_number(1).file);
  }
  const Manifest manifest(file);
  EXPECT_FALSE(manifest.find(record_number(1).file).has_value());
  EXPECT_TRUE(manifest.find(record_number(2).file).has_value());
}

// A record must not lead a reader, or `clean`, outside its folder.
TEST(Manifest, RefusesFilesOutsideTheFolder) {
  for (const char* name : {"/etc/passwd", "../x", "sim/../../x", ""}) {
    Record record = record_number(1);
    record.file = name;
    EXPECT_FALSE(parse_manifest_line(manifest_line(record)).has_value()) << name;
  }
}

TEST(Manifest, GivesClearErrorAndStaysWholeWhenTheDiskIsFull) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "manifest.jsonl";
  install_signal_handlers();  // SIGXFSZ would end the process
  Manifest manifest(file);
  manifest.open_for_append();
  manifest.add(record_number(1));
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{manifest_line(record_number(1)).size() + 50, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(manifest.add(record_number(2)), Error);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_EQ(text_of(file), manifest_line(record_number(1)) + "\n");
  manifest.add(record_number(3));
  const Manifest again(file);
  EXPECT_EQ(again.damaged_lines(), 0);
  EXPECT_EQ(again.records().size(), 2u);
}

// Each writer reads what the others wrote before it writes, and cuts off what one that was killed
// began.
TEST(Manifest, TakesTheLinesOfSeveralWriters) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "manifest.jsonl";
  Manifest first(file), second(file);
  first.open_for_append();
  second.open_for_append();
  first.add(record_number(1));
  EXPECT_FALSE(second.find(record_number(1).file));
  second.refresh();
  EXPECT_TRUE(second.find(record_number(1).file));
  std::ofstream(file, std::ios::app) << manifest_line(record_number(9)).substr(0, 50);
  second.add(record_number(2));
  first.drop(record_number(1).file);
  first.add(record_number(3));
  EXPECT_TRUE(first.find(record_number(2).file));
  second.refresh();
  EXPECT_FALSE(second.find(record_number(1).file));
  const Manifest again(file);
  EXPECT_EQ(again.damaged_lines(), 0);
  EXPECT_EQ(again.records().size(), 2u);
  EXPECT_EQ(second.records().size(), 2u);
}

TEST(Manifest, LosesNoLineOfWritersAtOnce) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "manifest.jsonl";
  constexpr int writers = 4, lines = 100;
  std::vector<pid_t> children;
  for (int k = 0; k < writers; ++k) {
    children.push_back(::fork());
    if (children.back() != 0) continue;
    Manifest manifest(file);
    manifest.open_for_append();
    for (int line = 0; line < lines; ++line) manifest.add(record_number(1000 * k + line));
    ::_exit(manifest.damaged_lines());
  }
  for (const pid_t child : children) {
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  const Manifest manifest(file);
  EXPECT_EQ(manifest.damaged_lines(), 0);
  EXPECT_EQ(manifest.records().size(), size_t(writers * lines));
}

}  // namespace
}  // namespace drench

#include "pipeline/contract/files/files.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <fstream>

#include "tests/temporary_folder.h"

namespace drench {
namespace {

namespace fs = std::filesystem;
using test::error_of;
using test::TemporaryFolder;

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// XXH3-128 of the empty input is a constant of its specification.
TEST(Hash, IsXxh3OfTheSpecification) {
  EXPECT_EQ(hash_bytes("", 0).hex(), "99aa06d3014798d86001c324468d497f");
}

TEST(Hash, StreamsToTheSameDigestAsOnePiece) {
  const std::string text(100000, 'x');
  Hasher pieces;
  for (size_t at = 0; at < text.size(); at += 777) {
    pieces.bytes(text.data() + at, std::min<size_t>(777, text.size() - at));
  }
  EXPECT_EQ(pieces.finish(), hash_bytes(text.data(), text.size()));
}

TEST(Hash, TellsStringsApartByTheirBorders) {
  EXPECT_NE(Hasher().text("ab").text("c").finish(), Hasher().text("a").text("bc").finish());
}

TEST(Hash, ReadsItsOwnHexAndRefusesOtherText) {
  const Digest digest = hash_bytes("drench", 6);
  EXPECT_EQ(Digest::from_hex(digest.hex()), digest);
  for (const char* bad :
       {"", "12", "99AA06d3014798d86001c324468d497f", "g9aa06d3014798d86001c324468d497f"}) {
    error_of([&] { Digest::from_hex(bad); });
  }
}

TEST(WriteFile, GivesContentSizeAndDigestAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const WrittenFile written = write_file_whole(folder / "a/b/file.txt", "some text");
  EXPECT_EQ(content(folder / "a/b/file.txt"), "some text");
  EXPECT_EQ(written.size, 9u);
  EXPECT_EQ(written.digest, hash_bytes("some text", 9));
  EXPECT_EQ(written.digest, hash_file(folder / "a/b/file.txt"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a/b"), {}), 1);
}

TEST(WriteFile, KeepsTheOldFileWhenTheWriterThrows) {
  const TemporaryFolder folder;
  write_file_whole(folder / "file.txt", "old");
  const auto fails = [](const fs::path& temporary) {
    std::ofstream(temporary) << "half";
    throw std::runtime_error("the library's reason");
  };
  const std::string text = error_of([&] { write_file_whole(folder / "file.txt", fails); });
  EXPECT_NE(text.find("file.txt"), std::string::npos) << text;
  EXPECT_NE(text.find("the library's reason"), std::string::npos) << text;
  EXPECT_EQ(content(folder / "file.txt"), "old");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"file.txt"});
}

// A logic_error is our bug and must stay one: exit code 2, not 1.
TEST(WriteFile, PassesOurOwnBugsOn) {
  const TemporaryFolder folder;
  const auto fails = [](const fs::path&) { throw std::logic_error("bug"); };
  EXPECT_THROW(write_file_whole(folder / "file.txt", fails), std::logic_error);
  EXPECT_TRUE(folder.names().empty());
}

TEST(WriteFile, FailsWhenTheWriterMadeNoFile) {
  const TemporaryFolder folder;
  error_of([&] { write_file_whole(folder / "file.txt", [](const fs::path&) {}); });
  EXPECT_TRUE(folder.names().empty());
}

TEST(WriteFile, SaysThatAFolderStandsInThePlace) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "file.txt");
  const std::string text = error_of([&] { write_file_whole(folder / "file.txt", "text"); });
  EXPECT_NE(text.find("a folder stands where"), std::string::npos) << text;
}

// A file where a folder should be is refused for every user, root too.
TEST(WriteFile, SaysThatTheFolderCannotBeWritten) {
  const TemporaryFolder folder;
  write_file_whole(folder / "taken", "a file");
  const std::string text = error_of([&] { write_file_whole(folder / "taken/file.txt", "text"); });
  EXPECT_NE(text.find("taken"), std::string::npos) << text;
  EXPECT_NE(text.find("a file stands where a folder is needed"), std::string::npos) << text;
  EXPECT_EQ(content(folder / "taken"), "a file");
  // The kernel's own file system takes no files from anyone.
  error_of([&] { write_file_whole("/proc/drench/file.txt", "text"); });
}

/// Runs f in a child that may write files of at most `bytes`: what a full disk does, without a
/// disk.
/// @return 0 if f threw an Error that says so, 1 if not, 2 if it was killed by something else.
template <class F>
int run_with_file_size_limit(rlim_t bytes, F&& f) {
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit limit{bytes, bytes};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    int code = 1;
    try {
      f();
    } catch (const Error& error) {
      code = std::string(error.what()).find("file size limit") != std::string::npos ? 0 : 1;
    } catch (...) {
    }
    ::_exit(code);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 2;
}

TEST(WriteFile, SurvivesTheFileSizeLimitAndKeepsTheOldFile) {
  const TemporaryFolder folder;
  write_file_whole(folder / "file.bin", "old");
  const std::string big(1 << 20, 'x');
  EXPECT_EQ(run_with_file_size_limit(100000, [&] { write_file_whole(folder / "file.bin", big); }),
            0);
  EXPECT_EQ(content(folder / "file.bin"), "old");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"file.bin"});
}

TEST(WriteFile, SurvivesAFullDiskAndKeepsTheOldFile) {
  const TemporaryFolder folder;
  if (::mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "mounting a small disk needs root; the file size limit is tested instead";
  }
  write_file_whole(folder / "file.bin", "old");
  const std::string big(1 << 20, 'x');
  const std::string text = error_of([&] { write_file_whole(folder / "file.bin", big); });
  const std::vector<std::string> names = folder.names();
  const std::string kept = content(folder / "file.bin");
  write_file_whole(folder / "small.bin", "room again");  // nothing of the failed one takes space
  ::umount(folder.path().c_str());
  EXPECT_NE(text.find("disk is full"), std::string::npos) << text;
  EXPECT_EQ(kept, "old");
  EXPECT_EQ(names, std::vector<std::string>{"file.bin"});
}

TEST(ReadFile, RefusesWhatIsMissingTooLargeOrNoFile) {
  const TemporaryFolder folder;
  write_file_whole(folder / "file.txt", "0123456789");
  EXPECT_EQ(read_text(folder / "file.txt", 10), "0123456789");
  EXPECT_NE(error_of([&] { read_text(folder / "file.txt", 9); }).find("10 bytes"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_text(folder / "none.txt"); }).find("does not exist"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_text(folder.path()); }).find("it is a folder"), std::string::npos);
}

// Opening a FIFO without a writer blocks for ever unless it is asked not to.
TEST(ReadFile, DoesNotHangOnAFifo) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
  error_of([&] { read_text(folder / "fifo"); });
  error_of([&] { hash_file(folder / "fifo"); });
}

TEST(StaleTemporaries, OfDeadProcessesAreRemovedAndNothingElse) {
  const TemporaryFolder folder;
  const pid_t child = ::fork();
  if (child == 0) {  // dies by a signal in the middle of writing
    write_file_whole(folder / "fluid.1001.ply", [](const fs::path& temporary) {
      std::ofstream(temporary) << "half";
      ::raise(SIGKILL);
    });
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_EQ(folder.names().size(), 1u);
  const std::vector<std::string> others{"fluid.1000.ply",    ".hidden",
                                        ".note.tmp",         ".a.1-x.tmp",
                                        ".a.00000000.1.tmp", "x.00000000.1-1.tmp"};
  for (const std::string& name : others) write_file_whole(folder / name, "kept");
  write_file_whole(folder / ".of another machine.00000000.1-1.tmp.ply", "half");
  EXPECT_EQ(remove_stale_temporaries(folder.path()), 2);
  EXPECT_EQ(folder.names().size(), others.size());
  EXPECT_EQ(remove_stale_temporaries(folder / "missing"), 0);
}

TEST(StaleTemporaries, OfThisProcessAreKeptWhileItWritesThem) {
  const TemporaryFolder folder;
  write_file_whole(folder / "file.txt", [&](const fs::path& temporary) {
    std::ofstream(temporary) << "whole";
    EXPECT_EQ(remove_stale_temporaries(folder.path()), 0);
  });
  EXPECT_EQ(content(folder / "file.txt"), "whole");
}

}  // namespace
}  // namespace drench

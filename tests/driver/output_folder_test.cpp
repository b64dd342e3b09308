#include "pipeline/driver/output_folder.h"

#include <sys/wait.h>
#include <unistd.h>

#include "pipeline/contract/error.h"
#include "tests/driver/folder.h"

namespace drench {
namespace {

using test::put_text;
using test::TemporaryFolder;

TEST(FolderLock, RefusesASecondHolderAndSaysWho) {
  const TemporaryFolder folder;
  const FolderLock lock(folder.path());
  try {
    const FolderLock second(folder.path());
    FAIL() << "two holders";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(::getpid())), std::string::npos)
        << error.what();
  }
}

// The kernel releases the lock of a killed process: none is ever stale.
TEST(FolderLock, DoesNotSurviveAKill) {
  const TemporaryFolder folder;
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const FolderLock lock(folder.path());
    (void)!::write(ready[1], "x", 1);
    for (;;) ::pause();
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_THROW(FolderLock(folder.path()), Error);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_NO_THROW(FolderLock(folder.path()));
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(FolderLock, NamesAFolderThatCannotBeMade) {
  const TemporaryFolder folder;
  put_text(folder.path() / "file", "x");
  try {
    const FolderLock lock(folder.path() / "file" / "out");
    FAIL() << "made a folder inside a file";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("file/out"), std::string::npos) << error.what();
  }
}

Record recorded(const std::filesystem::path& folder, const std::string& file,
                const std::string& text) {
  return record_of_file(folder, write_file_whole(folder / file, text));
}

TEST(FileState, TrustsAnUntouchedFile) {
  const TemporaryFolder folder;
  EXPECT_EQ(state_of(folder.path(), recorded(folder.path(), "sim/a", "hello")), FileState::intact);
}

TEST(FileState, SeesAMissingFile) {
  const TemporaryFolder folder;
  const Record record = recorded(folder.path(), "a", "hello");
  std::filesystem::remove(folder.path() / "a");
  EXPECT_EQ(state_of(folder.path(), record), FileState::missing);
}

TEST(FileState, SeesOtherBytesOfTheSameSize) {
  const TemporaryFolder folder;
  const Record record = recorded(folder.path(), "a", "hello");
  put_text(folder.path() / "a", "hellp");
  EXPECT_EQ(state_of(folder.path(), record), FileState::changed);
}

// Time decides nothing: a copied or touched file with the same bytes is still the same file.
TEST(FileState, TrustsEqualBytesWithAnotherTime) {
  const TemporaryFolder folder;
  const Record record = recorded(folder.path(), "a", "hello");
  const auto years = std::chrono::hours(24 * 365 * 10);
  for (const auto shift : {-years, years}) {
    std::filesystem::last_write_time(folder.path() / "a",
                                     std::filesystem::file_time_type::clock::now() + shift);
    EXPECT_EQ(state_of(folder.path(), record), FileState::intact);
  }
}

TEST(FileState, RefusesALinkInThePlaceOfAFile) {
  const TemporaryFolder folder;
  const Record record = recorded(folder.path(), "a", "hello");
  std::filesystem::rename(folder.path() / "a", folder.path() / "b");
  std::filesystem::create_symlink("b", folder.path() / "a");
  EXPECT_EQ(state_of(folder.path(), record), FileState::changed);
  EXPECT_FALSE(has_recorded_digest(folder.path(), record));
}

// The digest finds what size and time cannot show.
TEST(FileState, FindsAQuietlyFlippedBitByDigest) {
  const TemporaryFolder folder;
  const Record record = recorded(folder.path(), "a", "hello");
  test::flip_bit_quietly(folder.path() / "a");
  EXPECT_FALSE(has_recorded_digest(folder.path(), record));
}

}  // namespace
}  // namespace drench

#pragma once
// A shot of the real stages that takes a fraction of a second: a ball of water on a small sheet.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/driver/child.h"
#include "tests/driver/folder.h"

namespace drench::test {

class TinyShot {
 public:
  explicit TinyShot(int frames = 12);

  std::filesystem::path out() const { return folder_.path() / "out"; }
  std::filesystem::path file() const { return folder_.path() / "tiny.toml"; }
  const std::filesystem::path& folder() const { return folder_.path(); }

  /// drench COMMAND tiny.toml --out out MORE...
  std::vector<std::string> words(const std::string& command,
                                 const std::vector<std::string>& more = {}) const;
  Ended run(const std::string& command, const std::vector<std::string>& more = {}) const;
  /// With a fault in its system calls, see faults.cpp.
  Ended run_with_fault(const std::string& fault) const;

  /// Digests of every file the manifest lists, as they are on the disk.
  std::map<std::string, std::string> digests() const;

 private:
  TemporaryFolder folder_;
};

/// The text of a shot that also makes foam and noisy frames.
std::string with_every_kind_of_file(std::string shot);

/// Digests after one undisturbed run of as many frames; made once in a process.
const std::map<std::string, std::string>& undisturbed_digests(int frames = 12);

}  // namespace drench::test

#pragma once
// A program that works for this one: ffmpeg, the commands of Slurm.

#include <sys/types.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace drench {

/// What it reads comes from us, what it says goes to temporary files. It ends when this process
/// does.
class ChildProcess {
 public:
  /// @param command  path of the program, then its arguments: no shell sees them.
  /// @throws Error if it cannot be started.
  explicit ChildProcess(const std::vector<std::string>& command);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// @return false if it no longer reads.
  bool send(const void* data, size_t size);
  /// Closes its input and waits. @return its exit status, or 128 + signal.
  int finish();
  /// What it printed so far, at most so many bytes of the end.
  std::string output(size_t most = size_t(1) << 28) const;
  std::string errors(size_t most = size_t(1) << 16) const;

 private:
  using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
  void close_input();

  const File output_, errors_;
  pid_t pid_ = -1;
  int input_ = -1;
};

/// The last line of a text.
std::string last_line(std::string text);

/// Where $PATH has a program that this user may run.
std::optional<std::filesystem::path> find_program(std::string_view name);

}  // namespace drench

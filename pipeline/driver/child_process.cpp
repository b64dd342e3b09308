#include "pipeline/driver/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

/// In the new process: only calls that are safe between fork and exec of a threaded program.
[[noreturn]] void become(char* const* arguments, int input, int output, int errors, pid_t parent) {
  // It must not outlive us: after a kill it would go on writing where the next run works.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  ::setpgid(0, 0);  // Ctrl-C is for us; we end it when we stop
  ::dup2(input, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(errors, STDERR_FILENO);
  ::execv(arguments[0], arguments);
  ::_exit(127);
}

std::string end_of(std::FILE* file, size_t most) {
  std::fseek(file, 0, SEEK_END);
  const auto size = size_t(std::max(0L, std::ftell(file)));
  std::string text(std::min(size, most), '\0');
  std::fseek(file, long(size - text.size()), SEEK_SET);
  text.resize(std::fread(text.data(), 1, text.size(), file));
  return text;
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command)
    : output_(std::tmpfile(), std::fclose), errors_(std::tmpfile(), std::fclose) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const pid_t parent = ::getpid();
  std::array<int, 2> pipe{-1, -1};
  if (output_ && errors_ && ::pipe2(pipe.data(), O_CLOEXEC) == 0) pid_ = ::fork();
  if (pid_ == 0) {
    become(arguments.data(), pipe[0], ::fileno(output_.get()), ::fileno(errors_.get()), parent);
  }
  const int reason = errno;
  if (pipe[0] >= 0) ::close(pipe[0]);
  input_ = pipe[1];
  if (pid_ > 0) return;
  close_input();
  throw Error(fmt::format("{}: cannot be started: {}", command.front(), system_reason(reason)));
}

ChildProcess::~ChildProcess() {
  close_input();
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  (void)::waitpid(pid_, nullptr, 0);
}

void ChildProcess::close_input() {
  if (input_ >= 0) ::close(input_);
  input_ = -1;
}

bool ChildProcess::send(const void* data, size_t size) {
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t done = ::write(input_, bytes, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;  // EPIPE: it has ended; finish() says how
    bytes += done;
    size -= size_t(done);
  }
  return true;
}

int ChildProcess::finish() {
  close_input();
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0) {
    if (errno != EINTR) return 127;
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string ChildProcess::output(size_t most) const { return end_of(output_.get(), most); }
std::string ChildProcess::errors(size_t most) const { return end_of(errors_.get(), most); }

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const size_t line = text.rfind('\n');
  return line == std::string::npos ? text : text.substr(line + 1);
}

std::optional<fs::path> find_program(std::string_view name) {
  const char* path = std::getenv("PATH");
  std::string_view rest = path ? path : "";
  while (!rest.empty()) {
    const size_t colon = rest.find(':');
    const std::string_view folder = rest.substr(0, colon);
    rest = colon == std::string_view::npos ? "" : rest.substr(colon + 1);
    if (folder.empty()) continue;
    const fs::path file = fs::path(folder) / name;
    if (::access(file.c_str(), X_OK) == 0 && fs::is_regular_file(file)) return file;
  }
  return {};
}

}  // namespace drench

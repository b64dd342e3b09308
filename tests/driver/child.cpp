#include "tests/driver/child.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <stdexcept>

#include "tests/driver/folder.h"

extern char** environ;

namespace drench::test {

namespace {
std::filesystem::path log_file(const std::filesystem::path& folder, const char* extension) {
  static std::atomic<int> count{0};
  return folder / ("log-" + std::to_string(count++) + extension);
}
}  // namespace

Child::Child(const std::string& program, const std::vector<std::string>& arguments,
             const std::filesystem::path& folder, const std::vector<std::string>& environment)
    : out_(log_file(folder, ".out")), err_(log_file(folder, ".err")) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const int flags = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out_.c_str(), flags, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err_.c_str(), flags, 0600);
  std::vector<char*> words{const_cast<char*>(program.c_str())};
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  std::vector<char*> variables;
  // The first of a name counts.
  for (const std::string& text : environment) variables.push_back(const_cast<char*>(text.c_str()));
  for (char** variable = environ; *variable; ++variable) variables.push_back(*variable);
  variables.push_back(nullptr);
  const int reason =
      ::posix_spawn(&pid_, words[0], &actions, nullptr, words.data(), variables.data());
  posix_spawn_file_actions_destroy(&actions);
  if (reason != 0) throw std::runtime_error("cannot start " + program);
}

Child::~Child() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void Child::send(int signal) { ::kill(pid_, signal); }

bool Child::running() {
  siginfo_t info{};
  return ::waitid(P_PID, id_t(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
}

Ended Child::wait() {
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  Ended ended;
  if (WIFEXITED(status)) ended.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) ended.signal = WTERMSIG(status);
  ended.out = text_of(out_);
  ended.err = text_of(err_);
  return ended;
}

std::string Child::err_so_far() const { return text_of(err_); }

Ended run_program(const std::string& program, const std::vector<std::string>& arguments,
                  const std::filesystem::path& folder,
                  const std::vector<std::string>& environment) {
  return Child(program, arguments, folder, environment).wait();
}

}  // namespace drench::test

#pragma once
// Runs the real program as a child process and says how it ended.

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace drench::test {

struct Ended {
  int code = -1;   // exit code, or -1
  int signal = 0;  // that killed it, or 0
  std::string out, err;
};

class Child {
 public:
  /// @param program  DRENCH_PROGRAM or DRENCH_FAULT_PROGRAM.
  /// @param environment  added to ours, "NAME=value".
  Child(const std::string& program, const std::vector<std::string>& arguments,
        const std::filesystem::path& folder, const std::vector<std::string>& environment = {});
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void send(int signal);
  bool running();
  Ended wait();
  std::string err_so_far() const;

 private:
  const std::filesystem::path out_, err_;
  pid_t pid_ = -1;
};

Ended run_program(const std::string& program, const std::vector<std::string>& arguments,
                  const std::filesystem::path& folder,
                  const std::vector<std::string>& environment = {});

}  // namespace drench::test

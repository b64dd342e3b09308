#include "pipeline/driver/farm/slurm.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>

#include "pipeline/contract/error.h"
#include "pipeline/driver/child_process.h"

namespace drench::slurm {

namespace {

/// @return what the command printed. @throws Error with its last words if it fails
std::string run(const std::string& program, const std::vector<std::string>& arguments,
                const std::string& input = {}) {
  const std::optional<std::filesystem::path> path = find_program(program);
  if (!path) {
    throw Error(
        fmt::format("{}: not found on PATH; on Debian install slurm-client, or work on a "
                    "machine that submits to the farm",
                    program));
  }
  std::vector<std::string> command{path->string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  ChildProcess child(command);
  child.send(input.data(), input.size());
  const int status = child.finish();
  if (status != 0) {
    throw Error(fmt::format(
        "{} ended with status {}: {}. If this machine belongs to no Slurm cluster, work "
        "on one that does, or give --template openjd for another farm",
        program, status, last_line(child.errors())));
  }
  return child.output();
}

std::string dependency(const std::vector<std::string>& jobs) {
  std::string text = "afterok";
  for (const std::string& job : jobs) text += fmt::format(":{}", job);
  return text;
}

std::vector<std::string> split(const std::string& line, char mark) {
  std::vector<std::string> parts{""};
  for (const char c : line) {
    if (c == mark) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string submit_held(const Array& array) {
  std::vector<std::string> arguments{"--parsable",
                                     "--hold",
                                     "--requeue",
                                     "--kill-on-invalid-dep=yes",
                                     "--open-mode=append",
                                     "--job-name=" + array.name,
                                     fmt::format("--array=0-{}", array.count - 1)};
  arguments.insert(arguments.end(), array.options.begin(), array.options.end());
  std::string text = run("sbatch", arguments, array.script);
  text = text.substr(0, text.find_first_of(";\n"));  // "12;cluster"
  if (text.empty() || !std::all_of(text.begin(), text.end(), is_digit))
    throw Error(fmt::format("sbatch: '{}' is no job number", text));
  return text;
}

void release(const std::vector<Element>& elements, const std::vector<std::string>& arrays) {
  std::string commands;
  for (const Element& element : elements) {
    commands += fmt::format("update JobId={} JobName={}", element.job, element.name);
    if (!element.after.empty()) commands += " Dependency=" + dependency(element.after);
    commands += '\n';
  }
  for (const std::string& array : arrays) commands += fmt::format("release {}\n", array);
  run("scontrol", {"--oneliner"}, commands + "quit\n");
}

void cancel(const std::vector<std::string>& jobs) {
  if (jobs.empty()) return;
  std::vector<std::string> arguments{"--quiet"};
  arguments.insert(arguments.end(), jobs.begin(), jobs.end());
  run("scancel", arguments);
}

bool State::is_active() const {
  constexpr auto ended = std::to_array<std::string_view>(
      {"COMPLETED", "FAILED", "TIMEOUT", "CANCELLED", "NODE_FAIL", "OUT_OF_MEMORY", "BOOT_FAIL",
       "DEADLINE", "PREEMPTED", "REVOKED"});
  return std::find(ended.begin(), ended.end(), state) == ended.end() && reason != never;
}

bool State::is_waiting() const {
  return is_active() && state != "RUNNING" && state != "COMPLETING" && state != "SUSPENDED";
}

bool State::is_held() const { return is_waiting() && reason == "JobHeldUser"; }

std::map<std::string, State> queue() {
  const std::string text =
      run("squeue", {"--noheader", "--array", "--me", "--states=all", "--format=%i|%j|%T|%r|%N"});
  std::map<std::string, State> states;
  for (const std::string& line : split(text, '\n')) {
    const std::vector<std::string> parts = split(line, '|');
    if (parts.size() == 5) states[parts[0]] = {parts[1], parts[2], parts[3], parts[4]};
  }
  return states;
}

std::string plain_name(std::string text) {
  constexpr std::string_view kept = "._,-+";
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c)) && kept.find(c) == kept.npos) c = '_';
  return text;
}

}  // namespace drench::slurm

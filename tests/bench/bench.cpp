#include "tests/bench/bench.h"

#include <sched.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <vector>

namespace drench::bench {
namespace {

using nlohmann::ordered_json;

struct Case {
  std::string description;
  std::function<void(const Emit&)> run;
};

std::map<std::string, Case>& registry() {  // built on first use: registrations run before main
  static std::map<std::string, Case> cases;
  return cases;
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Highest resident size since the last reset, MiB.
double peak_mib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}

/// Where the system refuses, the peak is that of the process so far: too high, never too low.
void reset_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

template <class T>
ordered_json or_null(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}
ordered_json or_null(const std::string& text) {
  return text.empty() ? ordered_json(nullptr) : ordered_json(text);
}

ordered_json json_of(const std::string& name, const Line& line) {
  ordered_json json;
  json["case"] = name;
  json["method"] = or_null(line.method);
  json["resolution"] = or_null(line.resolution);
  json["time_step"] = or_null(line.time_step);
  json["device"] = or_null(line.device);
  json["threads"] = or_null(line.threads);
  const auto cost = [&](double Measured::*member) {
    return line.cost ? ordered_json((*line.cost).*member) : ordered_json(nullptr);
  };
  json["wall_s"] = cost(&Measured::wall_s);
  json["cpu_s"] = cost(&Measured::cpu_s);
  json["peak_mib"] = cost(&Measured::peak_mib);
  json["error"] = or_null(line.error);
  json["error_of"] = or_null(line.error_of);
  json["gate"] = or_null(line.gate);
  json["pass"] = nullptr;
  if (line.gate) json["pass"] = line.error && *line.error <= *line.gate;
  for (const auto& [key, value] : line.more.items()) json[key] = value;
  return json;
}

int list_cases() {
  for (const auto& [name, entry] : registry())
    std::printf("%-24s %s\n", name.c_str(), entry.description.c_str());
  return 0;
}

/// @return whether every gate passed.
bool run_case(const std::string& name) {
  bool passed = true;
  registry().at(name).run([&](const Line& line) {
    const ordered_json json = json_of(name, line);
    passed &= json["pass"].is_null() || json["pass"].get<bool>();
    std::printf("%s\n", json.dump().c_str());
    std::fflush(stdout);
  });
  return passed;
}

}  // namespace

Measured measure(const std::function<void()>& work) {
  reset_peak();
  const double cpu = cpu_seconds();
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(), cpu_seconds() - cpu, peak_mib()};
}

Registration::Registration(std::string name, std::string description,
                           std::function<void(const Emit&)> run) {
  if (!registry().emplace(name, Case{std::move(description), std::move(run)}).second) {
    std::fprintf(stderr, "bench: two cases are named %s\n", name.c_str());
    std::terminate();
  }
}

int hardware_threads() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

int run_bench(int argc, char** argv) {
  std::vector<std::string> names;
  for (int k = 1; k < argc; ++k) {
    const std::string argument = argv[k];
    if (argument == "--list") return list_cases();
    if (argument == "--help") {
      std::printf(
          "%s [--list] [CASE...]\nRuns cases (all without a name), a JSON line each to stdout.\n"
          "Example: %s surface_error\n",
          argv[0], argv[0]);
      return 0;
    }
    if (!registry().contains(argument)) {
      std::fprintf(stderr, "bench: there is no case '%s'; --list names them\n", argument.c_str());
      return 1;
    }
    names.push_back(argument);
  }
  if (names.empty())
    for (const auto& [name, entry] : registry()) names.push_back(name);
  bool passed = true;
  for (const std::string& name : names) {
    try {
      passed &= run_case(name);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "bench: %s: %s\n", name.c_str(), error.what());
      passed = false;
    }
  }
  return passed ? 0 : 1;
}

}  // namespace drench::bench

#include "tests/bench/bench.h"

#include <sched.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <stdexcept>
#include <vector>

#include "tests/bench/record.h"

namespace drench::bench {
namespace {

using nlohmann::ordered_json;

struct Case {
  std::string description;
  std::function<void(const Emit&)> run;
  InQuick in_quick;
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

struct Options {
  std::vector<std::string> cases;
  Extent extent = Extent::full;
  Record record;
  enum class Which { all, missing } which = Which::all;
  enum class Do { run, list, help } what = Do::run;
};
Options options;  // of this run; the program has one

constexpr const char* usage =
    "%s [--quick] [--record FILE --commit HASH [--missing]] [CASE...]\n"
    "Runs cases (all without a name), a JSON line each to stdout.\n\n"
    "  --list         names the cases\n"
    "  --quick        without names a choice of cases, all of them at small sizes\n"
    "  --record FILE  appends the rows of each case that ends, with time, machine and commit\n"
    "  --commit HASH  the state of the code\n"
    "  --missing      leaves out cases of which FILE has rows of this commit\n\n"
    "Example: %s surface_error\n";

/// @throws std::invalid_argument for what is no option and no case.
Options parse(const std::vector<std::string>& arguments) {
  Options o;
  for (size_t k = 0; k < arguments.size(); ++k) {
    const std::string& argument = arguments[k];
    const auto value = [&] {
      if (k + 1 == arguments.size()) throw std::invalid_argument(argument + " needs a value");
      return arguments[++k];
    };
    if (argument == "--list")
      o.what = Options::Do::list;
    else if (argument == "--help")
      o.what = Options::Do::help;
    else if (argument == "--quick")
      o.extent = Extent::quick;
    else if (argument == "--missing")
      o.which = Options::Which::missing;
    else if (argument == "--record")
      o.record.file = value();
    else if (argument == "--commit")
      o.record.commit = value();
    else if (registry().contains(argument))
      o.cases.push_back(argument);
    else
      throw std::invalid_argument("there is no case '" + argument + "'; --list names them");
  }
  if (!o.record.file.empty() && o.record.commit.empty())
    throw std::invalid_argument("--record needs --commit, the state of the code");
  if (o.which == Options::Which::missing && o.record.file.empty())
    throw std::invalid_argument("--missing needs --record, the file to look in");
  if (o.cases.empty())
    for (const auto& [name, entry] : registry())
      if (o.extent == Extent::full || entry.in_quick == InQuick::yes) o.cases.push_back(name);
  return o;
}

/// @return whether every gate passed.
bool run_case(const std::string& name) {
  const std::string command =
      "./bench " + std::string(options.extent == Extent::quick ? "--quick " : "") + name;
  if (options.which == Options::Which::missing && has_rows(options.record, command)) return true;
  const Origin origin = origin_now(options.record, command);
  bool passed = true;
  std::vector<ordered_json> results;
  registry().at(name).run([&](const Line& line) {
    results.push_back(json_of(name, line));
    const ordered_json& json = results.back();
    passed &= json["pass"].is_null() || json["pass"].get<bool>();
    std::printf("%s\n", json.dump().c_str());
    std::fflush(stdout);
  });
  if (!options.record.file.empty()) append_rows(options.record, origin, results);
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

Extent extent() { return options.extent; }

Registration::Registration(std::string name, std::string description,
                           std::function<void(const Emit&)> run, InQuick in_quick) {
  if (!registry().emplace(name, Case{std::move(description), std::move(run), in_quick}).second) {
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
  try {
    options = parse({argv + 1, argv + argc});
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "bench: %s\n", error.what());
    return 1;
  }
  if (options.what == Options::Do::list) return list_cases();
  if (options.what == Options::Do::help) return std::printf(usage, argv[0], argv[0]), 0;
  bool passed = true;
  for (const std::string& name : options.cases) {
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

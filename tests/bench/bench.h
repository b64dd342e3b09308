#pragma once
// The bench harness: cases register themselves by name and emit JSON lines. Only std and nlohmann
// json, because two programs use it: drench_bench has every stage, drench_sim_bench the simulator
// alone.
//
// A case lives in a file of its own area:
//
//     const Registration error{"surface_error", "errors on five shapes", [](const
//     Emit& emit) {
//       const Measured cost = measure([&] { ... });
//       Line line;
//       line.resolution = "1000000 particles";
//       line.cost = cost;
//       emit(line);
//     }};

#include <nlohmann/json.hpp>

#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace drench::bench {

/// What a piece of work took.
struct Measured {
  double wall_s = 0;
  double cpu_s = 0;     // user and system, all threads of the process
  double peak_mib = 0;  // resident, highest during the work, of the whole process
};

/// Runs `work` once and measures it. For a median call it more than once.
Measured measure(const std::function<void()>& work);

/// One result. Members left empty are null in the JSON line.
struct Line {
  std::string method;               // which way of doing it
  std::string resolution;           // of the input, with its unit
  std::optional<double> time_step;  // s
  std::string device = "cpu";
  std::optional<int> threads;
  std::optional<Measured> cost;
  std::optional<double> error;
  std::string error_of;        // what the error is, with its unit
  std::optional<double> gate;  // the error must not be larger
  nlohmann::ordered_json more = nlohmann::ordered_json::object();  // keys of the case's own
};

/// Writes the line to stdout. `pass` is null without a gate; a gate without an error does not pass.
using Emit = std::function<void(const Line&)>;

/// How much of a case runs: all of it, or what takes seconds.
enum class Extent { full, quick };
Extent extent();

/// Of a case's sizes (or tolerances, or scenes), cheapest first, those of this run: a quick one
/// has the first `few`.
template <class T>
std::vector<T> sizes(std::initializer_list<T> all, size_t few) {
  return {all.begin(), extent() == Extent::quick ? all.begin() + few : all.end()};
}

/// Whether --quick without names runs a case.
enum class InQuick { no, yes };

/// Makes a case known; static objects of it register before main.
struct Registration {
  Registration(std::string name, std::string description, std::function<void(const Emit&)> run,
               InQuick in_quick = InQuick::no);
};

/// The whole of a bench program: its --help says what it takes.
/// @return 0; 1 for an unknown case or option, or if a gate did not pass.
int run_bench(int argc, char** argv);

/// Threads that parallel work of this process may use.
int hardware_threads();

}  // namespace drench::bench

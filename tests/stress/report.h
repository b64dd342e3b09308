#pragma once
// The table of docs/stress.md: a line for every row of a test, printed as it
// is measured, and the gates of the research notes.

#include <limits>
#include <string>

#include "tests/stress/watch.h"

namespace drench::stress_tests {

/// DRENCH_STRESS=long: more settings, larger and longer scenes, minutes to hours in place of
/// seconds.
bool long_form();

/// In place of a gate.
// The row still says whether the common gate holds.
constexpr double not_gated = std::numeric_limits<double>::infinity();
constexpr double no_rule = 1e300;  // there is none, something outside acts: it says nothing

/// What all stress tests are to hold. A test that must ask for less says why.
struct Gates {
  double speed = 1;                              // over Figures::speed_bound
  double energy = 0.02;                          // over the energy at the start
  double mean = 1e-3, p999 = 0.03, worst = 0.2;  // compression
  double drift = 1e-5;                           // of momentum
  int crossings = 0;
  int blow_ups = 0;  // 1 where the run may end in one that the solver tells
};
/// Compression is reported alone where fluid is squeezed between closing sheets.
Gates squeezed();

/// Do the gates hold?
bool holds(const Watch& watch, const Gates& gates);

/// Adds a row and expects the gates to hold. The row says which of the common gates fail, whatever
/// the test itself asks for.
/// @param measured  the row's own figure, in words.
void report(const std::string& stress, const std::string& setting, const Watch& watch,
            const Gates& gates = {}, const std::string& measured = "");
/// A row without a run: refused input, bits, ratios.
void report(const std::string& stress, const std::string& setting, bool passed,
            const std::string& measured);

}  // namespace drench::stress_tests

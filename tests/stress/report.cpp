#include "tests/stress/report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

namespace drench::stress_tests {

namespace {

/// At once, so that what a long run has measured is there when it is stopped.
void print(const std::string& row) {
  static bool first = true;
  if (first) {
    std::cout
        << "| stress | setting | particles | steps | CPU ms | speed, of bound % | energy % "
           "| compression mean / 99.9 / worst % | crossings | momentum | capped | measured | "
           "verdict |\n"
           "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  }
  first = false;
  std::cout << row << std::endl;
}

/// The gates that do not hold, by name.
std::string broken(const Figures& f, const Gates& g) {
  std::string list;
  const auto need = [&](bool holds, const char* name) {
    if (!holds) list += (list.empty() ? "" : ", ") + std::string(name);
  };
  need(f.finite || g.blow_ups > 0, "blow-up"), need(f.whole, "mass"),
      need(f.crossings <= g.crossings, "crossings");
  need(f.max_speed <= g.speed * f.speed_bound, "speed"), need(f.energy <= g.energy, "energy");
  need(f.mean <= g.mean, "mean compression"), need(f.p999 <= g.p999, "99.9th compression");
  need(f.worst <= g.worst, "worst compression"), need(f.drift <= g.drift, "momentum");
  return list;
}

/// The common gates but those that there is no rule for.
Gates common_of(const Gates& gates) {
  Gates common;
  for (double Gates::*gate : {&Gates::speed, &Gates::energy, &Gates::drift})
    if (gates.*gate == no_rule) common.*gate = no_rule;
  return common;
}

}  // namespace

bool long_form() {
  const char* form = std::getenv("DRENCH_STRESS");
  return form && std::string(form) == "long";
}

Gates squeezed() {
  Gates gates;
  gates.mean = gates.p999 = gates.worst = not_gated;
  return gates;
}

bool holds(const Watch& watch, const Gates& gates) {
  return broken(watch.figures(), gates).empty();
}

void report(const std::string& stress, const std::string& setting, const Watch& watch,
            const Gates& gates, const std::string& measured) {
  const Figures f = watch.figures();
  EXPECT_EQ(broken(f, gates), "") << stress << ", " << setting;
  const std::string fails = broken(f, common_of(gates));
  print(fmt::format(
      "| {} | {} | {} | {} | {:.2f} | {:.0f} | {:.2f} | {:.3f} / {:.2f} / {:.1f} | {} | {:.0e} | "
      "{} | {} | {} |",
      stress, setting, f.particles, f.steps, f.cpu_ms, 100 * f.max_speed / f.speed_bound,
      100 * f.energy, 100 * f.mean, 100 * f.p999, 100 * f.worst, f.crossings, f.drift, f.capped,
      measured, fails.empty() ? "pass" : "FAIL: " + fails));
}

void report(const std::string& stress, const std::string& setting, bool passed,
            const std::string& measured) {
  EXPECT_TRUE(passed) << stress << ", " << setting << ": " << measured;
  print(fmt::format("| {} | {} | | | | | | | | | | {} | {} |", stress, setting, measured,
                    passed ? "pass" : "FAIL"));
}

}  // namespace drench::stress_tests

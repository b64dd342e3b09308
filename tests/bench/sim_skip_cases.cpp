// Case sim_skips: what a term of the physics costs a scene that has it and does not use it: with
// its coefficient zero, or out of reach.

#include <map>
#include <string>
#include <utility>

#include "tests/bench/bench.h"
#include "tests/bench/instructions.h"
#include "tests/sim/skip_terms.h"
#include "tests/sim/support.h"

namespace drench::bench {
namespace {

using sim_tests::Term;

constexpr int steps = 10;

/// @param variant the place of a term among all, behind it "-" for the scene without the term
void step_variant(const std::string& variant) {
  const Term& term = sim_tests::skip_terms()[std::stoul(variant)];
  Shot shot = term.without(term.solver);
  if (variant.back() != '-') term.idle(shot);
  sim_tests::Stepper run(shot);
  count_instructions([&] {
    for (int k = 0; k < steps; ++k) run.step();
  });
}

void sim_skips(const Emit& emit) {
  if (const char* variant = variant_to_count()) return step_variant(variant);
  std::map<std::pair<Shot (*)(FluidSolver), FluidSolver>, double> scenes;  // that terms share
  for (size_t k = 0; k < sim_tests::skip_terms().size(); ++k) {
    const Term& term = sim_tests::skip_terms()[k];
    double& without = scenes[{term.without, term.solver}];
    if (without == 0) without = instructions("sim_skips", std::to_string(k) + "-");
    Line line;
    line.method = term.name;
    const bool fluid = !term.without(term.solver).fluid.box.empty();
    line.resolution = fluid ? "512 particles, 10 steps" : "sheets alone, 10 steps";
    line.threads = 1;
    line.error = instructions("sim_skips", std::to_string(k)) / without;
    line.error_of = "instructions over those of the scene without it";
    // What is out of reach has passes that look for it (their share is what is told).
    if (term.leaves == sim_tests::Leaves::the_plan) line.gate = 1.01;
    line.more["million_instructions"] = without * 1e-6;
    emit(line);
  }
}

const Registration sim_skips_case{
    "sim_skips", "instructions that terms of the physics take which a scene does not use",
    sim_skips};

}  // namespace
}  // namespace drench::bench

#pragma once
// Every term of the physics, one by one: a scene without it, the scene with it, and the scene where
// it is idle.

#include <set>
#include <span>
#include <string>

#include "pipeline/contract/shot/shot.h"

namespace drench::sim_tests {

using Names = std::set<std::string>;

enum class Leaves {
  the_plan,  // a zero: no pass, no column
  the_bits   // out of reach: its passes are there and find nothing
};

struct Term {
  const char* name;
  FluidSolver solver;
  Shot (*without)(FluidSolver);
  void (*with)(Shot&);
  void (*idle)(Shot&);  // explicitly zero, or out of reach
  Leaves leaves;
  Names pass, group;  // that the term brings: names of the plan, and of groups of columns
};

std::span<const Term> skip_terms();

}  // namespace drench::sim_tests

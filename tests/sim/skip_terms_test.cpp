// Every term of the physics, one by one: a shot without it has no pass and no column of it, and
// the same bits as with its coefficient explicitly zero, or with the thing out of reach.

#include <gtest/gtest.h>

#include <algorithm>

#include "sim/simulator.h"
#include "tests/same_bits.h"
#include "tests/sim/skip_terms.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {}  // namespace

void PrintTo(const Term& term, std::ostream* out) { *out << term.name; }

namespace {

class SkipTerm : public testing::TestWithParam<Term> {};
INSTANTIATE_TEST_SUITE_P(All, SkipTerm, testing::ValuesIn(skip_terms().begin(), skip_terms().end()),
                         [](const auto& p) { return p.param.name; });

struct Found {
  Names pass, group;
  sim::ColumnSet allocated;
};
/// The plan of a shot and the columns that it has after some steps.
Found found_in(const Shot& shot) {
  Stepper run(shot);
  for (int k = 0; k < 3; ++k) run.step();
  Found found;
  for (const sim::PassInfo& pass : run.solver->plan()) found.pass.insert(pass.name);
  for (const sim::ColumnMemory& group : run.solver->memory()) found.group.insert(group.name);
  found.allocated = run.solver->allocated();
  return found;
}
Names beyond(const Names& all, const Names& base) {
  Names more;
  std::set_difference(all.begin(), all.end(), base.begin(), base.end(),
                      std::inserter(more, more.end()));
  return more;
}

/// Particles and cloth after a tenth of a second.
struct End {
  ParticleFrame fluid;
  std::vector<ClothFrame> cloth;
};
End end_of(const Shot& shot) {
  Simulator simulator(shot, {.device = Device::cpu, .level_set = {}});
  for (int k = 0; k < 10; ++k) simulator.advance_frame();
  return {simulator.particles(), simulator.cloth()};
}
bool same(const End& a, const End& b) {
  bool equal = test::same_bits(a.fluid.position, b.fluid.position) &&
               test::same_bits(a.fluid.velocity, b.fluid.velocity) &&
               test::same_bits(a.fluid.density, b.fluid.density) && a.fluid.id == b.fluid.id;
  for (size_t k = 0; k < a.cloth.size(); ++k) {
    equal = equal && test::same_bits(a.cloth[k].mesh.position, b.cloth[k].mesh.position) &&
            test::same_bits(a.cloth[k].mesh.velocity, b.cloth[k].mesh.velocity);
  }
  return equal;
}

TEST_P(SkipTerm, HasPassesAndColumnsOnlyWhereItIs) {
  const Term& term = GetParam();
  const Shot without = term.without(term.solver);
  Shot with = without, idle = without;
  term.with(with), term.idle(idle);
  const Found none = found_in(without), zero = found_in(idle), some = found_in(with);
  EXPECT_EQ(beyond(some.pass, none.pass), term.pass);
  EXPECT_EQ(beyond(some.group, none.group), term.group);
  if (term.leaves == Leaves::the_bits) return;
  EXPECT_EQ(none.pass, zero.pass);
  EXPECT_EQ(none.group, zero.group);
  EXPECT_EQ(none.allocated, zero.allocated);
}

TEST_P(SkipTerm, IdleChangesNoBit) {
  const Term& term = GetParam();
  const Shot without = term.without(term.solver);
  Shot with = without, idle = without;
  term.with(with), term.idle(idle);
  const End none = end_of(without);
  EXPECT_TRUE(same(none, end_of(idle)));
  EXPECT_FALSE(same(none, end_of(with)));  // the scene does meet the term
}

}  // namespace
}  // namespace drench::sim_tests

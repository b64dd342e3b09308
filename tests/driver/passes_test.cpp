// What the step plan says of passes is what they do.

#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/shot/shot_file.h"
#include "sim/step_plan.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

std::string names_of(sim::ColumnSet set) {
  std::string names;
  for (size_t k = 0; k < sim::column_group_names.size(); ++k)
    if (set.contains(sim::ColumnGroup(k)))
      names += (names.empty() ? "" : ", ") + std::string(name_of(sim::ColumnGroup(k)));
  return names;
}

struct Written {
  sim::ColumnSet changed, declared;
};

/// Shells in place of a shot's sheets, each with another just above it.
Shot with_layers(Shot shot) {
  for (size_t k = shot.cloth.size(); k-- > 0;) {
    shot.cloth[k].model = ClothModel::shell;
    Cloth above = shot.cloth[k];
    above.name += "_above", above.corner.y += 1.2 * above.thickness;
    shot.cloth.push_back(above);
  }
  return shot;
}

/// Fluid in a corner of the domain, far from the sheets, which are coarser.
Shot beside_fluid(Shot shot) {
  for (Cloth& c : shot.cloth) c.cells = V2i(6, 6);
  shot.fluid.spacing = 0.04, shot.fluid.solver = FluidSolver::incompressible;
  const V3d size(0.2, 0.08, 0.2);
  shot.fluid.box = {{.min = shot.domain.min, .max = shot.domain.min + size}};
  return shot;
}

/// The shots whose bits are kept, which use every pass, three of them with layers of shells, and
/// cloth alone in wind.
std::map<std::string, Shot> kept_shots() {
  std::map<std::string, Shot> shots;
  for (const auto& entry : std::filesystem::directory_iterator(DRENCH_SOURCE_DIR "/tests/bits"))
    if (entry.path().extension() == ".toml")
      shots[entry.path().stem()] = read_shot(entry.path(), {});
  Shot wind = shots.at("napkin");
  wind.wind.present = true, wind.wind.velocity = Animated<V3d>(V3d(3, 0, 0));
  shots["napkin in wind"] = wind;
  shots["layers"] = with_layers(shots.at("napkin"));
  shots["layers beside water"] = beside_fluid(shots.at("layers"));
  shots["layers in water"] = with_layers(shots.at("splash"));
  return shots;
}

/// By shot and pass: what launches in some steps changed.
std::map<std::pair<std::string, std::string>, Written> written_in_kept_shots() {
  std::map<std::pair<std::string, std::string>, Written> written;
  for (const auto& kept : kept_shots()) {
    Stepper run(kept.second, make_level_set);
    run.solver->observe_passes([&](const sim::PassInfo& pass, sim::ColumnSet groups) {
      Written& of = written[{kept.first, pass.name}];
      of.changed |= groups, of.declared |= pass.writes;
    });
    for (int k = 0; k < 500; ++k) run.step();
  }
  return written;
}

TEST(Passes, TouchOnlyWhatTheyDeclare) {
  std::map<std::string, sim::ColumnSet> changed, declared;
  for (const auto& [name, written] : written_in_kept_shots()) {
    EXPECT_EQ(names_of(written.changed.without(written.declared)), "")
        << name.second << " writes what it does not declare, in " << name.first;
    changed[name.second] |= written.changed, declared[name.second] |= written.declared;
  }
  for (const auto& [name, groups] : declared)
    EXPECT_EQ(names_of(groups.without(changed[name])), "") << name << " declares what it leaves";
}

}  // namespace
}  // namespace drench::sim_tests

#pragma once
// Scenes, stepping and sums that the tests of the simulator share.

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "sim/setup/scene.h"
#include "sim/solver.h"
#include "sim/stepper.h"

namespace drench::sim_tests {

/// No gravity, no walls, domain of 2 m about the origin, nothing in it; weakly compressible.
Shot empty_shot();
/// Adds a lattice of cells.x cells.y cells.z particles whose box starts at `corner`, m.
void add_box(Shot& shot, V3d corner, std::array<int, 3> cells, V3d velocity = V3d(0));
/// Adds a square horizontal sheet of `size` m about (0, height, 0), cells x cells, free at all
/// edges.
Cloth& add_sheet(Shot& shot, double size, double height, int cells);
/// Pins all four edges of a sheet added by add_sheet.
void pin_edges(Cloth& sheet);

/// The Simulator's steps, on the CPU.
struct Stepper : sim::Stepper {
  explicit Stepper(const Shot& shot, const LevelSetMaker& make_level_set = {});
  explicit Stepper(sim::Scene scene);
  /// The largest stable step, s.
  double stable_dt() { return stable_limit().dt; }
  /// The same with obstacles moving.
  double next_dt() { return limit().dt; }
  using sim::Stepper::step;
  void step() { step(next_dt()); }
  /// Steps of the largest stable size until `end` s.
  void advance(double end);
};

V3d at(const sim::HostVec& v, size_t i);
/// What a plane flow has across its plane: kinetic energy along z over all of it.
double energy_across(const sim::HostVec& velocity);
/// Index of every id in the columns of a state.
std::vector<int> place_of_id(const sim::HostState& state);

/// Momentum of fluid and cloth, kg m/s. What the collision test took from particles and cloth has not
/// received yet counts as taken from the cloth.
V3d total_momentum(const sim::Scene& scene, const sim::HostState& state);
/// Sum of m max(speed, least_speed) over particles and free vertices, kg m/s.
double momentum_scale(const sim::Scene& scene, const sim::HostState& state, double least_speed);
/// Centre of mass of the particles, m local.
V3d centre_of_mass(const sim::HostState& state);

/// Every coordinate at the start is its next float, the one before, or itself.
sim::Scene jostled(sim::Scene scene, uint64_t seed);

/// Rows of a CSV file of tests/validation/data without its comment lines; the first is the header.
std::vector<std::vector<std::string>> read_validation(const std::string& name);

/// Evenly distributed numbers in [0, 1), the same in every standard library.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  double operator()() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return double(state_ >> 11) / 9007199254740992.0;
  }

 private:
  uint64_t state_;
};

}  // namespace drench::sim_tests

#pragma once
// Shells at rest under dead loads, in double: Newton's method with a line search. What the passes'
// functions say is what it solves; it shares nothing with the solver of the simulator.

#include <memory>

#include "sim/setup/shell_rest.h"
#include "tests/sim/shell_sheets.h"
#include "tests/sim/skyline.h"

namespace drench::sim_tests {

/// Whether compressed triangles push over sideways in the matrix, as they do, or not:
/// positive_part.
enum class Tangent { exact, projected };

class ShellStatics {
 public:
  ShellStatics(const sim::ShellSurface& surface, const sim::ShellConstants& constants,
               const sim::cpu::MembraneLaw<double>& law);

  std::vector<V3d> x;     // m, of the nodes
  std::vector<V3d> load;  // N
  const sim::ShellRest& rest() const { return rest_; }
  /// Of the plane of the sheet, from now on.
  void set_law(const sim::cpu::MembraneLaw<double>& law) { law_ = law; }

  /// Adds the weight of the masses.
  void add_gravity(V3d gravity);
  double energy() const;
  std::vector<V3d> forces() const;  // N, loads as well; 0 where held
  /// Until no force exceeds `tolerance` of the largest load. @return iterations, or -1.
  int solve(double tolerance = 1e-5, int most_iterations = 400);
  /// Of the exact tangent: ways to fall from where it is.
  int negative_eigenvalues();

 private:
  bool is_held(int node) const { return !surface_.held.empty() && surface_.held[size_t(node)]; }
  void number_unknowns();  // by rising x at rest: rows are short in strips along x
  sim::cpu::SurfaceGradient<double> gradient(size_t triangle) const;
  void add_block(int a, int b, const sim::cpu::Block3<double>& block);
  int assemble(Tangent tangent);
  std::vector<double> newton_step(const std::vector<V3d>& force);
  sim::cpu::Vec3<double> place(const sim::BendingPatch& patch, int k) const;

  sim::ShellSurface surface_;
  sim::ShellRest rest_;
  sim::cpu::MembraneLaw<double> law_;
  std::vector<int> unknown_;  // of a node: its first, -1 where held
  std::unique_ptr<Skyline> matrix_;
};

}  // namespace drench::sim_tests

#pragma once
// Flat sheets that are shells, run from the text of a shot file as a user writes it.

#include <functional>

#include "tests/sim/shell_sheets.h"
#include "tests/sim/shell_statics.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {

constexpr double shell_gravity = 9.81;  // m/s^2, downwards

/// An isotropic sheet that spans size.length along `along` and size.width along `across`, unless it
/// has a shape.
struct ShellSheet {
  SheetMesh mesh = SheetMesh::diagonal;
  SheetSize size{1, 1, 8};
  V3d corner{0}, along{1, 0, 0}, across{0, 0, 1};   // m; unit vectors
  double young = 1000, bend = 1e-4, poisson = 0;    // N/m, N m
  double areal_density = 0.2, stretch_limit = 100;  // kg/m^2, 1
  double damping = 0, damping_time = 0;             // 1/s, s
  V3d gravity{0, -shell_gravity, 0};                // m/s^2
  std::function<bool(V3d)> held = {};               // of a place in its plane; empty: nothing is
  std::function<V3d(V3d)> shape = {};               // from there to its rest shape; empty: flat

  double weight() const { return areal_density * shell_gravity; }  // N/m^2
};

/// A shot file whose sheet is the OBJ file `mesh`.
std::string shell_text(const ShellSheet& sheet, const std::string& mesh);

struct ShellRun : Stepper {
  explicit ShellRun(const ShellSheet& sheet);

  sim::ShellSurface surface;  // at rest, as it stands at the start; m, world

  size_t size() const { return surface.rest.size(); }
  /// Of a vertex at rest, in the plane of the sheet.
  V3d flat(size_t vertex) const { return flat_[vertex]; }
  /// m, world, with what single precision rounded off.
  std::vector<V3d> places() const;
  std::vector<V3d> velocities() const;
  /// Starts anew from there.
  void start_from(const std::vector<V3d>& places, const std::vector<V3d>& velocities);
  /// Mean of `places` over the vertices whose places at rest in the plane `where` is true of.
  V3d mean(const std::function<bool(V3d)>& where) const;
  /// J, in double: kinetic, of gravity, and elastic by the energies that forces derive from.
  double energy() const;
  /// kg m/s, kg m^2/s about the centre of mass.
  V3d momentum() const;
  V3d spin() const;

 private:
  std::vector<V3d> flat_;
  mutable ShellStatics statics_;
  V3d origin_;
};

}  // namespace drench::sim_tests

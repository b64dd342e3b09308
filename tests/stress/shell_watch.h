#pragma once
// A run with shells that is measured after every step, outside the solver and in double.

#include <string>
#include <vector>

#include "tests/stress/report.h"
#include "tests/stress/watch.h"

namespace drench::stress_tests {

/// What a run with shells did.
struct ShellFigures {
  int vertices = 0, particles = 0, steps = 0;
  double cpu_ms = 0;       // of the solver, a step, all threads
  double max_speed = 0;    // m/s, of particles and vertices
  double speed_bound = 0;  // m/s: 3 sqrt(2 g H), the fastest at the start, and the fastest of pins
                           // and obstacles; H from the highest start to the lowest place
  double energy = 0;       // most that the total was above its start, over the energy at the start
  double nearest = 0;      // least distance of pieces of sheets, over what they keep; 2: or more
  int meetings = 0;        // pairs of an edge and a triangle with a point in common, in all steps
  int leaks = 0;           // paths of particles through triangles, in all steps
  int capped = 0;          // steps whose pressure solve took all the iterations there are
  bool finite = true;      // and no blow-up that the solver would report
  bool whole = true;       // no particle lost or doubled
};

/// What all rows of shells are to hold. One that must ask for less says why.
struct ShellGates {
  double speed = 1, energy = 0.02;
  double nearest = 0.5;
  int meetings = 0;
  int blow_ups = 0;  // 1 where the run may end in one that the solver tells
};

/// How the steps and what is measured of a run differ from the rule.
struct ShellRunOptions {
  double step = 1;        // times the solver's own
  double driven = 0;      // m/s, the fastest of obstacles
  int nearest_every = 5;  // steps between two measures of distance
};

class ShellWatch {
 public:
  explicit ShellWatch(const Shot& shot, const ShellRunOptions& how = {},
                      const LevelSetMaker& make_level_set = {});
  explicit ShellWatch(sim::Scene scene, const ShellRunOptions& how = {});

  /// @return false once the state is not finite, or something is a hundred times as fast as the
  /// bound: the run is over.
  bool until(double time);
  const sim::HostState& state() const { return last_; }
  ShellFigures figures() const;
  double last_speed() const { return last_speed_; }  // m/s, of the fastest

  Stepper run;

 private:
  bool thrown() const;
  void measure(double cpu_s);
  double energy(const sim::HostState& state) const;

  ShellRunOptions how_;
  ShellFigures figures_;
  sim::HostState last_;
  double energy_ = 0, gained_ = 0, scale_ = 0;  // J
  double highest_ = 0, lowest_ = 0;             // m
  double fastest_ = 0, last_speed_ = 0;         // m/s
  double cpu_s_ = 0;
};

/// Adds a row of the table of shells and expects the gates to hold. The row says which of the
/// common gates fail, whatever the test itself asks for.
void report(const std::string& stress, const std::string& setting, const ShellWatch& watch,
            const ShellGates& gates = {}, const std::string& measured = "");

}  // namespace drench::stress_tests

#pragma once
// A run that is measured after every step, outside the solver and in double, by the rules that all
// stress tests share.

#include <functional>
#include <string>
#include <vector>

#include "tests/sim/support.h"

namespace drench::stress_tests {

using namespace sim_tests;

/// What a run did. Compressions are max(rho / rho_0 - 1, 0) from the 10th step on, rho the
/// Wendland sum over the particles that no sheet hides, and the walls' closed form. A sheet's own
/// share is not in it: what is pressed against one shows where particles come near each other.
struct Figures {
  int particles = 0, steps = 0;
  double time = 0;         // s simulated
  double cpu_ms = 0;       // of the solver, a step, all threads
  double max_speed = 0;    // m/s, of particles and vertices
  double speed_bound = 0;  // m/s, 3 sqrt(2 g H) + fastest at the start; H from the highest start
                           // to the lowest place of the run
  double energy = 0;       // most that the total was above its start, over the energy at the start
  double mean = 0, p999 = 0, worst = 0;  // compression: over particles and samples
  double drift = 0;   // of the momentum, over sum m max(speed, sqrt(gH)); 0 unless it is closed
  int crossings = 0;  // pairs of particle and triangle in all substeps
  int capped = 0;     // steps whose pressure solve took all the iterations there are
  uint64_t guard_hits = 0;  // particles that the collision test held back
  bool finite = true;       // and no blow-up that the solver would report
  bool whole = true;        // no particle lost or doubled
};

class Watch {
 public:
  /// @param sample_every  steps between two measures of density; 0 is none.
  explicit Watch(const Shot& shot, int sample_every = 5);
  explicit Watch(sim::Scene scene, int sample_every = 5);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// @return false once the state is not finite: the run is over.
  bool step(double dt);
  bool step() { return step(run.stable_dt()); }
  /// Steps of the largest stable size.
  bool until(double time);
  bool steps(int count);

  /// Of the fastest particle or vertex, m/s.
  double last_speed() const { return last_speed_; }
  const sim::HostState& state() const { return last_; }
  Figures figures() const;

  Stepper run;

 private:
  void start();
  void observe(const sim::HostState& state);
  void measure();
  double energy(const sim::HostState& state);

  int sample_every_;
  bool closed_ = false;
  Figures figures_;
  sim::HostState last_;
  V3d momentum_{0}, period_{0};
  double energy_ = 0, gained_ = 0;                // J
  double height_ = 0, highest_ = 0, lowest_ = 0;  // m; of the mean mass at the start, and of all
  double mass_ = 0, kinetic_ = 0, fastest_ = 0, last_speed_ = 0;
  double cpu_s_ = 0, observing_ = 0;
  double compression_ = 0, samples_ = 0;
  std::vector<float> compressed_;  // those above 0.1 %
};

/// rho / rho_0 of every particle; see Figures.
std::vector<double> densities(const sim::Scene& scene, const sim::HostState& state);

/// CPU time of the process, s.
double cpu_seconds();

}  // namespace drench::stress_tests

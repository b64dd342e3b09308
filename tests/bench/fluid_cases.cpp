// Cases fluid_martin_moyce, fluid_rest and fluid_lobovsky: flows with a known answer
// (tests/validation).
//
// Cases fluid_dam_64k and fluid_dam_250k: a cube of water of 1 m collapses in a tank of 3 x 2 x 1
// m, with the time step 0.4 a / v, capped. Time against the mean of max(rho / rho_0 - 1, 0) over
// particles and steps, density measured anew at the positions a step ends with, off the clock. The
// gates are what the best open CPU solver reached on this scene (SPlisHSPlasH 2.16 DFSPH, 2.1 GHz
// Xeon): 0.013 % in 258 CPU s and 0.10 % in 107 CPU s for 64,000 particles and 1 s; 318 CPU s for
// 250,047 particles and 0.25 s.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sim/setup/scene.h"
#include "sim/solver.h"
#include "tests/bench/bench.h"
#include "tests/sim/support.h"
#include "tests/validation/fluid.h"
#include "tests/validation/lobovsky.h"

namespace drench::bench {
namespace {

struct Dam {
  int side;         // particles along an edge of the cube
  double end, cap;  // s; longest step
};

struct Quality {
  double tolerance, gate;  // asked of the solver; what the mean error must not pass
};

/// Sums over the steps after the first 5 ms.
struct Errors {
  double mean = 0, percentile = 0, worst = 0;  // of max(rho / rho_0 - 1, 0)
  int steps = 0;

  void add(std::vector<float> density, double rest) {
    for (float& d : density) d = std::max(0.f, d / float(rest) - 1.f);
    double sum = 0;
    for (const float d : density) sum += d;
    const auto high = density.begin() + long(0.999 * double(density.size()));
    std::nth_element(density.begin(), high, density.end());
    mean += sum / double(density.size()), percentile += *high;
    worst = std::max(worst, double(*std::max_element(high, density.end())));
    ++steps;
  }
};

Shot dam_shot(const Dam& dam, double tolerance) {
  Shot shot;
  shot.name = shot.file = "dam";
  shot.fluid.spacing = 1.0 / dam.side;
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.tolerance = tolerance;
  shot.domain.min = V3d(0), shot.domain.max = V3d(3, 2, 1);
  shot.fluid.box = {{V3d(0), V3d(1), V3d(0)}};
  return shot;
}

struct Energies {
  double kinetic = 0, potential = 0;  // J/kg, sums over the particles
};
Energies energies(const sim::HostState& s) {
  Energies e;
  for (size_t i = 0; i < s.id.size(); ++i) {
    const double vx = s.velocity.x[i], vy = s.velocity.y[i], vz = s.velocity.z[i];
    e.kinetic += 0.5 * (vx * vx + vy * vy + vz * vz);
    e.potential += 9.81 * s.position.y[i];
  }
  return e;
}

void run_dam(const Dam& dam, const Quality& quality, const Emit& emit) {
  sim_tests::Stepper run(dam_shot(dam, quality.tolerance));
  const double start = energies(run.scene.start).potential;
  Measured total;
  Errors errors;
  double kick = 0, half = 0, iterations = 0;
  while (run.time < dam.end - 1e-9) {
    const double dt = std::min({run.stable_dt(), dam.cap, dam.end - run.time});
    const Measured cost = measure([&] { run.step(dt); });
    total.wall_s += cost.wall_s, total.cpu_s += cost.cpu_s;
    total.peak_mib = std::max(total.peak_mib, cost.peak_mib);
    iterations += run.limits.iterations;
    if (run.time <= 0.005) kick = energies(run.solver->save()).kinetic / start;
    if (run.time <= 0.005) continue;
    run.solver->refresh();
    errors.add(run.solver->density(), run.scene.parameters.rest_density);
    if (half == 0 && run.time >= 0.5) {
      const Energies e = energies(run.solver->save());
      half = (e.kinetic + e.potential) / start;
    }
  }
  const Energies e = energies(run.solver->save());
  Line line;
  line.method = "incompressible, tolerance " + std::to_string(100 * quality.tolerance) + " %";
  line.resolution = std::to_string(run.scene.start.id.size()) + " particles";
  line.time_step = dam.end / double(run.steps);
  line.threads = hardware_threads();
  line.cost = total;
  line.error = errors.mean / errors.steps;
  line.error_of = "mean of max(rho / rho_0 - 1, 0)";
  line.gate = quality.gate;
  line.more["steps"] = run.steps;
  line.more["iterations_a_step"] = iterations / double(run.steps);
  line.more["percentile_99_9"] = errors.percentile / errors.steps;
  line.more["worst"] = errors.worst;
  line.more["kick"] = kick;
  if (half > 0) line.more["energy_at_0.5_s"] = half;
  line.more["energy_at_end"] = (e.kinetic + e.potential) / start;
  emit(line);
}

const Registration dam_64k{
    "fluid_dam_64k", "time and density error of a collapsing cube of water",
    [](const Emit& emit) {
      for (const Quality q :
           sizes({Quality{3e-3, 1e-3}, Quality{1.5e-3, 1e-3}, Quality{5e-4, 1e-3},
                  Quality{2e-4, 1.3e-4}, Quality{1e-4, 1.3e-4}, Quality{5e-5, 1.3e-4}},
                 2))
        run_dam({40, 1.0, 4e-3}, q, emit);
    },
    InQuick::yes};
const Registration dam_250k{"fluid_dam_250k", "the same, finer, its first quarter of a second",
                            [](const Emit& emit) {
                              for (const Quality q : {Quality{2e-4, 1.3e-4}})
                                run_dam({63, 0.25, 2e-3}, q, emit);
                            }};

void martin_moyce(const Emit& emit) {
  for (const int across : sizes({10, 20, 40, 60}, 2)) {
    validation::Collapse result;
    Line line;
    line.cost = measure([&] { result = validation::martin_moyce(across, 1e-4); });
    line.method = "incompressible, tolerance 0.01 %";
    line.resolution = std::to_string(result.particles) + " particles, " + std::to_string(across) +
                      " across the column";
    line.threads = hardware_threads();
    line.error = result.front, line.gate = 0.05;
    line.error_of = "RMS of the front's relative error";
    line.more["shift"] = result.shift;
    line.more["slope"] = result.slope;
    line.more["height_rms"] = result.height;
    line.more["energy_across"] = result.thickness;
    emit(line);
  }
}

void resting_column(const Emit& emit) {
  for (const int layers : sizes({10, 20, 40}, 1)) {
    validation::Rest result;
    Line line;
    line.cost = measure([&] { result = validation::resting_column(layers, 5, 10, 1e-5); });
    line.method = "incompressible, tolerance 0.001 %";
    line.resolution =
        std::to_string(result.particles) + " particles, " + std::to_string(layers) + " layers";
    line.threads = hardware_threads();
    line.error = result.pressure;
    line.error_of = "RMS of the pressure's error over rho g H, by slabs";
    if (layers == 40) line.gate = 0.02;
    line.more["density_error"] = result.density;
    line.more["drift"] = result.drift;
    line.more["volume"] = result.volume;
    emit(line);
  }
}

void lobovsky(const Emit& emit) {
  for (const int across : sizes({20, 30, 40}, 1)) {
    validation::Impact result;
    Line line;
    line.cost = measure([&] { result = validation::lobovsky(across, 1e-4); });
    line.method = "incompressible, tolerance 0.01 %";
    line.resolution = std::to_string(result.particles) + " particles, " + std::to_string(across) +
                      " over the column's height";
    line.threads = hardware_threads();
    line.error = std::abs(result.time), line.gate = 0.03;
    line.error_of = "relative error of the time of impact";
    line.more["impulse"] = result.impulse;
    line.more["peak"] = result.peak;
    line.more["plateau"] = result.plateau;
    line.more["plateau_P"] = result.wall;
    line.more["plateau_over_frictionless"] = result.frictionless;
    line.more["energy_across"] = result.thickness;
    emit(line);
  }
}

const Registration impact{"fluid_lobovsky", "a collapsing column hits a wall with a pressure probe",
                          lobovsky, InQuick::yes};
const Registration collapse{"fluid_martin_moyce", "a collapsing column against the experiment",
                            martin_moyce, InQuick::yes};
const Registration rest{"fluid_rest", "a column at rest for 10 s", resting_column, InQuick::yes};

}  // namespace
}  // namespace drench::bench

// Cases flow_standing_wave, flow_elliptical_drop and flow_taylor_green: plane flows with a closed
// form (tests/validation/plane_flow.h), time against error.

#include <cmath>
#include <string>

#include "tests/bench/bench.h"
#include "tests/validation/plane_flow.h"

namespace drench::bench {
namespace {

Line line_of(double tolerance, int particles, const std::string& across, const Measured& cost) {
  Line line;
  line.method = "incompressible, tolerance " + std::to_string(100 * tolerance) + " %";
  line.resolution = std::to_string(particles) + " particles, " + across;
  line.threads = hardware_threads();
  line.cost = cost;
  return line;
}

void standing_wave(const Emit& emit) {
  for (const int layers : sizes({10, 20, 40}, 2)) {
    validation::StandingWave wave;
    const Measured cost = measure([&] { wave = validation::standing_wave(layers, 1e-4, 5); });
    Line line = line_of(1e-4, wave.particles, std::to_string(layers) + " layers", cost);
    line.error = std::abs(wave.period), line.error_of = "relative error of the period, of five";
    if (layers == 40) line.gate = 0.01;
    line.more["amplitude_kept"] = wave.amplitude;
    line.more["energy_across"] = wave.thickness;
    emit(line);
  }
}

void elliptical_drop(const Emit& emit) {
  for (const int across : sizes({12, 25, 50}, 2)) {
    validation::EllipticalDrop drop;
    const Measured cost = measure([&] { drop = validation::elliptical_drop(across, 1e-4, 0.8); });
    Line line = line_of(1e-4, drop.particles, std::to_string(across) + " to the radius", cost);
    line.error = drop.axis, line.error_of = "largest relative error of the half axes to t A = 0.8";
    if (across == 50) line.gate = 0.01;
    line.more["energy_change"] = drop.energy;
    line.more["energy_across"] = drop.thickness;
    emit(line);
  }
}

void taylor_green(const Emit& emit) {
  struct Size {
    int across;
    double gate;
  };
  for (const Size size : sizes({Size{50, 0.05}, Size{100, 0.02}, Size{200, 0.01}}, 1)) {
    validation::TaylorGreen flow;
    const Measured cost = measure([&] { flow = validation::taylor_green(size.across, 1e-4, 1); });
    Line line = line_of(1e-4, flow.particles, std::to_string(size.across) + " to the side", cost);
    line.error = std::abs(flow.rate),
    line.error_of = "relative error of the decay rate, t U/L to 1";
    line.gate = size.gate;
    line.more["rate_of_mode"] = flow.mode;
    line.more["rate"] = flow.rate;
    line.more["friction_of_pairs"] = flow.friction;
    line.more["speed_error"] = flow.speed;
    line.more["density_spread"] = flow.density;
    line.more["energy_across"] = flow.thickness;
    line.more["iterations_a_step"] = double(flow.iterations) / flow.steps;
    emit(line);
  }
}

const Registration wave{"flow_standing_wave", "a standing wave against linear theory",
                        standing_wave, InQuick::yes};
const Registration drop{"flow_elliptical_drop", "a drop in a straining flow", elliptical_drop,
                        InQuick::yes};
const Registration vortices{"flow_taylor_green", "decaying vortices at Re = 100", taylor_green,
                            InQuick::yes};

}  // namespace
}  // namespace drench::bench

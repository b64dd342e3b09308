// Case wave_maker: a piston in a plane tank against the transfer function of linear theory
// (tests/validation/wave_maker.h).

#include <cmath>
#include <string>

#include "tests/bench/bench.h"
#include "tests/validation/wave_maker.h"

namespace drench::bench {
namespace {

void piston(const Emit& emit) {
  for (const int layers : sizes({10, 20, 30}, 1)) {
    validation::WaveMaker wave;
    Line line;
    line.cost = measure([&] { wave = validation::wave_maker(layers, 1e-3); });
    line.method = "incompressible, tolerance 0.1 %";
    line.resolution =
        std::to_string(wave.particles) + " particles, " + std::to_string(layers) + " layers";
    line.threads = hardware_threads();
    line.error = std::abs(wave.made - 1),
    line.error_of = "height over stroke at the piston to linear theory";
    if (layers == 30) line.gate = 0.05;
    line.more["signed"] = wave.made - 1;
    line.more["carried"] = wave.carried;
    line.more["decay_a_wavelength"] = wave.decay;
    line.more["wavelength"] = wave.length;
    line.more["energy_across"] = wave.thickness;
    line.more["steps"] = wave.steps;
    emit(line);
  }
}

const Registration wave_maker{"wave_maker", "a piston's waves against linear theory", piston,
                              InQuick::yes};

}  // namespace
}  // namespace drench::bench

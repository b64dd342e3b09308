// Cases of shells against measurements and under water. shell_in_water: a plate under water and
// the elastic gate of Antoci et al. fabric_drape: Cusick's drape coefficient of the fabrics.

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/bench/bench.h"
#include "tests/validation/fabric_drape.h"
#include "tests/validation/shell_in_water.h"

namespace drench::bench {
namespace {

void plates(const Emit& emit) {
  for (const int across : sizes({6, 10, 20}, 2)) {
    Line line;
    line.method = "plate under water";
    line.resolution = std::to_string(across) + " across";
    line.threads = hardware_threads();
    line.cost = measure([&] { line.error = std::abs(validation::plate_under_water(across) - 1); });
    line.error_of = "deflection of the middle over that of the closed form, less 1";
    if (across == 20) line.gate = 0.05;
    emit(line);
  }
}

void gates(const Emit& emit) {
  for (const double a : sizes({8e-3, 5e-3, 3.5e-3}, 1)) {
    validation::OpenedGate gate;
    const Measured cost = measure([&] { gate = validation::opened_gate(a); });
    for (const bool aside : {true, false}) {
      Line line;
      line.method = aside ? "elastic gate, aside" : "elastic gate, up";
      line.resolution = std::to_string(int(std::lround(0.14 / a))) + " layers";
      line.threads = hardware_threads();
      line.cost = cost;
      if (!gate.blew_up) line.error = aside ? gate.x : gate.y;
      line.error_of = "RMS of the tip's place over 0.3 s, over 46.4 mm";
      if (a < 8e-3) line.gate = 0.12;
      line.more["most_aside_mm"] = 1e3 * gate.most;
      line.more["most_aside_s"] = gate.most_time;
      emit(line);
    }
  }
}

void shell_in_water(const Emit& emit) {
  plates(emit);
  gates(emit);
}

void fabric_drape(const Emit& emit) {
  for (const validation::MeasuredDrape& known : validation::measured_drapes()) {
    for (const int rings : sizes({15, 20, 25}, 1)) {
      validation::Drape drape;
      Line line;
      line.cost = measure([&] { drape = validation::fabric_drape(known.fabric, rings); });
      line.method = known.fabric;
      line.resolution = std::to_string(rings) + " rings";
      line.threads = 1;
      const double found = drape.coefficient;
      if (drape.unsolved_loads == 0)
        line.error = std::max({known.least - found, found - known.most, 0.}) / 100;
      line.error_of = "drape coefficient beyond what was measured";
      if (rings == 25) line.gate = 0;
      line.more["drape_coefficient"] = found;
      line.more["measured_least"] = known.least, line.more["measured_most"] = known.most;
      line.more["ways_to_fall"] = drape.ways_to_fall;
      emit(line);
    }
  }
}

const Registration water{"shell_in_water",
                         "a plate under water and an elastic gate: time and error", shell_in_water,
                         InQuick::yes};
const Registration drape{"fabric_drape", "drape coefficients of the fabrics", fabric_drape,
                         InQuick::yes};

}  // namespace
}  // namespace drench::bench

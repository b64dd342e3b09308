// Case fluid_drop: a drop with surface tension in zero gravity (tests/validation/drop.h).

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/bench/bench.h"
#include "tests/validation/drop.h"

namespace drench::bench {
namespace {

void run_drop(double radius, const Emit& emit) {
  validation::Drop drop;
  Line line;
  line.cost = measure([&] { drop = validation::oscillating_drop(radius); });
  line.method = "attraction along the surface";
  line.resolution = std::to_string(int(radius)) + " spacings to the radius";
  line.error = std::max(std::abs(drop.period - 1), std::abs(drop.jump - 1));
  line.error_of = "period of mode 2 and mean pressure, the worse of them";
  if (radius >= 10) line.gate = 0.05;
  line.more["particles"] = drop.particles, line.more["period"] = drop.period;
  line.more["laplace_jump"] = drop.jump, line.more["current"] = drop.current;
  line.more["momentum"] = drop.momentum, line.more["amplitude_kept"] = drop.kept;
  emit(line);
}

const Registration fluid_drop{"fluid_drop", "a drop: period, pressure, currents",
                              [](const Emit& emit) {
                                for (const double radius : sizes({7., 10., 15.}, 1))
                                  run_drop(radius, emit);
                              },
                              InQuick::yes};

}  // namespace
}  // namespace drench::bench

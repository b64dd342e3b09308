#include "sim/setup/wall_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace drench::sim {

WallTableData build_wall_table(double ratio) {
  WallTableData table{};
  constexpr double pi = std::numbers::pi;
  constexpr int offsets = 8;  // a side; the mean over offsets converges to the integral
  const int reach = int(std::ceil(ratio)) + 1;
  const double cell = 1 / ratio;  // lattice spacing in units of h
  for (int k = 0; k <= WallTableData::samples; ++k) {
    const double q = double(k) / WallTableData::samples;
    double density = 0, viscosity = 0;
    for (int o = 0; o < offsets * offsets; ++o) {
      const double ox = (o % offsets + 0.5) / offsets, oy = (o / offsets + 0.5) / offsets;
      for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach; ++i) {
          const double x = (i - ox) * cell, y = (j - oy) * cell;
          const double r2 = q * q + x * x + y * y;
          if (r2 >= 1) continue;
          density += 315 / (64 * pi) * std::pow(1 - r2, 3);
          viscosity += 45 / pi * (1 - std::sqrt(r2));
        }
      }
    }
    const double mean = cell * cell / (offsets * offsets);
    table.density[k] = float(density * mean);
    table.viscosity[k] = float(viscosity * mean);
  }
  return table;
}

}  // namespace drench::sim

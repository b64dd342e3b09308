#include "tests/validation/fabric_drape.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/shot/fabrics.h"
#include "tests/sim/shell_statics.h"

namespace drench::validation {
namespace {

using Imath::V3d;
using namespace sim::cpu;
using namespace sim_tests;

constexpr double disc = 0.15, support = 0.09;  // m

/// A disc of `rings` rings of vertices, six more in each; what lies on the support is held.
sim::ShellSurface disc_sheet(int rings) {
  sim::ShellSurface s;
  const auto first = [](int ring) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1); };
  for (int ring = 0; ring <= rings; ++ring) {
    for (int k = 0; k < std::max(1, 6 * ring); ++k) {
      const double r = ring * disc / rings, angle = k * M_PI / (3 * std::max(1, ring));
      s.rest.push_back({r * std::cos(angle), r * std::sin(angle), 0});
    }
  }
  for (int ring = 1; ring <= rings; ++ring) {
    const auto outer = [&](int k) { return first(ring) + k % (6 * ring); };
    const auto inner = [&](int k) {
      return ring == 1 ? 0 : first(ring - 1) + k % (6 * (ring - 1));
    };
    for (int sector = 0; sector < 6; ++sector) {
      for (int k = 0; k < ring; ++k) {
        const int out = sector * ring + k, in = sector * (ring - 1) + k;
        s.triangle.push_back({inner(in), outer(out), outer(out + 1)});
        if (k + 1 < ring) s.triangle.push_back({inner(in), outer(out + 1), inner(in + 1)});
      }
    }
  }
  find_neighbours(s);
  hold(s, [](V3d x) { return x.length() < support + 1e-6; });
  return s;
}

bool covers(const V3d (&corner)[3], double x, double y) {
  int left = 0, right = 0;
  for (int k = 0; k < 3; ++k) {
    const V3d side = corner[(k + 1) % 3] - corner[k];
    const double turn = side.x * (y - corner[k].y) - side.y * (x - corner[k].x);
    left += turn >= 0, right += turn <= 0;
  }
  return left == 3 || right == 3;
}

/// Share of the overhanging ring that the shadow of the draped disc covers, %.
double drape_coefficient(const sim::ShellSurface& surface, const std::vector<V3d>& x) {
  constexpr double cell = 5e-4;
  constexpr int half = 340, side = 2 * half;
  std::vector<char> dark(size_t(side) * side, 0);
  for (const auto& t : surface.triangle) {
    const V3d corner[3] = {x[t[0]], x[t[1]], x[t[2]]};
    const auto [west, east] = std::minmax({corner[0].x, corner[1].x, corner[2].x});
    const auto [south, north] = std::minmax({corner[0].y, corner[1].y, corner[2].y});
    for (int i = int(std::ceil(west / cell)); i * cell <= east; ++i)
      for (int j = int(std::ceil(south / cell)); j * cell <= north; ++j)
        if (std::max(std::abs(i), std::abs(j)) < half && covers(corner, i * cell, j * cell))
          dark[size_t(j + half) * side + size_t(i + half)] = 1;
  }
  const double shadow = double(std::count(dark.begin(), dark.end(), 1)) * cell * cell;
  return 100 * (shadow - M_PI * support * support) / (M_PI * (disc * disc - support * support));
}

}  // namespace

const std::vector<MeasuredDrape>& measured_drapes() {
  static const std::vector<MeasuredDrape> all{{"cotton", 60, 76},
                                              {"wool", 40, 70},
                                              {"leather", 47, 70},
                                              {"denim", 70, 90},
                                              {"silk", 20, 40}};
  return all;
}

Drape fabric_drape(const std::string& fabric, int rings) {
  const Fabric& f = *find_fabric(fabric);
  const sim::ShellSurface surface = disc_sheet(rings);
  const auto moduli = orthotropic(f.young_warp, f.young_weft, f.shear, f.poisson);
  ShellStatics sheet(
      surface,
      {f.areal_density, sim::rigidity_of_fabric(f.bend_warp, f.bend_weft, f.bend_bias, f.poisson)},
      {moduli, strain_limit(f.stretch_limit, moduli.c11), 0});
  for (V3d& x : sheet.x) {
    const double beyond = std::max(0., (x.length() - support) / (disc - support));
    x.z += 0.01 * beyond * std::cos(6 * std::atan2(x.y, x.x) + 0.4);
  }
  Drape found;
  for (const double part : {0.25, 0.5, 0.75, 1.}) {
    sheet.load.assign(sheet.x.size(), V3d(0));
    sheet.add_gravity(V3d(0, 0, -9.81 * part));
    found.unsolved_loads += sheet.solve(part < 1 ? 3e-2 : 1e-3) < 0;
  }
  found.ways_to_fall = sheet.negative_eigenvalues();
  found.coefficient = drape_coefficient(surface, sheet.x);
  return found;
}

}  // namespace drench::validation

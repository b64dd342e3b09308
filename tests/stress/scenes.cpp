#include "tests/stress/scenes.h"

#include <set>
#include <string>

#include "pipeline/contract/files/mesh_file.h"

namespace drench::stress_tests {

using namespace sim_tests;

Shot water(double spacing) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = spacing;
  return shot;
}

void cotton(Cloth& sheet) {
  sheet.areal_density = 0.2, sheet.retardation_time = 0.005;
  sheet.adjacent_stiffness = 6000, sheet.diagonal_stiffness = 3000;
}

Shot fall_on_sheet(double mass_ratio, int cells) {
  const double a = 0.02, half = 8 * a;
  Shot shot = water(a);
  shot.domain.min = V3d(-half, -0.5, -half), shot.domain.max = V3d(half, 0.5, half);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(-6 * a, 0.1, -6 * a), {12, 5, 12});
  Cloth& sheet = add_sheet(shot, 2 * half, 0, cells);
  cotton(sheet);
  sheet.areal_density = 1000 * a / mass_ratio;
  pin_edges(sheet);
  return shot;
}

Cloth& add_mesh(Shot& shot, const TriangleMesh& mesh, const test::TemporaryFolder& folder) {
  Cloth sheet;
  sheet.name = "mesh" + std::to_string(shot.cloth.size());
  sheet.mesh_file = folder / (sheet.name + ".ply");
  write_mesh(sheet.mesh_file, mesh);
  cotton(sheet);
  // Edges that one triangle has run along the rim.
  std::set<std::pair<uint32_t, uint32_t>> edge;
  for (const auto& t : mesh.triangle)
    for (int k = 0; k < 3; ++k) edge.insert({t[k], t[(k + 1) % 3]});
  std::set<uint32_t> rim;
  for (const auto& [a, b] : edge)
    if (!edge.count({b, a})) rim.insert({a, b});
  if (!rim.empty()) sheet.pin.push_back({std::vector<uint32_t>(rim.begin(), rim.end()), {}});
  shot.cloth.push_back(sheet);
  return shot.cloth.back();
}

TriangleMesh square_mesh(double size, double height, const std::vector<double>& line) {
  TriangleMesh mesh;
  const uint32_t n = uint32_t(line.size());
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = 0; i < n; ++i)
      mesh.position.emplace_back(float(size * (line[i] - 0.5)), float(height),
                                 float(size * (line[j] - 0.5)));
  }
  for (uint32_t j = 0; j + 1 < n; ++j) {
    for (uint32_t i = 0; i + 1 < n; ++i) {
      const uint32_t a = j * n + i, b = a + 1, c = b + n, d = a + n;
      mesh.triangle.emplace_back(a, d, c);
      mesh.triangle.emplace_back(a, c, b);
    }
  }
  mesh.velocity.resize(mesh.position.size(), V3f(0));
  return mesh;
}

}  // namespace drench::stress_tests

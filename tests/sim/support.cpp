#include "tests/sim/support.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace drench::sim_tests {

Shot empty_shot() {
  Shot shot;
  shot.name = "test", shot.file = "test.toml";
  shot.gravity = V3d(0);
  shot.fluid.solver = FluidSolver::weakly_compressible;
  shot.domain.min = V3d(-1), shot.domain.max = V3d(1);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  return shot;
}

void add_box(Shot& shot, V3d corner, std::array<int, 3> cells, V3d velocity) {
  const V3d size = V3d(cells[0], cells[1], cells[2]) * shot.fluid.spacing;
  shot.fluid.box.push_back({corner, corner + size, velocity});
}

Cloth& add_sheet(Shot& shot, double size, double height, int cells) {
  Cloth cloth;
  cloth.corner = V3d(-size / 2, height, -size / 2);
  cloth.u = V3d(size, 0, 0), cloth.v = V3d(0, 0, size);
  cloth.cells = V2i(cells, cells);
  shot.cloth.push_back(cloth);
  return shot.cloth.back();
}

void pin_edges(Cloth& sheet) {
  ClothPin pin;
  const int n = sheet.cells.x + 1;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      if (i == 0 || j == 0 || i == n - 1 || j == n - 1) pin.vertices.push_back(uint32_t(j * n + i));
    }
  }
  sheet.pin.push_back(pin);
}

Stepper::Stepper(const Shot& shot, const LevelSetMaker& make_level_set)
    : Stepper(sim::build_scene(shot, make_level_set)) {}

namespace {

sim::Stepper on_cpu(sim::Scene scene) {
  std::unique_ptr<sim::Solver> solver = sim::cpu::make_solver(scene.parameters, scene.cloth);
  return {std::move(scene), std::move(solver)};
}

}  // namespace

Stepper::Stepper(sim::Scene scene) : sim::Stepper(on_cpu(std::move(scene))) {}

void Stepper::advance(double end) {
  while (time < end) step_towards(end, next_dt());
}

V3d at(const sim::HostVec& v, size_t i) { return V3d(v.x[i], v.y[i], v.z[i]); }

double energy_across(const sim::HostVec& velocity) {
  double all = 0, across = 0;
  for (size_t i = 0; i < velocity.x.size(); ++i)
    all += at(velocity, i).length2(), across += velocity.z[i] * velocity.z[i];
  return across / all;
}

std::vector<int> place_of_id(const sim::HostState& state) {
  std::vector<int> place(state.id.size());
  for (size_t i = 0; i < state.id.size(); ++i) place.at(state.id[i]) = int(i);
  return place;
}

V3d total_momentum(const sim::Scene& scene, const sim::HostState& state) {
  V3d sum(0);
  for (size_t i = 0; i < state.id.size(); ++i) {
    sum += at(state.velocity, i) * double(scene.parameters.particle_mass);
    if (state.owed.size() > 0) sum -= at(state.owed, i);
  }
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v) {
    sum += at(state.cloth_velocity, v) * double(scene.cloth.mass[v]);
  }
  return sum;
}

double momentum_scale(const sim::Scene& scene, const sim::HostState& state, double least_speed) {
  double sum = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    sum += scene.parameters.particle_mass * std::max(at(state.velocity, i).length(), least_speed);
  }
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v) {
    sum += scene.cloth.mass[v] * std::max(at(state.cloth_velocity, v).length(), least_speed);
  }
  return sum;
}

V3d centre_of_mass(const sim::HostState& state) {
  V3d sum(0);
  for (size_t i = 0; i < state.id.size(); ++i) sum += at(state.position, i);
  return sum / double(state.id.size());
}

sim::Scene jostled(sim::Scene scene, uint64_t seed) {
  Random random(seed);
  for (sim::HostVec* column : {&scene.start.position, &scene.start.cloth_position}) {
    for (std::vector<float>* x : {&column->x, &column->y, &column->z})
      for (float& coordinate : *x)
        coordinate = std::nextafter(coordinate, coordinate + float(std::floor(3 * random())) - 1);
  }
  return scene;
}

std::vector<std::vector<std::string>> read_validation(const std::string& name) {
  const char* source = std::getenv("DRENCH_SOURCE");  // set by tests/gpu/gather's run script
  std::ifstream file(std::string(source ? source : DRENCH_SOURCE_DIR) + "/tests/validation/data/" +
                     name);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> row;
    std::istringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace drench::sim_tests

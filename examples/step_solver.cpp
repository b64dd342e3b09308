// Steps the simulator from C++: a block of water falls on a sheet. Writes the particles of the last
// frame, which surface_points makes a mesh of.
//
//   build/bin/examples/step_solver points.ply

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>

#include "pipeline/contract/shot/shot.h"
#include "sim/simulator.h"

using Imath::V3d, Imath::V3f;

namespace {

// What shots/*.toml says in text, in memory; docs/shots.md has units and defaults of every member.
drench::Shot water_on_a_sheet() {
  drench::Shot shot;
  shot.name = "example";
  shot.timeline = {.first = 1, .last = 8};
  shot.domain = {.min = V3d(-0.5, 0, -0.5), .max = V3d(0.5, 1, 0.5)};
  shot.fluid.spacing = 0.02;
  drench::FluidBox block;
  block.min = V3d(-0.1, 0.45, -0.1), block.max = V3d(0.1, 0.65, 0.1);
  shot.fluid.box.push_back(block);
  drench::Cloth sheet;
  sheet.name = "sheet";
  sheet.corner = V3d(-0.3, 0.4, -0.3), sheet.u = V3d(0.6, 0, 0), sheet.v = V3d(0, 0, 0.6);
  sheet.cells = Imath::V2i(20, 20);
  drench::ClothPin corners;
  corners.vertices = {0, 20, 21 * 20, 21 * 21 - 1};  // row by row, 21 vertices each
  sheet.pin.push_back(corners);
  shot.cloth.push_back(sheet);
  return shot;
}

void write_points(const char* path, const drench::ParticleFrame& particles) {
  std::ofstream file(path);
  file << "ply\nformat ascii 1.0\nelement vertex " << particles.position.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (const V3f& x : particles.position) file << x.x << ' ' << x.y << ' ' << x.z << '\n';
  if (!file.flush()) throw std::runtime_error(std::string("cannot write ") + path);
}

void simulate(const char* path) {
  const drench::Shot shot = water_on_a_sheet();
  drench::Simulator simulator(shot, {.device = drench::Device::cpu});
  std::printf("%6s %9s %6s %10s %10s\n", "frame", "particles", "steps", "lowest m", "energy J");
  while (simulator.frame() < shot.timeline.last) {
    const drench::StepReport report = simulator.advance_frame();
    float lowest = 1e30f;
    for (const V3f& x : simulator.cloth().front().mesh.position) lowest = std::min(lowest, x.y);
    std::printf("%6d %9zu %6d %10.4f %10.4f\n", simulator.frame(), report.particles, report.steps,
                lowest, report.kinetic_energy);
  }
  write_points(path, simulator.particles());
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: step_solver POINTS.ply\n");
    return 1;
  }
  try {
    simulate(arguments[1]);
  } catch (const std::exception& error) {  // drench::Error says what is wrong and what to do
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

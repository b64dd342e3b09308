// Makes a closed mesh of points, wherever they come from: what any SPH or FLIP program writes.
//
//   build/bin/examples/surface_points points.ply 0.02 surface.ply

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "pipeline/contract/files/mesh_file.h"
#include "surfacing/surface.h"

using Imath::V3f;

namespace {

/// Points of an ASCII PLY whose vertices start with x, y and z, m.
drench::ParticleFrame read_points(const std::string& path, float spacing) {
  std::ifstream file(path);
  size_t count = 0;
  std::string line;
  while (std::getline(file, line) && line != "end_header") {
    if (line.starts_with("format") && line != "format ascii 1.0")
      throw std::runtime_error(path + ": is binary; write it as ASCII");
    if (line.starts_with("element vertex ")) count = std::stoull(line.substr(15));
  }
  drench::ParticleFrame particles;
  particles.spacing = spacing;
  for (V3f x; particles.position.size() < count && std::getline(file, line);) {
    if (!(std::istringstream(line) >> x.x >> x.y >> x.z)) break;
    particles.position.push_back(x);
  }
  if (count == 0 || particles.position.size() != count)
    throw std::runtime_error(path + ": is no PLY with vertices of x, y, z");
  particles.velocity.resize(count);  // at rest; with velocities the mesh's motion blur is right
  return particles;
}

double volume_of(const drench::TriangleMesh& mesh) {
  double volume = 0;  // by the divergence theorem: tetrahedra from the origin to each triangle
  for (const auto& t : mesh.triangle)
    volume += mesh.position[t.x].dot(mesh.position[t.y].cross(mesh.position[t.z])) / 6;
  return volume;
}

void surface(const std::string& from, float spacing, const std::string& to) {
  const drench::ParticleFrame particles = read_points(from, spacing);
  const drench::TriangleMesh mesh = drench::surface_frame(particles, drench::SurfaceSettings{});
  drench::write_mesh(to, mesh);
  const double points = double(particles.position.size()) * spacing * spacing * spacing;
  std::printf("%zu points of %.6f m^3 in all; %zu triangles enclose %.3f of that\n",
              particles.position.size(), points, mesh.triangle.size(), volume_of(mesh) / points);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) {
    std::fprintf(stderr, "usage: surface_points POINTS.ply SPACING SURFACE.ply\n");
    return 1;
  }
  try {
    surface(arguments[1], std::strtof(arguments[2], nullptr), arguments[3]);
  } catch (const std::exception& error) {  // drench::Error says what is wrong and what to do
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

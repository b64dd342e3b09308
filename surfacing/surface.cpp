#include "surfacing/surface.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "pipeline/contract/error.h"
#include "surfacing/anisotropy.h"
#include "surfacing/attributes.h"
#include "surfacing/cloth_contact.h"
#include "surfacing/field.h"
#include "surfacing/marching_cubes.h"
#include "surfacing/overlap.h"
#include "surfacing/slivers.h"
#include "surfacing/smooth.h"
#include "surfacing/velocity.h"

namespace drench {
namespace {

using namespace surfacing;

void check_range(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error(fmt::format("surface.{} is {}; it must be from {} to {}", name, value, low, high));
}

void check_settings(const ParticleFrame& particles, const SurfaceSettings& settings) {
  check_range("voxel", settings.voxel, 0.05, 4);  // the limits of the shot file
  check_range("support", settings.support, std::max(1.0, settings.voxel), 8);
  check_range("iso_value", settings.iso_value, 0.01, 0.99);
  check_range("smoothing", settings.smoothing, 0, 1000);
  check_range("memory_gib", settings.memory_gib, 1e-6, 1e6);
  if (!(particles.spacing > 0) || !std::isfinite(particles.spacing))
    throw Error(fmt::format("surfacing: the particle spacing is {} m; it must be above 0",
                            particles.spacing));
  const size_t n = particles.position.size();
  if (particles.velocity.size() != n)
    throw Error(fmt::format("surfacing: {} positions but {} velocities; a frame needs one each", n,
                            particles.velocity.size()));
  for (const size_t rows :
       {particles.source.size(), particles.age.size(), particles.wetness.size()})
    if (rows != 0 && rows != n)
      throw Error(fmt::format("surfacing: {} positions but a column of {}; a frame needs one each",
                              n, rows));
  if (n >= UINT32_MAX)
    throw Error(fmt::format("surfacing: {} particles; at most {} fit", n, UINT32_MAX - 1));
}

bool finite(V3f v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

struct Bounds {
  static constexpr size_t none = ~size_t{0};
  V3f low{std::numeric_limits<float>::max()}, high{std::numeric_limits<float>::lowest()};
  size_t bad_position = none, bad_velocity = none;  // the lowest index

  void add(const ParticleFrame& particles, size_t i) {
    const V3f p = particles.position[i];
    if (!finite(p)) bad_position = std::min(bad_position, i);
    if (!finite(particles.velocity[i])) bad_velocity = std::min(bad_velocity, i);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  static Bounds joined(Bounds a, const Bounds& b) {
    a.bad_position = std::min(a.bad_position, b.bad_position);
    a.bad_velocity = std::min(a.bad_velocity, b.bad_velocity);
    for (int axis = 0; axis < 3; ++axis) {
      a.low[axis] = std::min(a.low[axis], b.low[axis]);
      a.high[axis] = std::max(a.high[axis], b.high[axis]);
    }
    return a;
  }
};

Bounds bounds_of(const ParticleFrame& particles) {
  const Bounds bounds = tbb::parallel_reduce(
      tbb::blocked_range<size_t>(0, particles.position.size(), 16384), Bounds{},
      [&](const auto& range, Bounds part) {
        for (size_t i = range.begin(); i < range.end(); ++i) part.add(particles, i);
        return part;
      },
      [](const Bounds& a, const Bounds& b) { return Bounds::joined(a, b); });
  const auto complain = [&](size_t index, const char* what, V3f v) {
    if (index == Bounds::none) return;
    throw Error(fmt::format(
        "surfacing: the {} of particle {} is ({}, {}, {}); the frame is damaged or the simulation "
        "blew up, simulate it again",
        what, index, v.x, v.y, v.z));
  };
  if (bounds.bad_position != Bounds::none)
    complain(bounds.bad_position, "position", particles.position[bounds.bad_position]);
  if (bounds.bad_velocity != Bounds::none)
    complain(bounds.bad_velocity, "velocity", particles.velocity[bounds.bad_velocity]);
  return bounds;
}

Lattice lattice_of(const ParticleFrame& particles, const SurfaceSettings& settings,
                   const Bounds& bounds) {
  Lattice lattice;
  lattice.voxel = settings.voxel * particles.spacing;
  lattice.reach = static_cast<float>(settings.support / settings.voxel);
  lattice.voxels_per_spacing = static_cast<float>(1 / settings.voxel);
  for (lattice.bins = 8; lattice.bins > 1; lattice.bins /= 2)  // bins of at least 0.7 spacings
    if (block_edge * settings.voxel / lattice.bins > 0.7) break;
  if (const int axis = lattice.fit(bounds.low, bounds.high); axis >= 0) {
    const double extent = lattice.to_voxels(bounds.high[axis], axis);
    throw Error(fmt::format(
        "surfacing: particles are spread over {:.4g} m along {}, {:.3g} voxels of {:.4g} m; at "
        "most "
        "2^24 voxels can be told apart. Remove particles that flew away, or raise surface.voxel",
        bounds.high[axis] - bounds.low[axis], "xyz"[axis], extent, lattice.voxel));
  }
  return lattice;
}

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Memory that is left for what comes after the sorted particles, bytes.
double memory_left(size_t n, double memory_gib) {
  const double needed = 36.0 * static_cast<double>(n), max_bytes = memory_gib * (1 << 30);
  if (needed <= max_bytes) return max_bytes - needed;
  throw Error(fmt::format("surfacing: {} particles need {:.3g} GiB; surface.memory_gib is {}", n,
                          needed / (1 << 30), memory_gib));
}

/// Cloth and obstacles near the particles, on the lattice.
struct NearSolids {
  ClothSolids cloth;
  NearTriangles obstacles;
  std::optional<float> ground;  // voxels from the lattice's origin

  NearSolids(const Surroundings& around, const BinnedParticles& binned)
      : cloth(around.cloth, binned),
        obstacles(around.obstacles, binned, 2 * binned.lattice.voxels_per_spacing, "obstacle",
                  "export its mesh again") {
    if (around.ground)
      ground = static_cast<float>(binned.lattice.to_voxels(double{*around.ground}, 1));
  }
};

/// Whether the volume that the mesh encloses is measured.
enum class Volume { ignored, measured };

/// Smooth, in solids, on cloth, with normals; positions in voxels still.
struct Finished {
  LatticeMesh mesh;
  ClothContact contact;
  std::vector<V3f> normal;
};
Finished finish(LatticeMesh extracted, const NearSolids& solids, const BinnedParticles& binned,
                int passes, Volume volume, SurfaceStats& report) {
  const Lattice& lattice = binned.lattice;
  constexpr float offset = 0.02f;  // spacings before cloth
  Finished result{std::move(extracted), {}, {}};
  LatticeMesh& mesh = result.mesh;
  VertexRings rings = rings_of(mesh);
  const Components parts = components_of(mesh);
  const float spacing = lattice.voxels_per_spacing;
  result.contact = find_contact(mesh, rings, solids.cloth);
  smooth_mesh(mesh, rings, parts, passes);
  draw_in(mesh, binned);
  result.normal = normals_of(mesh, rings);
  const std::vector<uint8_t> moved =
      overlap_solids(mesh, result.contact, solids.obstacles, solids.ground, spacing);
  if (!solids.cloth.empty()) {
    report.crossing =
        lay_on_cloth(mesh, rings, result.contact, solids.cloth, result.normal, offset * spacing);
    std::vector<V3f> free = free_normals(mesh, rings, result.contact);
    for (size_t v = 0; v < free.size(); ++v)  // what is in a solid keeps what it had outside
      if (moved.empty() || !moved[v]) result.normal[v] = free[v];
  }
  smooth_normals(result.normal, rings, passes > 0 ? 4 : 0);
  if (volume == Volume::measured)
    for (const double voxels : volumes_of(mesh, rings, parts))
      report.volume += voxels * std::pow(lattice.voxel, 3);
  remove_slivers(mesh, std::move(rings), result.contact, solids.cloth, result.normal);
  report.components = parts.size();
  report.vertices = mesh.position.size();
  report.triangles = mesh.triangle.size();
  return result;
}

/// In metres of the world, beside the columns that it has.
TriangleMesh world_mesh(Finished finished, const Lattice& lattice, TriangleMesh result) {
  result.normal = std::move(finished.normal);
  result.triangle = std::move(finished.mesh.triangle);
  result.position = std::move(finished.mesh.position);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, result.position.size()), [&](const auto& range) {
    for (size_t v = range.begin(); v < range.end(); ++v)
      for (int axis = 0; axis < 3; ++axis)
        result.position[v][axis] = lattice.to_metres(result.position[v][axis], axis);
  });
  if (finished.contact.side.empty()) return result;
  result.contact.reserve(result.triangle.size());
  for (const Triangle& t : result.triangle) result.contact.push_back(finished.contact.touches(t));
  return result;
}

}  // namespace

TriangleMesh surface_frame(const ParticleFrame& particles, const SurfaceSettings& settings,
                           const Surroundings& around, InteriorBlocks mode, SurfaceStats* stats) {
  SurfaceStats unused;
  SurfaceStats& report = stats ? *stats : unused;
  report = {};
  report.particles = particles.position.size();
  check_settings(particles, settings);
  if (particles.position.empty()) return {};
  double left = memory_left(report.particles, settings.memory_gib);
  Stopwatch watch;
  BinnedParticles binned =
      bin_particles(particles.position, lattice_of(particles, settings, bounds_of(particles)));
  report.occupied_blocks = binned.block.size();
  const NearSolids solids(around, binned);
  report.bin_s = watch.lap();

  const ColourKernel kernel{static_cast<float>(settings.support),
                            static_cast<float>(settings.voxel),
                            static_cast<float>(settings.iso_value)};
  const std::vector<uint8_t> interior = count_interior(binned);
  weigh_particles(binned, kernel, interior, settings.kernel);
  left -= binned.ellipsoids.bytes();
  report.weight_s = watch.lap();

  ColourField field = evaluate_field(binned, kernel, interior, solids.cloth, mode, left);
  report.interior_blocks = field.stats.interior;
  report.evaluated_blocks = field.stats.evaluated;
  report.grown_blocks = field.stats.grown;
  report.closure_rounds = field.stats.closure_rounds;
  report.field_s = watch.lap();

  const double beside = left - static_cast<double>(field.block.size() * bytes_a_block);
  LatticeMesh mesh = extract_surface(std::move(field), kernel.iso_value, beside);
  report.extract_s = watch.lap();

  Finished finished = finish(std::move(mesh), solids, binned, settings.smoothing,
                             stats ? Volume::measured : Volume::ignored, report);
  report.smooth_s = watch.lap();

  const float column_reach =
      std::min(2.5f * binned.lattice.voxels_per_spacing, binned.lattice.reach);
  TriangleMesh columns;
  columns.velocity = vertex_velocities(finished.mesh, binned, particles.velocity, column_reach);
  move_with_cloth(finished.mesh, finished.contact, solids.cloth, columns.velocity);
  add_attributes(finished.mesh, binned, particles, column_reach, columns);
  report.velocity_s = watch.lap();
  TriangleMesh result = world_mesh(std::move(finished), binned.lattice, std::move(columns));
  report.contact = static_cast<size_t>(std::count(result.contact.begin(), result.contact.end(), 1));
  return result;
}

}  // namespace drench

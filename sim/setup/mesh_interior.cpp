#include "sim/setup/mesh_interior.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/shells.h"
#include "sim/passes/obstacle/obstacle_distance.h"
#include "sim/setup/scene_report.h"

namespace drench::sim {

namespace {

constexpr double voxel = 0.5, band = 2.0;  // of the level set, in spacings
constexpr double rounding = 1e-3;          // spacings; a lattice may stand just as deep as asked
constexpr double most_particles = 2e8;

/// By the divergence theorem, of a mesh that faces away from its solid or into it all over. m^3
double volume_of(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangle) {
    const V3d a(mesh.position[t.x]), b(mesh.position[t.y]), c(mesh.position[t.z]);
    sum += a.dot(b.cross(c)) / 6;
  }
  return std::abs(sum);
}

void check_size(const Shot& shot, const TriangleMesh& mesh, const V3d& size,
                const std::string& name) {
  const double a = shot.fluid.spacing, count = volume_of(mesh) / (a * a * a);
  const double most = 8.0 * (1 << 16) * voxel * a;  // 65536 blocks of the level set
  if (count <= most_particles && std::max({size.x, size.y, size.z}) <= most) return;
  const std::string guess = guess_of_unit(shot.domain, V3d(0), size);
  throw Error(
      fmt::format("{}: {} is [{:.4g}, {:.4g}, {:.4g}] m large and would hold about {:.3g} "
                  "particles of fluid.spacing = {} m; at most {:.3g} are allowed. Use a "
                  "smaller scale or a larger spacing{}",
                  shot.file.string(), name, size.x, size.y, size.z, count, a, most_particles,
                  guess.empty() ? "" : ": " + guess));
}

}  // namespace

V3d place_of(const Shot& shot, const Cell& cell) {
  return shot.domain.min +
         V3d(double(cell[0]) + 0.5, double(cell[1]) + 0.5, double(cell[2]) + 0.5) *
             shot.fluid.spacing;
}

MeshInterior::MeshInterior(const Shot& shot, const TriangleMesh& mesh, double inset,
                           const std::string& name, const LevelSetMaker& make_level_set)
    : depth_((inset - rounding) * shot.fluid.spacing),
      volume_(holds_twice(mesh) ? 0 : volume_of(mesh)) {
  if (!make_level_set) throw std::logic_error("MeshInterior: no make_level_set");
  for (const V3f& p : mesh.position) {
    for (int k = 0; k < 3; ++k) {
      low_[k] = std::min(low_[k], double(p[k]));
      high_[k] = std::max(high_[k], double(p[k]));
    }
  }
  check_size(shot, mesh, high_ - low_, name);
  try {
    set_ = make_level_set(mesh, voxel * shot.fluid.spacing, band * shot.fluid.spacing, {});
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}: {}", shot.file.string(), name, error.what()));
  }
}

V3d MeshInterior::corner(int which) const {
  return {which & 1 ? high_.x : low_.x, which & 2 ? high_.y : low_.y, which & 4 ? high_.z : low_.z};
}

std::vector<Cell> MeshInterior::cells(const Shot& shot, const Pose& pose,
                                      const CellRange& within) const {
  cpu::FieldView distance = cpu::field_view(set_);
  distance.block = set_.block.data(), distance.value = set_.value.data();
  V3d low(1e30), high(-1e30);
  for (int c = 0; c < 8; ++c) {
    const V3d p = pose.to_world(corner(c));
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
  Cell first, last;
  for (size_t k = 0; k < 3; ++k) {
    const double a = shot.fluid.spacing, begin = shot.domain.min[int(k)];
    first[k] = std::max(within.first[k], int64_t(std::floor((low[int(k)] - begin) / a)));
    last[k] = std::min(within.last[k], int64_t(std::ceil((high[int(k)] - begin) / a)));
  }
  std::vector<Cell> inside;
  for (int64_t z = first[2]; z < last[2]; ++z) {
    for (int64_t y = first[1]; y < last[1]; ++y) {
      for (int64_t x = first[0]; x < last[0]; ++x) {
        const V3d own = pose.to_own(place_of(shot, {x, y, z}));
        if (distance({float(own.x), float(own.y), float(own.z)}) <= -depth_)
          inside.push_back({x, y, z});
      }
    }
  }
  return inside;
}

}  // namespace drench::sim

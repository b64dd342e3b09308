#include "pipeline/contract/files/particles_file.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/vdb_archive.h"
#include "pipeline/contract/geometry/point_grid.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

using VelocityArray = points::TypedAttributeArray<openvdb::Vec3f, points::TruncateCodec>;
using HalfArray = points::TypedAttributeArray<float, points::TruncateCodec>;
using SourceArray = IdArray;  // one number in a block is kept once

constexpr float largest_half = 65504;

/// The columns of one number a particle, halves in the file unless a value is too large for one.
struct RealColumn {
  const char* name;
  std::vector<float> ParticleFrame::*values;
};
constexpr RealColumn real_columns[] = {{"density", &ParticleFrame::density},
                                       {"age", &ParticleFrame::age},
                                       {"wetness", &ParticleFrame::wetness}};

/// The name of a column whose value of particle i is not finite, or null.
const char* real_not_finite(const ParticleFrame& frame, size_t i) {
  for (const auto& [name, values] : real_columns)
    if (!(frame.*values).empty() && !std::isfinite((frame.*values)[i])) return name;
  return nullptr;
}

void check_frame(const fs::path& path, const ParticleFrame& frame) {
  const size_t n = frame.position.size();
  const auto fits = [&](const auto& column) { return column.empty() || column.size() == n; };
  if (frame.velocity.size() != n || !fits(frame.density) || !fits(frame.id) ||
      !fits(frame.source) || !fits(frame.age) || !fits(frame.wetness) || !(frame.spacing > 0)) {
    throw std::logic_error("write_particles: columns differ in length, or no spacing");
  }
  // Beyond this a voxel has no 32-bit coordinate.
  const float farthest = float(voxel_in_spacings * frame.spacing * (1 << 30));
  const auto beyond = [](const Imath::V3f& v, float limit) {
    return !(std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit);
  };
  for (size_t i = 0; i < n; ++i) {
    const char* const not_finite = real_not_finite(frame, i);
    if (beyond(frame.position[i], farthest) || beyond(frame.velocity[i], largest_half) ||
        not_finite) {
      const Imath::V3f &x = frame.position[i], &v = frame.velocity[i];
      throw Error(
          fmt::format("{}: particle {} has position [{}, {}, {}] m and velocity [{}, {}, {}] "
                      "m/s{}; the file was "
                      "not written. The simulation has blown up: use a smaller time step",
                      path.string(), i, x.x, x.y, x.z, v.x, v.y, v.z,
                      not_finite ? fmt::format(", whose {} is not finite", not_finite) : ""));
    }
  }
}

void add_real(const IndexedPoints& made, const char* name, const std::vector<float>& column) {
  if (column.empty()) return;
  const auto [least, most] = std::minmax_element(column.begin(), column.end());
  if (std::max(-*least, *most) < largest_half) {
    made.add_column<HalfArray>(name, column);
  } else {
    made.add_column<FloatArray>(name, column);
  }
}

points::PointDataGrid::Ptr grid_of(const ParticleFrame& frame) {
  const IndexedPoints made = point_grid(frame.position, frame.spacing);
  const points::PointDataGrid::Ptr& grid = made.grid;
  if (!grid->tree().empty()) {
    made.add_column<VelocityArray>("v", converted<openvdb::Vec3f>(frame.velocity));
    for (const auto& [name, values] : real_columns) add_real(made, name, frame.*values);
    if (!frame.id.empty()) made.add_column<IdArray>("id", converted<int32_t>(frame.id));
    if (!frame.source.empty())
      made.add_column<SourceArray>("source", converted<int32_t>(frame.source));
  }
  grid->setName("particles");
  grid->insertMeta("spacing", openvdb::FloatMetadata(frame.spacing));
  grid->insertMeta("rest_density", openvdb::FloatMetadata(frame.rest_density));
  grid->insertMeta("count", openvdb::Int64Metadata(int64_t(frame.position.size())));
  return grid;
}

void append_leaf(const points::PointDataGrid& grid, const Leaf& leaf, ParticleFrame& frame) {
  append_motion(grid, leaf, frame.position, frame.velocity);
  for (const auto& [name, values] : real_columns) append_column<float>(leaf, name, frame.*values);
  append_column<int32_t>(leaf, "id", frame.id);
  append_column<int32_t>(leaf, "source", frame.source);
}

void sort_by_id(ParticleFrame& frame) {
  const std::vector<uint32_t> order = order_of_ids(frame.id);
  reorder(frame.position, order);
  reorder(frame.velocity, order);
  for (const auto& [name, values] : real_columns) reorder(frame.*values, order);
  reorder(frame.id, order);
  reorder(frame.source, order);
}

ParticleFrame frame_of(const openvdb::GridBase::Ptr& base) {
  const auto grid = openvdb::gridPtrCast<points::PointDataGrid>(base);
  if (!grid) throw std::runtime_error("it holds no particles");
  ParticleFrame frame;
  frame.spacing = meta_value<float>(*grid, "spacing");
  frame.rest_density = meta_value<float>(*grid, "rest_density");
  const size_t count = checked_count(*grid);
  frame.position.reserve(count);
  frame.velocity.reserve(count);
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) append_leaf(*grid, *leaf, frame);
  const auto fits = [&](const auto& column) { return column.empty() || column.size() == count; };
  bool whole = frame.position.size() == count && fits(frame.id) && fits(frame.source);
  for (const auto& [name, values] : real_columns) whole = whole && fits(frame.*values);
  if (!whole) throw std::runtime_error("some particles are missing");
  if (!frame.id.empty()) sort_by_id(frame);
  return frame;
}

}  // namespace

WrittenFile write_particles(const fs::path& path, const ParticleFrame& frame) {
  check_frame(path, frame);
  initialize_vdb();
  return write_file_whole(path, vdb_bytes({grid_of(frame)}));
}

ParticleFrame read_particles(const fs::path& path) {
  return read_points(path, "a particle cache", "the simulation will write it again", frame_of);
}

}  // namespace drench

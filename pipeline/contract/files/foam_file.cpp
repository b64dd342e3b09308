#include "pipeline/contract/files/foam_file.h"

#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/vdb_archive.h"
#include "pipeline/contract/geometry/point_grid.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

using VelocityArray = points::TypedAttributeArray<openvdb::Vec3f, points::NullCodec>;
using KindArray = points::TypedAttributeArray<int8_t, points::NullCodec>;

void check_frame(const fs::path& path, const FoamFrame& frame) {
  const size_t n = frame.position.size();
  for (const size_t column : {frame.velocity.size(), frame.id.size(), frame.age.size(),
                              frame.radius.size(), frame.kind.size()})
    if (column != n) throw std::logic_error("write_foam: columns differ in length");
  if (!(frame.spacing > 0)) throw std::logic_error("write_foam: no spacing");
  const float farthest = float(voxel_in_spacings * frame.spacing * (1 << 30));
  for (size_t i = 0; i < n; ++i) {
    const Imath::V3f &x = frame.position[i], &v = frame.velocity[i];
    const bool near =
        std::abs(x.x) <= farthest && std::abs(x.y) <= farthest && std::abs(x.z) <= farthest;
    if (near && std::isfinite(v.x + v.y + v.z)) continue;
    throw Error(
        fmt::format("{}: foam particle {} has position [{}, {}, {}] m and velocity [{}, {}, {}] "
                    "m/s; the file was not written. The fluid's velocities are damaged or blew up: "
                    "simulate with a smaller time step",
                    path.string(), frame.id[i], x.x, x.y, x.z, v.x, v.y, v.z));
  }
}

points::PointDataGrid::Ptr grid_of(const FoamFrame& frame) {
  const IndexedPoints made = point_grid(frame.position, frame.spacing);
  if (!made.grid->tree().empty()) {
    made.add_column<VelocityArray>("v", converted<openvdb::Vec3f>(frame.velocity));
    made.add_column<IdArray>("id", converted<int32_t>(frame.id));
    made.add_column<FloatArray>("age", frame.age);
    made.add_column<FloatArray>("pscale", frame.radius);
    made.add_column<KindArray>("kind", converted<int8_t>(frame.kind));
  }
  made.grid->setName("foam");
  made.grid->insertMeta("spacing", openvdb::FloatMetadata(frame.spacing));
  made.grid->insertMeta("next_id", openvdb::Int64Metadata(int64_t(frame.next_id)));
  made.grid->insertMeta("count", openvdb::Int64Metadata(int64_t(frame.position.size())));
  return made.grid;
}

void append_leaf(const points::PointDataGrid& grid, const Leaf& leaf, FoamFrame& frame) {
  append_motion(grid, leaf, frame.position, frame.velocity);
  append_column<int32_t>(leaf, "id", frame.id);
  append_column<float>(leaf, "age", frame.age);
  append_column<float>(leaf, "pscale", frame.radius);
  append_column<int8_t>(leaf, "kind", frame.kind);
}

FoamFrame frame_of(const openvdb::GridBase::Ptr& base) {
  const auto grid = openvdb::gridPtrCast<points::PointDataGrid>(base);
  if (!grid || grid->getName() != "foam") throw std::runtime_error("it holds no foam");
  FoamFrame frame;
  frame.spacing = meta_value<float>(*grid, "spacing");
  frame.next_id = uint32_t(meta_value<int64_t>(*grid, "next_id"));
  const size_t count = checked_count(*grid);
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) append_leaf(*grid, *leaf, frame);
  for (const size_t rows : {frame.position.size(), frame.id.size(), frame.age.size(),
                            frame.radius.size(), frame.kind.size()})
    if (rows != count) throw std::runtime_error("some particles are missing");
  if (std::any_of(frame.kind.begin(), frame.kind.end(),
                  [](FoamKind kind) { return kind > FoamKind::bubble; }))
    throw std::runtime_error("a particle is neither spray nor foam nor a bubble");
  const std::vector<uint32_t> order = order_of_ids(frame.id);
  reorder(frame.position, order);
  reorder(frame.velocity, order);
  reorder(frame.age, order);
  reorder(frame.radius, order);
  reorder(frame.kind, order);
  reorder(frame.id, order);
  return frame;
}

}  // namespace

WrittenFile write_foam(const fs::path& path, const FoamFrame& frame) {
  check_frame(path, frame);
  initialize_vdb();
  return write_file_whole(path, vdb_bytes({grid_of(frame)}));
}

FoamFrame read_foam(const fs::path& path) {
  return read_points(path, "a foam cache",
                     "the run makes it again, and the frames after it if it comes out different",
                     frame_of);
}

}  // namespace drench

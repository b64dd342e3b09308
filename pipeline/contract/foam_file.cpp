#include "pipeline/contract/foam_file.h"

#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/point_grid.h"
#include "pipeline/contract/vdb_archive.h"

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

void append_leaf(const points::PointDataGrid& grid, const points::PointDataTree::LeafNodeType& leaf,
                 FoamFrame& frame) {
  const points::AttributeHandle<openvdb::Vec3f> position(leaf.constAttributeArray("P"));
  const points::AttributeHandle<openvdb::Vec3f> velocity(leaf.constAttributeArray("v"));
  const points::AttributeHandle<int32_t> id(leaf.constAttributeArray("id"));
  const points::AttributeHandle<float> age(leaf.constAttributeArray("age"));
  const points::AttributeHandle<float> radius(leaf.constAttributeArray("pscale"));
  const points::AttributeHandle<int8_t> kind(leaf.constAttributeArray("kind"));
  for (auto point = leaf.beginIndexOn(); point; ++point) {
    const openvdb::Vec3d cell = point.getCoord().asVec3d();
    const openvdb::Vec3d x = grid.indexToWorld(cell + openvdb::Vec3d(position.get(*point)));
    const openvdb::Vec3f v = velocity.get(*point);
    const int8_t of_kind = kind.get(*point);
    if (of_kind < 0 || of_kind > int8_t(FoamKind::bubble))
      throw std::runtime_error("a particle is neither spray nor foam nor a bubble");
    frame.position.emplace_back(float(x.x()), float(x.y()), float(x.z()));
    frame.velocity.emplace_back(v.x(), v.y(), v.z());
    frame.id.push_back(uint32_t(id.get(*point)));
    frame.age.push_back(age.get(*point));
    frame.radius.push_back(radius.get(*point));
    frame.kind.push_back(FoamKind(of_kind));
  }
}

FoamFrame frame_of(const openvdb::GridBase::Ptr& base) {
  const auto grid = openvdb::gridPtrCast<points::PointDataGrid>(base);
  if (!grid || grid->getName() != "foam") throw std::runtime_error("it holds no foam");
  FoamFrame frame;
  frame.spacing = meta_value<float>(*grid, "spacing");
  frame.next_id = uint32_t(meta_value<int64_t>(*grid, "next_id"));
  const size_t count = checked_count(*grid);
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) append_leaf(*grid, *leaf, frame);
  if (frame.position.size() != count) throw std::runtime_error("some particles are missing");
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
  const std::vector<std::byte> bytes = read_file(path);
  try {
    return frame_of(vdb_grid({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    throw Error(
        fmt::format("{}: cannot be used as a foam cache: {}. Remove it; the run makes it "
                    "again, and the frames after it if it comes out different",
                    path.string(), problem.what()));
  }
}

}  // namespace drench

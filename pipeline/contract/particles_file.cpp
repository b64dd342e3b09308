#include "pipeline/contract/particles_file.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/point_grid.h"
#include "pipeline/contract/vdb_archive.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

using VelocityArray = points::TypedAttributeArray<openvdb::Vec3f, points::TruncateCodec>;
using HalfArray = points::TypedAttributeArray<float, points::TruncateCodec>;

constexpr float largest_half = 65504;

void check_frame(const fs::path& path, const ParticleFrame& frame) {
  const size_t n = frame.position.size();
  if (frame.velocity.size() != n || (!frame.density.empty() && frame.density.size() != n) ||
      (!frame.id.empty() && frame.id.size() != n) || !(frame.spacing > 0)) {
    throw std::logic_error("write_particles: columns differ in length, or no spacing");
  }
  // Beyond this a voxel has no 32-bit coordinate.
  const float farthest = float(voxel_in_spacings * frame.spacing * (1 << 30));
  const auto beyond = [](const Imath::V3f& v, float limit) {
    return !(std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit);
  };
  for (size_t i = 0; i < n; ++i) {
    const bool density_fails = !frame.density.empty() && !std::isfinite(frame.density[i]);
    if (beyond(frame.position[i], farthest) || beyond(frame.velocity[i], largest_half) ||
        density_fails) {
      const Imath::V3f &x = frame.position[i], &v = frame.velocity[i];
      throw Error(
          fmt::format("{}: particle {} has position [{}, {}, {}] m and velocity [{}, {}, {}] "
                      "m/s{}; the file was "
                      "not written. The simulation has blown up: use a smaller time step",
                      path.string(), i, x.x, x.y, x.z, v.x, v.y, v.z,
                      density_fails ? " and a density that is not finite" : ""));
    }
  }
}

points::PointDataGrid::Ptr grid_of(const ParticleFrame& frame) {
  const IndexedPoints made = point_grid(frame.position, frame.spacing);
  const points::PointDataGrid::Ptr& grid = made.grid;
  if (!grid->tree().empty()) {
    made.add_column<VelocityArray>("v", converted<openvdb::Vec3f>(frame.velocity));
    if (!frame.density.empty()) {
      const float largest = *std::max_element(frame.density.begin(), frame.density.end());
      const auto density = converted<float>(frame.density);
      if (largest < largest_half) {
        made.add_column<HalfArray>("density", density);
      } else {
        made.add_column<FloatArray>("density", density);
      }
    }
    if (!frame.id.empty()) made.add_column<IdArray>("id", converted<int32_t>(frame.id));
  }
  grid->setName("particles");
  grid->insertMeta("spacing", openvdb::FloatMetadata(frame.spacing));
  grid->insertMeta("rest_density", openvdb::FloatMetadata(frame.rest_density));
  grid->insertMeta("count", openvdb::Int64Metadata(int64_t(frame.position.size())));
  return grid;
}

void append_leaf(const points::PointDataGrid& grid, const points::PointDataTree::LeafNodeType& leaf,
                 ParticleFrame& frame) {
  const points::AttributeHandle<openvdb::Vec3f> position(leaf.constAttributeArray("P"));
  const points::AttributeHandle<openvdb::Vec3f> velocity(leaf.constAttributeArray("v"));
  const auto& descriptor = leaf.attributeSet();
  const auto density =
      descriptor.find("density") != points::AttributeSet::INVALID_POS
          ? points::AttributeHandle<float>::create(leaf.constAttributeArray("density"))
          : nullptr;
  const auto id = descriptor.find("id") != points::AttributeSet::INVALID_POS
                      ? points::AttributeHandle<int32_t>::create(leaf.constAttributeArray("id"))
                      : nullptr;
  for (auto point = leaf.beginIndexOn(); point; ++point) {
    const openvdb::Vec3d cell = point.getCoord().asVec3d();
    const openvdb::Vec3d x = grid.indexToWorld(cell + openvdb::Vec3d(position.get(*point)));
    const openvdb::Vec3f v = velocity.get(*point);
    frame.position.emplace_back(float(x.x()), float(x.y()), float(x.z()));
    frame.velocity.emplace_back(v.x(), v.y(), v.z());
    if (density) frame.density.push_back(density->get(*point));
    if (id) frame.id.push_back(uint32_t(id->get(*point)));
  }
}

void sort_by_id(ParticleFrame& frame) {
  const std::vector<uint32_t> order = order_of_ids(frame.id);
  reorder(frame.position, order);
  reorder(frame.velocity, order);
  reorder(frame.density, order);
  reorder(frame.id, order);
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
  if (frame.position.size() != count) throw std::runtime_error("some particles are missing");
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
  const std::vector<std::byte> bytes = read_file(path);
  try {
    return frame_of(vdb_grid({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    throw Error(
        fmt::format("{}: cannot be used as a particle cache: {}. Remove it; the simulation "
                    "will write it again",
                    path.string(), problem.what()));
  }
}

}  // namespace drench

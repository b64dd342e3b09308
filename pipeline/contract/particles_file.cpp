#include "pipeline/contract/particles_file.h"

#include <fmt/format.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pipeline/contract/error.h"
#include "pipeline/contract/vdb_archive.h"

namespace drench {

namespace fs = std::filesystem;
namespace points = openvdb::points;
using openvdb::Index64;

namespace {

using PositionCodec = points::FixedPointCodec</*OneByte=*/false>;
using VelocityArray = points::TypedAttributeArray<openvdb::Vec3f, points::TruncateCodec>;
using HalfArray = points::TypedAttributeArray<float, points::TruncateCodec>;
using FloatArray = points::TypedAttributeArray<float, points::NullCodec>;
using IdArray = points::TypedAttributeArray<int32_t, points::NullCodec>;  // Houdini's type of id

constexpr float largest_half = 65504;
constexpr double voxel_in_spacings = 2;

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

/// A vector as OpenVDB's functions want it.
template <class To, class From>
std::vector<To> converted(const std::vector<From>& column) {
  std::vector<To> result;
  result.reserve(column.size());
  for (const From& value : column) {
    if constexpr (std::is_arithmetic_v<From>) {
      result.push_back(To(value));
    } else {
      result.push_back(To(value.x, value.y, value.z));
    }
  }
  return result;
}

template <class Array, class Value>
void add_column(points::PointDataGrid& grid, const openvdb::tools::PointIndexGrid& index,
                const std::string& name, const std::vector<Value>& column) {
  points::appendAttribute<typename Array::ValueType, typename Array::Codec>(grid.tree(), name);
  const points::PointAttributeVector<Value> wrapper(column);
  points::populateAttribute<points::PointDataTree, openvdb::tools::PointIndexTree,
                            points::PointAttributeVector<Value>>(grid.tree(), index.tree(), name,
                                                                 wrapper);
}

points::PointDataGrid::Ptr grid_of(const ParticleFrame& frame) {
  const auto transform =
      openvdb::math::Transform::createLinearTransform(voxel_in_spacings * double(frame.spacing));
  const auto positions = converted<openvdb::Vec3f>(frame.position);
  const points::PointAttributeVector<openvdb::Vec3f> wrapper(positions);
  const auto index =
      openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapper, *transform);
  const auto grid = points::createPointDataGrid<PositionCodec, points::PointDataGrid>(
      *index, wrapper, *transform);
  if (!grid->tree().empty()) {
    add_column<VelocityArray>(*grid, *index, "v", converted<openvdb::Vec3f>(frame.velocity));
    if (!frame.density.empty()) {
      const float largest = *std::max_element(frame.density.begin(), frame.density.end());
      const auto density = converted<float>(frame.density);
      if (largest < largest_half) {
        add_column<HalfArray>(*grid, *index, "density", density);
      } else {
        add_column<FloatArray>(*grid, *index, "density", density);
      }
    }
    if (!frame.id.empty()) add_column<IdArray>(*grid, *index, "id", converted<int32_t>(frame.id));
  }
  grid->setName("particles");
  grid->insertMeta("spacing", openvdb::FloatMetadata(frame.spacing));
  grid->insertMeta("rest_density", openvdb::FloatMetadata(frame.rest_density));
  grid->insertMeta("count", openvdb::Int64Metadata(int64_t(frame.position.size())));
  return grid;
}

template <class T>
T meta_value(const openvdb::GridBase& grid, const char* name) {
  const auto meta = grid.getMetadata<openvdb::TypedMetadata<T>>(name);
  if (!meta) throw std::runtime_error(fmt::format("it lacks the metadata '{}'", name));
  return meta->value();
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

template <class T>
void reorder(std::vector<T>& column, const std::vector<uint32_t>& order) {
  if (column.empty()) return;
  std::vector<T> sorted;
  sorted.reserve(column.size());
  for (const uint32_t i : order) sorted.push_back(column[i]);
  column = std::move(sorted);
}

void sort_by_id(ParticleFrame& frame) {
  std::vector<uint32_t> order(frame.id.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return frame.id[a] < frame.id[b]; });
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
  const int64_t count = meta_value<int64_t>(*grid, "count");
  if (count < 0 || Index64(count) != points::pointCount(grid->tree())) {
    throw std::runtime_error("it holds another number of particles than it says");
  }
  frame.position.reserve(size_t(count));
  frame.velocity.reserve(size_t(count));
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) append_leaf(*grid, *leaf, frame);
  if (frame.position.size() != size_t(count))
    throw std::runtime_error("some particles are missing");
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

#pragma once
// Columns of particles in OpenVDB point grids. Only for the files that read and write them.

#include <fmt/format.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/files/vdb_archive.h"

namespace drench {

namespace points = openvdb::points;

using PositionCodec = points::FixedPointCodec</*OneByte=*/false>;
using FloatArray = points::TypedAttributeArray<float, points::NullCodec>;
using IdArray = points::TypedAttributeArray<int32_t, points::NullCodec>;  // Houdini's type of id

inline constexpr double voxel_in_spacings = 4;

/// A column as OpenVDB's functions want it.
template <class To, class From>
std::vector<To> converted(const std::vector<From>& column) {
  std::vector<To> result;
  result.reserve(column.size());
  for (const From& value : column) {
    if constexpr (std::is_arithmetic_v<From> || std::is_enum_v<From>) {
      result.push_back(To(value));
    } else {
      result.push_back(To(value.x, value.y, value.z));
    }
  }
  return result;
}

/// A grid with positions alone, and the index that further columns are added by.
struct IndexedPoints {
  openvdb::tools::PointIndexGrid::Ptr index;
  points::PointDataGrid::Ptr grid;

  template <class Array, class Value>
  void add_column(const std::string& name, const std::vector<Value>& column) const {
    points::appendAttribute<typename Array::ValueType, typename Array::Codec>(grid->tree(), name);
    const points::PointAttributeVector<Value> wrapper(column);
    points::populateAttribute<points::PointDataTree, openvdb::tools::PointIndexTree,
                              points::PointAttributeVector<Value>>(grid->tree(), index->tree(),
                                                                   name, wrapper);
  }
};

template <class Vector>
IndexedPoints point_grid(const std::vector<Vector>& position, float spacing) {
  const auto transform =
      openvdb::math::Transform::createLinearTransform(voxel_in_spacings * double(spacing));
  const auto positions = converted<openvdb::Vec3f>(position);
  const points::PointAttributeVector<openvdb::Vec3f> wrapper(positions);
  IndexedPoints result;
  result.index =
      openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapper, *transform);
  result.grid = points::createPointDataGrid<PositionCodec, points::PointDataGrid>(
      *result.index, wrapper, *transform);
  return result;
}

template <class T>
T meta_value(const openvdb::GridBase& grid, const char* name) {
  const auto meta = grid.getMetadata<openvdb::TypedMetadata<T>>(name);
  if (!meta) throw std::runtime_error(fmt::format("it lacks the metadata '{}'", name));
  return meta->value();
}

/// The "count" that the grid says it holds. @throws std::runtime_error if it holds another, or a
/// leaf's columns are not as long as its voxels say.
inline size_t checked_count(const points::PointDataGrid& grid) {
  const int64_t count = meta_value<int64_t>(grid, "count");
  if (count < 0 || openvdb::Index64(count) != points::pointCount(grid.tree())) {
    throw std::runtime_error("it holds another number of particles than it says");
  }
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) leaf->validateOffsets();
  return size_t(count);
}

using Leaf = points::PointDataTree::LeafNodeType;

/// @throws std::runtime_error if it has none of that name.
inline const points::AttributeArray& column_of(const Leaf& leaf, const char* name) {
  if (leaf.attributeSet().find(name) == points::AttributeSet::INVALID_POS)
    throw std::runtime_error(fmt::format("it lacks the column '{}'", name));
  return leaf.constAttributeArray(name);
}

/// Appends places and velocities of a leaf's points, m and m/s.
inline void append_motion(const points::PointDataGrid& grid, const Leaf& leaf,
                          std::vector<Imath::V3f>& position, std::vector<Imath::V3f>& velocity) {
  const points::AttributeHandle<openvdb::Vec3f> own_place(column_of(leaf, "P"));
  const points::AttributeHandle<openvdb::Vec3f> own_velocity(column_of(leaf, "v"));
  for (auto point = leaf.beginIndexOn(); point; ++point) {
    const openvdb::Vec3d cell = point.getCoord().asVec3d();
    const openvdb::Vec3d x = grid.indexToWorld(cell + openvdb::Vec3d(own_place.get(*point)));
    const openvdb::Vec3f v = own_velocity.get(*point);
    position.emplace_back(float(x.x()), float(x.y()), float(x.z()));
    velocity.emplace_back(v.x(), v.y(), v.z());
  }
}

/// Appends a leaf's values of a column of one number a point, if it has that column.
template <class Stored, class To>
void append_column(const Leaf& leaf, const char* name, std::vector<To>& column) {
  if (leaf.attributeSet().find(name) == points::AttributeSet::INVALID_POS) return;
  const points::AttributeHandle<Stored> values(leaf.constAttributeArray(name));
  for (auto point = leaf.beginIndexOn(); point; ++point)
    column.push_back(static_cast<To>(values.get(*point)));
}

/// What `frame_of` makes of the first grid of a file.
/// @throws Error naming file and reason if it is damaged or not `what`, with the way to get it
/// anew.
template <class FrameOf>
auto read_points(const std::filesystem::path& path, const char* what, const char* remade,
                 FrameOf frame_of) {
  const std::vector<std::byte> bytes = read_file(path);
  try {
    const auto grid = vdb_grid({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    // Columns of one value take no room in a file, but positions do.
    constexpr int64_t most_a_byte = 64;
    const auto count = grid->getMetadata<openvdb::Int64Metadata>("count");
    if (count && count->value() / most_a_byte > int64_t(bytes.size()))
      throw std::runtime_error("it says to hold more particles than fit into it");
    return frame_of(grid);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    throw Error(fmt::format("{}: cannot be used as {}: {}. Remove it; {}", path.string(), what,
                            problem.what(), remade));
  }
}

/// Indices in the order of rising ids.
inline std::vector<uint32_t> order_of_ids(const std::vector<uint32_t>& id) {
  std::vector<uint32_t> order(id.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return id[a] < id[b]; });
  return order;
}

template <class T>
void reorder(std::vector<T>& column, const std::vector<uint32_t>& order) {
  if (column.empty()) return;
  std::vector<T> sorted;
  sorted.reserve(column.size());
  for (const uint32_t i : order) sorted.push_back(column[i]);
  column = std::move(sorted);
}

}  // namespace drench

#include "pipeline/contract/files/point_file.h"

#include <fmt/format.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/vdb_archive.h"
#include "pipeline/contract/frames.h"

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {

// As in vdb_trees.h.
#if defined(__OPTIMIZE__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
extern template class tree::Tree<points::PointDataTree::RootNodeType>;
extern template class tree::Tree<tools::PointIndexTree::RootNodeType>;
extern template class Grid<points::PointDataTree>;
extern template class Grid<tools::PointIndexTree>;
#endif

}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace drench {

namespace points = openvdb::points;

struct PointWriter::Grids {
  openvdb::tools::PointIndexGrid::Ptr index;
  points::PointDataGrid::Ptr points;
};

struct PointReader::Grid {
  openvdb::GridBase::Ptr base;
  points::PointDataGrid::Ptr points;  // null if it is of another type
};

namespace {

using Leaf = points::PointDataTree::LeafNodeType;

/// What a column of T is stored as.
template <class T>
struct StoredAs;
template <>
struct StoredAs<float> {
  using Type = float;
};
template <>
struct StoredAs<uint32_t> {
  using Type = int32_t;
};
template <>
struct StoredAs<uint8_t> {
  using Type = int32_t;
};
template <>
struct StoredAs<FoamKind> {
  using Type = int8_t;
};

std::vector<openvdb::Vec3f> as_vdb(const std::vector<Imath::V3f>& column) {
  std::vector<openvdb::Vec3f> result;
  result.reserve(column.size());
  for (const Imath::V3f& v : column) result.emplace_back(v.x, v.y, v.z);
  return result;
}

template <class Codec, class Value>
void add_column(points::PointDataTree& tree, const openvdb::tools::PointIndexTree& index,
                const char* name, const std::vector<Value>& column) {
  if (tree.empty()) return;
  points::appendAttribute<Value, Codec>(tree, name);
  const points::PointAttributeVector<Value> wrapper(column);
  points::populateAttribute<points::PointDataTree, openvdb::tools::PointIndexTree,
                            points::PointAttributeVector<Value>>(tree, index, name, wrapper);
}

template <class Value>
void add_column(points::PointDataTree& tree, const openvdb::tools::PointIndexTree& index,
                const char* name, const std::vector<Value>& column, Precision precision) {
  if (precision == Precision::half) {
    add_column<points::TruncateCodec>(tree, index, name, column);
  } else {
    add_column<points::NullCodec>(tree, index, name, column);
  }
}

template <class T>
T meta_value(const openvdb::GridBase& grid, const char* name) {
  const auto meta = grid.getMetadata<openvdb::TypedMetadata<T>>(name);
  if (!meta) throw std::runtime_error(fmt::format("it lacks the metadata '{}'", name));
  return meta->value();
}

const points::AttributeArray& column_of(const Leaf& leaf, const char* name) {
  if (leaf.attributeSet().find(name) == points::AttributeSet::INVALID_POS)
    throw std::runtime_error(fmt::format("it lacks the column '{}'", name));
  return leaf.constAttributeArray(name);
}

}  // namespace

PointWriter::PointWriter(const char* name, const std::vector<Imath::V3f>& position, float spacing)
    : grids_(std::make_unique<Grids>()) {
  initialize_vdb();
  const auto transform =
      openvdb::math::Transform::createLinearTransform(voxel_in_spacings * double(spacing));
  const auto positions = as_vdb(position);
  const points::PointAttributeVector<openvdb::Vec3f> wrapper(positions);
  auto& [index, points] = *grids_;
  index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapper, *transform);
  points = points::createPointDataGrid<points::FixedPointCodec</*OneByte=*/false>,
                                       points::PointDataGrid>(*index, wrapper, *transform);
  points->setName(name);
  set("spacing", spacing);
  set("count", int64_t(position.size()));
}
PointWriter::~PointWriter() = default;

void PointWriter::add(const char* name, const std::vector<Imath::V3f>& column,
                      Precision precision) {
  add_column(grids_->points->tree(), grids_->index->tree(), name, as_vdb(column), precision);
}

void PointWriter::add(const char* name, const std::vector<float>& column, Precision precision) {
  add_column(grids_->points->tree(), grids_->index->tree(), name, column, precision);
}

template <class Integer>
void PointWriter::add(const char* name, const std::vector<Integer>& column) {
  std::vector<typename StoredAs<Integer>::Type> stored;
  stored.reserve(column.size());
  for (const Integer value : column)
    stored.push_back(static_cast<typename StoredAs<Integer>::Type>(value));
  add_column<points::NullCodec>(grids_->points->tree(), grids_->index->tree(), name, stored);
}
template void PointWriter::add(const char*, const std::vector<uint32_t>&);
template void PointWriter::add(const char*, const std::vector<uint8_t>&);
template void PointWriter::add(const char*, const std::vector<FoamKind>&);

void PointWriter::set(const char* name, float value) {
  grids_->points->insertMeta(name, openvdb::FloatMetadata(value));
}

void PointWriter::set(const char* name, int64_t value) {
  grids_->points->insertMeta(name, openvdb::Int64Metadata(value));
}

WrittenFile PointWriter::write(const std::filesystem::path& path) const {
  return write_file_whole(path, vdb_bytes({grids_->points}));
}

PointReader::PointReader(std::string_view bytes) : grid_(std::make_unique<Grid>()) {
  grid_->base = vdb_grid(bytes);
  // Columns of one value take no room in a file, but positions do.
  constexpr int64_t most_a_byte = 64;
  const auto count = grid_->base->getMetadata<openvdb::Int64Metadata>("count");
  if (count && count->value() / most_a_byte > int64_t(bytes.size()))
    throw std::runtime_error("it says to hold more particles than fit into it");
  grid_->points = openvdb::gridPtrCast<points::PointDataGrid>(grid_->base);
}
PointReader::~PointReader() = default;

bool PointReader::holds_points() const { return grid_->points != nullptr; }
std::string PointReader::name() const { return grid_->base->getName(); }
float PointReader::real(const char* name) const { return meta_value<float>(*grid_->base, name); }
int64_t PointReader::integer(const char* name) const {
  return meta_value<int64_t>(*grid_->base, name);
}

size_t PointReader::count() const {
  const int64_t count = integer("count");
  const points::PointDataTree& tree = grid_->points->tree();
  if (count < 0 || openvdb::Index64(count) != points::pointCount(tree))
    throw std::runtime_error("it holds another number of particles than it says");
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) leaf->validateOffsets();
  return size_t(count);
}

PointReader::Motion PointReader::motion() const {
  const points::PointDataGrid& grid = *grid_->points;
  const size_t count = size_t(points::pointCount(grid.tree()));
  Motion motion;
  motion.position.reserve(count);
  motion.velocity.reserve(count);
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const points::AttributeHandle<openvdb::Vec3f> position(column_of(*leaf, "P"));
    const points::AttributeHandle<openvdb::Vec3f> velocity(column_of(*leaf, "v"));
    for (auto point = leaf->beginIndexOn(); point; ++point) {
      const openvdb::Vec3d cell = point.getCoord().asVec3d();
      const openvdb::Vec3d x = grid.indexToWorld(cell + openvdb::Vec3d(position.get(*point)));
      const openvdb::Vec3f v = velocity.get(*point);
      motion.position.emplace_back(float(x.x()), float(x.y()), float(x.z()));
      motion.velocity.emplace_back(v.x(), v.y(), v.z());
    }
  }
  return motion;
}

template <class T>
std::vector<T> PointReader::column(const char* name) const {
  std::vector<T> column;
  for (auto leaf = grid_->points->tree().cbeginLeaf(); leaf; ++leaf) {
    if (leaf->attributeSet().find(name) == points::AttributeSet::INVALID_POS) continue;
    if (column.empty()) column.reserve(size_t(points::pointCount(grid_->points->tree())));
    const points::AttributeHandle<typename StoredAs<T>::Type> values(
        leaf->constAttributeArray(name));
    for (auto point = leaf->beginIndexOn(); point; ++point)
      column.push_back(static_cast<T>(values.get(*point)));
  }
  return column;
}
template std::vector<float> PointReader::column(const char*) const;
template std::vector<uint32_t> PointReader::column(const char*) const;
template std::vector<uint8_t> PointReader::column(const char*) const;
template std::vector<FoamKind> PointReader::column(const char*) const;

void read_point_file(const std::filesystem::path& path, const char* what, const char* remade,
                     const std::function<void(const PointReader&)>& take) {
  const std::vector<std::byte> bytes = read_file(path);
  try {
    take(PointReader({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    throw Error(fmt::format("{}: cannot be used as {}: {}. Remove it; {}", path.string(), what,
                            problem.what(), remade));
  }
}

std::vector<uint32_t> order_of_ids(const std::vector<uint32_t>& id) {
  std::vector<uint32_t> order(id.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return id[a] < id[b]; });
  return order;
}

}  // namespace drench

#pragma once
// OpenVDB point grids as columns by name. What they are made of stays in one unit: it takes ten
// seconds to compile.

#include <Imath/ImathVec.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/files/files.h"

namespace drench {

/// Side of a voxel of a point grid.
inline constexpr double voxel_in_spacings = 4;

/// How a column of real numbers is stored.
enum class Precision { half, full };

/// Makes a file of particles. Columns are as long as `position` and come in the order of `add`.
class PointWriter {
 public:
  /// Positions "P" are stored with 16 bits an axis; metadata "spacing" and "count" come with them.
  /// @param name  of the grid. @param position  m. @param spacing  m.
  PointWriter(const char* name, const std::vector<Imath::V3f>& position, float spacing);
  ~PointWriter();

  void add(const char* name, const std::vector<Imath::V3f>& column, Precision precision);
  void add(const char* name, const std::vector<float>& column, Precision precision);
  /// @tparam Integer  uint32_t and uint8_t are stored as int32, Houdini's type of id; FoamKind as
  /// int8.
  template <class Integer>
  void add(const char* name, const std::vector<Integer>& column);

  void set(const char* name, float value);
  void set(const char* name, int64_t value);

  WrittenFile write(const std::filesystem::path& path) const;

 private:
  struct Grids;
  std::unique_ptr<Grids> grids_;
};

/// What the first grid of a file holds. Functions throw std::runtime_error with the reason if it
/// lacks what is asked for.
class PointReader {
 public:
  struct Motion {
    std::vector<Imath::V3f> position, velocity;  // m, m/s
  };

  explicit PointReader(std::string_view bytes);
  ~PointReader();

  bool holds_points() const;
  std::string name() const;
  float real(const char* name) const;
  int64_t integer(const char* name) const;
  /// The "count" that the grid says it holds. @throws std::runtime_error if it holds another, or a
  /// leaf's columns are not as long as its voxels say.
  size_t count() const;
  /// Columns "P" and "v".
  Motion motion() const;
  /// A column of one number a particle; shorter if leaves lack it, empty if all do.
  /// @tparam T  float, or as in PointWriter::add.
  template <class T>
  std::vector<T> column(const char* name) const;

 private:
  struct Grid;
  std::unique_ptr<Grid> grid_;
};

/// Reads a file of particles.
/// @param what, remade  of the file, and the way to get it anew: for the message.
/// @throws Error naming file and reason if it is damaged or `take` throws.
void read_point_file(const std::filesystem::path& path, const char* what, const char* remade,
                     const std::function<void(const PointReader&)>& take);

/// Indices in the order of rising ids.
std::vector<uint32_t> order_of_ids(const std::vector<uint32_t>& id);

template <class T>
void reorder(std::vector<T>& column, const std::vector<uint32_t>& order) {
  if (column.empty()) return;
  std::vector<T> sorted;
  sorted.reserve(column.size());
  for (const uint32_t i : order) sorted.push_back(column[i]);
  column = std::move(sorted);
}

}  // namespace drench

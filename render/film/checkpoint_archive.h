#pragma once
// Memory to a file or back: what a class says once holds for both directions.

#include <filesystem>
#include <fstream>
#include <type_traits>
#include <vector>

#include "pipeline/contract/hash.h"

namespace drench::render {

class CheckpointArchive {
 public:
  enum class Mode { write, read };

  /// @throws Error if the file cannot be opened.
  CheckpointArchive(const std::filesystem::path& file, Mode mode);

  void bytes(void* data, size_t size);
  /// Plain numbers, though Imath's vectors do not say so of themselves.
  template <class T>
  requires std::is_trivially_destructible_v<T>
  void value(T& value) { bytes(&value, sizeof value); }
  /// A vector whose length both sides know.
  template <class T>
  requires std::is_trivially_destructible_v<T>
  void column(std::vector<T>& column) { bytes(column.data(), column.size() * sizeof(T)); }
  /// Ends the file with its digest and closes it, or compares the digest. @return whether all is
  /// well: nothing failed, and what was written lies on the disk in its whole length
  bool finish();

 private:
  Mode mode_;
  std::filesystem::path file_;
  std::fstream stream_;
  uint64_t size_ = 0;  // bytes so far
  Hasher hasher_;
};

}  // namespace drench::render

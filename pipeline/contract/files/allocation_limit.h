#pragma once
// What a library may allocate at once while it reads a file: some make room for what four bytes of
// the file say before they look whether the file has so much.

#include <cstddef>
#include <new>

namespace drench {

struct BeyondAllocationLimit : std::bad_alloc {};

/// While it lives, `operator new` of this thread throws BeyondAllocationLimit for more than so
/// much at once.
class AllocationLimit {
 public:
  explicit AllocationLimit(size_t bytes);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;

 private:
  size_t before_;
};

}  // namespace drench

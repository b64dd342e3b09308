#include "pipeline/contract/files/allocation_limit.h"

#include <cstdint>
#include <cstdlib>

namespace drench {

namespace {

thread_local size_t most = SIZE_MAX;

}  // namespace

AllocationLimit::AllocationLimit(size_t bytes) : before_(most) { most = bytes; }
AllocationLimit::~AllocationLimit() { most = before_; }

}  // namespace drench

// Every other form of new and delete that is not for greater alignment comes to these.

void* operator new(size_t bytes) {
  if (bytes > drench::most) throw drench::BeyondAllocationLimit();
  for (;;) {
    if (void* const p = std::malloc(bytes > 0 ? bytes : 1)) return p;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, size_t) noexcept { std::free(p); }

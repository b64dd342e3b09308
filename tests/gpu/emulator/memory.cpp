// Device memory: one large region of addresses that are never used twice. Pinned host memory is the
// second half of it, given to the host as what lies behind those addresses.

#include <sys/mman.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "tests/gpu/emulator/runtime.h"

namespace gpu_emulator {

namespace {

constexpr u64 alignment = 256, gap = 256;  // as cudaMalloc; between allocations
constexpr u32 poison = 0x7fa5a5a5;         // NaN as a float, far away as an index

void reserve(u64 address, u64 size, int protection) {
  void* got = mmap(reinterpret_cast<void*>(address), size, protection,
                   MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE, -1, 0);
  if (got == reinterpret_cast<void*>(address)) return;
  std::perror("gpu-emulator: reserving addresses");
  std::abort();
}

/// Host code that follows a device pointer ends here.
void on_fault(int, siginfo_t* info, void*) {
  const u64 address = reinterpret_cast<u64>(info->si_addr);
  if (on_device(address)) {
    say("HOST CODE DEREFERENCES A DEVICE ADDRESS: %s, %s", describe(address).c_str(),
        after_launch().c_str());
  }
  std::signal(SIGSEGV, SIG_DFL);  // the same instruction again, and the end
}

struct Memory {
  Memory() {
    reserve(device_base, device_size, PROT_NONE);
    reserve(bytes_base, device_size, PROT_READ | PROT_WRITE);
    reserve(valid_base, device_size / 8, PROT_READ | PROT_WRITE);
    if (settings().init) reserve(written_base, device_size, PROT_READ | PROT_WRITE);
    if (settings().race) reserve(race_base, device_size * sizeof(Race), PROT_READ | PROT_WRITE);
    if (!settings().profile.empty())
      reserve(sector_base, device_size / sector_bytes * sizeof(Sector), PROT_READ | PROT_WRITE);
    struct sigaction action = {};
    action.sa_sigaction = on_fault, action.sa_flags = SA_SIGINFO;
    sigaction(SIGSEGV, &action, nullptr);
  }
  u64 next[2] = {device_base + (1 << 20), device_base + pinned_from};  // by Place
  u64 live = 0;
  std::map<u64, Allocation> all;  // by address; freed ones too
};
Memory& memory() {
  static Memory* one = new Memory;  // never destroyed: columns are freed by destructors of statics
  return *one;
}

void give_back(u64 base, u64 begin, u64 end) {  // whole pages to the system
  const u64 page = sysconf(_SC_PAGESIZE), from = (begin + page - 1) / page * page,
            to = end / page * page;
  if (from < to) madvise(reinterpret_cast<void*>(base + from), to - from, MADV_DONTNEED);
}

}  // namespace

u64 allocate(u64 size, const std::string& what, Place place) {
  Memory& m = memory();
  u64& next = m.next[int(place)];
  const u64 address = next, granules = size / 8;
  if (address + size + gap > device_base + (place == Place::device ? pinned_from : device_size))
    return 0;
  next = (address + size + gap + alignment - 1) / alignment * alignment;
  u8* valid = reinterpret_cast<u8*>(valid_base) + (address - device_base) / 8;
  std::memset(valid, 8, granules);
  if (size % 8) valid[granules] = u8(size % 8);
  char* data = contents(address);
  for (u64 k = 0; k + 4 <= size; k += 4) std::memcpy(data + k, &poison, 4);
  m.all[address] = {address, size, int(m.all.size()), false, what};
  if (place == Place::device) m.live += size;
  return address;
}

const Allocation* allocation_at(u64 address) {
  const auto found = memory().all.find(address);
  return found == memory().all.end() || found->second.freed ? nullptr : &found->second;
}

void release(const Allocation& allocation) {
  Memory& m = memory();
  Allocation& a = m.all[allocation.address];
  const u64 offset = a.address - device_base;
  std::memset(reinterpret_cast<u8*>(valid_base) + offset / 8, 0, (a.size + 7) / 8);
  give_back(bytes_base, offset, offset + a.size);
  if (settings().init) give_back(written_base, offset, offset + a.size);
  if (settings().race)
    give_back(race_base, offset * sizeof(Race), (offset + a.size) * sizeof(Race));
  a.freed = true, a.what += ", freed " + after_launch();
  if (offset < pinned_from) m.live -= a.size;
}

std::string describe(u64 address) {
  address = as_device(address);
  char text[200];
  std::snprintf(text, sizeof text, "0x%llx is ", static_cast<unsigned long long>(address));
  std::string all = text;
  if (address < 4096) return all + "null";
  if (address - shared_window < shared_most) return all + "in shared memory";
  if (!on_device(address)) return all + "no device address (a host pointer?)";
  const Memory& m = memory();
  auto after = m.all.upper_bound(address);
  if (after == m.all.begin()) return all + "before all allocations";
  const Allocation& a = std::prev(after)->second;
  const u64 at = address - a.address;
  std::snprintf(text, sizeof text, "%s allocation %d of %llu bytes at 0x%llx, %llu bytes %s (",
                a.freed ? "FREED" : "of", a.number, static_cast<unsigned long long>(a.size),
                static_cast<unsigned long long>(a.address),
                static_cast<unsigned long long>(at < a.size ? at : at - a.size),
                at < a.size ? "into it" : "behind its end");
  return all + text + a.what + ")";
}

bool all_allocated(u64 address, u64 size) {
  const Memory& m = memory();
  auto after = m.all.upper_bound(address);
  if (after == m.all.begin()) return false;
  const Allocation& a = std::prev(after)->second;
  return !a.freed && address + size <= a.address + a.size;
}

void mark_written(u64 address, u64 size, bool written) {
  if (settings().init)
    std::memset(reinterpret_cast<void*>(address - device_base + written_base), written, size);
}

u64 bytes_allocated() { return memory().live; }

}  // namespace gpu_emulator

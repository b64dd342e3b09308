#pragma once
// What the parts of the emulated runtime know of each other.

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/gpu/emulator/ptx.h"

namespace gpu_emulator {

// settings.cpp: environment variables ------------------------------------------------------------

struct Settings {
  bool init = false, race = false;                                         // GPUEMU_CHECK=init,race
  bool strict = false;                                                     // GPUEMU_STRICT_INIT
  std::string profile;                                                     // GPUEMU_PROFILE=FILE
  enum class Order { forward, reverse, shuffled } order = Order::forward;  // GPUEMU_ORDER
  bool abort = false;                                                      // GPUEMU_FAULT=abort
  std::string fuse;                                                        // GPUEMU_FUSE=1: "f"
  bool trace = false;     // GPUEMU_TRACE=1: a line a launch
  int most_reports = 20;  // GPUEMU_REPORTS: of each check
  std::string cache;      // GPUEMU_CACHE
  bool digest = false;    // GPUEMU_DIGEST=1
};
const Settings& settings();
/// One line to stderr.
void say(const char* format, ...) __attribute__((format(printf, 1, 2)));
/// The same, and the end of the program.
[[noreturn]] void give_up(const std::string& why);

// The device that is not there: an H100 or H200 ---------------------------------------------------

constexpr int sms = 132, shared_of_sm = 228 << 10, most_shared = 227 << 10, plain_shared = 48 << 10;

// memory.cpp -------------------------------------------------------------------------------------

struct Allocation {
  u64 address = 0, size = 0;
  int number = 0;
  bool freed = false;
  std::string what;  // "cudaMalloc after launch 12 of NAME"
};
enum class Place { device, host };  // host: pinned, which kernels see too
/// @return a device address, 0 if there is no room.
u64 allocate(u64 size, const std::string& what, Place place = Place::device);
/// @return the allocation that begins at a device address, null if none does.
const Allocation* allocation_at(u64 address);
void release(const Allocation& allocation);
/// What is at or near an address, for people.
std::string describe(u64 address);
inline bool on_device(u64 address) { return address - device_base < device_size; }
inline char* contents(u64 address) {
  return reinterpret_cast<char*>(address - device_base + bytes_base);
}
/// Of pinned memory the device's address, of anything else the address itself.
inline u64 as_device(u64 address) {
  return is_pinned(address) ? address - bytes_base + device_base : address;
}
/// Are all these bytes allocated?
bool all_allocated(u64 address, u64 size);
void mark_written(u64 address, u64 size, bool written = true);
u64 bytes_allocated();

// order.cpp: what is known to be over before what -------------------------------------------------

struct Kernel;
/// By timeline, of which every stream and every chain of a graph's nodes has one, and the host the
/// first: the last operation there that is over.
using Clock = std::vector<u32>;
constexpr u32 host_timeline = 0;
u32 new_timeline();
void free_timeline(u32 timeline);
void join(Clock& clock, const Clock& other);
bool covers(const Clock& clock, const Clock& other);
/// An operation begins after all that the clock tells; the clock then tells of it too.
void begin_operation(u32 timeline, Clock& clock, const char* via, const char* what,
                     const Kernel* kernel = nullptr);
void end_operation(Clock& clock);
struct Operation {
  u32 timeline = 0, position = 0, serial = 0;
  const char *via = "", *what = "";
  const Kernel* kernel = nullptr;
  u32 one = 0, other = 0;  // if it stands for two
};
constexpr u32 most_operations = 1 << 21;  // that are told apart
u32 current_operation();
const Operation& operation(u32 number);
/// Is an operation, or are both that a number stands for, over when `now` runs?
bool is_over(u32 number, u32 now);
/// Those of them that are not, 0 if there are none.
u32 not_over(u32 number, u32 now);
/// A number for both.
u32 both(u32 a, u32 b);
/// Is this the last of those that a number stands for?
bool is_last_of(u32 number, u32 set);
std::string name_of(u32 operation);

void begin_phases(u32 blocks);
/// A strong access: an atomic, volatile, acquiring or releasing one.
void pass_on(Thread& t, u64 address, u32 order, bool looks);
/// Had the thread of an earlier phase let go of what it did, when its block came to the barrier?
bool was_released(u32 operation, u32 block, u32 rank, u32 barriers);

// launch.cpp -------------------------------------------------------------------------------------

struct Module;
struct Kernel {
  std::string name, pretty;  // mangled, and for people
  bool fibers = false, any_order = false;
  u32 most_threads = 1024, shared = 0, number = 0;
  u32 most_dynamic = ~0u;                       // cudaFuncSetAttribute
  std::vector<std::pair<u32, u32>> parameters;  // bytes, alignment
  Module* module = nullptr;
  void (*run)(Thread&) = nullptr;
  const Site* sites = nullptr;
  u32 launches = 0;
  int registers = 0, stack = 0, spilled = 0, barriers = 0;  // see resources_of
};
struct Module {
  std::string folder;    // of the translated kernels
  int architecture = 0;  // 90: sm_90
  std::map<std::string, Kernel> kernels;
  std::map<std::string, std::pair<u64, u64>> variables;  // address, bytes
  std::vector<u64> symbols;
};
struct Dim {
  u32 x, y, z;
  u64 count() const { return u64(x) * y * z; }
};
struct Launch {
  Kernel* kernel = nullptr;
  u32 serial = 0;
  Dim grid{}, block{};
  bool cooperative = false;
};
const Launch& current_launch();
/// @return false if the launch failed; the reason has been said.
bool launch(Kernel& kernel, Dim grid, Dim block, u32 dynamic_shared,
            const std::vector<char>& arguments, bool cooperative);
/// The arguments as the kernel declares them.
std::vector<char> packed(const Kernel& kernel, void** arguments);
/// In what order n things are done.
std::vector<u32> order_of(u32 n, bool free);
/// "thread (3,0,0) of block (1,0,0)"
std::string who(const Thread& t);
/// Name and last launch of the latest kernel.
std::string after_launch();
/// One of a launch's blocks.
struct Block {
  u32 index = 0, slot = 0;           // of the grid; of those that run together
  u32 operation = 0;                 // as racecheck knows it: one a phase
  u32 phase = 0;                     // barriers of the whole grid that it has passed
  std::vector<Race> shared_touched;  // a Race a byte
};

// modules.cpp ----------------------------------------------------------------------------------

/// Translates (or finds translated) the PTX of a fat binary.
Module* load_module(const void* fat_binary);
/// Makes kernel.run callable: compiles it the first time.
void compile(Kernel& kernel);
/// Asks ptxas for registers, stack and spills.
void resources_of(Kernel& kernel);
/// How many blocks one multiprocessor holds.
int blocks_per_sm(Kernel& kernel, u32 threads, u64 dynamic_shared);

// checks.cpp -------------------------------------------------------------------------------------

/// The present operation, of the host or a copy, touches bytes of device memory.
void check_range(u64 address, u64 size, Use use);
void summarise_checks();

// profile.cpp ------------------------------------------------------------------------------------

void profile_operation(const Operation& operation, const Clock& before);  // it begins
void profile_block(Thread* threads, u32 count, u32 stride);               // a block has ended
void profile_barrier(const Block& block);                                 // all its threads meet
void profile_launch();
void profile_event(const char* what, u64 bytes);  // a copy, a wait, an allocation
void profile_reset();
void profile_write();

}  // namespace gpu_emulator

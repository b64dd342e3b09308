// Runs a grid, block after block. Threads of kernels that meet each other (barriers, shuffles) are
// fibers that yield where they wait; those of all others run one after the other. Where a block
// only looks again and again at memory, the next ones begin and take turns with it, as many as the
// device has room for: so grids meet at barriers of their own.

#include <sys/mman.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <numeric>
#include <random>

#include "tests/gpu/emulator/runtime.h"

extern "C" void gpu_emulator_switch(void** save, void* load);
asm(R"(
.text
.globl gpu_emulator_switch
.type gpu_emulator_switch, @function
gpu_emulator_switch:
  push %rbp; push %rbx; push %r12; push %r13; push %r14; push %r15
  mov %rsp, (%rdi)
  mov %rsi, %rsp
  pop %r15; pop %r14; pop %r13; pop %r12; pop %rbx; pop %rbp
  ret
)");

namespace gpu_emulator {

namespace {

constexpr u64 stack_bytes = 512 << 10, local_bytes = 64 << 10;
constexpr u32 most_looks = 8;             // of a thread at what others write, before it gives way
constexpr u32 most_quiet = 100'000;       // rounds in which nothing happens,
constexpr u64 most_visits = 200'000'000;  // or visits of threads in them
constexpr u64 most_kept = 100'000;        // threads whose stacks are kept for the next launch
struct Fault {};
Launch now;
u64 changes = 0;      // of memory by strong accesses: what threads that look may wait for
bool failed = false;  // a thread of this launch

enum class State { ready, polling, barrier, warp, done };
struct Fiber : Thread {
  void* stack = nullptr;  // its pointer, when it does not run
  State state = State::done;
  bool again = false;                             // it was polling before
  u32 site = 0, number = 0, count = 0, mask = 0;  // of what it waits for
  bool vote = false;
  Reduced reduced{};
  u64 value = 0, gathered[32];
  u32 looks = 0;
  u64 seen[4] = {};  // where it looked lately
  std::vector<AsyncCopy> own_copies;
};

char* map_memory(u64 size) {
  void* got = mmap(nullptr, size, PROT_READ | PROT_WRITE,
                   MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (got == MAP_FAILED) give_up("no memory for threads");
  return static_cast<char*>(got);
}

/// A block that runs together with others, and its threads.
struct Resident : Block {
  std::vector<Fiber> fibers;
  char *stacks = nullptr, *locals = nullptr;
  std::vector<char> shared;
  std::vector<u32> warps;  // in the order in which they run
  u32 threads = 0, ended = 0;
  bool taken = false;
  u32 alive[32] = {}, waiting[32] = {};  // lanes of each warp: not done, in an exchange

  void make_room(u32 count) {
    if (fibers.size() >= count) return;
    if (stacks) munmap(stacks, fibers.size() * stack_bytes);
    if (locals) munmap(locals, fibers.size() * local_bytes);
    fibers.clear(), fibers.resize(count);
    stacks = map_memory(count * stack_bytes), locals = map_memory(count * local_bytes);
  }
  ~Resident() {
    if (stacks) munmap(stacks, fibers.size() * stack_bytes);
    if (locals) munmap(locals, fibers.size() * local_bytes);
  }
};
std::vector<std::unique_ptr<Resident>> slots;
void* scheduler = nullptr;  // its stack pointer
Fiber* running = nullptr;

void yield(Fiber& f) { gpu_emulator_switch(&f.stack, scheduler); }

void fiber_main() {
  Fiber& self = *running;
  for (;;) {
    try {
      now.kernel->run(self);
    } catch (const ThreadExit&) {
    } catch (const Fault&) {
      failed = true;
    }
    self.state = State::done;
    yield(self);
  }
}

/// Stacks begin at different places of a page, or they would share a few lines of the cache.
void new_stack(Resident& block, u32 rank) {
  char* const top = block.stacks + (rank + 1) * stack_bytes - (rank % 61) * 64 - 256;
  void** sp = reinterpret_cast<void**>(top);
  *--sp = nullptr;  // where fiber_main would return to
  *--sp = reinterpret_cast<void*>(&fiber_main);
  for (int k = 0; k < 6; ++k) *--sp = nullptr;
  block.fibers[rank].stack = sp;
}

void finish_barrier(Resident& block, const Fiber& last) {
  u32 arrived = 0, left = 0, set = 0;
  for (u32 k = 0; k < block.threads; ++k) {
    const Fiber& f = block.fibers[k];
    left += f.state != State::done;
    if (f.state != State::barrier || f.number != last.number) continue;
    ++arrived, set += f.vote;
  }
  if (arrived < (last.count ? last.count : left)) return;
  if (arrived == left) profile_barrier(block);
  const u32 number = last.number;
  for (u32 k = 0; k < block.threads; ++k) {
    Fiber& f = block.fibers[k];
    if (f.state != State::barrier || f.number != number) continue;
    f.state = State::ready, f.looks = 0, ++f.barriers;
    f.reduced = {set, set > 0, set == arrived};
  }
}

void finish_exchange(Resident& block, u32 warp, u32 mask) {
  const u32 want = mask & block.alive[warp];
  if ((block.waiting[warp] & want) != want) return;
  Fiber* const lanes = &block.fibers[warp * 32];
  for (u32 k = 0; k < 32; ++k) {
    if (want >> k & 1 && lanes[k].mask != mask) return;
  }
  for (u32 k = 0; k < 32; ++k) {
    if (!(want >> k & 1)) continue;
    for (u32 j = 0; j < 32; ++j) lanes[k].gathered[j] = want >> j & 1 ? lanes[j].value : 0;
    lanes[k].state = State::ready;
  }
  block.waiting[warp] &= ~want;
}

void has_ended(Resident& block, Fiber& f) {
  const u32 warp = f.rank / 32;
  ++block.ended;
  block.alive[warp] &= ~(1u << f.lane);
  for (u32 k = 0; k < 32; ++k) {  // those that waited for it
    if (block.waiting[warp] >> k & 1)
      finish_exchange(block, warp, block.fibers[warp * 32 + k].mask);
  }
  for (u32 k = 0; k < block.threads; ++k) {
    if (block.fibers[k].state != State::barrier) continue;
    finish_barrier(block, block.fibers[k]);
    break;
  }
}

void say_deadlock(const std::vector<Resident*>& blocks, u64 grid, u64 begun) {
  say("DEADLOCK in %s, launch %u: threads wait for others that do not come",
      now.kernel->pretty.c_str(), now.serial);
  if (begun < grid)
    say("  %zu of its %llu blocks have room at once; the others begin when these end",
        blocks.size(), static_cast<unsigned long long>(grid));
  std::map<std::pair<State, u32>, std::pair<u32, const Fiber*>> places;
  for (const Resident* b : blocks) {
    for (u32 k = 0; k < b->threads; ++k) {
      const Fiber& f = b->fibers[k];
      if (f.state == State::done) continue;
      auto& [count, one] = places[{f.state, f.site}];
      ++count, one = &f;
    }
  }
  for (const auto& [place, found] : places)
    say("  %u threads %s, such as %s, at %s  %s", found.first,
        place.first == State::polling ? "look at memory" : "wait", who(*found.second).c_str(),
        now.kernel->sites[place.second].text, now.kernel->sites[place.second].location);
}

void set_place(Thread& t, u32 rank) {
  t.tid[0] = rank % t.ntid[0], t.tid[1] = rank / t.ntid[0] % t.ntid[1],
  t.tid[2] = rank / (t.ntid[0] * t.ntid[1]);
  t.rank = rank, t.lane = rank % 32;
}

void set_block(Thread& t, Block& block, u32 index) {
  t.ctaid[0] = index % t.nctaid[0], t.ctaid[1] = index / t.nctaid[0] % t.nctaid[1],
  t.ctaid[2] = index / (t.nctaid[0] * t.nctaid[1]);
  t.block = &block;
  block.index = index, block.phase = 0, block.operation = current_operation();
  std::memset(t.shared, 0x7f, t.shared_size);
  if (settings().race) block.shared_touched.assign(t.shared_size, {});
}

Resident& free_slot() {
  for (const auto& slot : slots)
    if (!slot->taken) return *slot;
  slots.push_back(std::make_unique<Resident>());
  slots.back()->slot = u32(slots.size() - 1);
  return *slots.back();
}

Resident& begin(Thread common, u32 index, u32 threads) {
  Resident& block = free_slot();
  block.make_room(threads);
  block.taken = true, block.threads = threads, block.ended = 0;
  block.shared.resize(std::max<u64>(block.shared.size(), common.shared_size));
  common.shared = block.shared.data();
  set_block(common, block, index);
  for (u32 k = 0; k < threads; ++k) {
    Fiber& f = block.fibers[k];
    static_cast<Thread&>(f) = common;
    set_place(f, k);
    f.local = f.local_top = reinterpret_cast<u64>(block.locals + k * local_bytes);
    f.local_end = f.local + local_bytes;
    f.own_copies.clear(), f.copies = &f.own_copies;
    if (!f.stack || f.state != State::done) new_stack(block, k);
    f.state = State::ready, f.looks = 0, f.again = false;
  }
  const u32 warps = (threads + 31) / 32;
  for (u32 w = 0; w < warps; ++w) {
    block.alive[w] = threads - 32 * w >= 32 ? ~0u : (1u << (threads - 32 * w)) - 1;
    block.waiting[w] = 0;
  }
  block.warps = order_of(warps, true);
  return block;
}

/// Runs every thread of the block until it waits. @return whether more has happened than looking.
bool take_turn(Resident& block) {
  bool progress = false;
  for (u32 k = 0; k < block.threads; ++k) {
    Fiber& f = block.fibers[k];
    if (f.state == State::polling) f.state = State::ready, f.again = true;
  }
  for (const u32 w : block.warps) {
    for (bool again = true; again;) {  // a warp runs until it waits for other warps
      again = false;
      for (u32 k = 32 * w; k < std::min(block.threads, 32 * w + 32); ++k) {
        Fiber& f = block.fibers[k];
        if (f.state != State::ready) continue;
        again = true, running = &f;
        gpu_emulator_switch(&scheduler, f.stack);
        if (failed) return false;
        progress |= !f.again || f.state != State::polling;
        f.again = false;
        if (f.state == State::done) has_ended(block, f);
      }
    }
  }
  return progress;
}

bool run_fibers(const Thread& common, const std::vector<u32>& order, u32 threads) {
  std::vector<Resident*> blocks;
  u64 begun = 0, most = 0;
  u32 quiet = 0;
  while (begun < order.size() || !blocks.empty()) {
    u64 more = blocks.empty();
    if (quiet > 0 && begun < order.size()) {
      if (most == 0)
        most = u64(sms) * std::max(1, blocks_per_sm(*now.kernel, threads, common.dynamic_shared));
      more = std::min<u64>(blocks.size(), most - blocks.size());
      if (more > 0) quiet = 0;
    }
    for (; more > 0 && begun < order.size(); --more)
      blocks.push_back(&begin(common, order[begun++], threads));
    const u64 before = changes;
    bool progress = false, polling = false;
    for (Resident* const block : blocks) {
      for (bool more = true; more && block->ended < threads; progress |= more) {
        more = take_turn(*block);
        if (failed) return false;
      }
      if (block->ended < threads) continue;
      profile_block(block->fibers.data(), threads, sizeof(Fiber));
      block->taken = false;
    }
    std::erase_if(blocks, [](const Resident* b) { return !b->taken; });
    quiet = progress || changes != before ? 0 : quiet + 1;
    if (quiet == 0) continue;
    for (const Resident* b : blocks)
      polling |= std::any_of(b->fibers.begin(), b->fibers.begin() + threads,
                             [](const Fiber& f) { return f.state == State::polling; });
    if (!polling || quiet > most_quiet || quiet * blocks.size() * threads > most_visits) {
      say_deadlock(blocks, order.size(), begun);
      return false;
    }
  }
  return true;
}

bool run_plain(Thread common, const std::vector<u32>& order, u32 threads) {
  static char* const local = map_memory(local_bytes);
  static Block block;
  static std::vector<char> shared(shared_most);
  common.local = common.local_top = reinterpret_cast<u64>(local),
  common.local_end = common.local + local_bytes;
  common.shared = shared.data();
  const bool forward = settings().order == Settings::Order::forward,
             profile = !settings().profile.empty();
  std::vector<u32> ranks;
  if (!forward) ranks = order_of(threads, true);
  for (const u32 index : order) {
    set_block(common, block, index);
    std::vector<Thread> done;
    for (u32 k = 0; k < threads; ++k) {
      Thread t = common;
      set_place(t, forward ? k : ranks[k]);
      try {
        now.kernel->run(t);
      } catch (const ThreadExit&) {
      } catch (const Fault&) {
        return false;
      }
      if (profile) done.push_back(t);
    }
    if (profile) profile_block(done.data(), threads, sizeof(Thread));
  }
  return true;
}

/// %envreg1 and 2 of a cooperative launch: cooperative_groups counts the blocks that have come
/// there.
u64 clear_workspace() {
  static const u64 address = allocate(64, "where grids meet");
  std::memset(contents(address), 0, 64);
  mark_written(address, 64);
  return address;
}

}  // namespace

std::vector<u32> order_of(u32 n, bool free) {
  std::vector<u32> order(n);
  std::iota(order.begin(), order.end(), 0);
  const Settings::Order how = free ? settings().order : Settings::Order::forward;
  if (how == Settings::Order::reverse) std::reverse(order.begin(), order.end());
  static std::mt19937 random(1);
  if (how == Settings::Order::shuffled) std::shuffle(order.begin(), order.end(), random);
  return order;
}

std::vector<char> packed(const Kernel& kernel, void** arguments) {
  std::vector<char> all;
  for (size_t k = 0; k < kernel.parameters.size(); ++k) {
    const auto [size, align] = kernel.parameters[k];
    all.resize((all.size() + align - 1) / align * align);
    const char* from = static_cast<const char*>(arguments[k]);
    all.insert(all.end(), from, from + size);
  }
  return all;
}

const Launch& current_launch() { return now; }

std::string who(const Thread& t) {
  char text[120];
  std::snprintf(text, sizeof text, "thread (%u,%u,%u) of block (%u,%u,%u)", t.tid[0], t.tid[1],
                t.tid[2], t.ctaid[0], t.ctaid[1], t.ctaid[2]);
  return text;
}
std::string after_launch() {
  if (!now.kernel) return "before any launch";
  return "after launch " + std::to_string(now.serial) + " (" + now.kernel->pretty + ")";
}

bool launch(Kernel& kernel, Dim grid, Dim dim, u32 dynamic_shared,
            const std::vector<char>& arguments, bool cooperative) {
  compile(kernel);
  now = {&kernel, now.serial + 1, grid, dim, cooperative};
  ++kernel.launches;
  const u32 threads = u32(dim.count()), blocks = u32(grid.count());
  if (settings().trace)
    say("launch %u: %s <<<%u, %u>>> by %s", now.serial, kernel.pretty.c_str(), blocks, threads,
        operation(current_operation()).via);
  Thread common{};
  common.ntid[0] = dim.x, common.ntid[1] = dim.y, common.ntid[2] = dim.z;
  common.nctaid[0] = grid.x, common.nctaid[1] = grid.y, common.nctaid[2] = grid.z;
  common.shared_size = kernel.shared + dynamic_shared, common.dynamic_shared = dynamic_shared;
  common.params = arguments.data(), common.param_size = u32(arguments.size());
  if (cooperative) common.workspace = clear_workspace();
  begin_phases(blocks);
  failed = false;
  for (const auto& slot : slots) slot->taken = false;
  const std::vector<u32> order = order_of(blocks, kernel.any_order || cooperative);
  const bool fine =
      kernel.fibers ? run_fibers(common, order, threads) : run_plain(common, order, threads);
  if (slots.size() * threads > most_kept) slots.resize(1);
  profile_launch();
  if (!fine && settings().abort) std::abort();
  return fine;
}

// What translated kernels call --------------------------------------------------------------------

void fault(Thread& t, u32 site, u64 address, u32 bytes, Space space, Use use) {
  static const char* const name[] = {"global",   "shared",    "local",
                                     "constant", "parameter", "generic"};
  const Site& s = now.kernel->sites[site];
  say("FAULT in %s, launch %u, %s", now.kernel->pretty.c_str(), now.serial, who(t).c_str());
  say("  %s   %s", s.text, s.location);
  const bool misaligned = on_device(address) && all_allocated(address, bytes) && address % bytes;
  const bool own = space == shared_space || space == local_space;  // an offset, a stack
  const u64 at = space == local_space ? address - t.local : address,
            size = space == local_space ? t.local_top - t.local : t.shared_size;
  const std::string where =
      own ? "byte " + std::to_string(s64(at)) + " of " + std::to_string(size) : describe(address);
  say("  %s %u bytes%s through a %s address: %s", writes(use) ? "writes" : "reads", bytes,
      misaligned ? " (MISALIGNED)" : "", name[space], where.c_str());
  throw Fault{};
}
void fault_trap(Thread& t, u32 site) {
  say("TRAP in %s, launch %u, %s: %s  %s", now.kernel->pretty.c_str(), now.serial, who(t).c_str(),
      now.kernel->sites[site].text, now.kernel->sites[site].location);
  throw Fault{};
}
void fault_unknown(Thread& t, u32 site) {
  say("UNKNOWN INSTRUCTION in %s: %s", now.kernel->pretty.c_str(), now.kernel->sites[site].text);
  throw Fault{};
}

Reduced block_barrier(Thread& t, u32 site, u32 number, u32 count, bool value) {
  Resident& block = static_cast<Resident&>(*t.block);
  Fiber& f = static_cast<Fiber&>(t);
  f.state = State::barrier, f.site = site, f.number = number, f.count = count, f.vote = value;
  const u32 warp = f.rank / 32;
  // Only the last thread of a warp that still runs can complete a barrier.
  bool last = true;
  for (u32 k = 32 * warp; k < std::min(block.threads, 32 * warp + 32) && last; ++k)
    last = block.fibers[k].state != State::ready;
  if (last) finish_barrier(block, f);
  if (f.state == State::barrier) yield(f);
  return f.reduced;
}

const u64* exchange(Thread& t, u32 site, u32 mask, u64 value) {
  Resident& block = static_cast<Resident&>(*t.block);
  Fiber& f = static_cast<Fiber&>(t);
  if (!(mask >> f.lane & 1)) {
    say("a thread is not in the mask of its own warp instruction");
    fault_trap(t, site);
  }
  f.state = State::warp, f.site = site, f.mask = mask, f.value = value;
  block.waiting[f.rank / 32] |= 1u << f.lane;
  finish_exchange(block, f.rank / 32, mask);
  if (f.state == State::warp) yield(f);
  return f.gathered;
}

void give_way(Thread& t, u32 site) {
  Fiber& f = static_cast<Fiber&>(t);
  f.state = State::polling, f.site = site, f.looks = 0;
  yield(f);
}

void strong_access(Thread& t, u32 site, u64 address, u32 order, bool looks, bool changed) {
  static const bool watched = settings().race || !settings().profile.empty();
  if (watched && on_device(address)) pass_on(t, address, order, looks);
  changes += changed;
  if (!looks || !now.kernel->fibers) return;
  Fiber& f = static_cast<Fiber&>(t);
  const u64 what = address ^ u64(site) << 48;
  const bool seen = std::find(std::begin(f.seen), std::end(f.seen), what) != std::end(f.seen);
  if (!seen) std::copy_backward(f.seen, f.seen + 3, f.seen + 4), f.seen[0] = what;
  f.looks = seen && !changed ? f.looks + 1 : 0;
  if (f.looks >= most_looks) give_way(t, site);
}

}  // namespace gpu_emulator

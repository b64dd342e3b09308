// initcheck: reads of memory that nothing has written. racecheck: two threads of a launch touch a
// byte, one of them writes, and neither a barrier nor atomics stand between; or two operations do
// of which neither is known to be over before the other.

#include <map>
#include <set>

#include "tests/gpu/emulator/runtime.h"

namespace gpu_emulator {

namespace {

/// A race word: operation, flags, thread and how many barriers it had passed.
constexpr int epoch_bits = 16, thread_bits = 24, flag_bits = 3;
constexpr u64 is_atomic = 1, many_in_block = 2, many_blocks = 4;

struct Word {
  u64 flags, thread, epoch;
  u32 operation;
  explicit Word(u64 w)
      : flags(w >> (epoch_bits + thread_bits) & ((1 << flag_bits) - 1)),
        thread(w >> epoch_bits & ((1 << thread_bits) - 1)),
        epoch(w & ((1 << epoch_bits) - 1)),
        operation(u32(w >> (epoch_bits + thread_bits + flag_bits))) {}
};
u64 pack(u64 operation, u64 flags, u64 thread, u64 epoch) {
  return ((operation << flag_bits | flags) << thread_bits | thread) << epoch_bits | epoch;
}

struct Self {
  u32 operation;
  u64 thread, epoch, block_threads;
};
Self self_of(const Thread& t) {
  const u64 in_block = t.ntid[0] * t.ntid[1] * t.ntid[2];
  return {t.block->operation, (t.block->index * in_block + t.rank) & ((1 << thread_bits) - 1),
          u64(t.barriers & 255) << 8 | (t.warp_barriers & 255), in_block};
}

/// Does a barrier of the block stand between what the word tells and now?
bool ordered(const Word& w, const Self& self) {
  if (w.flags & many_blocks) return false;
  const bool same_block = w.thread / self.block_threads == self.thread / self.block_threads;
  if (!same_block) return false;
  if (w.epoch >> 8 != self.epoch >> 8) return true;
  if (w.flags & many_in_block) return false;
  if (w.thread == self.thread) return true;
  const u64 warp = w.thread % self.block_threads / 32, own = self.thread % self.block_threads / 32;
  return warp == own && w.epoch != self.epoch;
}

/// May what the word tells be at the same time as now?
bool together(const Word& w, const Self& self, Space space) {
  if (space == shared_space || w.operation == self.operation) return !ordered(w, self);
  if (is_last_of(self.operation, w.operation))
    return !ordered(w, self) || !is_over(operation(w.operation).one, self.operation);
  return !is_over(w.operation, self.operation) ||
         !was_released(w.operation, u32(w.thread / self.block_threads),
                       u32(w.thread % self.block_threads), u32(w.epoch >> 8));
}
/// Are both of the same launch?
bool is_of(u32 a, u32 b) {
  return operation(a).kernel && operation(a).kernel == operation(b).kernel &&
         operation(a).serial == operation(b).serial;
}
/// Who has read, if `self` now does too.
u32 readers(const Word& reader, u32 self) {
  if (is_last_of(self, reader.operation)) return reader.operation;
  const u32 others = not_over(reader.operation, self);
  return others ? both(others, self) : self;
}

std::map<std::string, int> counted;
int said = 0;

void report(const std::string& what, const std::string& where, const std::string& about) {
  if (counted[what]++ > 0 || ++said > settings().most_reports) return;
  say("%s (%s)\n    %s", what.c_str(), where.c_str(), about.c_str());
}
void report(const Thread& t, const char* what, u32 site, const std::string& about) {
  const Kernel& k = *current_launch().kernel;
  report(std::string(what) + " in " + k.pretty + ": " + k.sites[site].text + "   " +
             k.sites[site].location,
         "launch " + std::to_string(current_launch().serial) + ", " + who(t), about);
}

std::string other(const Word& w, const Self& self) {
  if (!is_of(w.operation, self.operation))
    return "against " + name_of(w.operation) + ", unordered with " + name_of(self.operation);
  return "against thread " + std::to_string(w.thread % self.block_threads) + " of block " +
         std::to_string(w.thread / self.block_threads);
}

}  // namespace

void check_written(Thread& t, u32 site, u64 offset, u32 bytes) {
  const u8* written = reinterpret_cast<const u8*>(written_base + offset);
  for (u32 k = 0; k < bytes; ++k) {
    if (written[k]) continue;
    return report(t, "UNINITIALISED READ", site, describe(device_base + offset + k));
  }
}

void check_race(Thread& t, u32 site, u64 offset, u32 bytes, Use use, bool same_value, Space space) {
  const Self self = self_of(t);
  const bool strong = use == atomic_ || use == strong_load || use == strong_store;
  const auto about = [&](const Word& w) {
    return other(w, self) + (space == shared_space ? ", shared memory at " + std::to_string(offset)
                                                   : ", " + describe(device_base + offset));
  };
  for (u32 k = 0; k < bytes; ++k) {
    Race& cell = space == shared_space ? t.block->shared_touched[offset + k]
                                       : reinterpret_cast<Race*>(race_base)[offset + k];
    const Word writer(cell.writer), reader(cell.reader);
    if (cell.writer && !(strong && writer.flags & is_atomic)) {
      if (use == constant_load && is_of(writer.operation, self.operation))
        report(t, "NON-COHERENT READ of what this launch wrote", site, about(writer));
      if (together(writer, self, space))
        report(t,
               writes(use) ? (same_value ? "RACE, two writes of one value" : "RACE, two writes")
                           : "RACE, a read after a write",
               site, about(writer));
    }
    if (writes(use)) {
      if (cell.reader && !(strong && reader.flags & is_atomic) && together(reader, self, space) &&
          !(same_value && !strong))
        report(t, "RACE, a write after a read", site, about(reader));
      cell.writer = pack(self.operation, strong ? is_atomic : 0, self.thread, self.epoch);
      continue;
    }
    u64 flags = strong ? is_atomic : 0;
    const u32 now =
        !cell.reader || space == shared_space ? self.operation : readers(reader, self.operation);
    const bool too = cell.reader && is_last_of(self.operation, reader.operation);
    if (too && reader.thread != self.thread) {
      const bool same_block =
          reader.thread / self.block_threads == self.thread / self.block_threads;
      if (reader.flags & many_blocks || !same_block)
        flags |= many_blocks;
      else if (!ordered(reader, self))
        flags |= many_in_block;
    }
    if (too && reader.flags & many_blocks) flags |= many_blocks;
    if ((too || now != self.operation) && !(reader.flags & is_atomic)) flags &= ~is_atomic;
    cell.reader = pack(now, flags, self.thread, self.epoch);
  }
}

void check_range(u64 address, u64 size, Use use) {
  address = as_device(address);
  if (!settings().race || !on_device(address)) return;
  const u32 self = current_operation();
  const auto check = [&](const Word& w, const char* what, u64 at) {
    if (w.operation != self && !is_over(w.operation, self))
      report(std::string(what) + " in a " + operation(self).what, name_of(self),
             "against " + name_of(w.operation) + ", " + describe(at));
  };
  for (u64 at = address; at < address + size; ++at) {
    Race& cell = reinterpret_cast<Race*>(race_base)[at - device_base];
    if (cell.writer)
      check(Word(cell.writer), writes(use) ? "RACE, two writes" : "RACE, a read after a write", at);
    if (writes(use)) {
      if (cell.reader) check(Word(cell.reader), "RACE, a write after a read", at);
      cell.writer = pack(self, 0, 0, 0);
    } else {
      cell.reader = pack(cell.reader ? readers(Word(cell.reader), self) : self, 0, 0, 0);
    }
  }
}

void summarise_checks() {
  if (counted.empty()) return;
  say("checks found %zu places:", counted.size());
  for (const auto& [key, times] : counted) say("  %d x %s", times, key.c_str());
}

}  // namespace gpu_emulator

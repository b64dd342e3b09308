// What kernels do, counted. The k-th time that a thread passes an instruction (since its block last
// met at a barrier, in long kernels) is taken to be together with the k-th time of the other
// threads of its warp, so divergent loops are only nearly right.

#include <algorithm>
#include <cstdio>

#include "tests/gpu/emulator/runtime.h"

namespace gpu_emulator {

namespace {

struct SiteCount {
  u64 requests = 0, bytes = 0, sectors = 0;
};
struct Counts {  // sums over launches
  u64 launches = 0, blocks = 0, warps = 0, threads = 0, instructions = 0, warp_instructions = 0;
  u64 loaded = 0, stored = 0;                        // bytes asked for
  u64 requests = 0, sectors = 0, least_sectors = 0;  // of warps; had they been contiguous
  u64 block_sectors = 0;  // different ones in each block: what misses a perfect L1
  u64 read_sectors = 0,
      written_sectors = 0;  // different ones in each launch: what memory must move
  u64 local_bytes = 0, atomics = 0, grid_syncs = 0;
};
constexpr size_t counts = sizeof(Counts) / sizeof(u64);
const char* const count_names =
    "launches\tblocks\twarps\tthreads\tinstructions\twarp_instructions\tloaded\tstored\trequests\t"
    "sectors\tleast_sectors\tblock_sectors\tread_sectors\twritten_sectors\tlocal_bytes\tatomics\t"
    "grid_syncs";
struct KernelCount {
  Counts n{};
  std::map<u32, SiteCount> sites;
  Kernel* kernel = nullptr;
};
struct Event {
  u64 times = 0, bytes = 0;
};
struct Row {  // what a warp does at once
  u32 lanes = 0;
  u64 address[32];
};
struct SiteLog {
  u32 bytes = 0;
  Use use = load;
  u32 passed[32] = {};
  u32 rows_used = 0;
  std::vector<Row> rows;
};
using WarpLog = std::vector<SiteLog>;
constexpr u32 most_rows = 20'000;  // of a block, before they are counted at a barrier

struct BlockLog {
  WarpLog warps[32];
  u32 rows = 0, serial = 0;
};
std::vector<BlockLog> logs;  // by slot
std::map<std::string, KernelCount> kernels;
std::map<std::pair<std::string, std::string>, Event> events;
u32 block_serial = 0;
u32 least_phase = ~0u;  // barriers that every block of this launch has passed

/// An operation, for the longest path through all of them.
struct Step {
  Operation operation;
  std::vector<std::pair<u32, u32>> after;  // the latest of other timelines: timeline, position
  u64 bytes = 0;
  Counts n{};
};
std::vector<Step> steps;
std::map<u32, Clock> known;  // by timeline: what its last operation came after

void touch(Counts& n, u64 sector, bool write) {
  Sector& s = reinterpret_cast<Sector*>(sector_base)[sector];
  const u32 launch = current_launch().serial;
  u32& in_launch = write ? s.launch_written : s.launch_read;
  u32& in_block = write ? s.block_written : s.block_read;
  if (in_launch != launch) in_launch = launch, ++(write ? n.written_sectors : n.read_sectors);
  if (in_block != block_serial) in_block = block_serial, ++n.block_sectors;
}

void count_row(Counts& n, SiteCount& at, const SiteLog& log, const Row& row) {
  u64 touched[64];
  u32 found = 0;
  for (u32 k = 0; k < row.lanes; ++k) {
    const u64 first = (row.address[k] - device_base) / sector_bytes,
              last = (row.address[k] + log.bytes - 1 - device_base) / sector_bytes;
    for (u64 s = first; s <= last; ++s) touched[found++] = s;
  }
  std::sort(touched, touched + found);
  found = u32(std::unique(touched, touched + found) - touched);
  const u64 bytes = u64(log.bytes) * row.lanes;
  for (u32 k = 0; k < found; ++k) touch(n, touched[k], writes(log.use));
  ++at.requests, at.bytes += bytes, at.sectors += found;
  ++n.requests, n.sectors += found, n.least_sectors += (bytes + sector_bytes - 1) / sector_bytes;
  (writes(log.use) ? n.stored : n.loaded) += bytes;
  if (log.use == atomic_) n.atomics += row.lanes;
}

Counts& counts_now() {
  if (steps.empty()) steps.emplace_back();  // begun before the profile was
  return steps.back().n;
}

void count_rows(u32 slot) {
  if (slot >= logs.size()) return;
  BlockLog& block = logs[slot];
  if (block.serial == 0) block.serial = ++block_serial;
  const u32 latest = std::exchange(block_serial, block.serial);
  KernelCount& c = kernels[current_launch().kernel->pretty];
  for (WarpLog& warp : block.warps) {
    for (u32 s = 0; s < warp.size(); ++s) {
      SiteLog& log = warp[s];
      for (u32 k = 0; k < log.rows_used; ++k) count_row(counts_now(), c.sites[s], log, log.rows[k]);
      log.rows_used = 0;
      std::fill_n(log.passed, 32, 0);
    }
  }
  block_serial = latest, block.rows = 0;
}

}  // namespace

void record_access(Thread& t, u32 site, u64 address, u32 bytes, Space, Use use) {
  if (logs.size() <= t.block->slot) logs.resize(t.block->slot + 1);
  BlockLog& block = logs[t.block->slot];
  WarpLog& warp = block.warps[t.rank / 32];
  if (warp.size() <= site) warp.resize(site + 1);
  SiteLog& log = warp[site];
  log.bytes = bytes, log.use = use;
  const u32 k = log.passed[t.lane]++;
  if (k >= log.rows_used) {
    log.rows_used = k + 1, ++block.rows;
    if (log.rows.size() < log.rows_used) log.rows.resize(std::max<size_t>(16, 2 * log.rows.size()));
    log.rows[k].lanes = 0;
  }
  Row& row = log.rows[k];
  row.address[row.lanes++] = address;
}

void profile_operation(const Operation& operation, const Clock& before) {
  if (settings().profile.empty()) return;
  Step step{operation, {}, 0, {}};
  Clock& last = known[operation.timeline];
  for (u32 k = 0; k < before.size(); ++k) {
    if (k != operation.timeline && before[k] > (k < last.size() ? last[k] : 0))
      step.after.push_back({k, before[k]});
  }
  join(last, before);
  steps.push_back(std::move(step));
}

void profile_block(Thread* all, u32 count, u32 stride) {
  if (settings().profile.empty()) return;
  Counts& n = counts_now();
  u64 most = 0;
  for (u32 k = 0; k < count; ++k) {
    const Thread& t = *reinterpret_cast<Thread*>(reinterpret_cast<char*>(all) + u64(k) * stride);
    n.instructions += t.instructions, n.local_bytes += t.local_bytes, ++n.threads;
    most = std::max(most, t.instructions);
    if (t.rank % 32 == 31 || k + 1 == count) n.warp_instructions += most, ++n.warps, most = 0;
  }
  ++n.blocks;
  least_phase = std::min(least_phase, all->block->phase);
  const u32 slot = all->block->slot;
  count_rows(slot);
  if (slot < logs.size()) logs[slot].serial = 0;
}

void profile_barrier(const Block& block) {
  if (block.slot < logs.size() && logs[block.slot].rows > most_rows) count_rows(block.slot);
}

void profile_launch() {
  if (settings().profile.empty()) return;
  Counts& n = counts_now();
  n.launches = 1, n.grid_syncs = n.blocks > 0 ? std::exchange(least_phase, ~0u) : 0;
  KernelCount& c = kernels[current_launch().kernel->pretty];
  c.kernel = current_launch().kernel;
  for (size_t k = 0; k < counts; ++k) (&c.n.launches)[k] += (&n.launches)[k];
  for (BlockLog& block : logs)
    for (WarpLog& warp : block.warps) warp.clear();  // instructions of the next kernel are others
}

void profile_event(const char* what, u64 bytes) {
  if (settings().profile.empty()) return;
  const Kernel* k = current_launch().kernel;
  Event& e = events[{what, k ? k->pretty : "the beginning"}];
  ++e.times, e.bytes += bytes;
  if (!steps.empty() && steps.back().operation.what == what) steps.back().bytes = bytes;
}

void profile_reset() { kernels.clear(), events.clear(), steps.clear(); }

void profile_write() {
  if (settings().profile.empty() || (kernels.empty() && steps.empty())) return;
  std::FILE* out = std::fopen(settings().profile.c_str(), "w");
  if (!out) return say("cannot write %s", settings().profile.c_str());
  const auto number = [](u64 n) { return static_cast<unsigned long long>(n); };
  const auto write = [&](const Counts& n) {
    for (size_t k = 0; k < counts; ++k) std::fprintf(out, "\t%llu", number((&n.launches)[k]));
  };
  std::fprintf(out, "#kernel\t%s\tregisters\tstack\tspilled\tname\n", count_names);
  for (const auto& [name, c] : kernels) {
    Kernel& k = *c.kernel;
    resources_of(k);
    std::fprintf(out, "kernel");
    write(c.n);
    std::fprintf(out, "\t%d\t%d\t%d\t%s\n", k.registers, k.stack, k.spilled, name.c_str());
  }
  std::fprintf(out, "#step\ttimeline\tposition\tafter\tvia\twhat\tbytes\t%s\tname\n", count_names);
  for (const Step& s : steps) {
    std::fprintf(out, "step\t%u\t%u\t", s.operation.timeline, s.operation.position);
    for (const auto& [timeline, position] : s.after)
      std::fprintf(out, "%u:%u ", timeline, position);
    std::fprintf(out, "\t%s\t%s\t%llu", s.operation.via, s.operation.what, number(s.bytes));
    write(s.n);
    std::fprintf(out, "\t%s\n", s.operation.kernel ? s.operation.kernel->pretty.c_str() : "");
  }
  std::fprintf(out, "#event\ttimes\tbytes\twhat\tafter\n");
  for (const auto& [key, e] : events)
    std::fprintf(out, "event\t%llu\t%llu\t%s\t%s\n", number(e.times), number(e.bytes),
                 key.first.c_str(), key.second.c_str());
  std::fprintf(out, "#site\trequests\tbytes\tsectors\ttext\tlocation\tkernel\n");
  for (const auto& [name, c] : kernels) {
    for (const auto& [s, site] : c.sites)
      std::fprintf(out, "site\t%llu\t%llu\t%llu\t%s\t%s\t%s\n", number(site.requests),
                   number(site.bytes), number(site.sectors), c.kernel->sites[s].text,
                   c.kernel->sites[s].location, name.c_str());
  }
  std::fclose(out);
  say("profile written to %s", settings().profile.c_str());
}

}  // namespace gpu_emulator

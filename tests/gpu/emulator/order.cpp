// Which operations are over before which: vector clocks over timelines. Within a launch the same
// for its blocks: each barrier of the whole grid begins a new phase, which is an operation of its
// own.

#include <algorithm>
#include <unordered_map>

#include "tests/gpu/emulator/runtime.h"

namespace gpu_emulator {

namespace {

std::vector<Operation> operations(1);
u32 begun = 0;    // operations, or pairs of them
Clock positions;  // the latest operation of each timeline
Clock before;     // what was over when the present operation began
std::vector<u32> unused;
std::map<std::pair<u32, u32>, u32> pairs;

u32 remember(const Operation& operation) {
  static const u32 most = settings().race ? most_operations : 2;
  if (++begun % most == 0) ++begun;
  const u32 number = begun % most;
  if (operations.size() <= number) operations.resize(2 * number);
  operations[number] = operation;
  return number;
}

/// What blocks meet at: an address that each of them tells that it has come.
struct Meeting {
  u32 phase = 0, came = 0;
  std::vector<bool> who;
};
/// How far a block was when it told.
struct Told {
  u32 phase = ~0u, rank = 0, barriers = 0;
};
std::unordered_map<u64, Meeting> meetings;
std::vector<u32> phases;  // their operations
std::vector<Told> told;   // of each block, of even and odd phases

void enter(Block& block, u32 phase) {
  if (phase <= block.phase) return;
  block.phase = phase;
  while (phases.size() <= phase) {
    Operation next = operation(phases.back());
    next.position = ++positions[next.timeline];
    phases.push_back(remember(next));
  }
  block.operation = phases[phase];
}

}  // namespace

u32 new_timeline() {
  if (positions.empty()) positions.push_back(0);  // the host's
  if (!unused.empty()) {
    const u32 again = unused.back();
    return unused.pop_back(), again;
  }
  return positions.push_back(0), u32(positions.size() - 1);
}
void free_timeline(u32 timeline) { unused.push_back(timeline); }

void join(Clock& clock, const Clock& other) {
  if (clock.size() < other.size()) clock.resize(other.size());
  for (size_t k = 0; k < other.size(); ++k) clock[k] = std::max(clock[k], other[k]);
}
bool covers(const Clock& clock, const Clock& other) {
  for (size_t k = 0; k < other.size(); ++k)
    if (other[k] > (k < clock.size() ? clock[k] : 0)) return false;
  return true;
}

void begin_operation(u32 timeline, Clock& clock, const char* via, const char* what,
                     const Kernel* kernel) {
  if (positions.size() <= timeline) positions.resize(timeline + 1);
  if (clock.size() <= timeline) clock.resize(timeline + 1);
  before = clock;
  const u32 position = clock[timeline] = ++positions[timeline];
  phases = {remember(
      {timeline, position, current_launch().serial + (kernel != nullptr), via, what, kernel})};
  profile_operation(operation(phases[0]), before);
}
void end_operation(Clock& clock) {
  const u32 timeline = operation(phases[0]).timeline;
  clock[timeline] = positions[timeline];
}
u32 current_operation() { return phases[0]; }
const Operation& operation(u32 number) { return operations[number]; }

bool is_over(u32 number, u32 now) {
  const Operation &a = operations[number], &b = operations[now];
  if (a.one) return is_over(a.one, now) && is_over(a.other, now);
  if (a.timeline == b.timeline) return a.position <= b.position;
  return a.timeline < before.size() && a.position <= before[a.timeline];
}
u32 both(u32 a, u32 b) {
  static u32 last[3] = {};
  if (last[0] == a && last[1] == b) return last[2];
  u32& number = pairs[{a, b}];
  if (number == 0 || operations[number].one != a || operations[number].other != b) {
    Operation pair = operations[b];
    pair.one = a, pair.other = b;
    number = remember(pair);
  }
  last[0] = a, last[1] = b;
  return last[2] = number;
}
u32 not_over(u32 number, u32 now) {
  const Operation o = operations[number];
  if (!o.one) return is_over(number, now) ? 0 : number;
  const u32 one = not_over(o.one, now), other = not_over(o.other, now);
  return one && other ? both(one, other) : one + other;
}
bool is_last_of(u32 number, u32 set) {
  return set == number || (operations[set].one && operations[set].other == number);
}
std::string name_of(u32 number) {
  const Operation& o = operations[number];
  return (o.kernel ? "launch " + std::to_string(o.serial) + " of " + o.kernel->pretty
                   : std::string(o.what)) +
         " (" + o.via + ", timeline " + std::to_string(o.timeline) + ")";
}

void begin_phases(u32 blocks) {
  meetings.clear();
  told.assign(2 * size_t(blocks), {});
}

void pass_on(Thread& t, u64 address, u32 order, bool looks) {
  Block& block = *t.block;
  const bool tells = !(order & only_looks) && (order & releases || t.fenced);
  const auto found = tells ? meetings.try_emplace(address).first : meetings.find(address);
  if (found == meetings.end()) return;
  Meeting& m = found->second;
  if (tells) {
    t.fenced = false;
    if (m.phase < block.phase) m = {block.phase, 0, {}};
    if (m.phase == block.phase) {
      m.who.resize(told.size() / 2);
      m.came += !m.who[block.index], m.who[block.index] = true;
      told[2 * block.index + block.phase % 2] = {block.phase, t.rank, t.barriers};
      if (m.came == m.who.size() && m.came > 1) m = {block.phase + 1, 0, {}};
    }
  }
  if (!looks) return;
  if (order & acquires)
    enter(block, m.phase);
  else
    t.seen_phase = std::max(t.seen_phase, m.phase);
}

bool was_released(u32 number, u32 block, u32 rank, u32 barriers) {
  const auto found = std::lower_bound(phases.begin(), phases.end(), number);
  if (found == phases.end() || *found != number) return true;  // another launch
  const u32 phase = u32(found - phases.begin());
  const Told& then = told[2 * block + phase % 2];
  return then.phase != phase || then.rank / 32 == rank / 32 || (then.barriers & 255) != barriers;
}

void fence(Thread& t) {
  t.fenced = true;
  enter(*t.block, t.seen_phase);
}

}  // namespace gpu_emulator

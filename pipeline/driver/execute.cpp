#include "pipeline/driver/execute.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <exception>
#include <set>
#include <system_error>
#include <thread>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/driver/channel.h"
#include "pipeline/driver/checkpoints.h"
#include "pipeline/driver/disk.h"
#include "pipeline/driver/failures.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/make.h"
#include "pipeline/driver/memory_budget.h"
#include "pipeline/driver/process.h"

namespace drench {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

constexpr size_t queued_frames = 2;
/// Two frames are rendered at once, so that one is read and built while the other has all tiles at
/// work; and one more for every so many cores, which its ends would leave idle.
constexpr int cores_a_frame = 32;

int cores(int threads) { return threads > 0 ? threads : tbb::this_task_arena::max_concurrency(); }
int frames_at_once(int threads) {
  return std::min(2 + cores(threads) / cores_a_frame, most_frames_rendered_at_once);
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class Executor {
 public:
  Executor(const Targets& targets, const Plan& plan, const fs::path& folder, Manifest& manifest,
           Stages& stages, Progress& progress, const ExecuteOptions& options);
  void run();

 private:
  void simulate_frames();
  void produce(int frame);
  void start_simulation();
  bool goes_on();
  void advance_to(int frame);
  std::string with_last_good(const char* text) const;
  void write_probes(int frame);

  void mesh_frames();
  void render_frames();
  std::vector<const Rule*> rules_of(Worker worker) const;
  void make(const Rule& rule, int frame);
  bool waits_to_retry(const Rule& rule, int frame, int tries, const char* why) const;
  void make_due(const Rule& rule, int frame);
  void make_up_to(const Rule& rule, int frame);
  void make_beside(const Rule& rule, int frame);
  void make_rest(const Rule& rule);
  bool neighbours_are_made(const Rule& rule, int frame) const;
  bool is_planned(const Rule& rule) const;

  bool stopping() const {
    return failed_ || (options_.stop_requested && options_.stop_requested());
  }
  void fail(std::exception_ptr error);
  void guard(void (Executor::*work)());
  void start(std::vector<std::thread>& threads, void (Executor::*work)());
  void watch();
  void watch_disk();
  std::string memory_message() const;
  std::string disk_message() const;

  /// How far a rule has come.
  struct Reached {
    int next = 0;           // Frames::from_first, of one thread: frame that was not looked at yet
    std::set<int> ready;    // Frames::with_neighbours: frames delivered whose own inputs are made
    std::set<int> started;  // frames that a thread has taken on
  };

  const Targets& targets_;
  const Plan& plan_;
  const fs::path folder_;
  Manifest& manifest_;
  Stages& stages_;
  Progress& progress_;
  const ExecuteOptions& options_;
  StageRunner runner_;
  Maker maker_;

  std::set<int> to_simulate_;
  std::vector<Digest> keys_;
  CheckpointKeeper checkpoints_;
  std::unique_ptr<Simulation> simulation_;
  int committed_ = 0;  // frame of the last commit of simulation_, or of the state it started with
  bool has_committed_ = false;
  bool kept_work_ = false;           // in a checkpoint, when it was stopped
  double over_memory_ = 0;           // bytes in use when that were too many
  std::optional<double> disk_left_;  // bytes, when that were too few

  std::array<Reached, size_t(Step::count)> reached_;  // by step
  std::mutex neighbours_mutex_;
  std::atomic<int> renderers_{0};
  Channel<int> to_mesh_{queued_frames}, to_render_{queued_frames};
  Failures failures_{targets_};
  MemoryBudget budget_;
  std::atomic<bool> failed_{false};
  std::atomic<int> running_{0};
  std::atomic<bool> simulating_{false};
  std::mutex error_mutex_;
  std::exception_ptr error_;
};

Executor::Executor(const Targets& targets, const Plan& plan, const fs::path& folder,
                   Manifest& manifest, Stages& stages, Progress& progress,
                   const ExecuteOptions& options)
    : targets_(targets),
      plan_(plan),
      folder_(folder),
      manifest_(manifest),
      stages_(stages),
      progress_(progress),
      options_(options),
      runner_(folder, manifest, stages, progress, options.threads),
      maker_(targets, folder, manifest, stages, progress, runner_, [this] { return stopping(); }),
      keys_(simulation_keys(targets, targets.frames.back())),
      checkpoints_(folder, manifest, targets, keys_, options.checkpoint_every,
                   options.checkpoints_kept),
      budget_(options.memory_gib * double(1 << 30), [] { return double(resident_memory()); }) {
  for (Reached& reached : reached_) reached.next = targets.first;
  for (const Task& task : plan.tasks) {
    if (task.step == Step::simulate && task.action == Action::run) to_simulate_.insert(task.frame);
  }
}

void Executor::fail(std::exception_ptr error) {
  {
    const std::scoped_lock lock(error_mutex_);
    if (!error_) error_ = error;
  }
  failed_ = true;
  to_mesh_.close();
  to_render_.close();
}

void Executor::guard(void (Executor::*work)()) {
  try {
    (this->*work)();
  } catch (const Stopped&) {
    // Asked for: run() says so when every stage has ended.
  } catch (...) {
    fail(std::current_exception());
  }
  if (work == &Executor::simulate_frames) simulating_ = false;
  --running_;
}

// ---- simulate ----

void Executor::start_simulation() {
  checkpoints_.remove_stale();
  runner_.compute(Worker::simulate, [&] { simulation_ = stages_.start_simulation(); });
  const std::string& file = plan_.simulation.checkpoint;
  if (file.empty()) {
    return runner_.compute(Worker::simulate,
                           [&] { simulation_->preroll([this] { return !stopping(); }); });
  }
  check_input(folder_, manifest_, file);
  try {
    runner_.compute(Worker::simulate, [&] { simulation_->read_checkpoint(folder_ / file); });
  } catch (const Error& error) {
    manifest_.drop(file);
    throw DamagedInput(fmt::format("{} cannot be used: {}", file, error.what()), file);
  }
  if (simulation_->frame() != plan_.simulation.from) {
    manifest_.drop(file);
    throw DamagedInput(
        fmt::format("{} holds frame {}, not {}", file, simulation_->frame(), plan_.simulation.from),
        file);
  }
  if (!to_simulate_.contains(plan_.simulation.from)) {
    committed_ = plan_.simulation.from;  // its files are there and right
    has_committed_ = true;
  }
  log_info("sim", fmt::format("continues from frame {}", plan_.simulation.from));
}

std::string Executor::with_last_good(const char* text) const {
  const fs::path good = checkpoints_.last_good();
  return fmt::format("{}\nLast good checkpoint in the output folder: {}", text,
                     good.empty() ? "none" : good.string());
}

/// Asked between steps.
bool Executor::goes_on() {
  progress_.share(Step::simulate, simulation_->frame() + 1, simulation_->share_of_frame());
  return !stopping();
}

void Executor::advance_to(int frame) {
  while (simulation_->frame() < frame) {
    const Clock::time_point start = Clock::now();
    StageReport report;
    const MemoryBudget::Frame in_work(budget_, Step::simulate, [this] { return !stopping(); });
    try {
      runner_.compute(Worker::simulate,
                      [&] { report = simulation_->advance([&] { return goes_on(); }); });
    } catch (const BlowUp& error) {
      // The simulator names a checkpoint it wrote or read itself; one of an earlier run it cannot
      // know.
      if (error.checkpoint == checkpoints_.last_good()) throw;
      throw Error(with_last_good(error.what()));
    } catch (const Error& error) {
      throw Error(with_last_good(error.what()));
    }
    runner_.finished(Step::simulate, simulation_->frame(), start, report);
  }
}

void Executor::produce(int frame) {
  if (!simulation_) start_simulation();
  advance_to(frame);
  // Before the frame: once a frame is there, so is its checkpoint, wherever a kill falls.
  checkpoints_.before_frame(*simulation_, frame);
  std::vector<WrittenFile> files;
  runner_.compute(Worker::simulate, [&] { files = simulation_->write_frame(folder_); });
  runner_.commit(files, step_name(Step::simulate), frame,
                 {keys_.at(size_t(frame - targets_.first)), targets_.simulate.parts});
  committed_ = frame;
  has_committed_ = true;
  const bool now_and_then = (frame - targets_.first) % options_.checkpoint_every == 0;
  if (now_and_then || frame == targets_.frames.back()) write_probes(frame);
  if (frame == targets_.first || frame == plan_.simulation.from) {
    progress_.not_needed(Step::simulate, frame);  // a state that was there costs no time
  }
}

/// Whole every time, and so only with the checkpoints and at the end.
void Executor::write_probes(int frame) {
  if (!decide_probes(targets_, frame, maker_.lookup()).make) return;
  std::vector<WrittenFile> files;
  // The records first: a kill in between leaves files that nothing trusts and the next run
  // replaces.
  for (const std::string& file : probe_files(targets_)) {
    if (manifest_.find(file)) manifest_.drop(file);
  }
  runner_.compute(Worker::simulate, [&] { files = simulation_->write_probes(folder_); });
  runner_.commit(files, probe_record, frame,
                 {keys_.at(size_t(frame - targets_.first)), targets_.simulate.parts});
}

void Executor::simulate_frames() {
  const auto keep_work = [this] {
    if (!simulation_ || !has_committed_ || simulation_->frame() != committed_) return;
    kept_work_ = checkpoints_.on_stop(*simulation_, committed_);
  };
  int frame = to_simulate_.empty() ? targets_.frames.front() : targets_.first;
  try {
    size_t next = 0;
    for (; frame <= targets_.frames.back(); ++frame) {
      if (stopping()) break;
      if (to_simulate_.contains(frame)) produce(frame);
      if (next >= targets_.frames.size() || targets_.frames[next] != frame) continue;
      ++next;
      if (!to_mesh_.push(frame)) break;
    }
  } catch (const Stopped&) {
    keep_work();
    throw;
  } catch (const Error& error) {  // frames before it are made all the same
    failures_.add(Step::simulate, frame, error.what());
  }
  if (stopping()) keep_work();
  to_mesh_.finish();
}

// ---- what the rules make ----

/// Rules that this run may carry out, in order.
std::vector<const Rule*> Executor::rules_of(Worker worker) const {
  std::vector<const Rule*> found;
  for (const Rule& rule : rules())
    if (worker_of(rule.step) == worker && is_active(rule, targets_)) found.push_back(&rule);
  return found;
}

/// A frame of a rule, unless it follows from one that failed.
void Executor::make(const Rule& rule, int frame) {
  if (failures_.leave_out(rule, frame)) return;
  for (int tries = 0;; ++tries) {
    try {
      const MemoryBudget::Frame in_work(budget_, rule.step, [this] { return !stopping(); });
      maker_.make(rule, frame);
      return failures_.succeeded(rule.step);
    } catch (const Error& error) {
      if (waits_to_retry(rule, frame, tries, error.what())) continue;
      failures_.add(rule.step, frame, error.what());
      if (failures_.are_hopeless()) fail(nullptr);
      return;
    }
  }
}

/// What fails for want of a network or a disk may go a little later. @return whether to try again
bool Executor::waits_to_retry(const Rule& rule, int frame, int tries, const char* why) const {
  if (tries >= options_.retry) return false;
  log_info("driver", fmt::format("{} frame={} failed and is tried again: {}", step_name(rule.step),
                                 frame, why));
  const auto end = Clock::now() + std::chrono::milliseconds(500) * (1 << std::min(tries, 6));
  while (Clock::now() < end && !stopping())
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return !stopping();
}

/// What a rule makes as soon as the steps before it are done with a frame.
void Executor::make_due(const Rule& rule, int frame) {
  switch (rule.frames) {
    case Frames::delivered:
      return make(rule, frame);
    case Frames::from_first:
      return make_up_to(rule, frame);
    case Frames::with_neighbours:
      return make_beside(rule, frame);
    case Frames::once:
      return;
  }
}

/// In order, whichever frames are asked for.
void Executor::make_up_to(const Rule& rule, int frame) {
  for (int& next = reached_[size_t(rule.step)].next; next <= frame && !stopping(); ++next)
    make(rule, next);
}

/// Frames delivered that waited for this one and for no other.
void Executor::make_beside(const Rule& rule, int frame) {
  Reached& reached = reached_[size_t(rule.step)];
  std::vector<int> due;
  {
    const std::scoped_lock lock(neighbours_mutex_);
    reached.ready.insert(frame);
    for (const Input& input : rule.inputs)
      for (const int near : possible_frames(rule, input, targets_, frame))
        if (targets_.includes(near) && neighbours_are_made(rule, near) &&
            reached.started.insert(near).second)
          due.push_back(near);
  }
  for (const int near : due) {
    if (stopping()) return;
    make(rule, near);
  }
}

/// Whether nothing of this run can change what a frame that it delivers is made from.
bool Executor::neighbours_are_made(const Rule& rule, int frame) const {
  const std::set<int>& ready = reached_[size_t(rule.step)].ready;
  for (const Input& input : rule.inputs)
    for (const int near : possible_frames(rule, input, targets_, frame)) {
      if (targets_.includes(near) && !ready.contains(near)) return false;
      if (targets_.includes(near)) continue;
      // Whether one that is not delivered may be used is known when all its caches are made.
      for (const std::string& file : input.files(targets_, near))
        if (manifest_.find(file)) return false;
    }
  return true;
}

/// Once all that it reads is made: frames at the ends of what is delivered, and beside it.
void Executor::make_rest(const Rule& rule) {
  if (rule.frames != Frames::with_neighbours) return;
  for (const int frame : frames_of(rule, targets_, maker_.lookup())) {
    if (stopping()) return;
    if (reached_[size_t(rule.step)].started.insert(frame).second) make(rule, frame);
  }
}

bool Executor::is_planned(const Rule& rule) const {
  return std::any_of(plan_.tasks.begin(), plan_.tasks.end(), [&](const Task& task) {
    return task.step == rule.step && task.action != Action::skip;
  });
}

void Executor::mesh_frames() {
  const std::vector<const Rule*> active = rules_of(Worker::mesh);
  while (const std::optional<int> frame = to_mesh_.pop()) {
    for (const Rule* rule : active) make_due(*rule, *frame);
    if (stopping() || !to_render_.push(*frame)) return;
  }
  to_render_.finish();
}

void Executor::render_frames() {
  const std::vector<const Rule*> active = rules_of(Worker::render);
  while (const std::optional<int> frame = to_render_.pop())
    for (const Rule* rule : active) make_due(*rule, *frame);
  if (--renderers_ > 0 || stopping()) return;
  for (const Rule* rule : active) make_rest(*rule);
}

// ---- all together ----

void Executor::watch() {
  const auto limit = uint64_t(options_.memory_gib * double(1 << 30));
  std::optional<Clock::time_point> stop_time;
  constexpr int looks_a_second = 50;
  int looks = 0;
  while (running_ > 0) {
    if (stopping()) {
      to_mesh_.close();
      to_render_.close();
      if (!stop_time) stop_time = Clock::now();
    }
    const bool asked = options_.stop_requested && options_.stop_requested();
    // Never while a checkpoint may be in the writing.
    if (asked && stop_time && !simulating_ && seconds_since(*stop_time) > options_.patience_s) {
      if (options_.abandon) options_.abandon();
    }
    budget_.sample();
    if (!stopping() && ++looks % looks_a_second == 0) watch_disk();
    if (limit > 0 && !stopping() && resident_memory() > limit) {
      over_memory_ = double(resident_memory());
      fail(nullptr);  // the message waits for what the simulation can keep
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

/// On a full disk not even a checkpoint could be kept.
void Executor::watch_disk() {
  const double free = free_disk(folder_), reserve = disk_reserve(manifest_.records());
  if (free >= reserve) return;
  disk_left_ = free;
  fail(nullptr);
}

void Executor::start(std::vector<std::thread>& threads, void (Executor::*work)()) {
  ++running_;
  try {
    threads.emplace_back([this, work] { guard(work); });
  } catch (const std::system_error&) {
    --running_;
    fail(std::current_exception());
  }
}

void Executor::run() {
  progress_.start(plan_);
  const int at_once = frames_at_once(options_.threads);
  check_threads(cores(options_.threads) + 2 + at_once);
  renderers_ = at_once;
  std::vector<std::thread> threads;
  threads.reserve(size_t(at_once) + 2);
  simulating_ = true;
  start(threads, &Executor::simulate_frames);
  start(threads, &Executor::mesh_frames);
  for (int k = 0; k < at_once; ++k) start(threads, &Executor::render_frames);
  watch();
  for (std::thread& thread : threads) thread.join();
  for (const Rule* rule : rules_of(Worker::last))
    if (!stopping() && is_planned(*rule)) make(*rule, 0);
  progress_.finish();
  if (error_) std::rethrow_exception(error_);
  if (over_memory_ > 0) throw Error(memory_message());
  if (disk_left_) throw Error(disk_message());
  if (failures_.any()) throw Error(failures_.text());
  if (stopping()) throw Stopped("stopped on request; the same command continues");
}

std::string Executor::memory_message() const {
  return fmt::format(
      "{}: the run uses {:.3g} GiB of memory, more than --memory {:g}; it was stopped{}. Give "
      "more, a larger spacing or smaller frames",
      folder_.string(), over_memory_ / double(1 << 30), options_.memory_gib,
      kept_work_ ? " with a checkpoint" : "");
}

std::string Executor::disk_message() const {
  return fmt::format(
      "{}: the disk is nearly full: {:.0f} MB are left, and {:.0f} are kept for a checkpoint and "
      "frames in work; the run was stopped{}. Free space, and the same command goes on, or choose "
      "another output "
      "folder",
      folder_.string(), *disk_left_ / 1e6, disk_reserve(manifest_.records()) / 1e6,
      kept_work_ ? " with a checkpoint" : "");
}

}  // namespace

void execute(const Targets& targets, const Plan& plan, const fs::path& folder, Manifest& manifest,
             Stages& stages, Progress& progress, const ExecuteOptions& options) {
  Executor(targets, plan, folder, manifest, stages, progress, options).run();
}

}  // namespace drench

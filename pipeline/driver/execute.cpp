#include "pipeline/driver/execute.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <semaphore>
#include <set>
#include <system_error>
#include <thread>

#include "build_id.h"
#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/driver/channel.h"
#include "pipeline/driver/checkpoints.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/process.h"
#include "pipeline/driver/stats_file.h"

namespace drench {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

constexpr size_t queued_frames = 2;
/// Two frames are rendered at once, so that one is read and built while the other has all tiles at
/// work; and one more for every so many cores, which its ends would leave idle.
constexpr int cores_a_frame = 32, most_frames_at_once = 4;
constexpr int most_stage_threads = 2 + most_frames_at_once;

int cores(int threads) { return threads > 0 ? threads : tbb::this_task_arena::max_concurrency(); }
int frames_at_once(int threads) {
  return std::min(2 + cores(threads) / cores_a_frame, most_frames_at_once);
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class Executor {
 public:
  Executor(const Wanted& wanted, const Plan& plan, const fs::path& folder, Manifest& manifest,
           Stages& stages, Progress& progress, const ExecuteOptions& options);
  void run();

 private:
  void simulate_frames();
  void produce(int frame);
  void start_simulation();
  void advance_to(int frame);
  void mesh_frames();
  bool is_held(int frame) const;
  StageReport held_mesh(int frame);
  void make_mesh(int frame);
  void make_foam(int frame);
  void render_frames();
  void make_image(int frame);
  bool neighbours_are_rendered(int frame) const;
  void denoise_beside(int frame);
  void denoise_rest();
  void make_denoised(int frame);
  void make_dailies(Step step);

  void write_probes(int frame);
  void commit(const std::vector<WrittenFile>& files, std::string_view step, int frame,
              const Key& key);
  void finished(Step step, int frame, Clock::time_point start, const StageReport& report);
  std::optional<KnownFile> look_up(const std::string& file) const;
  Attributes attributes_of(int frame, const Key& key) const;

  bool stopping() const {
    return failed_ || (options_.stop_requested && options_.stop_requested());
  }
  void fail(std::exception_ptr error);
  void guard(void (Executor::*work)());
  void start(std::vector<std::thread>& threads, void (Executor::*work)());
  void watch();
  std::string memory_message() const;
  /// Runs one frame of one stage in that stage's arena, when fewer than `threads` others compute.
  template <class Work>
  void compute(tbb::task_arena& arena, const Work& work);
  /// The same for work on files of the folder: none is read before its digest was checked.
  template <class Work>
  void compute_from(const std::vector<std::string>& files, tbb::task_arena& arena,
                    const Work& work);

  const Wanted& wanted_;
  const Plan& plan_;
  const fs::path folder_;
  Manifest& manifest_;
  Stages& stages_;
  Progress& progress_;
  const ExecuteOptions& options_;
  const Lookup lookup_;
  StatsFile stats_;

  std::set<int> to_simulate_;
  std::vector<Digest> keys_;
  CheckpointKeeper checkpoints_;
  std::unique_ptr<Simulation> simulation_;
  int committed_ = 0;  // frame of the last commit of simulation_, or of the state it started with
  bool has_committed_ = false;
  bool kept_work_ = false;  // in a checkpoint, when it was stopped
  double over_memory_ = 0;  // bytes in use when that were too many

  int next_foam_;  // frame that foam was not looked at yet; foam comes in order
  std::mutex denoise_mutex_;
  std::set<int> rendered_;  // wanted frames that are as they shall be
  std::set<int> denoised_;  // frames that someone has taken on
  std::atomic<int> renderers_{0};
  Channel<int> to_mesh_{queued_frames}, to_render_{queued_frames};
  tbb::task_arena simulate_arena_, mesh_arena_, render_arena_;
  std::counting_semaphore<most_stage_threads> slots_;
  std::atomic<bool> failed_{false};
  std::atomic<int> running_{0};
  std::atomic<bool> simulating_{false};
  std::mutex error_mutex_;
  std::exception_ptr error_;
};

int slots(int threads) {
  return threads > 0 ? std::min(threads, most_stage_threads) : most_stage_threads;
}
int arena_size(int threads) { return threads > 0 ? threads : tbb::task_arena::automatic; }

Executor::Executor(const Wanted& wanted, const Plan& plan, const fs::path& folder,
                   Manifest& manifest, Stages& stages, Progress& progress,
                   const ExecuteOptions& options)
    : wanted_(wanted),
      plan_(plan),
      folder_(folder),
      manifest_(manifest),
      stages_(stages),
      progress_(progress),
      options_(options),
      lookup_([this](const std::string& file) { return look_up(file); }),
      stats_(folder / layout::stats),
      keys_(simulation_keys(wanted, wanted.frames.back())),
      checkpoints_(folder, manifest, wanted, keys_, options.checkpoint_every,
                   options.checkpoints_kept),
      next_foam_(wanted.first),
      simulate_arena_(arena_size(options.threads)),
      mesh_arena_(arena_size(options.threads)),
      render_arena_(arena_size(options.threads)),
      slots_(slots(options.threads)) {
  for (const Task& task : plan.tasks) {
    if (task.step == Step::simulate && task.action == Action::run) to_simulate_.insert(task.frame);
  }
}

std::optional<KnownFile> Executor::look_up(const std::string& file) const {
  const std::optional<Record> record = manifest_.find(file);
  if (!record) return {};
  return KnownFile{*record, state_of(folder_, *record)};
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

template <class Work>
void Executor::compute(tbb::task_arena& arena, const Work& work) {
  slots_.acquire();
  try {
    arena.initialize();
    const ArithmeticMode mode(arena);
    arena.execute(work);
  } catch (...) {
    slots_.release();
    throw;
  }
  slots_.release();
}

template <class Work>
void Executor::compute_from(const std::vector<std::string>& files, tbb::task_arena& arena,
                            const Work& work) {
  for (const std::string& file : files) check_input(folder_, manifest_, file);
  try {
    compute(arena, work);
  } catch (const Error&) {
    drop_unreadable(folder_, manifest_, files,
                    [this](const fs::path& file) { return stages_.why_unreadable(file); });
    throw;
  }
}

void Executor::commit(const std::vector<WrittenFile>& files, std::string_view step, int frame,
                      const Key& key) {
  for (const WrittenFile& written : files) {
    Record record = record_of_file(folder_, written);
    record.step = step;
    record.frame = frame;
    record.key = key.digest;
    record.parts = key.parts;
    const std::optional<Record> before = manifest_.find(record.file);
    if (before && before->key == record.key && before->digest != record.digest) {
      log_warning("driver", fmt::format("{} came out different from the same inputs; what follows "
                                        "from it is made again",
                                        record.file));
    }
    manifest_.add(record);
  }
}

void Executor::finished(Step step, int frame, Clock::time_point start, const StageReport& report) {
  const double seconds = seconds_since(start);
  stats_.add(step_name(step), frame, seconds, report.json);
  progress_.done(step, frame, seconds, report.line);
}

// ---- simulate ----

void Executor::start_simulation() {
  checkpoints_.remove_stale();
  compute(simulate_arena_, [&] { simulation_ = stages_.start_simulation(); });
  const std::string& file = plan_.simulation.checkpoint;
  if (file.empty()) {
    return compute(simulate_arena_, [&] { simulation_->preroll([this] { return !stopping(); }); });
  }
  check_input(folder_, manifest_, file);
  try {
    compute(simulate_arena_, [&] { simulation_->read_checkpoint(folder_ / file); });
  } catch (const Error& error) {
    manifest_.drop(file);
    throw PlanAgain(fmt::format("{} cannot be used: {}", file, error.what()), file);
  }
  if (simulation_->frame() != plan_.simulation.from) {
    manifest_.drop(file);
    throw PlanAgain(
        fmt::format("{} holds frame {}, not {}", file, simulation_->frame(), plan_.simulation.from),
        file);
  }
  if (!to_simulate_.contains(plan_.simulation.from)) {
    committed_ = plan_.simulation.from;  // its files are there and right
    has_committed_ = true;
  }
  log_info("sim", fmt::format("continues from frame {}", plan_.simulation.from));
}

void Executor::advance_to(int frame) {
  while (simulation_->frame() < frame) {
    const Clock::time_point start = Clock::now();
    StageReport report;
    try {
      compute(simulate_arena_,
              [&] { report = simulation_->advance([this] { return !stopping(); }); });
    } catch (const Error& error) {
      // The simulator names a checkpoint it wrote or read itself; one of an earlier run it cannot
      // know.
      const std::string good = checkpoints_.last_good();
      if (std::string_view(error.what()).find(good) != std::string_view::npos) throw;
      throw Error(
          fmt::format("{}\nLast good checkpoint in the output folder: {}", error.what(), good));
    }
    finished(Step::simulate, simulation_->frame(), start, report);
  }
}

void Executor::produce(int frame) {
  if (!simulation_) start_simulation();
  advance_to(frame);
  // Before the frame: once a frame is there, so is its checkpoint, wherever a kill falls.
  checkpoints_.before_frame(*simulation_, frame);
  std::vector<WrittenFile> files;
  compute(simulate_arena_, [&] { files = simulation_->write_frame(folder_); });
  commit(files, step_name(Step::simulate), frame,
         {keys_.at(size_t(frame - wanted_.first)), wanted_.simulate.parts});
  committed_ = frame;
  has_committed_ = true;
  const bool now_and_then = (frame - wanted_.first) % options_.checkpoint_every == 0;
  if (now_and_then || frame == wanted_.frames.back()) write_probes(frame);
  if (frame == wanted_.first || frame == plan_.simulation.from) {
    progress_.not_needed(Step::simulate, frame);  // a state that was there costs no time
  }
}

/// Whole every time, and so only with the checkpoints and at the end.
void Executor::write_probes(int frame) {
  if (!decide_probes(wanted_, frame, lookup_).make) return;
  std::vector<WrittenFile> files;
  // The records first: a kill in between leaves files that nothing trusts and the next run
  // replaces.
  for (const std::string& file : probe_files(wanted_)) {
    if (manifest_.find(file)) manifest_.drop(file);
  }
  compute(simulate_arena_, [&] { files = simulation_->write_probes(folder_); });
  commit(files, probe_step, frame,
         {keys_.at(size_t(frame - wanted_.first)), wanted_.simulate.parts});
}

void Executor::simulate_frames() {
  const auto keep_work = [this] {
    if (!simulation_ || !has_committed_ || simulation_->frame() != committed_) return;
    kept_work_ = checkpoints_.on_stop(*simulation_, committed_);
  };
  try {
    const int begin = to_simulate_.empty() ? wanted_.frames.front() : wanted_.first;
    size_t next = 0;
    for (int frame = begin; frame <= wanted_.frames.back(); ++frame) {
      if (stopping()) break;
      if (to_simulate_.contains(frame)) produce(frame);
      if (next >= wanted_.frames.size() || wanted_.frames[next] != frame) continue;
      ++next;
      if (!to_mesh_.push(frame)) break;
    }
  } catch (const Stopped&) {
    keep_work();
    throw;
  }
  if (stopping()) keep_work();
  to_mesh_.finish();
}

// ---- mesh and render ----

/// Whether the mesh of the frame before is that of this one: of the same bytes, with nothing around
/// that moves.
bool Executor::is_held(int frame) const {
  if (wanted_.obstacles_move || frame == wanted_.first) return false;
  const std::vector<std::string> now = simulated_files(wanted_, frame),
                                 before = simulated_files(wanted_, frame - 1);
  for (size_t k = 0; k < now.size(); ++k) {
    const auto file = manifest_.find(now[k]), earlier = manifest_.find(before[k]);
    if (!file || !earlier || file->digest != earlier->digest) return false;
  }
  const std::optional<Decision> decision = decide_mesh(wanted_, frame - 1, lookup_);
  return decision && !decision->make;
}

StageReport Executor::held_mesh(int frame) {
  StageReport report;
  const std::vector<std::string> files = mesh_files(wanted_, frame),
                                 before = mesh_files(wanted_, frame - 1);
  for (size_t k = 0; k < files.size(); ++k) {
    report.files.push_back(
        write_file_whole(folder_ / files[k], checked_bytes(folder_, manifest_, before[k])));
  }
  report.line = fmt::format("as frame {}", frame - 1);
  report.json = fmt::format("{{\"held\":{}}}", frame - 1);
  return report;
}

void Executor::make_mesh(int frame) {
  const std::optional<Decision> decision = decide_mesh(wanted_, frame, lookup_);
  if (!decision) throw PlanAgain(fmt::format("the caches of frame {} are missing", frame), "");
  if (!decision->make) return progress_.not_needed(Step::mesh, frame);
  const Clock::time_point start = Clock::now();
  StageReport report;
  compute_from(simulated_files(wanted_, frame), mesh_arena_,
               [&] { report = is_held(frame) ? held_mesh(frame) : stages_.mesh(folder_, frame); });
  commit(report.files, step_name(Step::mesh), frame, decision->key);
  finished(Step::mesh, frame, start, report);
}

void Executor::make_foam(int frame) {
  const std::optional<Decision> decision = decide_foam(wanted_, frame, lookup_);
  if (!decision)
    throw PlanAgain(fmt::format("what the foam of frame {} is made of is missing", frame), "");
  if (!decision->make) return progress_.not_needed(Step::foam, frame);
  const Clock::time_point start = Clock::now();
  StageReport report;
  compute_from(foam_inputs(wanted_, frame), mesh_arena_,
               [&] { report = stages_.foam(folder_, frame); });
  commit(report.files, step_name(Step::foam), frame, decision->key);
  finished(Step::foam, frame, start, report);
}

void Executor::mesh_frames() {
  while (const std::optional<int> frame = to_mesh_.pop()) {
    if (wanted_.may(Step::mesh) && wanted_.fluid) make_mesh(*frame);
    for (; wanted_.may(Step::foam) && wanted_.has_foam && next_foam_ <= *frame; ++next_foam_) {
      if (stopping()) return;
      make_foam(next_foam_);
    }
    if (!to_render_.push(*frame)) return;
  }
  to_render_.finish();
}

Attributes Executor::attributes_of(int frame, const Key& key) const {
  // Only what the key covers: equal inputs give equal files.
  Attributes attributes{{"shot", wanted_.shot},
                        {"frame", std::to_string(frame)},
                        {"version", std::string(build_id::version)},
                        {"key.render", key.digest.hex()}};
  for (const std::string& file : render_inputs(wanted_, frame)) {
    if (const auto record = manifest_.find(file)) {
      attributes.emplace_back(fmt::format("key.{}", file), record->digest.hex());
    }
  }
  return attributes;
}

void Executor::make_image(int frame) {
  const std::optional<Decision> decision = decide_render(wanted_, frame, lookup_);
  if (!decision) throw PlanAgain(fmt::format("the meshes of frame {} are missing", frame), "");
  if (!decision->make) return progress_.not_needed(Step::render, frame);
  const Clock::time_point start = Clock::now();
  StageReport report;
  const auto share = [&](double finished) {
    if (stopping()) throw Stopped("stopped while rendering");
    progress_.share(Step::render, frame, finished);
  };
  compute_from(render_inputs(wanted_, frame), render_arena_, [&] {
    report = stages_.render(folder_, frame, attributes_of(frame, decision->key), share);
  });
  commit(report.files, step_name(Step::render), frame, decision->key);
  finished(Step::render, frame, start, report);
}

void Executor::render_frames() {
  const bool denoises = wanted_.may(Step::render) && wanted_.denoised_later;
  while (const std::optional<int> frame = to_render_.pop()) {
    if (!wanted_.may(Step::render)) continue;
    make_image(*frame);
    if (denoises) denoise_beside(*frame);
  }
  if (--renderers_ == 0 && denoises && !stopping()) denoise_rest();
}

/// Whether nothing of this run can change what a wanted frame is denoised by.
bool Executor::neighbours_are_rendered(int frame) const {
  for (int k = -wanted_.denoise_frames; k <= wanted_.denoise_frames; ++k) {
    const int near = frame + k;
    // Whether one that is not wanted may be used is known when all its caches are made.
    if (wanted_.wants(near) ? !rendered_.contains(near)
                            : manifest_.find(layout::noisy(wanted_.shot, near)).has_value())
      return false;
  }
  return true;
}

/// Denoises the frames that waited for this one and for no other.
void Executor::denoise_beside(int frame) {
  std::vector<int> ready;
  {
    const std::scoped_lock lock(denoise_mutex_);
    rendered_.insert(frame);
    for (int k = -wanted_.denoise_frames; k <= wanted_.denoise_frames; ++k) {
      const int near = frame + k;
      if (wanted_.wants(near) && neighbours_are_rendered(near) && denoised_.insert(near).second)
        ready.push_back(near);
    }
  }
  for (const int near : ready) {
    if (stopping()) return;
    make_denoised(near);
  }
}

/// Once all frames are rendered: those at the ends of what is wanted.
void Executor::denoise_rest() {
  for (const int frame : denoised_frames(wanted_, lookup_)) {
    if (stopping()) return;
    if (denoised_.insert(frame).second) make_denoised(frame);
  }
}

void Executor::make_denoised(int frame) {
  const std::optional<Decision> decision = decide_denoise(wanted_, frame, lookup_);
  if (!decision) throw PlanAgain(fmt::format("the noisy frame {} is missing", frame), "");
  if (!decision->make) return progress_.not_needed(Step::denoise, frame);
  const Clock::time_point start = Clock::now();
  const NoisyFiles noisy = denoise_inputs(wanted_, frame, lookup_);
  Attributes attributes{{"key.denoise", decision->key.digest.hex()}};
  for (const std::string& file : noisy.all()) {
    const std::optional<Record> record = manifest_.find(file);
    if (record)
      attributes.emplace_back(fmt::format("key.noisy.{}", record->frame), record->digest.hex());
  }
  StageReport report;
  compute_from(noisy.all(), render_arena_,
               [&] { report = stages_.denoise(folder_, frame, noisy, attributes); });
  commit(report.files, step_name(Step::denoise), frame, decision->key);
  finished(Step::denoise, frame, start, report);
}

void Executor::make_dailies(Step step) {
  if (!wanted_.may(step)) return;
  const auto planned = std::find_if(plan_.tasks.begin(), plan_.tasks.end(),
                                    [&](const Task& task) { return task.step == step; });
  if (planned == plan_.tasks.end() || planned->action == Action::skip) return;
  const std::optional<Decision> decision = decide_dailies(wanted_, step, lookup_);
  if (!decision) throw PlanAgain("a rendered frame is missing", "");
  if (!decision->make) return progress_.not_needed(step, 0);
  const Clock::time_point start = Clock::now();
  std::vector<std::string> images;
  for (const int frame : wanted_.frames) images.push_back(layout::image(wanted_.shot, frame));
  StageReport report;
  compute_from(images, render_arena_, [&] {
    report = step == Step::movie
                 ? stages_.movie(folder_, wanted_.frames, [this] { return !stopping(); })
                 : stages_.contact_sheet(folder_, wanted_.frames);
  });
  commit(report.files, step_name(step), 0, decision->key);
  finished(step, 0, start, report);
}

// ---- all together ----

void Executor::watch() {
  const auto limit = uint64_t(options_.memory_gib * double(1 << 30));
  std::optional<Clock::time_point> stop_time;
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
    if (limit > 0 && !stopping() && resident_memory() > limit) {
      over_memory_ = double(resident_memory());
      fail(nullptr);  // the message waits for what the simulation can keep
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
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
  if (!stopping()) {
    make_dailies(Step::contact_sheet);
    if (!stopping()) make_dailies(Step::movie);
  }
  progress_.finish();
  if (error_) std::rethrow_exception(error_);
  if (over_memory_ > 0) throw Error(memory_message());
  if (stopping()) throw Stopped("stopped on request; the same command continues");
}

std::string Executor::memory_message() const {
  return fmt::format(
      "{}: the run uses {:.1f} GiB of memory, more than --memory {:.1f}; it was stopped{}. Give "
      "more, a larger spacing or smaller frames",
      folder_.string(), over_memory_ / double(1 << 30), options_.memory_gib,
      kept_work_ ? " with a checkpoint" : "");
}

}  // namespace

void execute(const Wanted& wanted, const Plan& plan, const fs::path& folder, Manifest& manifest,
             Stages& stages, Progress& progress, const ExecuteOptions& options) {
  Executor(wanted, plan, folder, manifest, stages, progress, options).run();
}

}  // namespace drench

#include "pipeline/driver/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <system_error>

#include "pipeline/contract/log.h"

namespace drench {

namespace {

std::string clock_text(double seconds) {
  const auto whole = int64_t(std::ceil(seconds));
  if (whole >= 3600) {
    return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  }
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

std::string_view log_part(Step step) { return step == Step::simulate ? "sim" : step_name(step); }

}  // namespace

ProgressStyle progress_style() {
  return ::isatty(STDERR_FILENO) ? ProgressStyle::bar : ProgressStyle::lines;
}

Progress::Progress(ProgressStyle style) : style_(style) {}
Progress::~Progress() { finish(); }

void Progress::start(const Plan& plan) {
  finish();
  const std::scoped_lock lock(mutex_);
  counts_.clear();
  for (const Task& task : plan.tasks) {
    if (task.action != Action::skip) ++counts_[task.step].planned;
  }
  start_ = std::chrono::steady_clock::now();
  finished_ = false;
  if (style_ != ProgressStyle::bar) return;
  try {
    painter_ = std::thread([this] { draw_until_finished(); });
  } catch (const std::system_error&) {  // the work goes on without a bar, or says what is short
  }
}

void Progress::done(Step step, int frame, double seconds, std::string_view line) {
  {
    const std::scoped_lock lock(mutex_);
    Count& count = counts_[step];
    ++count.done;
    ++count.ran;
    count.seconds += seconds;
    count.share.erase(frame);
  }
  if (style_ != ProgressStyle::lines) return;
  log_info(log_part(step),
           fmt::format("{}{}{}ms={:.0f}", is_per_frame(step) ? fmt::format("frame={} ", frame) : "",
                       line, line.empty() ? "" : " ", seconds * 1000));
}

void Progress::not_needed(Step step, int frame) {
  {
    const std::scoped_lock lock(mutex_);
    Count& count = counts_[step];
    ++count.done;
  }
  if (style_ == ProgressStyle::lines) {
    log_verbose(log_part(step), fmt::format("frame={} unchanged", frame));
  }
}

void Progress::share(Step step, int frame, double finished) {
  const std::scoped_lock lock(mutex_);
  counts_[step].share[frame] = finished;
}

std::string Progress::text() const {
  const std::scoped_lock lock(mutex_);
  std::string text;
  double done = 0, planned = 0, left = 0;
  int frames = 0;
  for (const auto& [step, count] : counts_) {
    double finished = count.done;
    for (const auto& [frame, share] : count.share) finished += share;
    finished = std::min<double>(finished, count.planned);
    text += fmt::format("{} {}/{}  ", log_part(step), count.done, count.planned);
    done += finished;
    planned += count.planned;
    // Stages overlap: the slowest one says when all is done. Its mean time is measured while the
    // others run beside it.
    if (count.ran > 0) {
      const double at_once = std::max<double>(1, double(count.share.size()));
      left = std::max(left, (count.planned - finished) * count.seconds / (count.ran * at_once));
    }
    if (count.ran > 0 && is_per_frame(step)) frames = count.ran;  // of the last stage at work
  }
  const double share = planned > 0 ? done / planned : 1;
  constexpr int width = 20;
  const int filled = std::clamp(int(share * width), 0, width);
  text += fmt::format("[{}{}]", std::string(size_t(filled), '#'),
                      std::string(size_t(width - filled), '-'));
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - start_;
  if (frames > 0 && since.count() > 0) {
    text +=
        fmt::format("  {:.1f} frames/min  {} left", 60 * frames / since.count(), clock_text(left));
  }
  return text;
}

void Progress::draw_until_finished() {
  std::unique_lock lock(mutex_);
  while (!finished_) {
    lock.unlock();
    const std::string line = fmt::format("\r\x1b[K{}", text());
    std::fwrite(line.data(), 1, line.size(), stderr);
    lock.lock();
    wake_.wait_for(lock, std::chrono::milliseconds(200), [this] { return finished_; });
  }
}

void Progress::finish() {
  {
    const std::scoped_lock lock(mutex_);
    if (finished_) return;
    finished_ = true;
  }
  wake_.notify_all();
  if (painter_.joinable()) {
    painter_.join();
    const std::string line = fmt::format("\r\x1b[K{}\n", text());
    std::fwrite(line.data(), 1, line.size(), stderr);
  }
}

}  // namespace drench

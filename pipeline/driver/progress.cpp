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

std::string_view log_part(Step step) { return step == Step::simulate ? "sim" : step_name(step); }

}  // namespace

std::string clock_text(double seconds) {
  const auto whole = int64_t(std::ceil(seconds));
  if (whole >= 3600) {
    return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  }
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

std::string bar_text(double share, int width) {
  const int filled = std::clamp(int(share * width), 0, width);
  return fmt::format("[{}{}]", std::string(size_t(filled), '#'),
                     std::string(size_t(width - filled), '-'));
}

ProgressStyle progress_style() {
  return ::isatty(STDERR_FILENO) ? ProgressStyle::bar : ProgressStyle::lines;
}

Progress::Progress(ProgressStyle style, bool openjd) : style_(style), openjd_(openjd) {}
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
  const std::string numbered =
      is_per_frame(step) ? fmt::format("frame={} {}", frame, line) : std::string(line);
  tell_farm(fmt::format("{} {}", log_part(step), numbered));
  if (style_ != ProgressStyle::lines) return;
  log_info(log_part(step),
           fmt::format("{}{}ms={:.0f}", numbered, line.empty() ? "" : " ", seconds * 1000));
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
  {
    const std::scoped_lock lock(mutex_);
    counts_[step].share[frame] = finished;
  }
  tell_farm({});
}

double Progress::finished_share() const {
  double done = 0, planned = 0;
  for (const auto& [step, count] : counts_) {
    done += std::min<double>(finished(count), count.planned);
    planned += count.planned;
  }
  return planned > 0 ? done / planned : 1;
}

/// @param what  that is done; empty: a share of it, which is told once a second.
void Progress::tell_farm(std::string_view what) {
  if (!openjd_) return;
  const std::scoped_lock lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (what.empty() && now - told_ < std::chrono::seconds(1)) return;
  told_ = now;
  std::string text = fmt::format("{}{:.1f}\n", openjd_progress, 100 * finished_share());
  if (!what.empty()) text += fmt::format("{}{}\n", openjd_status, what);
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

/// Frames, those in work by their shares.
double Progress::finished(const Count& count) {
  double sum = count.done;
  for (const auto& [frame, share] : count.share) sum += share;
  return sum;
}

std::string Progress::text() const {
  const std::scoped_lock lock(mutex_);
  std::string text;
  double left = 0;
  int frames = 0;
  for (const auto& [step, count] : counts_) {
    text += fmt::format("{} {}/{}  ", log_part(step), count.done, count.planned);
    // Stages overlap: the slowest one says when all is done. Its mean time is measured while the
    // others run beside it.
    if (count.ran > 0) {
      const double at_once = std::max<double>(1, double(count.share.size()));
      const double unfinished = std::max(0.0, count.planned - finished(count));
      left = std::max(left, unfinished * count.seconds / (count.ran * at_once));
    }
    if (count.ran > 0 && is_per_frame(step)) frames = count.ran;  // of the last stage at work
  }
  text += bar_text(finished_share(), 20);
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

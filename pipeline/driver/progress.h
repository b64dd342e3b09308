#pragma once
// What the user sees while the driver works: a bar on a terminal, one line per event otherwise.

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "pipeline/driver/plan.h"

namespace drench {

enum class ProgressStyle { quiet, lines, bar };

/// What a farm's worker reads on standard output, by the Open Job Description: a share in percent,
/// a line on what is done, and what went wrong.
inline constexpr std::string_view openjd_progress = "openjd_progress: ",
                                  openjd_status = "openjd_status: ", openjd_fail = "openjd_fail: ";

/// "0:42", "1:02:03"
std::string clock_text(double seconds);
/// "[####----]", with this share of it filled.
std::string bar_text(double share, int width);

/// A bar if stderr is a terminal and nothing more is asked for.
ProgressStyle progress_style();

/// Counts what is done of what is planned, with rate and time left. Safe from several threads.
class Progress {
 public:
  /// @param openjd  also prints a farm's lines, on standard output.
  explicit Progress(ProgressStyle style, bool openjd = false);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Takes the planned counts; tasks that may turn out unneeded are counted.
  void start(const Plan& plan);
  /// A task ran in `seconds`, or turned out not to be needed.
  void done(Step step, int frame, double seconds, std::string_view line);
  void not_needed(Step step, int frame);
  /// Share of a frame in work that is finished, 0..1.
  void share(Step step, int frame, double finished);
  /// Takes the bar away.
  void finish();

  /// "sim 12/48  mesh 11/48  render 10/48  [####------]  2.1 frames/min  0:42 left"
  std::string text() const;

 private:
  struct Count {
    int planned = 0, done = 0;
    int ran = 0;
    double seconds = 0;           // of those that ran
    std::map<int, double> share;  // by frame
  };
  void draw_until_finished();
  static double finished(const Count& count);
  double finished_share() const;
  void tell_farm(std::string_view what);

  const ProgressStyle style_;
  const bool openjd_;
  std::chrono::steady_clock::time_point told_;
  mutable std::mutex mutex_;
  std::map<Step, Count> counts_;
  std::chrono::steady_clock::time_point start_;
  std::condition_variable wake_;
  bool finished_ = true;
  std::thread painter_;
};

}  // namespace drench

#pragma once
// How a stage's work is run: its inputs checked, on its cores, what it wrote committed to the
// manifest.

#include <tbb/task_arena.h>

#include <chrono>
#include <filesystem>
#include <semaphore>
#include <string_view>
#include <vector>

#include "pipeline/contract/error.h"
#include "pipeline/driver/inputs.h"
#include "pipeline/driver/process.h"
#include "pipeline/driver/progress.h"
#include "pipeline/driver/stages.h"
#include "pipeline/driver/stats_file.h"

namespace drench {

/// Who computes: the thread that simulates, the one that meshes, those that render. What is made
/// once all frames are there has the cores of rendering.
enum class Worker { simulate, mesh, render, last };

inline constexpr int most_frames_rendered_at_once = 4;

/// Safe from several threads.
class StageRunner {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param threads  that compute at once; 0: all cores.
  StageRunner(const std::filesystem::path& folder, Manifest& manifest, const Stages& stages,
              Progress& progress, int threads);

  /// Runs one frame of one stage on its worker's cores, when fewer than `threads` others compute.
  template <class Work>
  void compute(Worker worker, const Work& work);
  /// The same for work on files of the folder: none is read before its digest was checked.
  /// @throws DamagedInput if one is not what was recorded, or cannot be read
  template <class Work>
  void compute_from(const std::vector<InputFile>& files, Worker worker, const Work& work);

  void commit(const std::vector<WrittenFile>& files, std::string_view step, int frame,
              const Key& key);
  void finished(Step step, int frame, Clock::time_point start, const StageReport& report);

 private:
  tbb::task_arena& arena_of(Worker worker);

  static constexpr int most_at_once = 2 + most_frames_rendered_at_once;

  const std::filesystem::path folder_;
  Manifest& manifest_;
  const Stages& stages_;
  Progress& progress_;
  StatsFile stats_;
  tbb::task_arena simulate_arena_, mesh_arena_, render_arena_;
  std::counting_semaphore<most_at_once> slots_;
};

template <class Work>
void StageRunner::compute(Worker worker, const Work& work) {
  tbb::task_arena& arena = arena_of(worker);
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
void StageRunner::compute_from(const std::vector<InputFile>& files, Worker worker,
                               const Work& work) {
  for (const InputFile& file : files) check_input(folder_, manifest_, file.name);
  try {
    compute(worker, work);
  } catch (const Error&) {
    drop_unreadable(folder_, manifest_, files, [this](const std::filesystem::path& file) {
      return stages_.why_unreadable(file);
    });
    throw;
  }
}

}  // namespace drench

#include "pipeline/driver/stage_runner.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/log.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace {

int arena_size(int threads) { return threads > 0 ? threads : tbb::task_arena::automatic; }

}  // namespace

StageRunner::StageRunner(const std::filesystem::path& folder, Manifest& manifest,
                         const Stages& stages, Progress& progress, int threads)
    : folder_(folder),
      manifest_(manifest),
      stages_(stages),
      progress_(progress),
      stats_(folder / layout::stats),
      simulate_arena_(arena_size(threads)),
      mesh_arena_(arena_size(threads)),
      render_arena_(arena_size(threads)),
      slots_(threads > 0 ? std::min(threads, most_at_once) : most_at_once) {}

tbb::task_arena& StageRunner::arena_of(Worker worker) {
  if (worker == Worker::simulate) return simulate_arena_;
  return worker == Worker::mesh ? mesh_arena_ : render_arena_;
}

void StageRunner::commit(const std::vector<WrittenFile>& files, std::string_view step, int frame,
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

void StageRunner::finished(Step step, int frame, Clock::time_point start,
                           const StageReport& report) {
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  stats_.add(step_name(step), frame, seconds, report.json);
  progress_.done(step, frame, seconds, report.line);
}

}  // namespace drench

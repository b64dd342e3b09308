#include "pipeline/driver/job.h"

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/device.h"
#include "pipeline/driver/frame_range.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace fs = std::filesystem;

Job job_of(const ShotArguments& arguments, std::vector<Step> steps) {
  Job job;
  job.shot = read_shot(arguments.shot, {.quality = arguments.quality, .set = arguments.set});
  job.folder =
      arguments.out.empty() ? fs::path("out") / job.shot.name / arguments.quality : arguments.out;
  std::vector<int> frames = arguments.frames.empty()
                                ? all_frames(job.shot.timeline)
                                : parse_frames(arguments.frames, job.shot.timeline);
  job.targets =
      targets_of(job.shot, std::move(frames), std::move(steps), device_class(arguments.device));
  return job;
}

Job job_in(const fs::path& folder) {
  ShotArguments arguments;
  arguments.shot = folder / layout::shot_lock;
  arguments.out = folder;
  if (!fs::exists(arguments.shot)) {
    throw Error(fmt::format("{}: holds no {}; give an output folder that `drench run` made",
                            folder.string(), layout::shot_lock));
  }
  return job_of(arguments, all_steps());
}

Plan plan_of(const Job& job, const Manifest& manifest) {
  return make_plan(job.targets, take_snapshot(job.folder, manifest), job.shot.timeline.last);
}

void refuse_problems(const Job& job, const Plan& plan) {
  for (const std::string& warning : plan.warnings) log_warning("driver", warning);
  if (plan.problems.empty()) return;
  throw Error(fmt::format("{}: {}", job.folder.string(), plan.problems.front()));
}

}  // namespace drench

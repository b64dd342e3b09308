#pragma once
// A shot, what is to be made of it and where it goes: what a command's arguments name.

#include <filesystem>
#include <string_view>
#include <vector>

#include "pipeline/driver/commands.h"
#include "pipeline/driver/plan.h"

namespace drench {

struct Job {
  Shot shot;
  std::filesystem::path folder;
  Targets targets;
};

/// @throws Error if the shot or a file that it names cannot be read.
Job job_of(const ShotArguments& arguments, std::vector<Step> steps);

/// What lies in an output folder: the shot as it was made last.
/// @throws Error if the folder holds none
Job job_in(const std::filesystem::path& folder);

/// What would be made of it. @param manifest  of the job's folder.
Plan plan_of(const Job& job, const Manifest& manifest);

/// Says the plan's warnings. @throws Error if it has a problem.
void refuse_problems(const Job& job, const Plan& plan);

}  // namespace drench

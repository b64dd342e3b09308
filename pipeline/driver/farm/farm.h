#pragma once
// `drench farm`: the tasks of a shot on Slurm. Every task is a `drench run` of one step and a few
// frames in the shared output folder; what is made, and whether it is right, the folder's manifest
// says, not the farm.

#include <string>
#include <vector>

#include "pipeline/driver/job.h"

namespace drench {

struct FarmArguments {
  ShotArguments shot;
  int chunk = 0;                    // frames a task; 0: by what was measured
  int cores = 1;                    // a task
  int retry = 0;                    // times that a task is tried again which failed
  std::vector<std::string> sbatch;  // options handed on, as --partition=film
};

/// The shot of the arguments, all its steps. The device is the CPU unless they name another: the
/// machines of a farm differ.
Job farm_job(const FarmArguments& arguments);

/// Submits a task for all that is missing and not in the queue already. @throws Error if Slurm
/// refuses; what was submitted until then is cancelled.
void farm_submit(const FarmArguments& arguments);
/// Prints a job template of the Open Job Description of the whole shot.
void farm_template(const FarmArguments& arguments);
/// Prints how far each step is, what runs and what failed.
void farm_status(const FarmArguments& arguments);
/// Ends all tasks of the shot's output folder that wait or run.
void farm_cancel(const FarmArguments& arguments);

}  // namespace drench

#pragma once
// What can be said of a run before anything is built or read.

#include "pipeline/driver/job.h"

namespace drench {

/// Whether a plan makes pictures.
bool renders(const Plan& plan);

/// Warns of frames beyond the shot's, of values that look like mistakes and of pictures that would
/// be empty. @throws Error if the fluid that the shot starts with takes more memory than
/// `memory_gib`, or if that is 0 than this machine has
void check_early(const Job& job, const Plan& plan, double memory_gib);

/// Warns if the folder was filled by another shot: two of one name write into one folder, and each
/// would make the other's frames again.
void warn_of_another_shot(const Job& job);

}  // namespace drench

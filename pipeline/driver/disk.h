#pragma once
// How much disk a run will take, by what its frames took so far, and how much there is.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pipeline/driver/plan.h"

namespace drench {

/// Bytes that frames took: of a step, or of checkpoints.
struct DiskUse {
  int frames = 0;
  double mean = 0, most = 0;  // of a frame
};
/// By step as records name it. @param records  of a manifest
std::map<std::string, DiskUse> disk_use(const std::map<std::string, Record>& records);

struct DiskEstimate {
  double bytes = 0;           // that new frames will take; those made again take none
  std::vector<Step> unknown;  // steps of which no frame was made yet: not in it
};
DiskEstimate disk_estimate(const Plan& plan, const Targets& targets,
                           const std::map<std::string, Record>& records);

/// Bytes that two frames of every step and two checkpoints may take, and at least 4 MiB: with less
/// free a run stops while it can still keep its work.
double disk_reserve(const std::map<std::string, Record>& records);

/// Bytes that this user may still write there, or where the folder will be; infinite where the
/// system does not say.
double free_disk(const std::filesystem::path& folder);

/// "1.2 GB are needed, 80 GB are free"; empty if nothing is needed or known.
std::string disk_text(const DiskEstimate& estimate, double free);

}  // namespace drench

#pragma once
// What an output folder knows of how it was made: read for the report, and for nothing else.

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pipeline/driver/job.h"

namespace drench {

/// A probe's file: columns of numbers, the first of them the time.
struct ProbeTable {
  std::string name;
  std::vector<std::string> comments, columns;
  std::vector<std::vector<double>> values;  // by column; what is not there is not a number
};

struct ReportData {
  Job job;                                             // the shot as it was made last
  Plan plan;                                           // what would be made now, and why not
  std::map<Step, std::map<int, nlohmann::json>> rows;  // of stats.jsonl, the last of a frame
  std::vector<nlohmann::json> runs;                    // in order
  std::vector<nlohmann::json> warnings;                // of the last run that had any
  std::vector<ProbeTable> probes;
  std::map<std::string, Record> files;
  std::filesystem::path movie;  // empty if there is none

  bool is_rendered(int frame) const;
  /// Frames whose images are there, in order.
  std::vector<int> rendered() const;
};

/// @throws Error if the folder holds no shot, or a file cannot be read.
ReportData read_report_data(const std::filesystem::path& folder);

/// A table as sim/probe.*.csv has it. Lines that are none are left out.
ProbeTable parse_probe(const std::string& name, const std::string& text);

}  // namespace drench

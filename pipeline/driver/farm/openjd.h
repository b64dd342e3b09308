#pragma once
// A shot as a job template of the Open Job Description, for farms that read those.

#include <filesystem>
#include <map>
#include <string>

#include "pipeline/driver/farm/farm_graph.h"
#include "pipeline/driver/farm/measured.h"

namespace drench {

struct OpenjdTemplate {
  std::string name;  // of the job
  std::filesystem::path program, shot, folder;
  bool cuda = false;                       // simulates on a GPU
  int cores = 1;                           // that a task asks for
  std::map<Step, Measured> measured = {};  // memory that a task asks for
};

/// Tasks of a step that the specification allows.
inline constexpr int openjd_most_tasks = 1024;

/// Job template 2023-09 in JSON. Steps wait for whole steps, since the description has nothing
/// finer; a chain is one task.
/// Source: Open Job Description, Template Schemas 2023-09, sections 1.1, 2.2 and 3.
std::string openjd_template(const FarmGraph& graph, const OpenjdTemplate& what);

}  // namespace drench

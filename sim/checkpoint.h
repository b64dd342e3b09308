#pragma once
// Lossless restart files: every state the next step reads.

#include <filesystem>
#include <vector>

#include "pipeline/contract/files/files.h"
#include "sim/setup/births.h"
#include "sim/setup/sheet_rest.h"
#include "sim/solver.h"

namespace drench::sim {

struct Checkpoint {
  int frame = 0;
  double time = 0;  // s since the first frame
  uint64_t steps = 0;
  int next_id = 0;
  std::vector<Birth> births;
  std::vector<uint64_t> emitted;  // layers that left each emitter, particles of a mesh
  std::vector<uint64_t> shut;     // by emitter: particles when it had no room left; 0: it sends
  HostState state;
  SheetRestState rest;
  std::vector<double> probes;  // rows so far, ProbeSeries
  Digest layout;               // of the shot's settings and the file's layout
};

WrittenFile write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);
/// @throws Error if damaged (the content's own digest disagrees) or if `layout` differs.
Checkpoint read_checkpoint(const std::filesystem::path& path, const Digest& layout);

}  // namespace drench::sim

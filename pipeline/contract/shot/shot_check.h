#pragma once
// What no single value shows: limits between values, references, sizes.

#include <map>
#include <string>

#include "pipeline/contract/shot/shot.h"

namespace drench {

/// Where each value was written: "fluid.spacing" -> "shots/dam.toml:14" or "--set fluid.spacing=1".
/// Objects themselves stand under their path: "cloth[0]".
struct ShotSources {
  std::string file;
  std::map<std::string, std::string> where;

  /// Place of a key, else of what holds it, else the file.
  std::string at(const std::string& key) const;
};

/// Particles of boxes, spheres and drops, by their volumes.
double particles_at_start(const Shot& shot);

/// @throws Error with location, keys, values, reason and remedy for the first part that cannot be
/// right.
void check_shot(const Shot& shot, const ShotSources& sources);

}  // namespace drench

#pragma once
// Probes that stand where there is never any fluid.

#include "sim/setup/scene.h"

namespace drench::sim {

/// Notes probes in solids that stand, riders beyond the domain, and forces on obstacles that lie
/// wholly beyond it. What moves may come to where it reads: nothing is said of it.
void note_probes(const Shot& shot, Scene& scene);

}  // namespace drench::sim

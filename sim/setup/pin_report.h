#pragma once
// What is said about pins that move before anything runs.

namespace drench {
struct Shot;
}

namespace drench::sim {

struct Scene;

/// Notes pins that move apart farther than the sheet between them reaches, or through a wall or an
/// obstacle that does not deform. Looks at every frame.
void note_pins(const Shot& shot, Scene& scene);

}  // namespace drench::sim

#pragma once
// Pins that move, let go or are soft (sim/setup/cloth_pins.h), in the sheets' one system A w = b
// (cloth_implicit.h). A vertex that is held ends at the pin's place x_1 with its velocity v_1: its
// w is known and its axes are not free, as where a wall holds it. The straight path of a shell's is
//   p = (x_1 - x_0) / dt - (v_1 - v_0),
// so that w = dt (v_1 - v_0) as of all its vertices: for a free one's acceleration a_0 this is
// v_0 - dt/2 a_0. A soft pin is a spring without length to its place, k dt^2 on the diagonal of A;
// over the step it counts as the forces inside the sheet do (shell_system.h). Only the guard of the
// sheets (self_contact.h) stops a vertex short of its pin: the next step takes it there.

#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// The straight paths of shells' vertices that are held. After those of the others.
void find_pin_paths(State& state);

/// The soft pins' part of A and of the right side. Before linearise_cloth reads them.
void find_anchors(State& state);

/// The w of the vertices that are held.
void place_pins(State& state);

/// Ends the step of the vertices that are held where their pins are.
void finish_pins(State& state);

}  // namespace drench::sim::DRENCH_BACKEND

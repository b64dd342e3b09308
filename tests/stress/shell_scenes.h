#pragma once
// Scenes of the stress tests of shells: sheets with the constants of cotton, where a row does not
// say otherwise.

#include "tests/stress/scenes.h"

namespace drench::stress_tests {

/// Film frame after so many seconds.
double frame_at(const Shot& shot, double seconds);

/// A sheet of cells of `size` / `cells` m from `corner` along two edges, as a shell.
Cloth& add_shell(Shot& shot, V3d corner, V3d u, V3d v, V2i cells);
/// Isotropic, with these moduli: N/m, N m.
void set_moduli(Cloth& sheet, double young, double rigidity);

/// A sheet of 0.4 m that falls 0.05 m onto a ball and hangs down on the floor.
Shot fall_on_ball(int cells = 20);
/// `layers` of 0.2 m a fifth more than a thickness apart, that fall 0.05 m on the floor.
Shot pile(int layers, int cells);
/// A sheet of 0.35 x 0.3 m that stands on an edge on the floor, leaning by 1 in 35.
Shot standing(int cells);
/// A strip of length x width m about the origin, along x, held at both ends, that turn in opposite
/// senses about x by `turns` together within `seconds`, and come nearer by `nearer` m.
Shot twisted_strip(double length, double width, V2i cells, double turns, double nearer,
                   double seconds);

}  // namespace drench::stress_tests

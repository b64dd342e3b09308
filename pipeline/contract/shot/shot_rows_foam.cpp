#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

std::vector<Parameter> foam_rows() {
  constexpr Limits rate{0, 1e4};
  return {
      row<&FoamSettings::present>("foam", "present", "", none, foam,
                                  "there is foam; true when [foam] is written"),
      row<&FoamSettings::trapped_air>("foam", "trapped_air", "", rate, foam,
                                      "foam particles that each fluid particle at a surface makes "
                                      "while the fluid around it closes in by a spacing"),
      row<&FoamSettings::wave_crest>("foam", "wave_crest", "", rate, foam,
                                     "foam particles that each fluid particle at a crest or tip "
                                     "makes while it runs ahead of the fluid around it by a "
                                     "spacing"),
      row<&FoamSettings::threshold>("foam", "threshold", "", {0, 1000}, foam,
                                    "speed between neighbours from which air is caught, over the "
                                    "one that lifts fluid by a spacing against gravity and surface "
                                    "tension; all is caught at five times as much"),
      row<&FoamSettings::lifetime>("foam", "lifetime", "s", {0, 1e6}, foam,
                                   "mean time that foam stays on a surface, or spray on a wall; "
                                   "each has between half and one and a half of it"),
      row<&FoamSettings::rise_speed>("foam", "rise_speed", "m/s", {0, 100}, foam,
                                     "of bubbles in fluid at rest; millimetres to centimetres of "
                                     "air in water have 0.2 to 0.3"),
      row<&FoamSettings::radius>("foam", "radius", "", {1e-4, 1}, foam,
                                 "mean radius of a foam particle / spacing; each has between 0.6 "
                                 "and 1.4 of it, and foam shrinks in the last fifth of its life"),
  };
}

}  // namespace drench::shot_table

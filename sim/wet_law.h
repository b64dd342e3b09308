#pragma once

namespace drench::sim {

/// What water makes of a sheet. Times are s, and 0 is at once for soaking, never for drying.
struct WetLaw {
  float uptake;               // mass of the water that fills it over its own; 0: never wet
  float soak_time, dry_time;  // of the share that is left, towards full and towards none
  bool soaks;                 // it takes up fluid
  float stiffness;            // moduli and rigidities, full over dry
  float friction, wet_friction;
};

}  // namespace drench::sim

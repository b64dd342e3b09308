#pragma once
// What a step reads of one obstacle. Host and device, both builds.

namespace drench::sim {

enum class ObstacleShape : int { plane, box, sphere, field };

/// Lengths in m, local frame of the simulation. Index 0 is the start of a step, 1 its end.
struct ObstaclePlacement {
  ObstacleShape shape = ObstacleShape::plane;
  float half[3] = {0, 0, 0};        // box: half its edges; sphere: its radius
  float clearance = 0;              // no particle ends a step nearer
  float friction = 0;               // Coulomb's coefficient of sheets on it
  float wetting = 0;                // cosine of its contact angle
  float no_slip = 0;                // 1: it holds the fluid beside it; 0: fluid slips along it
  float centre[2][3] = {};          // where its own origin stands
  float axis[2][9] = {};            // its own axes, one after the other
  float blend[2] = {0, 0};          // 0 the first of its level sets .. 1 the second
  float deform = 0;                 // how far a vertex moves between these
  float low[3] = {}, high[3] = {};  // bounds over the step
  int of = 0;                       // which obstacle: it may have images (obstacle_images.h)
  bool around = false;              // images are one body with it: its distance is the least of all
  int joined[3][2] = {};            // these, first and last by axis
  float period[3][3] = {};          // to the next of these, in its own frame
};

}  // namespace drench::sim

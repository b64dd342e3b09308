#pragma once
// Shots, fluids and single particles for tests of foam.

#include <cmath>
#include <numeric>

#include "surfacing/foam.h"
#include "tests/surfacing/scenes.h"

namespace drench::foam_scenes {

using namespace surfacing_scenes;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;

inline constexpr double spacing = 0.01;  // m
inline constexpr float a = float(spacing);

inline Shot foam_shot() {
  Shot shot;
  shot.fluid.spacing = spacing;
  shot.domain.min = V3d(-4), shot.domain.max = V3d(4);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  shot.foam.present = true;
  return shot;
}

inline void number(ParticleFrame& frame) {
  frame.id.resize(frame.position.size());
  std::iota(frame.id.begin(), frame.id.end(), 0u);
}

/// A box of fluid whose top is at y = 0, shaken by a tenth of a spacing, all at one velocity.
inline ParticleFrame pool(V3i cells, const V3f& velocity = V3f(0)) {
  const V3f corner(-0.5f * a * float(cells.x), -a * float(cells.y), -0.5f * a * float(cells.z));
  ParticleFrame frame = shaken_box(corner, cells, spacing, 0.1, 3);
  frame.velocity.assign(frame.position.size(), velocity);
  number(frame);
  return frame;
}

/// The frame `seconds` earlier, if all went straight on.
inline ParticleFrame earlier(ParticleFrame frame, float seconds) {
  for (size_t i = 0; i < frame.position.size(); ++i)
    frame.position[i] -= frame.velocity[i] * seconds;
  return frame;
}

inline float frame_time(const Shot& shot) { return float(1 / shot.timeline.fps); }

inline FoamFrame advanced(const Shot& shot, int frame, const FoamFrame& before,
                          const ParticleFrame& fluid, FoamStats* stats = nullptr) {
  return foam_frame(shot, frame, before, earlier(fluid, frame_time(shot)), fluid, {}, stats);
}

inline FoamFrame one_particle(const Shot& shot, const V3f& place, const V3f& velocity) {
  FoamFrame foam = no_foam(shot);
  foam.position.push_back(place), foam.velocity.push_back(velocity);
  foam.id.push_back(0), foam.age.push_back(0), foam.radius.push_back(0.1f * a);
  foam.kind.push_back(FoamKind::spray);
  foam.next_id = 1;
  return foam;
}

/// Fluid that makes no foam and is far from everything: what moves here is alone.
inline ParticleFrame distant_drop() {
  ParticleFrame frame;
  frame.spacing = a;
  frame.position.assign(1, V3f(-3.9f));
  frame.velocity.assign(1, V3f(0));
  frame.id.assign(1, 0);
  return frame;
}

/// Two blocks that meet at x = 0, each with `speed` towards the other.
inline ParticleFrame head_on(float speed, V3i cells = {12, 5, 5}) {
  ParticleFrame frame = shaken_box(V3f(-0.5f * a * float(cells.x), 0, 0), cells, spacing, 0.1, 5);
  for (size_t i = 0; i < frame.position.size(); ++i)
    frame.velocity[i] = V3f(frame.position[i].x < 0 ? speed : -speed, 0, 0);
  number(frame);
  return frame;
}

}  // namespace drench::foam_scenes

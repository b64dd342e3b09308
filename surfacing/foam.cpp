#include "surfacing/foam.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/gravity.h"
#include "surfacing/foam_source.h"
#include "surfacing/foam_walls.h"

namespace drench {
namespace {

using namespace surfacing;

constexpr uint32_t least_foam = 6, most_foam = 20;  // fluid particles within foam_support
/// At a level surface half of a full neighbourhood, 4/3 pi 2^3, and how fast that changes with
/// depth in spacings: by the disc that the surface cuts, pi 2^2.
constexpr float floating_count = 16.755f, count_by_depth = 12.566f;
constexpr int most_substeps = 64;
constexpr float fading = 0.2f;            // fraction of its life in which foam shrinks
constexpr double bytes_a_particle = 200;  // with what a substep holds
enum Draw : uint32_t { life_draw, size_draw, count_draw, first_birth_draw };
constexpr uint32_t always = 0;  // instead of a frame, for what a particle keeps

struct Particle {
  V3f position, velocity;
  float age = 0, radius = 0;
  uint32_t id = 0;
  float birth = 0;  // fraction of the time between the frames; 0: it is there already
  FoamKind kind = FoamKind::spray;
  bool lost = false;
};

void check_fluid(const ParticleFrame& fluid, const char* which) {
  const size_t n = fluid.position.size();
  if (fluid.velocity.size() != n || (!fluid.id.empty() && fluid.id.size() != n))
    throw Error(fmt::format("foam: columns of the {} frame's fluid differ in length", which));
  for (size_t i = 0; i < n; ++i) {
    const V3f &x = fluid.position[i], &v = fluid.velocity[i];
    if (std::isfinite(x.x + x.y + x.z) && std::isfinite(v.x + v.y + v.z)) continue;
    throw Error(
        fmt::format("foam: particle {} of the {} frame's fluid is not finite; the frame is "
                    "damaged or the simulation blew up, simulate it again",
                    i, which));
  }
}

/// What a particle keeps for life.
float life_of(const Shot& shot, uint32_t id) {
  return float(shot.foam.lifetime) * (0.5f + random_number(shot.seed, always, id, life_draw));
}
float size_of(const Shot& shot, uint32_t id) {
  return float(shot.foam.radius * shot.fluid.spacing) *
         (0.6f + 0.8f * random_number(shot.seed, always, id, size_draw));
}
float radius_of(const Shot& shot, const Particle& p) {
  const float left = 1 - p.age / life_of(shot, p.id);
  return size_of(shot, p.id) * std::clamp(left / fading, 0.05f, 1.f);
}

/// Two unit vectors at right angles to a direction and to each other.
std::pair<V3f, V3f> across(const V3f& direction) {
  const V3f axis = std::abs(direction.x) < 0.6f * direction.length() ? V3f(1, 0, 0) : V3f(0, 1, 0);
  const V3f u = direction.cross(axis).normalized();
  return {u, u.cross(direction).normalized()};
}

/// How many a fluid particle makes this frame: its mean, rounded up or down by chance.
uint32_t births_of(const Shot& shot, int frame, uint32_t id, float mean) {
  return uint32_t(std::min(mean, 1e9f) + random_number(shot.seed, uint32_t(frame), id, count_draw));
}

Particle born(const Shot& shot, int frame, const FluidMotion& motion, size_t i, uint32_t parent,
              uint32_t k) {
  const auto draw = [&](uint32_t which) {
    return random_number(shot.seed, uint32_t(frame), parent, first_birth_draw + 3 * k + which);
  };
  Particle p;
  p.birth = draw(0);
  p.position = motion.position(i, p.birth);
  p.velocity = motion.velocity(i, p.birth);
  if (p.velocity.length2() > 0) {
    const auto [u, v] = across(p.velocity);
    const float angle = 2 * std::numbers::pi_v<float> * draw(1);
    const float off = 0.5f * float(shot.fluid.spacing) * std::sqrt(draw(2));
    p.position += (u * std::cos(angle) + v * std::sin(angle)) * off;
  }
  p.position = wrapped(p.position, shot.domain);
  return p;
}

/// One frame of all particles.
class FoamMotion {
 public:
  FoamMotion(const Shot& shot, int frame, const FluidMotion& fluid, const LevelSetMaker& level_set)
      : shot_(shot),
        fluid_(fluid),
        walls_(shot, frame, level_set),
        before_(frame - 1),
        dt_(float(1 / shot.timeline.fps)),
        turns_(shot.frame_rotation_deg.keys.size() > 1) {}

  int substeps(const std::vector<Particle>& particles) const {
    float speed = fluid_.largest_speed();
    for (const Particle& p : particles) speed = std::max(speed, p.velocity.length());
    const float width = 2 * foam_support * float(shot_.fluid.spacing);  // what a particle sees
    return std::clamp(int(std::ceil(std::min(speed * dt_ / width, 1e6f))), 1, most_substeps);
  }

  void advance(std::vector<Particle>& particles, float from, float to) const {
    std::vector<size_t> moving;
    for (size_t k = 0; k < particles.size(); ++k)
      if (particles[k].birth < to && !particles[k].lost) moving.push_back(k);
    const auto time = [&](const Particle& p) { return (to - std::max(from, p.birth)) * dt_; };
    std::vector<V3f> middle(moving.size());
    for (size_t m = 0; m < moving.size(); ++m) {
      const Particle& p = particles[moving[m]];
      middle[m] = wrapped(p.position + p.velocity * (0.5f * time(p)), shot_.domain);
    }
    const FluidMoment now =
        fluid_at(fluid_, 0.5f * (from + to), shot_.domain, float(shot_.fluid.spacing), middle);
    const std::vector<Around> around = fluid_around(now, middle);
    const Pull everywhere = pull_of(gravity_at(shot_, before_ + 0.5 * (from + to)));
    tbb::parallel_for(tbb::blocked_range<size_t>(0, moving.size(), 1024), [&](const auto& range) {
      for (size_t m = range.begin(); m < range.end(); ++m) {
        Particle& p = particles[moving[m]];
        const V3f start = p.position;
        const Flight flight{std::max(from, p.birth), to, time(p)};
        move(p, around[m], flight, turns_ ? pull_at(middle[m], flight) : everywhere);
        meet_walls(p, start, time(p), to);
      }
    });
  }

 private:
  /// Fractions of the time between the frames, and s.
  struct Flight {
    float from, to, dt;
    float middle() const { return 0.5f * (from + to); }
  };
  /// Gravity, m/s^2; upwards; m/s and s that a bubble rises by and takes to.
  struct Pull {
    V3f gravity{0, 0, 0}, up{0, 0, 0}, rise{0, 0, 0};
    float drag_time = 0;
  };
  Pull pull_of(const V3d& gravity) const {
    Pull pull{V3f(gravity)};
    const float g = pull.gravity.length(), speed = float(shot_.foam.rise_speed);
    if (!(g > 0)) return pull;
    // A sphere without weight in water has half its mass of water to move: 2 g.
    pull.up = pull.gravity / -g;
    pull.rise = pull.up * speed;
    pull.drag_time = speed / (2 * g);
    return pull;
  }
  /// In a turning frame: with what the centrifuge adds there.
  Pull pull_at(const V3f& position, const Flight& flight) const {
    const double frame = before_ + double(flight.middle());
    return pull_of(gravity_at(shot_, frame) +
                   frame_turn_at(shot_, frame).centrifugal(V3d(position)));
  }

  /// A parabola of the world, however the frame turns meanwhile.
  void fly(Particle& p, const Flight& flight, const Pull& pull) const {
    if (!turns_) {
      const V3f velocity = p.velocity + pull.gravity * flight.dt;
      p.position += (p.velocity + velocity) * (0.5f * flight.dt);
      p.velocity = velocity;
      return;
    }
    const FrameTurn start = frame_turn_at(shot_, before_ + double(flight.from)),
                    end = frame_turn_at(shot_, before_ + double(flight.to));
    const V3d before = start.velocity_in_world(V3d(p.position), V3d(p.velocity)),
              after = before + shot_.gravity.at(before_ + double(flight.middle())) * flight.dt,
              position =
                  start.position_in_world(V3d(p.position)) + (before + after) * (0.5 * flight.dt);
    const V3d own = end.position_from_world(position);
    p.position = V3f(own), p.velocity = V3f(end.velocity_from_world(own, after));
  }

  void move(Particle& p, const Around& around, const Flight& flight, const Pull& pull) const {
    const float dt = flight.dt;
    p.kind = around.count < least_foam  ? FoamKind::spray
             : around.count > most_foam ? FoamKind::bubble
                                        : FoamKind::foam;
    if (p.kind == FoamKind::spray) {
      fly(p, flight, pull);
    } else if (p.kind == FoamKind::foam) {
      p.velocity = around.velocity + pull.up * float_up(around.count, dt);
      p.position += p.velocity * dt;
      p.age += dt;
    } else {
      const V3f aim = around.velocity + pull.rise, off = p.velocity - aim;
      const float left = pull.drag_time > 0 ? std::exp(-dt / pull.drag_time) : 0;
      p.position += aim * dt + off * (pull.drag_time * (1 - left));
      p.velocity = aim + off * left;
    }
  }

  /// Speed upwards that takes foam to the surface it floats on, never past it, m/s.
  float float_up(uint32_t count, float dt) const {
    const float spacing = float(shot_.fluid.spacing);
    const float depth = spacing * (float(count) - floating_count) / count_by_depth;
    const float fraction = 1 - std::exp(-dt * float(shot_.foam.rise_speed) / (0.5f * spacing));
    return dt > 0 ? depth * fraction / dt : 0;
  }

  void meet_walls(Particle& p, const V3f& start, float dt, float s) const {
    const FoamWalls::Touch touch = walls_.keep_out(start, p.position, p.radius, s);
    p.lost = walls_.lost(p.position);
    if (!touch.met) return;
    if (p.kind == FoamKind::spray) {
      p.velocity = touch.velocity;
      p.age += dt;
    } else {
      const float into = (p.velocity - touch.velocity).dot(touch.normal);
      if (into < 0) p.velocity -= touch.normal * into;
    }
  }

  const Shot& shot_;
  const FluidMotion& fluid_;
  const FoamWalls walls_;
  int before_;  // film frame at the start of the motion
  float dt_;    // s
  bool turns_;  // the frame of the domain
};

std::vector<Particle> particles_of(const FoamFrame& frame) {
  std::vector<Particle> particles(frame.position.size());
  for (size_t k = 0; k < particles.size(); ++k) {
    Particle& p = particles[k];
    p.position = frame.position[k], p.velocity = frame.velocity[k], p.age = frame.age[k];
    p.radius = frame.radius[k], p.id = frame.id[k], p.kind = frame.kind[k];
  }
  return particles;
}

/// Appends what the fluid makes during the frame. @return the next id.
uint32_t give_birth(const Shot& shot, int frame, const FluidMotion& motion,
                    const ParticleFrame& fluid, uint32_t next_id,
                    std::vector<Particle>& particles) {
  constexpr uint32_t last_id = 1u << 31;
  const FluidMoment end = fluid_at(motion, 1, shot.domain, float(shot.fluid.spacing), {});
  const std::vector<float> rate = birth_rates(end, shot);
  const auto dt = float(1 / shot.timeline.fps);
  const double most = shot.surface.memory_gib * (1 << 30) / bytes_a_particle;
  for (size_t i = 0; i < rate.size(); ++i) {
    if (!(rate[i] > 0)) continue;
    const uint32_t parent = fluid.id.empty() ? uint32_t(i) : fluid.id[i];
    const uint32_t count = births_of(shot, frame, parent, rate[i] * dt);
    if (count > last_id - next_id || double(particles.size()) + count > most)
      throw Error(
          fmt::format("foam: frame {} would have more than {:.4g} foam particles, the most "
                      "that surface.memory_gib = {} or their numbers allow. Lower "
                      "foam.trapped_air and foam.wave_crest, or raise foam.threshold",
                      frame, std::min(most, double(last_id)), shot.surface.memory_gib));
    for (uint32_t k = 0; k < count; ++k) {
      Particle p = born(shot, frame, motion, i, parent, k);
      p.id = next_id++;
      p.radius = size_of(shot, p.id);
      particles.push_back(p);
    }
  }
  return next_id;
}

FoamFrame frame_of(const Shot& shot, const std::vector<Particle>& particles, FoamStats& stats) {
  FoamFrame frame = no_foam(shot);
  for (const Particle& p : particles) {
    stats.lost += p.lost;
    const bool dead = !p.lost && p.age >= life_of(shot, p.id);
    stats.died += dead;
    if (p.lost || dead) continue;
    frame.position.push_back(p.position);
    frame.velocity.push_back(p.velocity);
    frame.id.push_back(p.id);
    frame.age.push_back(p.age);
    frame.radius.push_back(radius_of(shot, p));
    frame.kind.push_back(p.kind);
    ++(p.kind == FoamKind::spray  ? stats.spray
       : p.kind == FoamKind::foam ? stats.foam
                                  : stats.bubbles);
  }
  return frame;
}

}  // namespace

FoamFrame no_foam(const Shot& shot) {
  FoamFrame frame;
  frame.spacing = float(shot.fluid.spacing);
  return frame;
}

FoamFrame foam_frame(const Shot& shot, int frame, const FoamFrame& before,
                     const ParticleFrame& fluid_before, const ParticleFrame& fluid,
                     const LevelSetMaker& level_set, FoamStats* stats) {
  FoamStats unused;
  FoamStats& report = stats ? *stats : unused;
  report = {};
  check_fluid(fluid_before, "earlier");
  check_fluid(fluid, "later");
  const FluidMotion motion(fluid_before, fluid, shot.domain, float(1 / shot.timeline.fps));
  std::vector<Particle> particles = particles_of(before);
  const uint32_t next_id = fluid.position.empty()
                               ? before.next_id
                               : give_birth(shot, frame, motion, fluid, before.next_id, particles);
  report.born = next_id - before.next_id;
  if (!particles.empty()) {
    const FoamMotion foam(shot, frame, motion, level_set);
    report.substeps = foam.substeps(particles);
    for (int k = 0; k < report.substeps; ++k)
      foam.advance(particles, float(k) / float(report.substeps),
                   float(k + 1) / float(report.substeps));
  }
  FoamFrame result = frame_of(shot, particles, report);
  result.next_id = next_id;
  return result;
}

}  // namespace drench

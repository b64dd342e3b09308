#include "tests/sim/obstacle_scenes.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "pipeline/contract/geometry/obstacle.h"

namespace drench::sim_tests {

namespace {

constexpr double g = 9.81;

Settled settled_of(Stepper& run, const Pose& tank, double a, double depth) {
  run.solver->refresh();
  const sim::HostState state = run.solver->save();
  const std::vector<float> density = run.solver->density();
  Settled result;
  double top = -1e30;
  std::vector<V3d> own;
  for (size_t i = 0; i < state.id.size(); ++i) {
    V3d world;
    for (int k = 0; k < 3; ++k) world[k] = run.scene.frame.to_world(k, at(state.position, i)[k]);
    own.push_back(tank.to_own(world) / a);
    result.centre += own.back() / double(state.id.size());
    result.kinetic += 0.5 * at(state.velocity, i).length2() / double(state.id.size()) / (g * depth);
    top = std::max(top, own.back().y);
  }
  int counted = 0;
  for (size_t i = 0; i < own.size(); ++i) {
    if (own[i].y > result.centre.y) continue;  // well below the surface
    result.density_error += std::abs(density[i] / 1000. - 1), ++counted;
  }
  result.density_error /= counted;
  return result;
}

constexpr int across = 16, deep = 10;

}  // namespace

Obstacle& add_obstacle(Shot& shot, ObstacleType type, V3d position) {
  Obstacle obstacle;
  obstacle.type = type, obstacle.position = position;
  obstacle.name += std::to_string(shot.obstacle.size());
  shot.obstacle.push_back(obstacle);
  return shot.obstacle.back();
}
void add_plane(Shot& shot, V3d point, V3d normal) {
  add_obstacle(shot, ObstacleType::plane, point).normal = normal;
}
void add_sphere(Shot& shot, V3d centre, double radius) {
  add_obstacle(shot, ObstacleType::sphere, centre).radius = radius;
}

Shot tank_shot(int layers) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.gravity = V3d(0, -g, 0);
  const double a = shot.fluid.spacing;
  shot.domain.min = V3d(0), shot.domain.max = V3d(8 * a, 2 * layers * a, 8 * a);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {8, layers, 8});
  return shot;
}

double exact_distance(const Obstacle& obstacle, double frame, const V3d& world) {
  const V3d own = obstacle_pose(obstacle, frame).to_own(world);
  if (obstacle.type == ObstacleType::plane) return own.y;
  if (obstacle.type == ObstacleType::sphere) return own.length() - obstacle.radius;
  V3d beyond, out;
  for (int k = 0; k < 3; ++k)
    beyond[k] = std::abs(own[k]) - 0.5 * obstacle.size[k], out[k] = std::max(beyond[k], 0.);
  const double most = std::max({beyond.x, beyond.y, beyond.z});
  return most > 0 ? out.length() : most;
}

int particles_inside(const Shot& shot, Stepper& run) {
  const sim::HostState state = run.solver->save();
  const double frame = shot.timeline.first + run.time * shot.timeline.fps;
  int inside = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    V3d world;
    for (int k = 0; k < 3; ++k) world[k] = run.scene.frame.to_world(k, at(state.position, i)[k]);
    bool in = false;
    for (const Obstacle& o : shot.obstacle) in |= exact_distance(o, frame, world) < 0;
    for (int k = 0; k < 3; ++k) {
      in |= shot.domain.axis[size_t(k)] == Axis::walls &&
            (world[k] < shot.domain.min[k] || world[k] > shot.domain.max[k]);
    }
    inside += in;
  }
  return inside;
}

Settled settle_in_tilted_gravity(double degrees, double seconds) {
  Shot shot = tank_shot(deep);
  const double a = shot.fluid.spacing, angle = degrees * M_PI / 180;
  shot.fluid.box.clear();
  add_box(shot, V3d(0), {across, deep, 8});
  shot.domain.max = V3d(across * a, 3 * deep * a, 8 * a);
  shot.gravity = V3d(-std::sin(angle), -std::cos(angle), 0) * g;
  Stepper run(shot);
  run.advance(seconds);
  const Pose tank{V3d(0), {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)}};
  Settled result = settled_of(run, tank, a, deep * a);
  result.outside = particles_inside(shot, run);
  return result;
}

Settled settle_in_tilted_tank(double degrees, double seconds) {
  Shot shot = tank_shot(deep);
  const double a = shot.fluid.spacing;
  // The tank's axes in the world: gravity is then turned the same way in both.
  Obstacle frame;
  frame.rotation_deg = V3d(0, 0, degrees);
  Pose tank = obstacle_pose(frame, 0);
  const V3d size(across * a, 3 * deep * a, 8 * a);
  shot.fluid.box.clear();
  shot.domain.min = V3d(-1), shot.domain.max = V3d(1);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};

  for (int k = 0; k < 3; ++k) {
    add_plane(shot, tank.to_world(V3d(0)), tank.axis[k]);
    add_plane(shot, tank.to_world(size), -tank.axis[k]);
  }
  add_box(shot, tank.to_world(0.5 * size), {1, 1, 1});
  sim::Scene scene = sim::build_scene(shot);
  // The same lattice, turned: no source is.
  sim::HostState& start = scene.start;
  start = {};
  for (int z = 0; z < 8; ++z) {
    for (int y = 0; y < deep; ++y) {
      for (int x = 0; x < across; ++x) {
        const V3d p = tank.to_world(V3d(x + 0.5, y + 0.5, z + 0.5) * a);
        start.position.push(scene.frame.to_local(0, p.x), scene.frame.to_local(1, p.y),
                            scene.frame.to_local(2, p.z));
        start.velocity.push(0, 0, 0);
        start.id.push_back(int(start.id.size()));
      }
    }
  }
  Stepper run(std::move(scene));
  run.advance(seconds);
  Settled result = settled_of(run, tank, a, deep * a);
  result.outside = particles_inside(shot, run);
  return result;
}

/// On the first obstacle, N, over half a second once the fluid is at rest.
static V3d mean_force(Stepper& run) {
  run.advance(0.8);
  V3d impulse(0);
  const double begin = run.time;
  while (run.time < begin + 0.5) {
    run.step();
    const sim::ObstacleImpulse i = run.solver->obstacle_impulses().at(0);
    impulse += V3d(i.impulse[0], i.impulse[1], i.impulse[2]);
  }
  return impulse / (run.time - begin);
}

Lift lift_of(ObstacleType type, double spacings) {
  Shot shot = tank_shot(1);
  const double a = shot.fluid.spacing = 0.06 / spacings;  // the body has one size
  const int side = int(std::round(4 * spacings)), depth = int(std::round(4.5 * spacings));
  shot.fluid.box.clear();
  shot.domain.max = V3d(side * a, 2 * depth * a, side * a);
  add_box(shot, V3d(0), {side, depth, side});
  Obstacle& body = add_obstacle(shot, type, V3d(side * a / 2, 2 * spacings * a, side * a / 2));
  const double half = spacings * a;
  body.radius = half, body.size = V3d(2 * half);
  const double volume =
      type == ObstacleType::sphere ? 4 * M_PI / 3 * half * half * half : 8 * half * half * half;
  if (type == ObstacleType::box) body.rotation_deg = V3d(0, 20, 10);
  Stepper run(shot);
  const V3d force = mean_force(run) / (1000 * g * volume);
  return {force.y - 1, std::hypot(force.x, force.z)};
}

BarForce lift_of_bar(Obstacle bar, double section, int across,
                     const LevelSetMaker& make_level_set) {
  Shot shot = tank_shot(1);
  const double a = shot.fluid.spacing = 0.06 / across;
  const int side = 2 * across, depth = int(std::round(2.25 * across));
  shot.fluid.box.clear();
  shot.domain.max = V3d(side * a, 2 * depth * a, 6 * a);
  shot.domain.axis[2] = Axis::periodic;
  add_box(shot, V3d(0), {side, depth, 6});
  bar.position = V3d(side * a / 2, 0.06, 1.7 * a);  // ends within the domain if there are any
  shot.obstacle.push_back(bar);
  Stepper run(shot, make_level_set);
  const V3d force = mean_force(run) / (1000 * g * section * 6 * a);
  return {force.y - 1, force.x, force.z};
}

LevelSet cylinder(double radius, double voxel, double band) {
  LevelSet set;
  set.voxel = float(voxel), set.band = float(band);
  const int reach = int(std::ceil((radius + band) / (8 * voxel))) + 1, deep = 3;
  for (int k = 0; k < 3; ++k) {
    set.low[k] = k == 2 ? -deep : -reach;
    set.blocks[k] = -2 * set.low[k];
  }
  int made = 0;
  for (int bz = 0; bz < set.blocks[2]; ++bz) {
    for (int by = 0; by < set.blocks[1]; ++by) {
      for (int bx = 0; bx < set.blocks[0]; ++bx) {
        set.block.push_back(made++);
        for (int z = 0; z < 9; ++z)
          for (int y = 0; y < 9; ++y)
            for (int x = 0; x < 9; ++x) {
              const double r = std::hypot(8 * (set.low[0] + bx) + x, 8 * (set.low[1] + by) + y);
              set.value.push_back(float(std::clamp(r * voxel - radius, -band, band)));
            }
      }
    }
  }
  return set;
}

std::filesystem::path bounding_mesh(double radius, double half_width) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("drench_cylinder_" + std::to_string(radius) + ".obj");
  std::ofstream file(path);
  for (int k = 0; k < 8; ++k) {
    file << "v " << (k & 1 ? radius : -radius) << ' ' << (k & 2 ? radius : -radius) << ' '
         << (k & 4 ? half_width : -half_width) << '\n';
  }
  const int side[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                          {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
  for (const auto& s : side) {
    file << "f " << s[0] << ' ' << s[1] << ' ' << s[2] << '\n';
    file << "f " << s[0] << ' ' << s[2] << ' ' << s[3] << '\n';
  }
  return path;
}

}  // namespace drench::sim_tests

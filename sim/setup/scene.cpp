// The initial state: local frame, parameters, all sheets in one, and the checks across parts.

#include "sim/setup/scene.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "sim/neighbours/periodic.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/setup/cloth_shell.h"
#include "sim/setup/cloth_start.h"
#include "sim/setup/pin_report.h"
#include "sim/setup/probe_report.h"
#include "sim/setup/seam_strips.h"

namespace drench::sim {

float LocalFrame::to_local(int axis, double world) const {
  const double step = spacing / 65536;
  return float(std::round((world - origin[axis]) / step) * step);
}

float Scene::place(int axis, double world) const {
  const float local = frame.to_local(axis, world);
  if (!parameters.periodic[axis]) return local;
  return cpu::wrap(local, parameters.low[axis], parameters.high[axis]);
}

void Scene::set_drive(double time) {
  const V3d g = motion.gravity(time);
  set_gravity(parameters, {float(g.x), float(g.y), float(g.z)});
  parameters.carried = float(motion.carried(time));
}

namespace {

LocalFrame local_frame(const Shot& shot) {
  LocalFrame frame{{0, 0, 0}, shot.fluid.spacing};
  for (int k = 0; k < 3; ++k) {
    frame.origin[k] = std::floor(shot.domain.min[k] / frame.spacing + 1e-9) * frame.spacing;
  }
  return frame;
}

/// Sum of a^3 W over the part of a cubic lattice of spacing a with z >= low, for the density
/// kernel.
template <class Kernel>
double lattice_sum(double a, double h, int low) {
  const int reach = int(std::ceil(h / a));
  double sum = 0;
  for (int z = std::max(low, -reach); z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x)
        sum += Kernel::shape((x * x + y * y + z * z) * float(a * a), float(h));
    }
  }
  return sum * a * a * a * Kernel::factor(float(h));
}

/// Sets the two numbers that make a lattice stress-free inside and half a spacing before a wall.
template <class Kernel>
void calibrate(double a, double h, Parameters& p) {
  const double whole = lattice_sum<Kernel>(a, h, -1000), cut = lattice_sum<Kernel>(a, h, 0);
  const float q = float(0.5 * a / h);
  const float beyond = p.incompressible ? cpu::WendlandC2::halfspace(q) : cpu::spiky_halfspace(q);
  p.lattice_sum = float(whole);
  p.wall_scale = float((whole - cut) / whole) / beyond;
}

/// Of a keyed place, m/s.
double fastest(const Animated<V3d>& track, const Timeline& time) {
  double speed = 0;
  constexpr double part = 0.25;  // frames
  if (track.keys.size() < 2) return 0;
  for (double f = time.first; f < time.last; f += part)
    speed = std::max(speed, (track.at(f + part) - track.at(f)).length() / part * time.fps);
  return speed;
}

/// 10 sqrt(g H): about 1 % compression under the weight of the whole fall; impacts of speed v at
/// start count as the height v^2/2g they would have fallen.
double automatic_sound_speed(const Shot& shot, const InitialFluid& fluid,
                             const std::vector<MeshEmitter>& emitters, const FrameMotion& motion,
                             double obstacle_speed) {
  const V3d first = shot.gravity.keys.front().second;
  const double g = motion.moves() ? motion.largest_acceleration() : first.length();
  double speed2 = obstacle_speed * obstacle_speed, top = -1e300, bottom = 1e300;
  if (motion.moves()) speed2 = std::max(speed2, std::pow(motion.largest_speed(), 2));
  const V3d down = first.length() > 0 ? first / first.length() : V3d(0, -1, 0);
  const auto see = [&](const V3d& p, double speed) {
    speed2 = std::max(speed2, speed * speed);
    top = std::max(top, -p.dot(down)), bottom = std::min(bottom, -p.dot(down));
  };
  for (size_t i = 0; i < fluid.position.size(); ++i)
    see(fluid.position[i], fluid.velocity[i].length());
  for (const FluidEmitter& e : shot.fluid.emitter) {
    for (const auto& [frame, center] : e.center.keys)
      see(center, e.speed + fastest(e.center, shot.timeline));
  }
  for (const MeshEmitter& e : emitters) {
    const double fastest = e.fastest();
    for (const V3d& corner : e.corners()) see(corner, fastest);
  }
  for (const Cloth& c : shot.cloth) speed2 = std::max(speed2, c.velocity.length2());
  for (int k = 0; k < 3; ++k) {  // the floor, if gravity points at a wall
    if (std::abs(down[k]) < 0.5 || shot.domain.axis[k] != Axis::walls) continue;
    bottom = std::min(bottom, down[k] < 0 ? shot.domain.min[k] : -shot.domain.max[k]);
  }
  const double height = std::max(top - bottom, shot.fluid.spacing);
  return std::max(10 * std::sqrt(g * height + 0.5 * speed2), 1.0);
}

/// Is there as much fluid as there is room, with no side open and no way in?
bool fills_domain(const Shot& shot, const InitialFluid& fluid) {
  if (!shot.cloth.empty() || !shot.fluid.emitter.empty() || !shot.obstacle.empty() ||
      !shot.sink.empty())
    return false;
  for (const Axis axis : shot.domain.axis) {
    if (axis == Axis::open) return false;
  }
  const V3d cells = (shot.domain.max - shot.domain.min) / shot.fluid.spacing;
  return std::abs(double(fluid.position.size()) - cells.x * cells.y * cells.z) < 0.5;
}

/// Do the domain's walls hold the fluid? Automatic: where the layer that a wall brakes grows a
/// spacing thick within a second, or where a wall moves.
bool walls_hold(const Shot& shot) {
  const Domain& domain = shot.domain;
  if (domain.slip != Slip::automatic) return domain.slip == Slip::none;
  for (const V3d& v : domain.wall_velocity.all()) {
    if (v.length() > 0) return true;
  }
  return holds_fluid(shot, Slip::automatic);
}

void set_viscosity(const Shot& shot, Parameters& p) {
  p.no_slip = walls_hold(shot);
  const bool viscous = shot.fluid.kinematic_viscosity > 0;
  for (const Obstacle& o : shot.obstacle)
    p.no_slip_obstacles |= viscous && holds_fluid(shot, o.slip);
  for (const Cloth& c : shot.cloth) p.no_slip_sheets |= viscous && holds_fluid(shot, c.slip);
  const auto velocity = shot.domain.wall_velocity.all();
  for (int k = 0; k < 3; ++k) {
    for (int end = 0; end < 2; ++end) {
      for (int c = 0; c < 3; ++c)
        p.wall_velocity[k][end][c] = float(velocity[2 * size_t(k) + size_t(end)][c]);
    }
  }
}

void set_wetting(const Shot& shot, Parameters& p) {
  if (!p.incompressible || shot.fluid.surface_tension == 0) return;
  p.wetting = float(wetting_of(shot.domain.contact_angle_deg));
  for (const Axis axis : shot.domain.axis) p.wets |= axis == Axis::walls && p.wetting != 0;
  for (const Obstacle& o : shot.obstacle) p.wets |= wetting_of(o.contact_angle_deg) != 0;
  for (const Cloth& c : shot.cloth) p.wets |= wetting_of(c.contact_angle_deg) != 0;
}

/// m; 0 with sheets of springs.
float shell_margin_of(const Shot& shot) {
  double thickest = 0;
  for (const Cloth& c : shot.cloth) {
    if (c.model != ClothModel::shell) return 0;
    thickest = std::max(thickest, c.thickness);
  }
  return float(shell_wall_margin * thickest);
}

Parameters build_parameters(const Shot& shot, const LocalFrame& frame, const InitialFluid& fluid,
                            const std::vector<MeshEmitter>& emitters, const ObstacleSet& obstacles,
                            const FrameMotion& motion) {
  Parameters p;
  const double a = shot.fluid.spacing, h = a * support_ratio(shot);
  p.fluid = shot.fluid.present();
  p.spacing = float(a), p.support_radius = float(h);
  p.rest_density = float(shot.fluid.rest_density);
  p.particle_mass = float(shot.fluid.rest_density * a * a * a);
  const bool poly6 = shot.coupling.scheme == CouplingScheme::paper && !shot.cloth.empty();
  p.incompressible = p.fluid && is_incompressible(shot);
  p.tolerance = float(shot.fluid.tolerance), p.xsph = float(shot.fluid.xsph);
  p.incompressible ? calibrate<cpu::WendlandC2>(a, h, p)
  : poly6          ? calibrate<cpu::Poly6>(a, h, p)
                   : calibrate<cpu::Spiky>(a, h, p);
  const bool chosen = shot.fluid.sound_speed > 0 && !is_incompressible(shot);
  p.sound_speed =
      float(chosen ? shot.fluid.sound_speed
                   : automatic_sound_speed(shot, fluid, emitters, motion, obstacles.fastest()));
  p.obstacles = obstacles.count(), p.sinks = int(shot.sink.size());
  // Monaghan's alpha as the viscosity it amounts to in three dimensions, nu = alpha c h / 10, h his
  // smoothing length, half the support radius.
  const double numerical = shot.fluid.artificial_viscosity * p.sound_speed * 0.5 * h / 10;
  const double viscosity = p.incompressible ? shot.fluid.kinematic_viscosity
                                            : std::max(shot.fluid.kinematic_viscosity, numerical);
  p.dynamic_viscosity = float(shot.fluid.rest_density * viscosity);
  p.wall_viscosity = float(shot.fluid.rest_density * shot.fluid.kinematic_viscosity);
  for (int k = 0; k < 3; ++k) {
    p.origin[k] = frame.origin[k];
    p.low[k] = float(shot.domain.min[k] - frame.origin[k]);
    p.high[k] = float(shot.domain.max[k] - frame.origin[k]);
    p.wall[k] = shot.domain.axis[k] == Axis::walls;
    p.periodic[k] = shot.domain.axis[k] == Axis::periodic;
  }
  p.full = p.incompressible && fills_domain(shot, fluid);
  // In a closed domain gravity is the gradient of a pressure that no velocity feels. Left to the
  // solve, whose rows differ from packing to packing, it stirs a sealed tank of water to 1 m/s.
  const V3d g = motion.moves() ? motion.gravity(-shot.preroll) : shot.gravity.keys.front().second;
  set_gravity(p, {float(g.x), float(g.y), float(g.z)});
  p.turns = motion.turns();
  if (p.incompressible) set_viscosity(shot, p);
  if (shot.wind.present) {
    p.air_density = float(shot.wind.air_density);
    p.cloth_drag = float(shot.wind.cloth_drag), p.cloth_friction = float(shot.wind.cloth_friction);
    p.fluid_drag = float(shot.wind.fluid_drag);
  }
  p.surface_tension = float(shot.fluid.surface_tension);
  set_wetting(shot, p);
  p.paper = shot.coupling.scheme == CouplingScheme::paper;
  for (const Cloth& c : shot.cloth) {
    p.shells |= c.model == ClothModel::shell;
    p.wet_sheets |= is_ever_wet(c);
  }
  if (!p.fluid) p.shell_margin = shell_margin_of(shot);
  p.fixed_dt = shot.time_step;
  return p;
}

/// Largest eigenvalue of a symmetric positive 3x3 matrix by power iteration, from above by 1 %.
double largest_eigenvalue(const double (&m)[6]) {
  V3d v(0.57, 0.61, 0.55);
  double value = 0;
  for (int k = 0; k < 50; ++k) {
    const V3d w(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[1] * v.x + m[3] * v.y + m[4] * v.z,
                m[2] * v.x + m[4] * v.y + m[5] * v.z);
    value = w.length();
    if (value == 0) return 0;
    v = w / value;
  }
  return 1.01 * value;
}

double damping_of(const Sheet& sheet, const Sheet::Spring& s, const Cloth& cloth) {  // N s/m
  const double reduced = sheet.mass[s.a] * sheet.mass[s.b] / (sheet.mass[s.a] + sheet.mass[s.b]);
  return cloth.spring_damping * 2 * std::sqrt(s.stiffness * reduced) +
         cloth.retardation_time * s.stiffness;
}

/// Largest over the free vertices of the eigenvalue of sum_j 2 k e e^T over m, for stiffness or
/// damping k.
template <class Coefficient>
double largest_rate(const Sheet& sheet, const Coefficient& coefficient) {
  std::vector<std::array<double, 6>> block(sheet.point.size(), {0, 0, 0, 0, 0, 0});
  for (const Sheet::Spring& s : sheet.spring) {
    const V3d e = sheet.along(s).normalized();
    const double entry[6] = {e.x * e.x, e.x * e.y, e.x * e.z, e.y * e.y, e.y * e.z, e.z * e.z};
    for (int v : {s.a, s.b}) {
      for (int k = 0; k < 6; ++k) block[v][k] += 2 * coefficient(s) * entry[k];
    }
  }
  double largest = 0;
  for (size_t v = 0; v < block.size(); ++v) {
    double m[6];
    std::copy(block[v].begin(), block[v].end(), m);
    if (!sheet.pinned[v]) largest = std::max(largest, largest_eigenvalue(m) / sheet.mass[v]);
  }
  return largest;
}

/// (2 / omega) (sqrt(1 + xi^2) - xi), the limit of damped symplectic Euler, with omega^2 and 2 xi
/// omega bounded by largest_rate: exact, 4 (k_adj + k_diag) / m, on a square lattice. 0.7 leaves
/// room for rotated and stretched springs.
double cloth_dt_limit(const Sheet& sheet, const Cloth& cloth) {
  const double omega =
      std::sqrt(largest_rate(sheet, [](const Sheet::Spring& s) { return s.stiffness; }));
  if (omega == 0) return 1e30;
  const double xi =
      largest_rate(sheet, [&](const Sheet::Spring& s) { return damping_of(sheet, s, cloth); }) /
      (2 * omega);
  return 0.7 * 2 / omega * (std::sqrt(1 + xi * xi) - xi);
}

/// Compressed rows: entries of row r stand at [start[r], start[r + 1]).
template <class T>
void to_rows(const std::vector<std::vector<T>>& rows, std::vector<int>& start,
             std::vector<T>& flat) {
  start.assign(1, 0);
  for (const std::vector<T>& row : rows) {
    flat.insert(flat.end(), row.begin(), row.end());
    start.push_back(int(flat.size()));
  }
}

/// Lengths are those of the snapped places: differences of world coordinates would depend on where
/// the shot stands.
void append_springs(const Sheet& sheet, const Cloth& cloth, const LocalFrame& frame,
                    ClothTopology& t, int base) {
  struct End {
    int vertex;
    float length, stiffness, damping;
    V3d shift;  // m
  };
  std::vector<std::vector<End>> rows(sheet.point.size());
  const auto local = [&](int node) {
    const V3d& p = sheet.rest[sheet.point[size_t(node)]];
    return V3d(frame.to_local(0, p.x), frame.to_local(1, p.y), frame.to_local(2, p.z));
  };
  for (const Sheet::Spring& s : sheet.spring) {
    const V3d shift = V3d(s.image) * sheet.period;
    const double length = (local(s.b) + shift - local(s.a)).length();
    const double damping = damping_of(sheet, s, cloth);
    rows[s.a].push_back({s.b + base, float(length), float(s.stiffness), float(damping), shift});
    rows[s.b].push_back({s.a + base, float(length), float(s.stiffness), float(damping), -shift});
  }
  if (t.spring_start.empty()) t.spring_start.push_back(0);
  for (const auto& row : rows) {
    for (const End& e : row) {
      t.spring_end.push_back(e.vertex), t.rest_length.push_back(e.length);
      t.stiffness.push_back(e.stiffness), t.spring_damping.push_back(e.damping);
      t.spring_shift.push(float(e.shift.x), float(e.shift.y), float(e.shift.z));
    }
    t.spring_start.push_back(int(t.spring_end.size()));
  }
}

/// Triangles across the edges ab, bc, ca of each triangle; -1 at free edges, whose vertices are
/// rim.
void append_neighbours(const Sheet& sheet, ClothTopology& t, int base_triangle) {
  std::unordered_map<uint64_t, int> of_edge;
  const auto key = [](uint32_t a, uint32_t b) { return uint64_t(a) << 32 | b; };
  const auto node = [&](size_t k, int c) { return uint32_t(sheet.node[sheet.triangle[k][c % 3]]); };
  for (size_t k = 0; k < sheet.triangle.size(); ++k) {
    for (int c = 0; c < 3; ++c) of_edge[key(node(k, c), node(k, c + 1))] = int(k);
  }
  const size_t first = t.rim.size();
  t.rim.resize(first + sheet.point.size(), 0);
  for (size_t k = 0; k < sheet.triangle.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      const uint32_t a = node(k, c), b = node(k, c + 1);
      const auto other = of_edge.find(key(b, a));
      t.neighbour.push_back(other == of_edge.end() ? -1 : other->second + base_triangle);
      if (other == of_edge.end()) t.rim[first + a] = t.rim[first + b] = 1;
    }
  }
}

WetLaw wet_law(const Cloth& cloth) {
  const bool wet = is_ever_wet(cloth);
  return {.uptake = wet ? float(cloth.water_capacity / cloth.areal_density) : 0.f,
          .soak_time = float(cloth.soak_time),
          .dry_time = float(cloth.dry_time),
          .soaks = cloth.soaks,
          .stiffness = wet ? float(cloth.wet_modulus_ratio) : 1.f,
          .friction = float(cloth.friction),
          .wet_friction = float(wet ? cloth.wet_friction : cloth.friction)};
}

/// Images across seams are not looked for: a sheet that is joined to itself meets none.
bool meets_sheets(const Cloth& cloth, const Sheet& sheet) {
  return cloth.model == ClothModel::shell && cloth.self_collision && !sheet.joined();
}

void append_sheet(const Sheet& sheet, const Cloth& cloth, int index, const LocalFrame& frame,
                  const Shot& shot, Scene& scene) {
  ClothTopology& t = scene.cloth;
  const int base = t.vertices(), base_triangle = t.triangles();
  append_springs(sheet, cloth, frame, t, base);
  append_neighbours(sheet, t, base_triangle);
  std::vector<std::vector<int>> fan(sheet.point.size());
  V3d spanned(0);
  for (size_t k = 0; k < sheet.triangle.size(); ++k) {
    V3d centre(0);
    for (int c = 0; c < 3; ++c) {
      const uint32_t v = sheet.triangle[k][c];
      t.corner.push_back(sheet.node[v] + base);
      const V3d shift = V3d(sheet.image[v]) * sheet.period;
      t.corner_shift.push(float(shift.x), float(shift.y), float(shift.z));
      for (int axis = 0; axis < 3; ++axis)
        if (sheet.image[v][axis] != 0) spanned[axis] = sheet.period[axis];
      fan[size_t(sheet.node[v])].push_back(3 * (int(k) + base_triangle) + c);
      centre += sheet.rest[v] / 3;
    }
    t.sheet.push_back(index);
    t.half_thickness.push_back(float(0.5 * cloth.thickness));
    t.no_slip.push_back(holds_fluid(shot, cloth.slip) ? 1.f : 0.f);
    t.wetting.push_back(float(wetting_of(cloth.contact_angle_deg)));
    t.rest_centroid.push(float(centre.x - frame.origin[0]), float(centre.y - frame.origin[1]),
                         float(centre.z - frame.origin[2]));
  }
  t.rest_period.push(float(spanned.x), float(spanned.y), float(spanned.z));
  std::vector<int> start, flat;
  to_rows(fan, start, flat);
  const int offset = int(t.fan_entry.size());
  if (t.fan_start.empty()) t.fan_start.push_back(0);
  for (size_t r = 1; r < start.size(); ++r) t.fan_start.push_back(start[r] + offset);
  t.fan_entry.insert(t.fan_entry.end(), flat.begin(), flat.end());
  const bool meets = meets_sheets(cloth, sheet);  // asks all vertices
  for (size_t v = 0; v < sheet.point.size(); ++v) {
    double third = 0;
    for (const int entry : fan[v]) {
      const auto& k = sheet.triangle[size_t(entry / 3 - base_triangle)];
      const V3d a = sheet.rest[k[0]];
      third += (sheet.rest[k[1]] - a).cross(sheet.rest[k[2]] - a).length() / 6;
    }
    const V3d& rest = sheet.rest[sheet.point[v]];
    t.rest.push(frame.to_local(0, rest.x), frame.to_local(1, rest.y), frame.to_local(2, rest.z));
    t.meets_sheets.push_back(meets);
    t.friction.push_back(float(cloth.friction));
    t.air_share.push_back(float(sheet.mass[v] / (cloth.areal_density * third)));
    t.mass.push_back(float(sheet.mass[v]));
    t.inverse_mass.push_back(sheet.pinned[v] ? 0.f : float(1 / sheet.mass[v]));
    t.damping_rate.push_back(float(cloth.damping));
    const V3d p = sheet.position[sheet.point[v]], u = sheet.pinned[v] ? V3d(0) : cloth.velocity;
    scene.start.cloth_position.push(frame.to_local(0, p.x), frame.to_local(1, p.y),
                                    frame.to_local(2, p.z));
    scene.start.cloth_velocity.push(float(u.x), float(u.y), float(u.z));
    if (scene.parameters.wet_sheets) scene.start.cloth_wetness.push_back(float(cloth.wetness));
  }
}

/// Of sides that are open, which drop what is more than a spacing beyond.
bool is_outside(const Domain& domain, const V3d& p, double spacing) {
  for (int k = 0; k < 3; ++k) {
    const bool open = domain.axis[size_t(k)] == Axis::open;
    if (open && (p[k] < domain.min[k] - spacing || p[k] > domain.max[k] + spacing)) return true;
  }
  return false;
}

/// Whether a point lies in a sink that is there from the start.
bool drains_at_once(const Shot& shot, Scene& scene, const V3d& p) {
  for (int k = 0; k < scene.sinks.count(); ++k) {
    if (shot.sink[size_t(k)].start > 0) continue;
    if (scene.sinks.distance_to(k, p, -shot.preroll) < 0) return true;
  }
  return false;
}

/// The first state of the fluid: what its sources have, less what starts in obstacles.
void place_fluid(const Shot& shot, const InitialFluid& fluid, Scene& scene) {
  HostState& start = scene.start;
  scene.report.source = fluid.report;
  std::vector<std::vector<size_t>> lost(fluid.report.size(),
                                        std::vector<size_t>(shot.obstacle.size(), 0));
  for (size_t i = 0; i < fluid.position.size(); ++i) {
    const V3d p = fluid.position[i], u = fluid.velocity[i];
    const auto source = size_t(fluid.source[i]);
    const int obstacle = obstacle_in_the_way(scene.obstacles, p, -shot.preroll, shot.fluid.spacing);
    if (obstacle >= 0) {
      ++scene.inside_obstacles, ++lost[source][size_t(obstacle)];
      continue;
    }
    start.position.push(scene.place(0, p.x), scene.place(1, p.y), scene.place(2, p.z));
    start.velocity.push(float(u.x), float(u.y), float(u.z));
    scene.births.add({int(start.id.size()), fluid.source[i], -shot.preroll});
    start.id.push_back(int(start.id.size()));
    const bool outside = is_outside(shot.domain, p, shot.fluid.spacing);
    ++(outside ? scene.report.source[source].outside : scene.report.source[source].kept);
    scene.report.source[source].drained += !outside && drains_at_once(shot, scene, p);
  }
  for (size_t s = 0; s < lost.size(); ++s) {
    for (size_t k = 0; k < lost[s].size(); ++k) {
      if (lost[s][k] > 0)
        scene.report.source[s].lost.push_back({shot.obstacle[k].name, lost[s][k]});
    }
  }
  check_sources_start(shot, scene.report);
  start.memory_triangle.assign(start.id.size(), -1);
  start.memory_side.assign(start.id.size(), 1);
  start.owed.resize(start.id.size());
}

/// Pins that do more than hold where a sheet starts, and what sews sheets.
void tie_sheets(const Shot& shot, Scene& scene) {
  scene.pins = ClothPins(shot, scene);
  scene.sewing = Sewing(shot, scene);
  if (scene.parameters.fluid) scene.cloth.strips = seam_strips(scene.cloth, shot.fluid.spacing);
  Parameters& p = scene.parameters;
  p.ties = scene.pins.any() || !scene.cloth.seam.empty();
  // As automatic_sound_speed, which does not know the sheets yet.
  const double speed = scene.pins.fastest();
  if (speed > 0)
    p.sound_speed = float(std::sqrt(double(p.sound_speed) * p.sound_speed + 50 * speed * speed));
}

void place_sheets(const Shot& shot, Scene& scene) {
  double dt_limit = 1e30;
  for (size_t s = 0; s < shot.cloth.size(); ++s) {
    scene.sheet.push_back(build_sheet(shot.cloth[s], seams_of(shot)));
    scene.first_vertex.push_back(scene.cloth.vertices());
    scene.first_triangle.push_back(scene.cloth.triangles());
    if (scene.parameters.wet_sheets) scene.cloth.wet.push_back(wet_law(shot.cloth[s]));
    append_sheet(scene.sheet.back(), shot.cloth[s], int(s), scene.frame, shot, scene);
    if (scene.parameters.shells)
      append_shell(scene.sheet.back(), shot.cloth[s], scene.frame, scene.cloth);
    dt_limit = std::min(dt_limit, cloth_dt_limit(scene.sheet.back(), shot.cloth[s]));
  }
  scene.first_vertex.push_back(scene.cloth.vertices());
  scene.first_triangle.push_back(scene.cloth.triangles());
  if (std::none_of(scene.sheet.begin(), scene.sheet.end(),
                   [](const Sheet& sheet) { return sheet.joined(); })) {
    ClothTopology& t = scene.cloth;
    t.corner_shift = t.spring_shift = t.rest_period = {};
    t.shell.push_x = t.shell.push_y = t.shell.push_z = {};
    t.shell.patch.shift_x = t.shell.patch.shift_y = t.shell.patch.shift_z = {};
  }
  if (!scene.cloth.shell.patch.used) scene.cloth.shell.patch = {};
  tie_sheets(shot, scene);
  // Images across seams are not looked for.
  const std::vector<char>& meets = scene.cloth.meets_sheets;
  scene.parameters.self_contact =
      std::any_of(meets.begin(), meets.end(), [](char c) { return c != 0; }) &&
      sheets_are_implicit(scene.parameters);
  // The implicit step of the sheets has no limit.
  scene.parameters.cloth_dt_limit =
      sheets_are_implicit(scene.parameters) ? 1e30f : float(std::min(dt_limit, 1e-3));
}

}  // namespace

int obstacle_in_the_way(ObstacleSet& obstacles, const V3d& point, double time, double spacing) {
  if (obstacles.count() == 0) return -1;
  const ObstacleSet::Nearest nearest = obstacles.nearest(point, time);
  return nearest.distance > 0.499 * spacing ? -1 : nearest.obstacle;
}

Scene build_scene(const Shot& shot, const LevelSetMaker& make_level_set) {
  if (!shot.fluid.present() && shot.cloth.empty()) {
    throw Error(shot.file.string() +
                ": there is nothing to simulate. Add a [[fluid.box]] or a [[cloth]]");
  }
  Scene scene;
  scene.frame = local_frame(shot);
  const InitialFluid fluid =
      shot.fluid.present() ? initial_fluid(shot, make_level_set) : InitialFluid{};
  scene.overlapping = fluid.overlapping;
  scene.obstacles = ObstacleSet(shot, scene.frame, make_level_set);
  if (shot.wind.present) scene.wind = Wind(shot, scene.frame);
  scene.sinks = sinks_of(shot, scene.frame, make_level_set);
  scene.mesh_emitter = mesh_emitters(shot, make_level_set);
  scene.motion = FrameMotion(shot, scene.frame);
  scene.parameters =
      build_parameters(shot, scene.frame, fluid, scene.mesh_emitter, scene.obstacles, scene.motion);
  scene.obstacles.set_images(ObstacleImages(scene.parameters));
  note_meshes(shot, scene);
  note_sinks(shot, scene);
  note_probes(shot, scene);
  place_fluid(shot, fluid, scene);
  place_sheets(shot, scene);
  scene.rest = SheetRest(shot, scene);
  note_cloth(shot, scene);
  note_pins(shot, scene);
  check_cloth_start(shot, scene);
  complete_report(shot, scene);
  return scene;
}

}  // namespace drench::sim

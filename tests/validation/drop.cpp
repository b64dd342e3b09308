#include "tests/validation/drop.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/neighbours/sph_kernels.h"
#include "tests/sim/support.h"

namespace drench::validation {

namespace {

using sim_tests::Stepper;

constexpr double sigma = 0.072, rho = 1000, R = 0.01;  // N/m, kg/m^3, m
constexpr int long_cells = 8;                          // of a cylinder, along its axis
constexpr double pi = 3.14159265358979323846;

Shot weightless(double spacing) {
  Shot shot = sim_tests::empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = spacing, shot.fluid.surface_tension = sigma;
  shot.domain.min = V3d(-10 * R), shot.domain.max = V3d(10 * R);
  return shot;
}

/// A ball, or a piece of a cylinder along z.
struct Body {
  double radius, omega, jump;  // m; rad/s, of mode 2; Pa
  bool cylinder;

  V3d across(V3d x) const { return cylinder ? V3d(x.x, x.y, 0) : x; }
};

/// Radius of a ball of the particles' volume, m.
double radius_of(const sim::Scene& scene) {
  const double volume =
      double(scene.start.id.size()) * std::pow(double(scene.parameters.spacing), 3);
  return std::cbrt(3 * volume / (4 * pi));
}

double rayleigh(double radius) { return std::sqrt(8 * sigma / (rho * std::pow(radius, 3))); }

Body ball_of(const sim::Scene& scene) {
  const double radius = radius_of(scene);
  return {radius, rayleigh(radius), 2 * sigma / radius, false};
}

/// Rayleigh 1879, n = 2 in a plane: omega^2 = n (n^2 - 1) sigma / (rho R^3).
Body cylinder_of(const sim::Scene& scene) {
  const double a = scene.parameters.spacing;
  const double radius = a * std::sqrt(double(scene.start.id.size()) / (long_cells * pi));
  return {radius, std::sqrt(6 * sigma / (rho * std::pow(radius, 3))), sigma / radius, true};
}

/// Speeds scaled by `share` after every step: a lattice settles.
void settle(Stepper& run, double seconds, double share) {
  for (const double end = run.time + seconds; run.time < end;) {
    run.step();
    sim::HostState state = run.solver->save();
    for (auto* v : {&state.velocity.x, &state.velocity.y, &state.velocity.z})
      for (float& f : *v) f *= float(share);
    run.solver->load(state);
  }
}

/// Particles more than 1.5 supports below the surface; of a cylinder in the middle of its length.
std::vector<size_t> inner(const Stepper& run, const sim::HostState& state, const Body& body) {
  std::vector<size_t> inside;
  const V3d centre = sim_tests::centre_of_mass(state);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d off = sim_tests::at(state.position, i) - centre;
    const double h = run.scene.parameters.support_radius, a = run.scene.parameters.spacing;
    if (body.across(off).length() > body.radius - 1.5 * h) continue;
    if (!body.cylinder || std::abs(off.z) < 0.5 * long_cells * a - h) inside.push_back(i);
  }
  return inside;
}

/// What q does to a volume over rho^2 q, as InnerSensor of probe_pressure.h has it: a third of the
/// sums' answer to dilation.
double response(const Stepper& run, const sim::HostState& state,
                const std::vector<size_t>& inside) {
  const sim::Parameters& p = run.scene.parameters;
  const double h = p.support_radius, scale = p.particle_mass / p.lattice_sum / std::pow(h, 5) / rho;
  double sum = 0;
  for (const size_t i : inside) {
    for (size_t j = 0; j < state.id.size(); ++j) {
      const double r2 =
          (sim_tests::at(state.position, j) - sim_tests::at(state.position, i)).length2();
      if (r2 < h * h)
        sum += scale * sim::cpu::WendlandC2::slope(float(1 - std::sqrt(r2) / h)) * r2 / 3;
    }
  }
  return sum / double(inside.size());
}

void measure_rest(Stepper& run, const Body& body, Drop& drop) {
  const double radius = body.radius, omega = body.omega;
  double pressure = 0, square = 0;
  int count = 0;
  sim::HostState state = run.solver->save();
  for (const double end = run.time + 2 * pi / omega; run.time < end; ++count) {
    run.step();
    state = run.solver->save();
    const std::vector<size_t> inside = inner(run, state, body);
    double q = 0;
    for (const size_t i : inside) q += state.pressure_term[i];
    pressure += rho * rho * q / double(inside.size());
    V3d sum(0);
    double speed2 = 0;
    for (size_t i = 0; i < state.id.size(); ++i) {
      const V3d v = sim_tests::at(state.velocity, i);
      sum += v, speed2 += v.length2();
    }
    const double n = double(state.id.size());
    square += speed2 / n;
    drop.momentum = std::max(drop.momentum, sum.length() / (n * radius * omega));
  }
  pressure *= response(run, state, inner(run, state, body)) / count;
  drop.jump = pressure / body.jump;
  drop.current = std::sqrt(square / count) / (radius * omega);
}

/// Second moment along z less the mean of the others, over that of a ball; of a cylinder along y
/// less that along x.
double elongation(const sim::HostState& state, const Body& body) {
  const V3d centre = sim_tests::centre_of_mass(state);
  V3d moment(0);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d x = sim_tests::at(state.position, i) - centre;
    moment += V3d(x.x * x.x, x.y * x.y, x.z * x.z);
  }
  const double long_one =
      body.cylinder ? moment.y - moment.x : moment.z - 0.5 * (moment.x + moment.y);
  return long_one / double(state.id.size()) / (0.2 * body.radius * body.radius);
}

/// Set going by the velocity of mode 2, (-x, -y, 2 z) or (-x, y); the period is that between the
/// first and the third time that it passes through the round shape.
void measure_period(Stepper& run, const Body& body, Drop& drop) {
  const double omega = body.omega;
  sim::HostState state = run.solver->save();
  const V3d centre = sim_tests::centre_of_mass(state);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d v = (sim_tests::at(state.position, i) - centre) * (0.1 * omega);
    state.velocity.x[i] = float(body.cylinder ? -v.x : -0.5 * v.x);
    state.velocity.y[i] = float(body.cylinder ? v.y : -0.5 * v.y);
    state.velocity.z[i] = body.cylinder ? 0.f : float(v.z);
  }
  run.solver->load(state);
  const double start = run.time, limit = start + 5 * pi / omega;
  std::vector<double> crossing, extreme(1, 0.);
  double last = 0, before = run.time;
  while (crossing.size() < 3 && run.time < limit) {
    before = run.time;
    run.step();
    const double now = elongation(run.solver->save(), body);
    extreme.back() = std::max(extreme.back(), std::abs(now));
    if (run.time > start + 0.3 / omega && last * now < 0) {
      crossing.push_back(before + (run.time - before) * last / (last - now));
      extreme.push_back(0);
    }
    last = now;
  }
  drop.period = crossing.size() < 3 ? 1e30 : (crossing[2] - crossing[0]) * omega / (2 * pi);
  drop.kept = extreme.size() < 3 ? 0 : extreme[2] / extreme[0];
}

Drop measure(Stepper& run, const Body& body) {
  Drop drop;
  drop.particles = int(run.scene.start.id.size());
  settle(run, 0.8 * 2 * pi / body.omega, 0.95);
  measure_rest(run, body, drop);
  measure_period(run, body, drop);
  return drop;
}

/// A cylinder along z, from 0 to `length`, m, between what its ends stand on.
Shot between(Ends ends, double spacing, double length) {
  Shot shot = weightless(spacing);
  const double wide = 3 * R, thick = 0.2 * spacing;
  shot.domain.min.z = ends == Ends::walls || ends == Ends::periodic ? 0 : -wide;
  shot.domain.max.z = length - shot.domain.min.z;
  if (ends == Ends::walls) shot.domain.axis[2] = Axis::walls;
  if (ends == Ends::periodic) shot.domain.axis[2] = Axis::periodic;
  for (const int side : {-1, 1}) {
    const double face = side < 0 ? 0 : length;
    if (ends == Ends::boxes) {
      Obstacle slab;
      slab.type = ObstacleType::box, slab.size = V3d(2 * wide, 2 * wide, wide);
      slab.position = V3d(0, 0, face + side * wide / 2);
      slab.name = side < 0 ? "lower" : "upper";
      shot.obstacle.push_back(slab);
    }
    if (ends == Ends::sheets) {
      Cloth sheet;
      sheet.name = side < 0 ? "lower" : "upper", sheet.thickness = thick;
      sheet.corner = V3d(-wide / 2, -wide / 2, face + side * thick / 2);
      sheet.u = V3d(wide, 0, 0), sheet.v = V3d(0, wide, 0), sheet.cells = V2i(12, 12);
      ClothPin all;
      for (uint32_t v = 0; v < 13 * 13; ++v) all.vertices.push_back(v);
      sheet.pin.push_back(all);
      shot.cloth.push_back(sheet);
    }
  }
  return shot;
}

/// The lattice points within the radius, in place of the sources' particles. Shaken: straight rows
/// along the axis would stay.
sim::HostState cylinder_of_particles(const sim::Scene& scene) {
  sim::HostState start;
  start.cloth_position = scene.start.cloth_position;
  start.cloth_velocity = scene.start.cloth_velocity;
  const double a = scene.parameters.spacing;
  const int reach = int(R / a) + 1;
  sim_tests::Random random(7);
  const auto shake = [&] { return 0.3 * (random() - 0.5); };
  for (int k = 0; k < long_cells; ++k) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        if (V3d(x + 0.13, y + 0.1, 0).length() * a > R) continue;
        const V3d p = V3d(x + 0.13 + shake(), y + 0.1 + shake(), k + 0.5 + shake()) * a;
        start.position.push(scene.frame.to_local(0, p.x), scene.frame.to_local(1, p.y),
                            scene.frame.to_local(2, p.z));
        start.velocity.push(0, 0, 0), start.owed.push(0, 0, 0);
        start.id.push_back(int(start.id.size()));
        start.memory_triangle.push_back(-1), start.memory_side.push_back(1);
      }
    }
  }
  return start;
}

}  // namespace

Drop oscillating_drop(double radius_in_spacings) {
  Shot shot = weightless(R / radius_in_spacings);
  FluidSphere ball;
  ball.center = V3d(0.00013, 0.0001, 0.00007), ball.radius = R;  // no symmetry with the lattice
  shot.fluid.sphere = {ball};
  Stepper run(shot);
  return measure(run, ball_of(run.scene));
}

Drop oscillating_cylinder(double radius_in_spacings, Ends ends) {
  const double a = R / radius_in_spacings;
  Shot shot = between(ends, a, long_cells * a);
  sim_tests::add_box(shot, V3d(0), {1, 1, long_cells});
  sim::Scene scene = sim::build_scene(shot, {});
  scene.start = cylinder_of_particles(scene);
  Stepper run(std::move(scene));
  return measure(run, cylinder_of(run.scene));
}

Rounding cube_to_sphere(int side) {
  const double a = R / side;
  Shot shot = weightless(a);
  sim_tests::add_box(shot, V3d(0), {side, side, side});
  Stepper run(shot);
  const double radius = radius_of(run.scene);
  const auto farthest = [&](const sim::HostState& state) {
    double most = 0;
    const V3d middle = sim_tests::centre_of_mass(state);
    for (size_t i = 0; i < state.id.size(); ++i) {
      most = std::max(most, (sim_tests::at(state.position, i) - middle).length());
    }
    return (most + 0.5 * a) / radius;
  };
  Rounding result;
  result.start = farthest(run.scene.start);
  run.advance(4 * 2 * pi / rayleigh(radius));
  const sim::HostState state = run.solver->save();
  result.farthest = farthest(state);
  const V3d centre = sim_tests::centre_of_mass(state);
  V3d extent(0);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d x = sim_tests::at(state.position, i) - centre;
    extent += V3d(x.x * x.x, x.y * x.y, x.z * x.z);
  }
  double low = 1e30, high = 0, mean = 0;
  for (int k = 0; k < 3; ++k) {
    const double e = std::sqrt(extent[k]);
    low = std::min(low, e), high = std::max(high, e), mean += e / 3;
  }
  result.spread = (high - low) / mean;
  return result;
}

namespace {

/// deg, of a cap of this volume: h from V = pi h^2 (3 R - h) / 3, cos = 1 - h / R.
double angle_by_height(double volume, double height) {
  const double radius = (3 * volume / (pi * height * height) + height) / 3;
  return std::acos(std::clamp(1 - height / radius, -1., 1.)) * 180 / pi;
}
/// The same from how high its centre of mass stands, 3 (2 R - h)^2 / (4 (3 R - h)) above the
/// sphere's centre, by halving.
double angle_by_centre(double volume, double centre) {
  double low = 1, high = 179;
  for (int k = 0; k < 60; ++k) {
    const double angle = 0.5 * (low + high), c = std::cos(angle * pi / 180);
    const double r = std::cbrt(3 * volume / (pi * (2 + c) * (1 - c) * (1 - c))), h = r * (1 - c);
    const double off = 3 * std::pow(2 * r - h, 2) / (4 * (3 * r - h));  // from the sphere's centre
    (off - (r - h) < centre ? low : high) = angle;
  }
  return low;
}

/// On y = 0; on a wall of the domain a block of that volume.
Shot half_a_ball(double size, double spacing, double angle_deg, Ground ground) {
  Shot shot = weightless(spacing);
  shot.fluid.kinematic_viscosity = 3e-4;
  if (ground == Ground::wall) {
    shot.domain.axis[1] = Axis::walls, shot.domain.min.y = 0;
    shot.domain.slip = Slip::free, shot.domain.contact_angle_deg = angle_deg;
    const int wide = int(std::round(1.6 * size / spacing));
    sim_tests::add_box(shot, V3d(-0.5 * wide * spacing, 0, -0.5 * wide * spacing),
                       {wide, (wide + 1) / 2, wide});
    return shot;
  }
  shot.fluid.sphere.push_back({V3d(0), size});
  if (ground == Ground::plane) {
    Obstacle& plane = shot.obstacle.emplace_back();
    plane.type = ObstacleType::plane, plane.slip = Slip::free, plane.contact_angle_deg = angle_deg;
    return shot;
  }
  shot.fluid.sphere.clear();
  const int wide = int(std::round(1.6 * size / spacing));
  sim_tests::add_box(shot, V3d(-0.5 * wide, 0.1, -0.5 * wide) * spacing,
                     {wide, (wide + 1) / 2, wide});
  Cloth& sheet = sim_tests::add_sheet(shot, 6 * size, -0.05 * spacing, 12);
  sheet.thickness = 0.1 * spacing, sheet.slip = Slip::free, sheet.contact_angle_deg = angle_deg;
  ClothPin all;
  for (uint32_t v = 0; v < 13 * 13; ++v) all.vertices.push_back(v);
  sheet.pin.push_back(all);
  return shot;
}

}  // namespace

Sessile sessile_drop(double radius, double angle_deg, Ground ground) {
  const double size = 0.005, a = size / radius, unit = 2 * pi / rayleigh(size);
  const Shot shot = half_a_ball(size, a, angle_deg, ground);
  Stepper run(shot);
  Sessile result;
  V3d given(0);
  const double volume = double(run.solver->particles()) * a * a * a;
  double mean_centre = 0, mean_height = 0, time = 0, square = 0;
  while (run.time < 6 * unit) {
    run.step();
    for (const sim::ObstacleImpulse& to : run.solver->obstacle_impulses())
      given += V3d(to.impulse[0], to.impulse[1], to.impulse[2]);
    if (run.time < 5 * unit) continue;
    const sim::HostState state = run.solver->save();
    double centre = 0, top = -1, n = double(state.id.size());
    const double dt = run.limits.step;
    for (size_t i = 0; i < state.id.size(); ++i) {
      const double y = run.scene.frame.to_world(1, state.position.y[i]);
      centre += y / n, top = std::max(top, y);
      square += sim_tests::at(state.velocity, i).length2() / n * dt;
    }
    mean_centre += centre * dt, mean_height += (top + a / 2) * dt, time += dt;
  }
  result.by_centre = angle_by_centre(volume, mean_centre / time);
  result.by_height = angle_by_height(volume, mean_height / time);
  const double speed = size * rayleigh(size);
  result.speed = std::sqrt(square / time) / speed;
  const sim::HostState state = run.solver->save();
  const double mass = run.scene.parameters.particle_mass * double(state.id.size());
  result.lost = (sim_tests::total_momentum(run.scene, state) + given).length() / (mass * speed);
  result.particles = run.solver->particles();
  for (size_t i = 0; i < state.id.size(); ++i)
    result.away += V3d(run.scene.frame.to_world(0, state.position.x[i]),
                       run.scene.frame.to_world(1, state.position.y[i]),
                       run.scene.frame.to_world(2, state.position.z[i]))
                       .length() > 3 * size;
  return result;
}

}  // namespace drench::validation

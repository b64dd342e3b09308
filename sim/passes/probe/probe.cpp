#include "sim/passes/probe/probe.h"

#include "sim/passes/probe/probe_height.h"
#include "sim/passes/probe/probe_pressure.h"
#include "sim/passes/probe/probe_sensor.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

HalfDensity half_density(const Parameters& p, const ProbeQuery& query) {
  const float h = p.support_radius;
  float half = 0.5f * p.rest_density;
  for (const int k : {0, 2}) {
    const float below = (query.place[k] - p.low[k]) / h, above = (p.high[k] - query.place[k]) / h;
    if (p.wall[k]) {
      half *= 1.f - WendlandC2::halfspace(minimum(max0(below), 1.f)) -
              WendlandC2::halfspace(minimum(max0(above), 1.f));
    }
  }
  return {half, p.low[1], p.high[1], h, p.wall[1]};
}

/// m local; NaN where no fluid reaches half of rest density over the line. From the top down in
/// steps of a quarter support, then once more in fifteenths of the step that crosses it.
double surface_height(const State& state, const ProbeQuery& query) {
  const Parameters& p = state.parameters;
  const HalfDensity enough = half_density(p, query);
  const float h = p.support_radius;
  LineDensity line{.position = state.fluid.position.view(),
                   .x = query.place[0],
                   .z = query.place[2],
                   .from = 1e30f,
                   .step = 0.25f * h,
                   .h = h,
                   .scale = p.particle_mass / (h * h * h),
                   .period = periods_of(p)};
  bool fine = false;
  while (true) {
    const LineSamples s = parallel_reduce(state.queue, "probe: height", state.fluid.count,
                                          LineSamples{}, line, AddLineSamples{});
    int k = 0;
    while (k < height_samples && s.density[k] < enough(line.from - float(k) * line.step)) ++k;
    if (k < height_samples && fine) {
      if (k == 0) return line.from;
      const float y = line.from - float(k) * line.step;
      const float above = enough(y + line.step) - s.density[k - 1], at = s.density[k] - enough(y);
      return double(y) + double(line.step) * at / (at + above);
    }
    if (k < height_samples) {
      line.from -= float(std::max(k - 1, 0)) * line.step;
      line.step /= float(height_samples - 1);
      fine = true;
    } else if (!fine && s.next > -1e30f) {
      line.from = s.next;
    } else {
      return std::numeric_limits<double>::quiet_NaN();
    }
  }
}

StepPressure step_pressure_of(const State& state) {
  const Parameters& p = state.parameters;
  const FluidState& f = state.fluid;
  const bool projected = p.incompressible;
  const float h = p.support_radius, h4 = h * h * h * h;
  // As in pressure_rows.h; the spiky gradient is 45 / (pi h^6) (h - r)^2.
  const float gradient = projected ? 1.f / (p.lattice_sum * h4 * h) : 45.f / (pi * h4 * h);
  return {.position = f.position.view(),
          .velocity = f.velocity.view(),
          .acceleration = f.acceleration.view(),
          .term = f.pressure_term.data(),
          .inverse_density = projected ? nullptr : f.inverse_density.data(),
          .predicted = projected ? state.pressure.place.data() : nullptr,
          .correction = projected ? state.pressure.correction.data() : nullptr,
          .correction_cross = projected ? state.pressure.correction_cross.data() : nullptr,
          .dt = float(state.dt),
          .h = h,
          .mass = p.particle_mass,
          .rest_density = p.rest_density,
          .wall_viscosity = p.wall_viscosity,
          .pair_scale = p.particle_mass / p.rest_density * gradient,
          .walls = halfspace_walls_of(p)};
}

BodyParts body_parts_of(const State& state) {
  return {.step = step_pressure_of(state),
          .image = image_walls_of(state.parameters),
          .law = obstacle_density_of(state.parameters),
          .obstacles = state.obstacles.views(),
          .rows = cloth_rows(state),
          .normal = state.fluid.normal.view()};
}

/// Sum of f(particle, row) over all particles, each once.
template <int N, class F>
Totals<N> sum_by_particle(const char* name, const State& state, const F& f) {
  const bool near = state.parameters.incompressible && state.contact.near > 0;
  const Totals<N> away =
      parallel_reduce(state.queue, name, state.fluid.count, Totals<N>{},
                      AwayFromCloth<N, F>{f, near ? state.fluid.triangle.data() : nullptr}, Plus{});
  if (!near) return away;
  const ClothRows rows = cloth_rows(state);
  return away + parallel_reduce(state.queue, name, rows.rows, Totals<N>{},
                                BesideClothOf<N, F>{f, rows.particle}, Plus{});
}

SoftDisc soft_disc_of(const ProbeQuery& q, const Parameters& p) {
  return {{q.place[0], q.place[1], q.place[2]},
          {q.normal[0], q.normal[1], q.normal[2]},
          q.radius,
          q.rim,
          periods_of(p)};
}

DiscPoints disc_points(const SoftDisc& disc, int layers, int rings, int spokes) {
  const Vec3<float> n = disc.normal,
                    other =
                        fabsf(n.x) < 0.6f ? Vec3<float>{1.f, 0.f, 0.f} : Vec3<float>{0.f, 1.f, 0.f},
                    across = cross(n, other), u = across * (1.f / length(across));
  return {
      .disc = disc, .u = u, .v = cross(n, u), .layers = layers, .rings = rings, .spokes = spokes};
}

/// The nearest sheet; none in a shot without any.
SensorBody cloth_at(const State& state, Vec3<float> centre) {
  const ClothState& c = state.cloth;
  if (!state.parameters.incompressible) return {};
  return parallel_reduce(state.queue, "probe: sheet", c.triangles, SensorBody{},
                         ClothAt{.corners = corners_of(c),
                                 .position = c.position.view(),
                                 .half_thickness = c.half_thickness.data(),
                                 .sheet = c.sheet.data(),
                                 .centre = centre,
                                 .period = periods_of(state.parameters)},
                         NearerBody{});
}

/// What a disc lies on: within half a spacing and 25 degrees of its surface. On obstacles either
/// sign of its normal is right, on sheets it points to the side that is measured.
SensorBody sensor_body(const State& state, const ProbeQuery& q) {
  SensorBody body;
  if (q.kind == ProbeKind::wall_pressure) {
    body.kind = SensorBody::wall, body.axis = q.axis, body.side = q.side;
    body.facing = along_axis(q.axis, q.side == 0 ? 1.f : -1.f);
    return body;
  }
  const Vec3<float> centre{q.place[0], q.place[1], q.place[2]},
      n{q.normal[0], q.normal[1], q.normal[2]};
  const float reach = 0.5f * state.parameters.spacing * 1.001f;
  const auto lies_on = [&](const SensorBody& b) {
    return fabsf(b.distance) <= reach && fabsf(dot(b.facing, n)) > 0.9f;
  };
  const ObstacleViews obstacles = state.obstacles.views();
  body = parallel_reduce(state.queue, "probe: obstacle", obstacles.count, SensorBody{},
                         ObstacleAt{obstacles, centre, q.on}, NearerBody{});
  if (lies_on(body)) {
    body.facing = dot(body.facing, n) < 0.f ? -n : n;
    return body;
  }
  body = cloth_at(state, centre);
  if (lies_on(body)) {
    body.facing = n;
    return body;
  }
  return {};
}

double surface_extent(const State& state, const ProbeQuery& q, const SoftDisc& disc,
                      const SensorBody& body, float reach) {
  const Parameters& p = state.parameters;
  const ClothState& c = state.cloth;
  if (body.kind == SensorBody::sheet) {
    return parallel_reduce(state.queue, "probe: sheet's area", c.triangles, Totals<1>{},
                           ClothExtent{.corners = corners_of(c),
                                       .position = c.position.view(),
                                       .sheet = c.sheet.data(),
                                       .disc = disc,
                                       .of = body.of,
                                       .reach = reach},
                           Plus{})
        .value[0];
  }
  const ObstacleViews obstacles = state.obstacles.views();
  if (obstacles.count == 0) return q.extent;
  const DiscPoints points = disc_points(disc, 1, 48, 96);
  const Vec3<float> none{0.f, 0.f, 0.f};
  return parallel_reduce(state.queue, "probe: area", points.count(), Totals<1>{},
                         SurfaceExtent{points,
                                       {image_walls_of(p), obstacles, none, none, points.cell()},
                                       body,
                                       p.spacing,
                                       reach},
                         Plus{})
      .value[0];
}

/// Force of the fluid through a disc on a body, over its area, Pa; 0 where nothing is left of it.
double surface_pressure(const State& state, const ProbeQuery& q, const SensorBody& body) {
  const SoftDisc disc = soft_disc_of(q, state.parameters);
  const float reach = disc.radius + disc.rim;
  const double extent = surface_extent(state, q, disc, body, reach);
  if (!(extent > 1e-3 * disc.rim * disc.rim)) return 0;
  const Totals<1> sum = sum_by_particle<1>("probe: pressure on a surface", state,
                                           SurfaceSensor{.parts = body_parts_of(state),
                                                         .disc = disc,
                                                         .body = body,
                                                         .triangle = state.fluid.triangle.data(),
                                                         .sheet = state.cloth.sheet.data(),
                                                         .reach = reach});
  return sum.value[0] / extent;
}

/// Mean of the pressure in a disc inside the fluid, Pa; where there is no fluid it counts as none.
double inner_pressure(const State& state, const ProbeQuery& q) {
  const Parameters& p = state.parameters;
  const FluidState& f = state.fluid;
  const SoftDisc disc = soft_disc_of(q, p);
  const ObstacleViews obstacles = state.obstacles.views();
  // Fluid on the disc's side of the nearest sheet alone, if that is in reach.
  const SensorBody sheet = cloth_at(state, disc.centre);
  Vec3<float> normal{0.f, 0.f, 0.f};
  if (sheet.distance < disc.rim) {
    const Vec3<float> up = disc.from_centre(sheet.foot) * -1.f;
    normal = dot(up, sheet.facing) < 0.f ? -sheet.facing : sheet.facing;
  }
  double extent = q.extent;
  if (obstacles.count > 0 || length2(normal) > 0.f) {
    const DiscPoints points = disc_points(disc, 32, 16, 32);
    extent =
        parallel_reduce(
            state.queue, "probe: volume of a disc", points.count(), Totals<1>{},
            InnerExtent{points, {image_walls_of(p), obstacles, normal, sheet.foot, points.cell()}},
            Plus{})
            .value[0];
  }
  if (!(extent > 1e-3 * disc.rim * disc.rim * disc.rim)) return 0;
  const Totals<1> sum = sum_by_particle<1>("probe: pressure", state,
                                           InnerSensor{.parts = body_parts_of(state),
                                                       .disc = disc,
                                                       .grid = {f.grid, f.cell_start.data()},
                                                       .list = view_of(state.pressure.lists),
                                                       .cloth_normal = normal,
                                                       .cloth_foot = sheet.foot});
  return sum.value[0] / extent;
}

/// Pressure of a disc, Pa, of a surface that it lies on or of the fluid around it.
double disc_pressure(const State& state, const ProbeQuery& q) {
  const SensorBody body = sensor_body(state, q);
  return body.kind == SensorBody::none ? inner_pressure(state, q)
                                       : surface_pressure(state, q, body);
}

/// Pressure of what gravity the walls of a closed domain hold up, Pa; none in its middle.
double held_pressure(const Parameters& p, const float (&position)[3]) {
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    sum += double(p.rest_density) * p.held[k] * (position[k] - 0.5 * (p.low[k] + p.high[k]));
  return sum;
}

/// Force of the fluid on a domain wall, N: what the step took from the fluid's momentum through the
/// wall's pressure and viscosity, over dt. A particle that the pressure fails to stop and the last
/// tenth of a spacing does (collision_rounds.h) is not in it.
std::vector<double> wall_force(const State& state, const ProbeQuery& query) {
  const Parameters& p = state.parameters;
  Totals<3> sum = sum_by_particle<3>("probe: wall force", state,
                                     WallForce{body_parts_of(state), {query.axis, query.side}});
  float centre[3];
  double area = query.side == 0 ? -1 : 1;  // along the axis
  for (int k = 0; k < 3; ++k) {
    centre[k] = 0.5f * (p.low[k] + p.high[k]);
    if (k != query.axis) area *= double(p.high[k]) - p.low[k];
  }
  centre[query.axis] = query.side == 0 ? p.low[query.axis] : p.high[query.axis];
  if (p.held[query.axis] != 0.f) sum.value[query.axis] += area * held_pressure(p, centre);
  return to_vector(sum);
}

double pressure(State& state, const ProbeQuery& query) {
  // What evens out a closed domain has had rows of its own since.
  if (state.parameters.full && query.kind == ProbeKind::inner_pressure) correct_gradients(state);
  return disc_pressure(state, query) + held_pressure(state.parameters, query.place);
}

/// Force of the fluid on a range of vertices, N: the impulses they were given in the step, over dt.
std::vector<double> cloth_force(const State& state, const ProbeQuery& query) {
  return to_vector(parallel_reduce(state.queue, "probe: cloth force", query.end - query.begin,
                                   Totals<3>{}, VertexForce{state.cloth.force.view(), query.begin},
                                   Plus{}));
}

std::vector<double> energy(const State& state, const ProbeQuery& query) {
  const Parameters& p = state.parameters;
  const FluidState& f = state.fluid;
  const ClothState& c = state.cloth;
  const Vec3<float> gravity{p.gravity[0] + p.held[0], p.gravity[1] + p.held[1],
                            p.gravity[2] + p.held[2]};
  const Vec3<float> zero{query.place[0], query.place[1], query.place[2]};
  const Totals<3> fluid = parallel_reduce(state.queue, "probe: fluid energy", f.count, Totals<3>{},
                                          PointEnergy{.position = f.position.view(),
                                                      .velocity = f.velocity.view(),
                                                      .masses = nullptr,
                                                      .mass = p.particle_mass,
                                                      .gravity = gravity,
                                                      .zero = zero},
                                          Plus{});
  const float behind =
      sheets_are_implicit(p) ? 0.f : float(0.5 * state.dt / std::max(1, state.substeps));
  const Totals<3> cloth =
      parallel_reduce(state.queue, "probe: cloth energy", c.vertices, Totals<3>{},
                      VertexEnergy{.points = {.position = c.position.view(),
                                              .velocity = c.velocity.view(),
                                              .masses = c.mass.data(),
                                              .mass = 0.f,
                                              .gravity = gravity,
                                              .zero = zero},
                                   .springs = {.position = c.position.view(),
                                               .velocity = c.velocity.view(),
                                               .ends = spring_ends_of(c),
                                               .rest_length = c.rest_length.data(),
                                               .stiffness = c.stiffness.data(),
                                               .damping = c.spring_damping.data()},
                                   .fluid_force = c.force.view(),
                                   .inverse_mass = c.inverse_mass.data(),
                                   .behind = behind},
                      Plus{});
  const Totals<3> springs = parallel_reduce(
      state.queue, "probe: spring energy", c.vertices, Totals<3>{},
      SpringEnergy{c.position.view(), spring_ends_of(c), c.rest_length.data(), c.stiffness.data()},
      Plus{});
  return to_vector(fluid + cloth + springs);
}

/// Measures the incompressible fluid's density anew; that of the weakly compressible one is of the
/// step's start.
std::vector<double> volume(State& state) {
  const int n = state.fluid.count;
  if (n > 0 && state.parameters.incompressible) measure_density(state);
  const Totals<4> sum =
      parallel_reduce(state.queue, "probe: volume", n, Totals<4>{},
                      PositionAndDensity{state.fluid.position.view(), state.fluid.density.data(),
                                         1.f / state.parameters.rest_density},
                      Plus{});
  std::vector<double> all{double(n)};
  for (const double value : sum.value)
    all.push_back(n > 0 ? value / n : std::numeric_limits<double>::quiet_NaN());
  return all;
}

/// Mean of the particles whose centres are in a ball, m/s.
std::vector<double> mean_velocity(const State& state, const ProbeQuery& q) {
  const Totals<4> sum =
      parallel_reduce(state.queue, "probe: velocity", state.fluid.count, Totals<4>{},
                      VelocityInBall{state.fluid.position.view(),
                                     state.fluid.velocity.view(),
                                     {q.place[0], q.place[1], q.place[2]},
                                     periods_of(state.parameters),
                                     q.radius * q.radius},
                      Plus{});
  if (sum.value[3] == 0) return std::vector<double>(3, std::numeric_limits<double>::quiet_NaN());
  return {sum.value[0] / sum.value[3], sum.value[1] / sum.value[3], sum.value[2] / sum.value[3]};
}

/// Half a spacing beyond the farthest particle, m local.
double front(const State& state, const ProbeQuery& q) {
  if (state.fluid.count == 0) return std::numeric_limits<double>::quiet_NaN();
  return 0.5 * state.parameters.spacing +
         parallel_reduce(
             state.queue, "probe: front", state.fluid.count, -1e30,
             PositionAlong{state.fluid.position.view(), {q.normal[0], q.normal[1], q.normal[2]}},
             Larger{});
}

std::vector<double> vertex(const State& state, int v) {
  const VecColumn& x = state.cloth.position;
  return {value_at(x.x, v), value_at(x.y, v), value_at(x.z, v)};
}

std::vector<double> probe_state(State& state, const ProbeQuery& query) {
  switch (query.kind) {
    case ProbeKind::height:
      return {surface_height(state, query)};
    case ProbeKind::wall_pressure:
    case ProbeKind::inner_pressure:
      return {pressure(state, query)};
    case ProbeKind::wall_force:
      return wall_force(state, query);
    case ProbeKind::cloth_force:
      return cloth_force(state, query);
    case ProbeKind::obstacle_force:
      return {};  // the solver adds what its obstacles received
    case ProbeKind::vertex:
      return vertex(state, query.begin);
    case ProbeKind::energy:
      return energy(state, query);
    case ProbeKind::velocity:
      return mean_velocity(state, query);
    case ProbeKind::front:
      return {front(state, query)};
    case ProbeKind::volume:
      return volume(state);
  }
  return {};
}

}  // namespace

std::vector<std::vector<double>> probe_states(State& state,
                                              const std::vector<ProbeQuery>& queries) {
  std::vector<std::vector<double>> answers(queries.size());
  for (const bool last : {false, true}) {
    for (size_t k = 0; k < queries.size(); ++k) {
      if ((queries[k].kind == ProbeKind::volume) == last)
        answers[k] = probe_state(state, queries[k]);
    }
  }
  return answers;
}

}  // namespace drench::sim::DRENCH_BACKEND

// One backend's Solver. Compiled twice: as it is, and as CUDA.

#include "sim/solver.h"

#include <algorithm>
#include <map>

#include "sim/passes/motion/limits.h"
#include "sim/passes/obstacle/obstacle_impulse.h"
#include "sim/passes/pressure/measure_density.h"
#include "sim/passes/probe/probe.h"
#include "sim/passes/viscosity/body_drag.h"
#include "sim/passes/viscosity/viscosity_solve.h"
#include "sim/state_memory.h"
#include "sim/step_plan.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

void upload(VecColumn& column, const HostVec& host) {
  from_host(column.x, host.x), from_host(column.y, host.y), from_host(column.z, host.z);
}
HostVec download(const VecColumn& column, int n) {
  return {to_host(column.x, n), to_host(column.y, n), to_host(column.z, n)};
}

class BackendSolver : public Solver {
 public:
  BackendSolver(const Parameters& parameters, const ClothTopology& cloth) {
    state_.parameters = parameters;
    if (parameters.paper) {
      state_.wall_table = build_wall_table(parameters.support_radius / parameters.spacing);
    }
    plan_ = step_plan(parameters, cloth.vertices() > 0);
    for (const Pass& pass : plan_) allocated_ |= pass.reads | pass.writes;
    if (cloth.vertices() > 0) load_topology(cloth);
  }

  void load(const HostState& host) override {
    state_.fluid.count = int(host.id.size());
    resize_particles(host.id.size());
    upload(state_.fluid.position, host.position);
    upload(state_.fluid.velocity, host.velocity);
    from_host(state_.fluid.id, host.id);
    if (allocated_ & column_memory) {
      from_host(state_.fluid.memory_triangle, host.memory_triangle);
      from_host(state_.fluid.memory_side, host.memory_side);
      upload(state_.fluid.owed, host.owed);
    }
    if (allocated_ & column_projection) {
      std::vector<float> term = host.pressure_term;
      term.resize(host.id.size(), 0.f);  // a state that no step has made yet has none
      from_host(state_.fluid.pressure_term, term);
    }
    state_.fluid.far_by.clear_bytes(0);
    state_.owes = true;
    if (allocated_ & column_cloth) {
      upload(state_.cloth.position, host.cloth_position);
      upload(state_.cloth.velocity, host.cloth_velocity);
      state_.cloth.position.resize(state_.cloth.padded);
      state_.cloth.velocity.resize(state_.cloth.padded);
    }
    state_.guard_hits = host.guard_hits;
    state_.guard_holds = host.guard_holds;
    state_.removed = host.removed;
    state_.removed.resize(size_t(state_.parameters.sinks) + 1);
  }

  HostState save() const override {
    HostState host;
    const FluidState& f = state_.fluid;
    const int n = f.count;
    host.position = download(f.position, n);
    host.velocity = download(f.velocity, n);
    host.id = to_host(f.id, n);
    if (allocated_ & column_memory) {
      host.memory_triangle = to_host(f.memory_triangle, n);
      host.memory_side = to_host(f.memory_side, n);
      host.owed = download(f.owed, n);
    }
    if (allocated_ & column_projection) host.pressure_term = to_host(f.pressure_term, n);
    if (allocated_ & column_cloth) {
      host.cloth_position = download(state_.cloth.position, state_.cloth.vertices);
      host.cloth_velocity = download(state_.cloth.velocity, state_.cloth.vertices);
    }
    host.guard_hits = state_.guard_hits;
    host.guard_holds = state_.guard_holds;
    host.removed = state_.removed;
    return host;
  }

  HostVec positions() const override { return download(state_.fluid.position, state_.fluid.count); }
  std::vector<float> density() const override {
    return to_host(state_.fluid.density, state_.fluid.count);
  }
  std::vector<float> pressure_term() const override {
    return to_host(state_.fluid.pressure_term, state_.fluid.count);
  }
  std::vector<int> near_triangles() const override {
    if (!(allocated_ & column_sheet)) return std::vector<int>(state_.fluid.count, -1);
    return to_host(state_.fluid.triangle, state_.fluid.count);
  }

  void append(const HostVec& position, const HostVec& velocity,
              const std::vector<int>& id) override {
    FluidState& f = state_.fluid;
    const size_t at = f.count, more = id.size();
    resize_particles(at + more);
    const auto put = [&](VecColumn& column, const HostVec& host) {
      column.x.upload(host.x.data(), more, at);
      column.y.upload(host.y.data(), more, at);
      column.z.upload(host.z.data(), more, at);
    };
    put(f.position, position);
    put(f.velocity, velocity);
    f.id.upload(id.data(), more, at);
    if (allocated_ & column_memory) {
      f.memory_triangle.upload(std::vector<int>(more, -1).data(), more, at);
      f.memory_side.upload(std::vector<int>(more, 1).data(), more, at);
      const std::vector<float> none(more, 0.f);
      put(f.owed, {none, none, none});
      f.far_by.upload(none.data(), more, at);
    }
    if (allocated_ & column_projection) {
      f.pressure_term.upload(std::vector<float>(more, 0.f).data(), more, at);
    }
    f.count = int(at + more);
  }

  Limits step(double dt, int substeps) override {
    state_.dt = dt;
    state_.substeps = substeps;
    if (state_.parameters.fluid && state_.fluid.count == 0) {  // an emitter that has not started
      if (state_.cloth.vertices > 0) step_cloth_alone(state_);
    } else {
      for (const Pass& pass : plan_) pass.launch(state_);
    }
    Limits limits = measure_limits(state_);
    if (state_.parameters.incompressible && state_.fluid.count > 0) {
      const SolveControl solve = value_at(state_.pressure.control, 0);
      limits.residual = std::max(solve.left, solve.residual);
      limits.iterations = std::max(solve.spent, solve.iterations);
      limits.step = float(dt), limits.pressure = solve.peak;
    }
    if (allocated_ & column_cloth_system) {
      const ClothControl sheets = value_at(state_.cloth_system.control, 0);
      limits.sheet_sweeps = sheets.sweeps, limits.sheets_cut_short = !sheets.done;
    }
    if (viscosity_is_implicit(state_.parameters, dt) && state_.fluid.count > 0) {
      const ViscousControl solve = value_at(state_.viscosity.control, 0);
      limits.viscous_residual = solve.converged ? 0.f : solve.residual;
      limits.viscous_iterations = solve.iterations;
    }
    return limits;
  }
  void observe_substeps(std::function<void(const HostState&)> observer) override {
    state_.after_substep = nullptr;
    if (observer) state_.after_substep = [this, observer] { observer(save()); };
  }

  void refresh() override {
    if (state_.fluid.count == 0) return;
    if (state_.parameters.incompressible) return measure_density(state_);
    for (const Pass& pass : plan_) {
      pass.launch(state_);
      if (pass.writes & column_density) break;
    }
  }

  Limits measure() override { return measure_limits(state_); }
  std::vector<std::vector<double>> probe(const std::vector<ProbeQuery>& queries) override {
    const auto on_obstacle = [](const ProbeQuery& q) {
      return q.kind == ProbeKind::obstacle_force;
    };
    std::vector<ObstacleImpulse> received;  // before the volume probe measures density anew
    if (std::any_of(queries.begin(), queries.end(), on_obstacle)) received = obstacle_impulses();
    std::vector<std::vector<double>> answers = probe_states(state_, queries);
    for (size_t k = 0; k < queries.size(); ++k) {
      if (!on_obstacle(queries[k])) continue;
      for (const double push : received[size_t(queries[k].begin)].impulse)
        answers[k].push_back(push / state_.dt);
    }
    return answers;
  }

  void load_level_set(Solids of, int index, int which, const LevelSet& set) override {
    const bool sinks = of == Solids::sinks;
    ObstacleState& o = sinks ? state_.sinks : state_.obstacles;
    const Parameters& p = state_.parameters;
    o.field.resize(size_t(2) * (sinks ? p.sinks : p.obstacles));
    ObstacleState::Field& field = o.field.at(size_t(2) * index + which);
    from_host(field.block, set.block), from_host(field.value, set.value);
    field.shape = field_view(set);
  }
  void place(Solids which, const std::vector<ObstaclePlacement>& placement) override {
    ObstacleState& o = which == Solids::sinks ? state_.sinks : state_.obstacles;
    std::vector<ObstacleView> views;
    for (size_t k = 0; k < placement.size(); ++k) {
      ObstacleView view{placement[k], {}};
      for (size_t s = 0; view.shape == ObstacleShape::field && s < 2; ++s) {
        const ObstacleState::Field& field = o.field.at(2 * size_t(view.of) + s);
        view.field[s] = field.shape;
        view.field[s].block = field.block.data(), view.field[s].value = field.value.data();
      }
      views.push_back(view);
    }
    o.count = int(views.size());
    from_host(o.view, views);
    const Parameters& p = state_.parameters;
    o.stopped.resize(size_t(4) * (which == Solids::sinks ? p.sinks : p.obstacles));
    o.stopped.clear_bytes(0);
  }
  void blow(const WindNow& wind) override { state_.wind = wind; }
  void drive(const FrameNow& frame) override {
    set_gravity(state_.parameters, frame.gravity);
    state_.frame = frame;
  }
  std::vector<ObstacleImpulse> obstacle_impulses() const override {
    const ObstacleState& o = state_.obstacles;
    const std::vector<long long> stopped = to_host(o.stopped, o.stopped.size());
    const int count = state_.parameters.obstacles;
    std::vector<ObstacleImpulse> impulses(count);
    for (int k = 0; k < count && state_.dt > 0; ++k) {
      Impulse all = pressure_impulse(state_, k);
      if (allocated_ & column_tension) all = all + tension_impulse(state_, k);
      if (allocated_ & column_drag) all = all + drag_impulse(state_, k);
      if (state_.contact.near > 0) all = all + pressure_impulse_near_sheets(state_, k);
      const double impulse[3] = {all.x, all.y, all.z};
      for (int c = 0; c < 3; ++c) {
        impulses[k].impulse[c] = impulse[c] + double(stopped[4 * k + c]) / StopSums::unit *
                                                  state_.parameters.particle_mass;
      }
      impulses[k].stopped = stopped[4 * k + 3];
    }
    return impulses;
  }

  std::vector<PassInfo> plan() const override {
    std::vector<PassInfo> info;
    for (const Pass& pass : plan_) info.push_back({pass.name, pass.reads, pass.writes});
    return info;
  }
  unsigned allocated() const override { return allocated_; }
  std::vector<ColumnMemory> memory() const override { return memory_of(state_); }
  int particles() const override { return state_.fluid.count; }

 private:
  void resize_particles(size_t n) {
    FluidState& f = state_.fluid;
    f.position.resize(n), f.velocity.resize(n), state_.swap_float.resize(n);
    for (Column<int>* c : {&f.id, &f.cell, &f.order}) c->resize(n);
    if (allocated_ & column_acceleration) f.acceleration.resize(n);
    if (allocated_ & column_density) {
      for (Column<float>* c : {&f.density, &f.pressure_term}) c->resize(n);
      if (!state_.parameters.incompressible) f.inverse_density.resize(n);
    }
    if (allocated_ & column_projection) {
      state_.pressure.resize(n);
      if (state_.parameters.full) state_.pressure.mean_displacement.resize(n);
    }
    if (allocated_ & column_tension) state_.tension.normal.resize(n);
    if (state_.parameters.wets) state_.tension.wetting.resize(n);
    if (allocated_ & column_drag) {
      ViscosityState& v = state_.viscosity;
      for (Column<Float4>* c : {&v.body_rate, &v.body_cross, &v.body_source}) c->resize(n);
    }
    if (allocated_ & column_sheet) {
      for (Column<float>* c : {&f.far_by, &f.weight_b, &f.weight_c, &f.sheet_distance, &f.plane,
                               &f.edge, &f.cloth_share}) {
        c->resize(n);
      }
      f.triangle.resize(n), f.shaded.resize(n);
      f.normal.resize(n);
    }
    if (allocated_ & column_contact) {
      resize_contacts(n);
    }
    if (allocated_ & column_memory) {
      f.memory_triangle.resize(n);
      f.memory_side.resize(n);
      f.owed.resize(n);
    }
  }

  void resize_contacts(size_t n) {
    FluidState& f = state_.fluid;
    ContactState& c = state_.contact;
    c.key.resize(n);
    if (state_.parameters.paper) return f.impulse.resize(n);
    for (VecColumn* v : {&f.start, &f.end}) v->resize(n);
    for (Column<int>* v : {&f.held, &f.moved, &f.stopped}) v->resize(n);
    const size_t rows = (n + 23) / 8 * 8;
    c.stride = int(rows);
    c.particle.resize(rows), c.vertex.resize(3 * rows), c.weight.resize(3 * rows);
    c.change.resize(rows);
    if (allocated_ & column_cloth_system) {
      f.drift.resize(n), c.gradient.resize(rows);
      for (Column<float>* v : {&c.recovery, &c.compliance, &c.gap, &c.open}) v->resize(rows);
      if (state_.parameters.no_slip_sheets) c.rate_along.resize(rows), c.rate_across.resize(rows);
    } else {
      for (VecColumn* v : {&c.normal, &c.velocity, &c.drag}) v->resize(rows);
      for (Column<float>* v : {&c.inverse_row, &c.pressure_target, &c.pressure_rate,
                               &c.pressure_scale, &c.least, &c.drag_rate, &c.drag_scale, &c.lambda})
        v->resize(rows);
    }
  }

  void load_topology(const ClothTopology& t) {
    ClothState& c = state_.cloth;
    c.vertices = t.vertices();
    c.triangles = t.triangles();
    c.padded = (c.vertices + 7) / 8 * 8;
    const auto pad = [&](Column<float>& column, std::vector<float> host) {
      host.resize(c.padded, 0.f);  // a padding vertex is pinned and has no springs
      from_host(column, host);
    };
    c.joined = t.corner_shift.size() > 0;
    upload(c.corner_shift, t.corner_shift);
    std::vector<Vec3<float>> rest_period;
    for (size_t k = 0; k < t.rest_period.size(); ++k)
      rest_period.push_back({t.rest_period.x[k], t.rest_period.y[k], t.rest_period.z[k]});
    from_host(c.rest_period, rest_period);
    pad(c.mass, t.mass), pad(c.inverse_mass, t.inverse_mass), pad(c.damping_rate, t.damping_rate);
    load_springs(t);
    from_host(c.corner, t.corner), from_host(c.neighbour, t.neighbour), from_host(c.sheet, t.sheet);
    from_host(c.half_thickness, t.half_thickness);
    if (state_.parameters.no_slip_sheets) from_host(c.no_slip, t.no_slip);
    if (state_.parameters.wets) from_host(c.wetting, t.wetting);
    upload(c.rest_centroid, t.rest_centroid);
    from_host(c.fan_start, t.fan_start), from_host(c.fan_entry, t.fan_entry),
        from_host(c.rim, t.rim);
    for (VecColumn* v :
         {&c.position, &c.velocity, &c.next, &c.next_velocity, &c.start, &c.predicted, &c.force}) {
      v->resize(c.padded);
    }
    c.force.clear();
    for (VecColumn* v : {&c.air_diagonal, &c.air_cross, &c.air_push})
      v->resize(state_.parameters.air_density > 0.f ? c.padded : 0);
    if (state_.parameters.air_density > 0.f) from_host(c.air_share, t.air_share);
    c.centroid.resize(c.triangles);
    c.sorted_low.resize(c.triangles + 8);
    c.sorted_high.resize(c.triangles + 8);
    c.sorted_triangle.resize(c.triangles + 8);
    c.cell.resize(c.triangles);
    state_.contact.impulse.resize(size_t(3) * c.triangles);
    c.share.resize(c.vertices);
    if (allocated_ & column_cloth_system) allocate_cloth_system(), find_loose_sheets(t);
    c.held.resize(c.vertices);
    c.stop_sum.resize(size_t(4) * c.vertices);
  }

  /// A sheet's vertices follow each other.
  void find_loose_sheets(const ClothTopology& t) {
    std::map<int, std::pair<int, int>> sheet;  // first and last vertex
    for (size_t k = 0; k < t.corner.size(); ++k) {
      const int v = t.corner[k];
      auto& [first, last] = sheet.try_emplace(t.sheet[k / 3], v, v).first->second;
      first = std::min(first, v), last = std::max(last, v);
    }
    for (const auto& [id, range] : sheet) {
      const auto begin = t.inverse_mass.begin() + range.first,
                 end = t.inverse_mass.begin() + range.second + 1;
      if (std::find(begin, end, 0.f) == end)
        state_.cloth.loose.push_back({range.first, int(end - begin)});
    }
  }

  void allocate_cloth_system() {
    const ClothState& c = state_.cloth;
    ClothSystem& s = state_.cloth_system;
    const size_t springs = size_t(c.spring_slots) * c.padded;
    s.tension.resize(springs), s.axis.resize(springs);
    s.inertia.resize(c.padded), s.factor.resize(size_t(6) * c.padded);
    for (VecColumn* v : {&s.base, &s.right, &s.free, &s.change, &s.answer, &s.residual, &s.scaled,
                         &s.image, &s.direction, &s.direction_image})
      v->resize(c.padded);
    s.control.resize(1);
    if (state_.parameters.no_slip_sheets) s.drag_factor.resize(size_t(6) * c.padded);
    if (state_.parameters.obstacles > 0) {
      s.normal.resize(c.padded), s.rub.resize(c.padded);
      s.grip.resize(c.padded), s.slides.resize(c.padded);
      s.free_factor.resize(size_t(6) * c.padded);
    }
  }

  /// Rows of springs to slots of all vertices. A slot takes springs of one offset between vertices
  /// as long as there are eight offsets or fewer at most vertices, as on grids; the rest fill up
  /// what is free.
  void load_springs(const ClothTopology& t) {
    ClothState& c = state_.cloth;
    int busiest = 0;
    std::map<int, int> count_of_offset;
    for (int v = 0; v < c.vertices; ++v) {
      busiest = std::max(busiest, t.spring_start[v + 1] - t.spring_start[v]);
      for (int k = t.spring_start[v]; k < t.spring_start[v + 1]; ++k)
        ++count_of_offset[t.spring_end[k] - v];
    }
    std::vector<int> offset;
    for (const auto& [o, count] : count_of_offset) {
      if (count > c.vertices / 4) offset.push_back(o);
    }
    if (int(count_of_offset.size()) > int(offset.size()) || int(offset.size()) > busiest)
      offset.clear();
    c.spring_slots = busiest;
    offset.resize(busiest, 0);
    const size_t size = size_t(busiest) * c.padded;
    std::vector<int> end(size);
    std::vector<float> length(size, 0.f), stiffness(size, 0.f), damping(size, 0.f);
    for (size_t k = 0; k < size; ++k) end[k] = int(k % c.padded);
    const std::vector<float>* of_springs[3] = {&t.spring_shift.x, &t.spring_shift.y,
                                               &t.spring_shift.z};
    std::vector<float> shift[3];
    for (std::vector<float>& axis : shift) axis.resize(c.joined ? size : 0, 0.f);
    for (int v = 0; v < c.vertices; ++v) {
      for (int k = t.spring_start[v], free = 0; k < t.spring_start[v + 1]; ++k, ++free) {
        const auto slot = std::find(offset.begin(), offset.end(), t.spring_end[k] - v);
        const size_t to =
            size_t(slot == offset.end() ? free : slot - offset.begin()) * c.padded + v;
        if (c.joined) {
          for (int a = 0; a < 3; ++a) shift[a][to] = (*of_springs[a])[k];
        }
        end[to] = t.spring_end[k], length[to] = t.rest_length[k];
        stiffness[to] = t.stiffness[k], damping[to] = t.spring_damping[k];
      }
    }
    from_host(c.slot_offset, offset), from_host(c.spring_end, end),
        from_host(c.rest_length, length);
    from_host(c.stiffness, stiffness), from_host(c.spring_damping, damping);
    upload(c.spring_shift, {shift[0], shift[1], shift[2]});
  }

  State state_;
  std::vector<Pass> plan_;
  unsigned allocated_ = 0;
};

}  // namespace

std::unique_ptr<Solver> make_solver(const Parameters& parameters, const ClothTopology& cloth) {
  return std::make_unique<BackendSolver>(parameters, cloth);
}

}  // namespace drench::sim::DRENCH_BACKEND

// One backend's Solver. Compiled twice: as it is, and as CUDA.

#include "sim/solver.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>

#include "pipeline/contract/hash.h"
#include "sim/columns.h"
#include "sim/passes/cloth/cloth_levels.h"
#include "sim/passes/cloth/self_contact.h"
#include "sim/passes/cloth/self_contact_pairs.h"
#include "sim/passes/cloth/shell_columns.h"
#include "sim/passes/cloth/triangle_obstacles.h"
#include "sim/passes/cloth/wet_cloth.h"
#include "sim/passes/motion/measure_limits.h"
#include "sim/passes/obstacle/obstacle_impulse.h"
#include "sim/passes/pressure/measure_density.h"
#include "sim/passes/probe/probe.h"
#include "sim/passes/viscosity/body_drag.h"
#include "sim/passes/viscosity/viscosity_solve.h"
#include "sim/step_plan.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

void upload(VecColumn& column, const HostVec& host) {
  from_host(column.x, host.x), from_host(column.y, host.y), from_host(column.z, host.z);
}
template <class T>
void upload(Column<T>& column, const std::vector<T>& host) {
  from_host(column, host);
}
HostVec download(const VecColumn& column, size_t n) {
  return {to_host(column.x, n), to_host(column.y, n), to_host(column.z, n)};
}
template <class T>
std::vector<T> download(const Column<T>& column, size_t n) {
  return to_host(column, n);
}
/// Elements from `at` on.
void put(VecColumn& column, const HostVec& host, size_t at) {
  column.x.upload(host.x.data(), host.size(), at), column.y.upload(host.y.data(), host.size(), at);
  column.z.upload(host.z.data(), host.size(), at);
}
template <class T>
void put(Column<T>& column, const std::vector<T>& host, size_t at) {
  column.upload(host.data(), host.size(), at);
}
/// n elements of what a new particle has.
HostVec repeated(const VecColumn&, size_t n, int value) {
  const std::vector<float> all(n, float(value));
  return {all, all, all};
}
template <class T>
std::vector<T> repeated(const Column<T>&, size_t n, int value) {
  if constexpr (std::is_arithmetic_v<T>) return std::vector<T>(n, T(value));
  return std::vector<T>(n);
}

uint64_t digest_of(const VecColumn& column);
template <class T>
uint64_t digest_of(const Column<T>& column) {
  const std::vector<T> host = to_host(column, column.size());
  const Digest digest = hash_bytes(host.data(), host.size() * sizeof(T));
  return digest.low ^ column.size();
}
uint64_t digest_of(const VecColumn& column) {
  return digest_of(column.x) + 3 * digest_of(column.y) + 9 * digest_of(column.z);
}

class BackendSolver : public Solver {
 public:
  BackendSolver(const Parameters& parameters, const ClothTopology& cloth) {
    state_.parameters = parameters;
    if (parameters.paper) {
      state_.wall_table = build_wall_table(parameters.support_radius / parameters.spacing);
    }
    plan_ = step_plan(parameters, cloth.vertices() > 0);
    for (const Pass& pass : plan_) allocated_ |= pass.writes;
    if (cloth.vertices() > 0) load_topology(cloth);
  }

  void load(const HostState& host) override {
    state_.fluid.count = int(host.id.size());
    resize_particles(state_, allocated_, host.id.size());
    for_each_kept_column(state_, [&](const ColumnInfo& info, auto& column, auto member) {
      if (!allocated_.contains(info.group)) return;
      const size_t n = count_of(info);  // a state that no step has made yet has no pressures
      const auto& values = host.*member;
      upload(column, values.size() == n ? values : repeated(column, n, info.initial));
      if (info.extent == Extent::vertices) column.resize(state_.cloth.padded);
    });
    if (state_.wet.any) apply_wetness(state_);
    state_.fluid.beyond_support.clear_bytes(state_.queue, 0);
    state_.owes = true;
    state_.guard_hits = host.guard_hits;
    state_.guard_holds = host.guard_holds;
    state_.removed = host.removed;
    state_.shell.dt = host.shell_dt;
    state_.removed.resize(size_t(state_.parameters.sinks) + 1);
  }

  HostState save() const override {
    HostState host;
    for_each_kept_column(state_, [&](const ColumnInfo& info, const auto& column, auto member) {
      if (allocated_.contains(info.group)) host.*member = download(column, count_of(info));
    });
    host.guard_hits = state_.guard_hits;
    host.guard_holds = state_.guard_holds;
    host.removed = state_.removed;
    host.shell_dt = state_.shell.dt;
    return host;
  }

  HostVec positions() const override { return download(state_.fluid.position, state_.fluid.count); }
  HostVec cloth_positions() const override {
    return download(state_.cloth.position, state_.cloth.vertices);
  }
  std::vector<float> density() const override {
    return to_host(state_.fluid.density, state_.fluid.count);
  }
  std::vector<float> pressure_term() const override {
    return to_host(state_.fluid.pressure_term, state_.fluid.count);
  }
  std::vector<int> near_triangles() const override {
    if (!(allocated_.contains(ColumnGroup::near_cloth)))
      return std::vector<int>(state_.fluid.count, -1);
    return to_host(state_.fluid.triangle, state_.fluid.count);
  }

  std::vector<char> sheets_near_fluid() const override {
    std::vector<char> near(sheet_.size(), 0);
    if (state_.contact.near == 0) return near;
    const std::vector<int> sheet = to_host(state_.cloth.sheet, state_.cloth.sheet.size());
    for (const int t : near_triangles())
      if (t >= 0) near[size_t(sheet[size_t(t)])] = 1;
    return near;
  }

  void append(const HostVec& position, const HostVec& velocity,
              const std::vector<int>& id) override {
    const size_t at = state_.fluid.count, more = id.size();
    resize_particles(state_, allocated_, at + more);
    for_each_column(state_, [&](const ColumnInfo& info, auto& column, auto) {
      const bool lasts = info.extent == Extent::particles && info.use != Use::rebuilt;
      if (lasts && size_of(column) > 0) put(column, repeated(column, more, info.initial), at);
    });
    put(state_.fluid.position, position, at);
    put(state_.fluid.velocity, velocity, at);
    put(state_.fluid.id, id, at);
    state_.fluid.count = int(at + more);
  }

  Limits step(double dt, int substeps) override {
    state_.dt = dt;
    state_.substeps = substeps;
    if (state_.parameters.fluid && state_.fluid.count == 0) {  // an emitter that has not started
      if (state_.cloth.vertices > 0) step_cloth_alone(state_);
    } else {
      for (const Pass& pass : plan_)
        if (!(pass.of_sheets && all_sheets_sleep(state_))) launch(pass);
    }
    Limits limits = measure_limits(state_);
    if (state_.parameters.incompressible && state_.fluid.count > 0) {
      const SolveControl solve = value_at(state_.pressure.control, 0);
      limits.residual = std::max(solve.left, solve.residual);
      limits.iterations = std::max(solve.spent, solve.iterations);
      limits.step = float(dt), limits.pressure = solve.peak;
    }
    if (allocated_.contains(ColumnGroup::cloth_system) && !all_sheets_sleep(state_)) {
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

  void observe_passes(std::function<void(const PassInfo&, ColumnSet)> observer) override {
    pass_observer_ = std::move(observer);
  }

  void refresh() override {
    if (state_.fluid.count == 0) return;
    if (state_.parameters.incompressible) return measure_density(state_);
    for (const Pass& pass : plan_) {
      pass.launch(state_);
      if (pass.writes.contains(ColumnGroup::density)) break;
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
    o.stopped.clear_bytes(state_.queue, 0);
  }
  void hold(const PinsNow& now) override {
    PinState& p = state_.pins;
    upload(p.place, now.place), upload(p.low, now.low), upload(p.velocity, now.velocity);
    const auto moves = [](float u) { return u != 0.f; };
    p.drive = std::any_of(now.velocity.x.begin(), now.velocity.x.end(), moves) ||
              std::any_of(now.velocity.y.begin(), now.velocity.y.end(), moves) ||
              std::any_of(now.velocity.z.begin(), now.velocity.z.end(), moves);
    if (now.pull == pull_) return;
    pull_ = now.pull;
    upload(p.pull, pull_);
    for (size_t k = 0; k < pull_.size(); ++k) {
      const auto v = size_t(pin_vertex_[k]);
      inverse_mass_[v] = pull_[k] == 0 ? 0.f : 1 / mass_[v];
    }
    put_inverse_masses();
    if (state_.wet.any) apply_wetness(state_);
  }
  void sleep(const std::vector<char>& asleep) override {
    for (size_t k = 0; k < sheet_.size(); ++k) {
      if (asleep[k]) halt(sheet_[k]);
    }
    asleep_ = asleep;
    state_.cloth.asleep = std::find(asleep.begin(), asleep.end(), 0) == asleep.end();
    put_inverse_masses();
  }
  void draw_seams(const std::vector<float>& rest_length) override {
    for (size_t k = 0; k < seam_slot_.size(); ++k) rest_length_[seam_slot_[k]] = rest_length[k / 2];
    from_host(state_.cloth.rest_length, rest_length_);
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
      if (allocated_.contains(ColumnGroup::tension)) all = all + tension_impulse(state_, k);
      if (allocated_.contains(ColumnGroup::drag)) all = all + drag_impulse(state_, k);
      if (state_.contact.near > 0) all = all + pressure_impulse_near_cloth(state_, k);
      const double impulse[3] = {all.x, all.y, all.z};
      for (int c = 0; c < 3; ++c) {
        impulses[k].impulse[c] = impulse[c] + double(stopped[4 * k + c]) / StopSums::unit *
                                                  state_.parameters.particle_mass;
      }
      impulses[k].stopped = stopped[4 * k + 3];
    }
    return impulses;
  }

  ClothContacts cloth_contacts() const override {
    const bool implicit =
        allocated_.contains(ColumnGroup::cloth_system) && !all_sheets_sleep(state_);
    return implicit ? count_cloth_contacts(state_) : ClothContacts{};
  }

  std::vector<PassInfo> plan() const override {
    std::vector<PassInfo> info;
    for (const Pass& pass : plan_) info.push_back({pass.name, pass.reads, pass.writes});
    return info;
  }
  ColumnSet allocated() const override { return allocated_; }
  std::vector<ColumnMemory> memory() const override {
    std::vector<ColumnMemory> all;
    for (const std::string_view name : column_group_names) all.push_back({std::string(name), 0});
    for_each_column(state_, [&](const ColumnInfo& info, const auto& column, auto) {
      all[size_t(info.group)].bytes += bytes_of(column);
    });
    std::erase_if(all, [](const ColumnMemory& one) { return one.bytes == 0; });
    return all;
  }
  int particles() const override { return state_.fluid.count; }

 private:
  size_t count_of(const ColumnInfo& info) const {
    return info.extent == Extent::vertices ? state_.cloth.vertices : state_.fluid.count;
  }

  std::array<uint64_t, column_group_names.size()> digests() const {
    std::array<uint64_t, column_group_names.size()> all{};
    for_each_column(state_, [&](const ColumnInfo& info, const auto& column, auto) {
      uint64_t& of_group = all[size_t(info.group)];
      of_group = of_group * 1099511628211u + digest_of(column);
    });
    return all;
  }

  void launch(const Pass& pass) {
    if (!pass_observer_) return pass.launch(state_);
    const auto before = digests();
    pass.launch(state_);
    const auto after = digests();
    ColumnSet changed;
    for (size_t k = 0; k < before.size(); ++k)
      if (before[k] != after[k]) changed |= ColumnGroup(k);
    pass_observer_({pass.name, pass.reads, pass.writes}, changed);
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
    load_polygons(t);
    std::vector<Vec3<float>> rest_period;
    for (size_t k = 0; k < t.rest_period.size(); ++k)
      rest_period.push_back({t.rest_period.x[k], t.rest_period.y[k], t.rest_period.z[k]});
    from_host(c.rest_period, rest_period);
    pad(c.mass, t.mass), pad(c.inverse_mass, t.inverse_mass), pad(c.damping_rate, t.damping_rate);
    load_springs(t);
    from_host(c.fan_start, t.fan_start), from_host(c.fan_entry, t.fan_entry),
        from_host(c.rim, t.rim);
    for (VecColumn* v :
         {&c.position, &c.velocity, &c.next, &c.next_velocity, &c.start, &c.predicted, &c.force}) {
      v->resize(c.padded);
    }
    c.force.clear(state_.queue);
    if (state_.parameters.air_density > 0.f) {
      for (VecColumn* v : {&c.air_diagonal, &c.air_cross, &c.air_push}) v->resize(c.padded);
      from_host(c.air_share, t.air_share);
    }
    c.share.resize(c.vertices);
    load_pins(t);
    if (allocated_.contains(ColumnGroup::cloth_system))
      allocate_cloth_system(), find_loose_sheets();
    c.held.resize(c.vertices);
    c.stop_sum.resize(size_t(4) * c.vertices);
    load_shell(state_, t);
    load_cloth_levels(state_, t);
    load_cloth_factor(state_);
    load_triangle_obstacles(state_, t);
    load_self_contact(state_, t);
    load_wet_cloth(state_, t);
  }

  /// The triangles of the sheets, and after them the strips of seams.
  void load_polygons(const ClothTopology& t) {
    ClothState& c = state_.cloth;
    const SeamStrips& strips = t.strips;
    const size_t count = strips.beside.size();
    c.polygons = c.triangles + int(count);
    const auto load = [&](auto& column, auto host) {
      for (const int k : strips.beside) host.push_back(host[size_t(k)]);
      from_host(column, host);
    };
    const auto joined = [](auto all, const auto& more) {
      all.insert(all.end(), more.begin(), more.end());
      return all;
    };
    from_host(c.corner, joined(t.corner, strips.corner));
    from_host(c.neighbour, count > 0 ? strips.neighbour : t.neighbour);
    load(c.sheet, t.sheet), load(c.half_thickness, t.half_thickness);
    if (state_.parameters.no_slip_sheets) load(c.no_slip, t.no_slip);
    if (state_.parameters.wets) load(c.wetting, t.wetting);
    HostVec centre = t.rest_centroid;
    for (const int k : strips.beside) {
      const auto s = size_t(k);
      centre.push(centre.x[s], centre.y[s], centre.z[s]);
    }
    upload(c.rest_centroid, centre);
    c.joined = t.corner_shift.size() > 0;
    upload(c.corner_shift,
           {joined(t.corner_shift.x, strips.shift.x), joined(t.corner_shift.y, strips.shift.y),
            joined(t.corner_shift.z, strips.shift.z)});
    c.centroid.resize(c.polygons), c.cell.resize(c.polygons);
    c.sorted_low.resize(c.polygons + 8), c.sorted_high.resize(c.polygons + 8);
    c.sorted_triangle.resize(c.polygons + 8);
    state_.contact.impulse.resize(size_t(3) * c.polygons);
    if (count == 0) return;
    from_host(c.seam_pair, strips.pair), from_host(c.seam_reach, strips.reach);
    from_host(c.seam_open, std::vector<int>(count, 1));
    from_host(c.seam_fan_start, strips.fan_start), from_host(c.seam_fan_entry, strips.fan_entry);
    c.widest_seam = *std::max_element(strips.reach.begin(), strips.reach.end());
  }

  void load_pins(const ClothTopology& t) {
    mass_ = t.mass, inverse_mass_ = t.inverse_mass, pin_vertex_ = t.pin_vertex;
    inverse_mass_.resize(size_t(state_.cloth.padded), 0.f);
    state_.pins.count = int(t.pin_vertex.size());
    state_.pins.soft = std::any_of(pin_vertex_.begin(), pin_vertex_.end(),
                                   [&](int v) { return inverse_mass_[size_t(v)] > 0; });
    if (state_.pins.count > 0) from_host(state_.pins.vertex, t.pin_vertex);
    find_free_sheets(t);
  }

  /// Sheets, and what seams make of sheets that follow each other, which move as a whole.
  void find_free_sheets(const ClothTopology& t) {
    const std::vector<VertexRange>& piece = sheet_ = sheet_ranges(t);
    std::vector<size_t> group(piece.size());
    std::iota(group.begin(), group.end(), size_t(0));
    const auto group_of = [&](int v) {
      const auto has = [v](const VertexRange& range) { return range.contains(v); };
      return group[size_t(std::find_if(piece.begin(), piece.end(), has) - piece.begin())];
    };
    for (const SeamSpring& s : t.seam)
      std::replace(group.begin(), group.end(), group_of(s.a), group_of(s.b));
    for (size_t k = 0; k < piece.size(); ++k) {
      if (std::find(group.begin(), group.begin() + std::ptrdiff_t(k), group[k]) !=
          group.begin() + std::ptrdiff_t(k))
        continue;
      VertexRange whole = piece[k];
      int count = 0;
      for (size_t j = k; j < piece.size(); ++j) {
        if (group[j] != group[k]) continue;
        whole.count = piece[j].first + piece[j].count - whole.first, count += piece[j].count;
      }
      if (whole.count == count) free_sheet_.push_back(whole);
    }
  }

  /// No velocity, and none of what the next step makes of the last one's.
  void halt(const VertexRange& range) {
    VecColumn* all[] = {&state_.cloth.velocity, &state_.shell.left, &state_.shell.lost,
                        &state_.shell.acceleration};
    for (VecColumn* column : all)
      put(*column, repeated(*column, size_t(range.count), 0), size_t(range.first));
  }

  /// 0 of vertices that pins hold, and of sheets that sleep.
  void put_inverse_masses() {
    std::vector<float> all = inverse_mass_;
    for (size_t k = 0; k < asleep_.size(); ++k) {
      const auto begin = all.begin() + sheet_[k].first;
      if (asleep_[k]) std::fill(begin, begin + sheet_[k].count, 0.f);
    }
    from_host(state_.cloth.inverse_mass, all);
    find_loose_sheets();
  }

  /// Those that nothing holds.
  void find_loose_sheets() {
    std::vector<VertexRange> loose;
    for (const VertexRange& range : free_sheet_) {
      const auto begin = inverse_mass_.begin() + range.first;
      bool held = std::find(begin, begin + range.count, 0.f) != begin + range.count;
      for (size_t k = 0; k < asleep_.size(); ++k)
        held |= asleep_[k] && range.contains(sheet_[k].first);
      for (size_t k = 0; k < pull_.size(); ++k)
        held |= pull_[k] > 0 && range.contains(pin_vertex_[k]);
      if (!held) loose.push_back(range);
    }
    state_.cloth.loose = int(loose.size());
    from_host(state_.cloth.loose_sheet, loose);
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
    if (state_.pins.soft) s.anchor.resize(c.padded), s.anchor_pull.resize(c.padded);
    if (state_.parameters.obstacles > 0) {
      s.normal.resize(c.padded), s.rub.resize(c.padded);
      s.grip.resize(c.padded), s.slides.resize(c.padded), s.cling.resize(c.padded);
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
    std::vector<int> seams(size_t(c.vertices), 0);  // springs of seams have slots of their own
    for (const SeamSpring& s : t.seam) ++seams[size_t(s.a)], ++seams[size_t(s.b)];
    c.spring_slots = busiest + (t.seam.empty() ? 0 : *std::max_element(seams.begin(), seams.end()));
    c.first_seam_slot = busiest;
    offset.resize(size_t(c.spring_slots), 0);
    const size_t size = size_t(c.spring_slots) * c.padded;
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
    std::fill(seams.begin(), seams.end(), busiest);
    for (const SeamSpring& s : t.seam) {
      for (const auto& [v, other] : {std::pair(s.a, s.b), std::pair(s.b, s.a)}) {
        const size_t to = size_t(seams[size_t(v)]++) * c.padded + v;
        end[to] = other, length[to] = s.rest_length, stiffness[to] = s.stiffness;
        seam_slot_.push_back(to);
      }
    }
    if (!t.seam.empty()) rest_length_ = length;
    from_host(c.slot_offset, offset), from_host(c.spring_end, end),
        from_host(c.rest_length, length);
    from_host(c.stiffness, stiffness), from_host(c.spring_damping, damping);
    upload(c.spring_shift, {shift[0], shift[1], shift[2]});
  }

  State state_;
  std::vector<Pass> plan_;
  ColumnSet allocated_;
  // of pins and seams, on the host
  std::vector<float> mass_, inverse_mass_, pull_, rest_length_;
  std::vector<int> pin_vertex_;
  std::vector<VertexRange> sheet_, free_sheet_;
  std::vector<char> asleep_;       // of a sheet; empty: none ever was
  std::vector<size_t> seam_slot_;  // two a seam's spring
  std::function<void(const PassInfo&, ColumnSet)> pass_observer_;
};

}  // namespace

std::unique_ptr<Solver> make_solver(const Parameters& parameters, const ClothTopology& cloth) {
  return std::make_unique<BackendSolver>(parameters, cloth);
}

}  // namespace drench::sim::DRENCH_BACKEND

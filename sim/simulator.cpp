#include "sim/simulator.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_file.h"
#include "sim/blow_up.h"
#include "sim/checkpoint.h"
#include "sim/cloth_frames.h"
#include "sim/probe_series.h"
#include "sim/setup/inlet_report.h"
#include "sim/setup/room.h"
#include "sim/setup/scene.h"
#include "sim/stepper.h"

namespace drench {

namespace {

std::unique_ptr<sim::Solver> make_solver(const sim::Scene& scene, Device device,
                                         std::string& name) {
#if defined(DRENCH_HAS_CUDA)
  if (device != Device::cpu && sim::cuda::device_available(name)) {
    return sim::cuda::make_solver(scene.parameters, scene.cloth);
  }
  if (device == Device::automatic)
    log_info("sim", "no usable GPU (" + name + "); running on the CPU");
  if (device == Device::cuda) {
    throw Error("--device cuda: no usable GPU (" + name +
                "). Install a driver or use --device cpu");
  }
#else
  if (device == Device::cuda) {
    throw Error(
        "--device cuda: this build has no CUDA. Install the CUDA Toolkit and build again, or use "
        "--device cpu");
  }
#endif
  name = "CPU";
  return sim::cpu::make_solver(scene.parameters, scene.cloth);
}

sim::Stepper make_stepper(const Shot& shot, const SimulatorOptions& options, std::string& device) {
  sim::Scene scene = sim::build_scene(shot, options.level_set);
  std::unique_ptr<sim::Solver> solver = make_solver(scene, options.device, device);
  return {std::move(scene), std::move(solver), 0 - shot.preroll};  // no -0
}

}  // namespace

struct Simulator::Implementation {
  Shot shot;
  SimulatorOptions options;
  std::string device;
  sim::Stepper run;
  std::vector<sim::EmitterLayer> layer;
  Digest layout;

  int frame = 0;
  int next_id = 0;
  sim::Births births;
  std::vector<uint64_t> emitted, shut;  // as Checkpoint
  std::vector<uint64_t> reported;       // HostState::removed of the last report
  int reported_id = 0;                  // next_id of the last report
  sim::ProbeSeries probes;
  std::optional<double> room;   // sim::room_of, once it is asked for
  std::vector<bool> told_full;  // emitters whose warning was given
  std::filesystem::path last_checkpoint;

  Implementation(const Shot& shot_, const SimulatorOptions& options_)
      : shot(shot_),
        options(options_),
        run(make_stepper(shot, options, device)),
        probes(shot, run.scene) {
    for (const FluidEmitter& e : shot.fluid.emitter)
      layer.push_back(sim::emitter_layer(e, shot.fluid.spacing));
    emitted.assign(layer.size(), 0), shut.assign(layer.size(), 0);
    told_full.assign(layer.size(), false);
    reported.assign(shot.sink.size() + 1, 0);
    Hasher hasher;
    layout = hasher.digest(stage_settings_digest(shot, Stage::simulate)).text("layout 9").finish();
    frame = shot.timeline.first;
    next_id = reported_id = int(run.scene.start.id.size());
    births = run.scene.births;
    run.solver->refresh();
    if (run.scene.overlapping > 0) {
      log_info("sim", fmt::format("{} particles of sources that overlap were left out",
                                  run.scene.overlapping));
    }
    if (run.scene.inside_obstacles > 0) {
      log_info("sim", fmt::format("{} particles of the sources start inside obstacles or within "
                                  "half a spacing of them and were left out",
                                  run.scene.inside_obstacles));
    }
    for (const std::string& warning : sim::warnings_of(run.scene.report))
      log_warning("sim", warning);
    probes.start(run.time, *run.solver);
  }

  double frame_time(int f) const { return (f - shot.timeline.first) / shot.timeline.fps; }

  /// Layers due by `until`, each moved on from the moment it left; the next step knows their speed.
  void emit(double until) {
    shut_crowded_inlets(until);
    for (size_t e = 0; e < layer.size(); ++e) {
      const FluidEmitter& source = shot.fluid.emitter[e];
      if (source.type == EmitterType::mesh) continue;
      for (;; ++emitted[e]) {
        const double leaves =
            source.start - shot.preroll + (double(emitted[e]) + 0.5) * layer[e].interval;
        if (leaves > until || leaves > source.stop - shot.preroll) break;
        check_room(e, layer[e].place.size(), until);
        if (that_fit(e, layer[e].place.size(), until) < layer[e].place.size()) continue;
        if (shut[e] > 0) continue;
        const double frame_then = shot.timeline.first + leaves * shot.timeline.fps;
        const sim::Inlet inlet = sim::inlet_at(source, shot.timeline, frame_then);
        run.limits.max_speed = std::max(run.limits.max_speed, float(inlet.velocity.length()));
        births.add({next_id, emitter_source(e), leaves});
        add_layer(layer[e], inlet, until - leaves, until);
      }
    }
    for (sim::MeshEmitter& e : run.scene.mesh_emitter) {
      if (e.active(until)) fill(e, until);
    }
  }

  int emitter_source(size_t e) const {
    return int(shot.fluid.sources() - shot.fluid.emitter.size() + e);
  }

  void check_room(size_t emitter, size_t more, double now) const {
    if (run.solver->particles() + more <= max_particles) return;
    throw Error(fmt::format(
        "{}: emitter {} would pass {} particles at t = {:.4g} s. Use a larger spacing or stop the "
        "emitter earlier",
        shot.file.string(), emitter + 1, max_particles, now));
  }

  /// Once an emitter.
  void warn_full(size_t emitter, double now, const std::string& what) {
    if (told_full[emitter]) return;
    told_full[emitter] = true;
    log_warning("sim", fmt::format("fluid.emitter[{}] has no room at t = {:.4g} s: {}. It sends "
                                   "nothing until there is room. Stop it earlier (stop), leave a "
                                   "way out, or add a [[sink]]",
                                   emitter, now, what));
  }

  /// Of `more` particles of an emitter those that a closed domain has room for. Nothing but their
  /// number decides, so that a sink lets it send again and a resumed run does the same.
  size_t that_fit(size_t emitter, size_t more, double now) {
    if (!room) room = sim::room_of(shot, run.scene, sim::Counted::standing, -shot.preroll);
    const double there = double(run.solver->particles());
    if (there + double(more) <= *room) return more;
    warn_full(
        emitter, now,
        fmt::format("the domain is closed and full ({:.0f} of {:.0f} particles)", there, *room));
    return size_t(std::max(0.0, *room - there));
  }

  /// Shuts emitters before whose inlets fluid has nowhere to go, as in a vessel that is full, which
  /// shows in its pressure; opens them once fluid has left the scene, or the inlet. Between,
  /// pressure falls back to what rest has, and would tell nothing.
  /// A domain without obstacles or sheets holds no vessel: that_fit knows its room.
  void shut_crowded_inlets(double now) {
    if (shot.obstacle.empty() && shot.cloth.empty()) return;
    for (size_t e = 0; e < layer.size(); ++e) {
      const FluidEmitter& emitter = shot.fluid.emitter[e];
      const double since = now + shot.preroll,
                   most = sim::pressure_without_room(run.scene, emitter);
      const bool sends = since >= emitter.start && since <= emitter.stop;
      if (emitter.type == EmitterType::mesh || !sends) continue;
      if (shut[e] == 0 && !(double(run.limits.pressure) > most)) continue;
      run.solver->refresh();  // the density of these positions, whoever has looked or stopped since
      const sim::NearInlet near = sim::near_inlet(
          shot, run.scene, emitter, shot.timeline.first + now * shot.timeline.fps,
          run.solver->positions(), run.solver->density(), run.solver->pressure_term());
      constexpr double dense = 0.97;  // all around the inlet is fluid
      if (shut[e] > 0) {
        if (uint64_t(run.solver->particles()) < shut[e] || near.density < dense) shut[e] = 0;
      } else if (near.density > dense && near.pressure > most) {
        shut[e] = uint64_t(run.solver->particles());
        warn_full(
            e, now,
            fmt::format("the fluid around it has a pressure of {:.3g} Pa, as in a vessel that "
                        "is closed and full",
                        near.pressure * run.scene.parameters.rest_density));
      }
    }
  }

  /// What a mesh that is kept full lacks, less what would appear inside an obstacle.
  void fill(sim::MeshEmitter& emitter, double now) {
    sim::HostVec position, velocity;
    std::vector<int> id;
    births.add({next_id, emitter_source(emitter.index()), now});
    for (const auto& [p, u] : emitter.missing(run.scene, run.solver->positions(), now)) {
      if (!sim::clear_of_obstacles(run.scene.obstacles, p, now, shot.fluid.spacing)) continue;
      position.push(run.scene.place(0, p.x), run.scene.place(1, p.y), run.scene.place(2, p.z));
      velocity.push(float(u.x), float(u.y), float(u.z));
      run.limits.max_speed = std::max(run.limits.max_speed, float(u.length()));
      id.push_back(next_id++);
    }
    if (id.empty()) return;
    check_room(emitter.index(), id.size(), now);
    const size_t fit = that_fit(emitter.index(), id.size(), now);
    next_id -= int(id.size() - fit);
    position.resize(fit), velocity.resize(fit), id.resize(fit);
    if (id.empty()) return;
    run.solver->append(position, velocity, id);
    emitted[emitter.index()] += id.size();
  }

  /// Moved on for `since` s from where it left. Less what has no way out or would appear inside an
  /// obstacle.
  void add_layer(const sim::EmitterLayer& what, sim::Inlet inlet, double since, double now) {
    sim::HostVec position, velocity;
    std::vector<int> id;
    const V3d u = inlet.velocity, along = inlet.along(), moved = u * since;
    inlet.center += moved;
    for (const auto& place : what.place) {
      V3d p = inlet.at(place);
      const sim::InletPlace from =
          sim::inlet_place(shot, run.scene.obstacles, p - moved, along, now);
      if (from.blocked != sim::InletPlace::Blocked::no) continue;
      if (from.ahead > 0) p += along * from.ahead;
      if (!sim::clear_of_obstacles(run.scene.obstacles, p, now, shot.fluid.spacing)) continue;
      position.push(run.scene.place(0, p.x), run.scene.place(1, p.y), run.scene.place(2, p.z));
      velocity.push(float(u.x), float(u.y), float(u.z));
      id.push_back(next_id++);
    }
    if (!id.empty()) run.solver->append(position, velocity, id);
  }

  /// Steps to time `end` exactly: the rest is cut into equal parts no longer than the stable step.
  void advance_to(double end, StepReport& report, const std::function<bool()>& keep_going) {
    std::map<std::string, int> ruled;
    while (run.time < end) {
      if (keep_going && !keep_going()) throw Stopped("stopped on request");
      emit(run.time);
      sim::StepLimit limit = run.limit();
      if (shot.time_step > 0) limit = fixed_step(limit);
      const double dt = run.step_towards(end, limit.dt);
      check_state(dt);
      probes.record(run.time, *run.solver);
      report.smallest_dt = report.steps ? std::min(report.smallest_dt, dt) : dt;
      report.largest_dt = std::max(report.largest_dt, dt);
      report.max_speed = std::max(report.max_speed, double(run.limits.max_speed));
      report.iterations += run.limits.iterations;
      report.unconverged += run.limits.residual > run.scene.parameters.tolerance;
      report.worst_residual = std::max(report.worst_residual, double(run.limits.residual));
      report.viscous_iterations += run.limits.viscous_iterations;
      report.viscous_unconverged += run.limits.viscous_residual > 0;
      report.sheet_sweeps += run.limits.sheet_sweeps;
      report.sheets_cut_short += run.limits.sheets_cut_short;
      report.worst_viscous_residual =
          std::max(report.worst_viscous_residual, double(run.limits.viscous_residual));
      ++report.steps, report.cloth_substeps += shot.cloth.empty() ? 0 : run.cloth_substeps(dt);
      if (++ruled[limit.name] > ruled[report.limit]) report.limit = limit.name;
    }
  }

  sim::StepLimit fixed_step(const sim::StepLimit& stable) const {
    if (shot.time_step > stable.dt) {
      throw Error(fmt::format(
          "{}: shot.time_step is {:.3g} s but steps above {:.3g} s are unstable now (frame {}, "
          "limit: {}). Use a smaller step, or 0 for an adaptive one",
          shot.file.string(), shot.time_step, stable.dt, frame, stable.name));
    }
    return {shot.time_step, "fixed"};
  }

  /// Of each emitter: whether it is shut.
  std::vector<bool> crowded() const {
    std::vector<bool> now;
    for (const uint64_t particles : shut) now.push_back(particles > 0);
    return now;
  }

  /// @throws BlowUp if anything is not finite or absurdly fast after a step of dt: what, where,
  /// when, why, and what is safe.
  void check_state(double dt) {
    if (run.limits.bad_particle < 0 && run.limits.bad_vertex < 0) return;
    const sim::HostState state = run.solver->save();
    const bool particle = run.limits.bad_particle >= 0;
    const int i = particle ? run.limits.bad_particle : run.limits.bad_vertex;
    const sim::HostVec &x = particle ? state.position : state.cloth_position,
                       &v = particle ? state.velocity : state.cloth_velocity;
    const double speed =
        std::sqrt(double(v.x[i]) * v.x[i] + double(v.y[i]) * v.y[i] + double(v.z[i]) * v.z[i]);
    const std::string text = fmt::format(
        "{}: the simulation blew up {}, t = {:.5f} s, step {}: {} {} at ({:.4g}, {:.4g}, {:.4g}) m "
        "has speed "
        "{:.4g} m/s. No file of the next frame was written; last good checkpoint: {}. {}",
        shot.file.string(), run.time > 0 ? fmt::format("after frame {}", frame) : "in the pre-roll",
        run.time, run.steps, particle ? "particle" : "cloth vertex", particle ? state.id[i] : i,
        run.scene.frame.to_world(0, x.x[i]), run.scene.frame.to_world(1, x.y[i]),
        run.scene.frame.to_world(2, x.z[i]), speed,
        last_checkpoint.empty() ? "none" : last_checkpoint.string(),
        sim::cause_of_blow_up(shot, run.scene, state, run.solver->density(), crowded(),
                              {particle, i}, run.time, dt));
    throw BlowUp(text, last_checkpoint);
  }

  /// What emitters added, sinks took and open sides let go since the last report.
  void count_particles(StepReport& report, const std::vector<uint64_t>& removed) {
    for (size_t k = 0; k < shot.sink.size(); ++k)
      report.drained.emplace_back(shot.sink[k].shape.name, removed[k] - reported[k]);
    report.lost = removed.back() - reported.back();
    report.emitted = uint64_t(next_id - reported_id);
    reported = removed, reported_id = next_id;
  }

  void describe(StepReport& report) {
    if (report.unconverged > 0) {
      log_warning(
          "sim",
          fmt::format("frame {}: in {} of {} steps {} iterations of the pressure solve "
                      "did not reach fluid.tolerance = {:.2g}; mean density error {:.2g} "
                      "at worst",
                      frame, report.unconverged, report.steps, run.scene.parameters.most_iterations,
                      run.scene.parameters.tolerance, report.worst_residual),
          "pressure solve unconverged");
    }
    if (report.viscous_unconverged > 0) {
      log_warning(
          "sim",
          fmt::format("frame {}: in {} of {} steps {} iterations of the viscous solve did "
                      "not reach {:.2g} of the velocity; {:.2g} at worst. Smaller steps "
                      "(shot.time_step) ask for fewer",
                      frame, report.viscous_unconverged, report.steps,
                      run.scene.parameters.most_viscous_iterations,
                      run.scene.parameters.viscous_tolerance, report.worst_viscous_residual),
          "viscous solve unconverged");
    }
    if (report.sheets_cut_short > 0) {
      log_warning("sim",
                  fmt::format("frame {}: in {} of {} steps the sheets' solve was cut short; "
                              "they lack some of what pushed them. Shorter steps "
                              "(shot.time_step) or softer cloth ask for less",
                              frame, report.sheets_cut_short, report.steps),
                  "sheets' solve cut short");
    }
    const std::vector<float> density = run.solver->density();
    const sim::HostState state = run.solver->save();
    report.time = run.time;
    report.particles = density.size();
    for (int t : run.solver->near_triangles()) report.near += t >= 0;
    double sum = 0;
    for (float rho : density) {
      const double over = std::max(0.0, double(rho) / run.scene.parameters.rest_density - 1);
      sum += over;
      report.max_compression = std::max(report.max_compression, over);
    }
    if (!density.empty()) report.mean_compression = sum / double(density.size());
    const auto add = [&](double mass, const sim::HostVec& v, size_t i) {
      const std::array<double, 3> velocity{v.x[i], v.y[i], v.z[i]};
      double square = 0;
      for (size_t c = 0; c < 3; ++c) {
        square += velocity[c] * velocity[c];
        report.momentum[c] += mass * velocity[c];
      }
      report.kinetic_energy += mass * (0.5 * square);
    };
    for (size_t i = 0; i < state.velocity.size(); ++i)
      add(run.scene.parameters.particle_mass, state.velocity, i);
    for (size_t i = 0; i < state.cloth_velocity.size(); ++i) {
      const double water = sim::water_at(run.scene.cloth, state, int(i));
      add(run.scene.cloth.mass[i] + water, state.cloth_velocity, i);
      report.water_in_cloth += water;
    }
    report.guard_hits = state.guard_hits;
    report.sheets_asleep = run.scene.rest.any() ? run.scene.rest.asleep() : 0;
    report.cloth_contacts = run.solver->cloth_contacts();
    for (const sim::ColumnMemory& group : run.solver->memory()) report.memory += group.bytes;
    count_particles(report, state.removed);
  }

  ParticleFrame particles() const {
    const sim::HostState state = run.solver->save();
    ParticleFrame out;
    out.spacing = float(shot.fluid.spacing), out.rest_density = float(shot.fluid.rest_density);
    out.density = run.solver->density();
    for (size_t i = 0; i < state.id.size(); ++i) {
      out.position.push_back(world(state.position, i));
      out.velocity.emplace_back(state.velocity.x[i], state.velocity.y[i], state.velocity.z[i]);
      out.id.push_back(uint32_t(state.id[i]));
      const sim::Birth& birth = births.of(state.id[i]);
      if (shot.fluid.write_source) out.source.push_back(uint8_t(birth.source));
      if (shot.fluid.write_age) out.age.push_back(float(run.time - birth.time));
    }
    return out;
  }

  V3f world(const sim::HostVec& p, size_t i) const {
    return V3f(float(run.scene.frame.to_world(0, p.x[i])),
               float(run.scene.frame.to_world(1, p.y[i])),
               float(run.scene.frame.to_world(2, p.z[i])));
  }

  std::vector<ClothFrame> cloth() const {
    return sim::cloth_frames(shot, run.scene, run.solver->save());
  }

  static constexpr size_t max_particles = 200'000'000;
};

Simulator::Simulator(const Shot& shot, const SimulatorOptions& options)
    : implementation_(std::make_unique<Implementation>(shot, options)) {}
Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&&) noexcept = default;

StepReport Simulator::preroll(const std::function<bool()>& keep_going) {
  Implementation& s = *implementation_;
  StepReport report;
  if (s.run.time >= 0) return report;
  log_info("sim", fmt::format("pre-roll of {} s", s.shot.preroll));
  s.advance_to(0, report, keep_going);
  s.run.solver->refresh();
  s.describe(report);
  return report;
}

StepReport Simulator::advance_frame(const std::function<bool()>& keep_going) {
  Implementation& s = *implementation_;
  preroll(keep_going);
  StepReport report;
  s.advance_to(s.frame_time(s.frame + 1), report, keep_going);
  ++s.frame;
  s.run.solver->refresh();
  s.describe(report);
  return report;
}

int Simulator::frame() const { return implementation_->frame; }

double Simulator::share_of_frame() const {
  const Implementation& s = *implementation_;
  const double begin = s.frame_time(s.frame), end = s.frame_time(s.frame + 1);
  return std::clamp((s.run.time - begin) / (end - begin), 0.0, 1.0);
}

ParticleFrame Simulator::particles() const { return implementation_->particles(); }
std::vector<ClothFrame> Simulator::cloth() const { return implementation_->cloth(); }
std::vector<ProbeText> Simulator::probes() const { return implementation_->probes.texts(); }
std::string Simulator::device_name() const { return implementation_->device; }

WrittenFile Simulator::write_checkpoint(const std::filesystem::path& path) const {
  Implementation& s = *implementation_;
  sim::Checkpoint checkpoint{.frame = s.frame,
                             .time = s.run.time,
                             .steps = uint64_t(s.run.steps),
                             .next_id = s.next_id,
                             .births = s.births.runs(),
                             .emitted = s.emitted,
                             .shut = s.shut,
                             .state = s.run.solver->save(),
                             .rest = s.run.scene.rest.state(),
                             .probes = s.probes.rows(),
                             .layout = s.layout};
  checkpoint.state.limits = s.run.limits;
  WrittenFile written = sim::write_checkpoint(path, checkpoint);
  s.last_checkpoint = path;
  return written;
}

void Simulator::read_checkpoint(const std::filesystem::path& path) {
  Implementation& s = *implementation_;
  sim::Checkpoint checkpoint = sim::read_checkpoint(path, s.layout);
  if (checkpoint.emitted.size() != s.emitted.size() || checkpoint.shut.size() != s.shut.size() ||
      checkpoint.state.cloth_position.size() != size_t(s.run.scene.cloth.vertices()) ||
      checkpoint.state.removed.size() != s.reported.size() ||
      checkpoint.rest.asleep.size() != s.run.scene.rest.state().asleep.size() ||
      checkpoint.rest.mark.size() != s.run.scene.rest.state().mark.size() ||
      !s.probes.fits(checkpoint.probes)) {
    throw Error(path.string() + ": the checkpoint does not fit this shot. Delete it");
  }
  s.frame = checkpoint.frame;
  s.next_id = checkpoint.next_id, s.emitted = checkpoint.emitted, s.shut = checkpoint.shut;
  s.births.resume(std::move(checkpoint.births));
  s.probes.resume(std::move(checkpoint.probes));
  s.run.load(checkpoint.state, checkpoint.state.limits, checkpoint.time, checkpoint.rest);
  s.run.steps = int64_t(checkpoint.steps);
  s.run.solver->refresh();
  s.reported = checkpoint.state.removed, s.reported_id = s.next_id;
  s.last_checkpoint = path;
}

}  // namespace drench

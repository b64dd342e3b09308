// Cases of shells, without water. shell_scaling, shell_million: what a triangle costs a step,
// beside the same sheet that meets nothing and the same net of springs. shell_layers: piles of
// sheets on a floor beside one sheet of as many triangles. shell_drape: a frame of a
// fine sheet that hangs over a ball. shell_work_precision: what errors of closed forms cost.
// shell_gpu, shell_gpu_layers, shell_gpu_drape: the same on a CUDA device.

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/bench/step_cost.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/shell_closed_forms.h"

namespace drench::bench {
namespace {

using sim_tests::SheetMesh;

constexpr int smallest = 64;             // cells along an edge, 8,192 triangles
constexpr double time_step = 1.0 / 300;  // s, five a frame of film at 60 a second

Shot shells_alone() {
  Shot shot = sim_tests::empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.spacing = 0.02;  // that steps may be longer than these
  shot.domain.min = V3d(-3), shot.domain.max = V3d(3);
  return shot;
}

/// Of cotton.
Cloth& add_shell(Shot& shot, V3d corner, V3d u, V3d v, int cells) {
  Cloth& sheet = shot.cloth.emplace_back();
  sheet.name = "sheet" + std::to_string(shot.cloth.size());
  sheet.model = ClothModel::shell;
  sheet.corner = corner, sheet.u = u, sheet.v = v, sheet.cells = V2i(cells, cells);
  return sheet;
}

/// A flat sheet of 1 m.
enum class Flat { hangs, falls };

/// What hangs does so by an edge, let go 30 degrees off the plumb line: it swings and bends.
Shot flat_sheet(Flat flat, int cells) {
  Shot shot = shells_alone();
  if (flat == Flat::falls) {
    add_shell(shot, V3d(-0.5, 2, -0.5), V3d(1, 0, 0), V3d(0, 0, 1), cells);
    return shot;
  }
  const V3d down(0.5, -std::sqrt(0.75), 0);
  ClothPin& pin = add_shell(shot, V3d(0, 0.5, -0.5), V3d(0, 0, 1), down, cells).pin.emplace_back();
  for (int k = 0; k <= cells; ++k) pin.vertices.push_back(uint32_t(k));
  return shot;
}

/// A run and what its steps took.
struct Taken {
  explicit Taken(sim::Scene scene, Where where = Where::cpu)
      : run(make_stepper(std::move(scene), where)), where(where) {}
  explicit Taken(const Shot& shot, Where where = Where::cpu)
      : Taken(sim::build_scene(shot), where) {}

  Measured step(double dt) {
    const Measured cost = measure([&] { run.step(dt); });
    if (run.limits.bad_vertex >= 0) throw BlowUp(run.time);
    cpu.push_back(cost.cpu_s), wall.push_back(cost.wall_s);
    sweeps += run.limits.sheet_sweeps, cut_short += run.limits.sheets_cut_short;
    add(total, cost);
    return cost;
  }
  void warm(int steps) {
    for (int k = 0; k < steps; ++k) run.step(time_step);
  }
  double triangles() const { return run.scene.cloth.triangles(); }

  sim::Stepper run;
  Where where;
  std::vector<double> cpu, wall;  // s, of steps
  double sweeps = 0;              // in all of them
  int cut_short = 0;              // of them
  Measured total;
};

Line line_of(const Taken& taken, const std::string& method) {
  Line line;
  line.method = method;
  line.resolution = std::to_string(int(taken.triangles())) + " triangles";
  line.time_step = time_step;
  line.device = name_of(taken.where);
  line.threads = hardware_threads();
  line.cost = taken.total;
  const double steps = double(taken.cpu.size());
  line.more["cpu_ms_a_step"] = 1e3 * median(taken.cpu);
  line.more["wall_ms_a_step"] = 1e3 * median(taken.wall);
  line.more["sweeps_a_step"] = taken.sweeps / steps;
  line.more["steps_cut_short"] = taken.cut_short;
  const double step = median(taken.where == Where::cpu ? taken.cpu : taken.wall);
  line.more["ns_a_triangle_step"] = 1e9 * step / taken.triangles();
  double bytes = 0;
  for (const sim::ColumnMemory& group : taken.run.solver->memory()) bytes += double(group.bytes);
  line.more["bytes_a_triangle"] = bytes / taken.triangles();
  line.more["steps"] = int(steps);
  return line;
}

struct Size {
  int cells, steps;
};

/// With contact among sheets and without, step by step in turns: nothing is near, so that both have
/// the same bits.
void flat_pair(Flat flat, const Size& size, const Emit& emit) {
  Shot shot = flat_sheet(flat, size.cells);
  Taken with(shot);
  shot.cloth[0].self_collision = false;
  Taken without(shot);
  with.warm(1), without.warm(1);
  std::vector<double> ratio;
  for (int k = 0; k < size.steps; ++k) {
    const Measured a = with.step(time_step), b = without.step(time_step);
    ratio.push_back(a.cpu_s / b.cpu_s);
  }
  const std::string what = flat == Flat::hangs ? "shell that hangs" : "shell that falls";
  Line line = line_of(with, what);
  line.error = median(ratio), line.gate = 2;
  line.error_of = "CPU time of a step over that of the sheet that meets nothing";
  emit(line);
  emit(line_of(without, what + ", meets nothing"));
  if (size.cells > smallest) return;
  line.method += ", against its bar";
  // A machine that others share has no wall time of its own.
  line.error = 1e3 * median(with.cpu) / 2, line.gate = 25;
  line.error_of = "CPU ms a step by two cores";
  emit(line);
}

/// Springs of the shell's moduli along both threads, explicit, in as many substeps as they ask for.
void springs(const Size& size, const Emit& emit) {
  Shot shot = flat_sheet(Flat::hangs, size.cells);
  Cloth& sheet = shot.cloth[0];
  sheet.model = ClothModel::springs;
  sheet.adjacent_stiffness = sheet.young_warp, sheet.diagonal_stiffness = 0.5 * sheet.young_warp;
  Taken taken(shot);
  taken.warm(1);
  for (int k = 0; k < size.steps; k += 3) taken.step(time_step);  // of many substeps, all alike
  Line line = line_of(taken, "springs that hang");
  line.more["substeps"] = taken.run.cloth_substeps(time_step);
  emit(line);
}

void shell_scaling(const Emit& emit) {
  flat_pair(Flat::falls, {smallest, 20}, emit);
  for (const Size& size : sizes({Size{smallest, 40}, Size{182, 9}, Size{360, 5}}, 1)) {
    flat_pair(Flat::hangs, size, emit);
    springs(size, emit);
  }
}

void add_contacts(Line& line, const sim::Stepper& run) {
  const sim::ClothContacts bear = run.solver->cloth_contacts();
  line.more["contacts_of_sheets"] = bear.sheets;
  line.more["contacts_at_obstacles"] = bear.obstacles;
  line.more["fastest_mm_a_s"] = 1e3 * run.limits.max_speed;
}

/// Layers of 0.2 m a thickness apart, the lowest on the floor, that press each other nearer by
/// their weight.
Shot layers_on_floor(int layers, int cells = 16) {
  Shot shot = shells_alone();
  shot.domain.min.y = 0, shot.domain.axis[1] = Axis::walls;
  const double keep = 0.25 * shot.fluid.spacing;  // m, that walls keep, and half the thickness
  for (int k = 0; k < layers; ++k) {
    const double height = keep + (k + 0.5) * Cloth{}.thickness;
    add_shell(shot, V3d(-0.1, height, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.2), cells).damping = 20;
  }
  return shot;
}

struct Pile {
  int layers, flat_cells;  // along an edge of a flat sheet of as many triangles
  int settling, steps;     // before those that are measured; of the same
};

/// Settling takes longer than the case may: how fast they still are stands beside it.
void layers_beside_flat(const Pile& of, const Emit& emit) {
  Taken flat(flat_sheet(Flat::hangs, of.flat_cells)), pile(layers_on_floor(of.layers));
  flat.warm(1), pile.warm(of.settling);
  std::vector<double> ratio;
  for (int k = 0; k < of.steps; ++k) {
    const Measured a = pile.step(time_step), b = flat.step(time_step);
    ratio.push_back(a.cpu_s / b.cpu_s);
  }
  emit(line_of(flat, "flat sheet that hangs"));
  Line line = line_of(pile, std::to_string(of.layers) + " layers on the floor");
  line.error = median(ratio), line.gate = 1.5;
  line.error_of = "CPU time of a step over that of the flat sheet beside it";
  add_contacts(line, pile.run);
  emit(line);
}

void shell_layers(const Emit& emit) {
  layers_beside_flat({10, 51, 15, 10}, emit);
  layers_beside_flat({100, 160, 2, 3}, emit);
}

/// A sheet of 1 m that falls a millimetre onto a ball of 0.2 m and hangs down from it.
Shot sheet_over_ball(int cells) {
  Shot shot = shells_alone();
  constexpr double radius = 0.2;
  sim_tests::add_sphere(shot, V3d(0), radius);
  const double keep = 0.25 * shot.fluid.spacing + 0.5 * Cloth{}.thickness;
  add_shell(shot, V3d(-0.5, radius + keep + 1e-3, -0.5), V3d(1, 0, 0), V3d(0, 0, 1), cells);
  return shot;
}

/// Columns of a grid of vertices on one `by` times as fine, bilinear.
sim::HostVec refined(const sim::HostVec& coarse, int cells, int by) {
  sim::HostVec fine;
  const auto line = [&](int k) { return std::min(k / by, cells - 1); };
  for (int j = 0; j <= cells * by; ++j) {
    for (int i = 0; i <= cells * by; ++i) {
      const double s = double(i) / by - line(i), t = double(j) / by - line(j);
      const auto corner = [&](int a, int b) {
        return sim_tests::at(coarse, size_t((line(j) + b) * (cells + 1) + line(i) + a));
      };
      const V3d x = (corner(0, 0) * (1 - s) + corner(1, 0) * s) * (1 - t) +
                    (corner(0, 1) * (1 - s) + corner(1, 1) * s) * t;
      fine.push(float(x.x), float(x.y), float(x.z));
    }
  }
  return fine;
}

/// How a sheet over a ball hangs after half a second, and one four times as fine that has a frame
/// of 1/60 s to itself after another.
struct Draped {
  static constexpr int cells = 71, by = 4, steps = 5;

  explicit Draped(Where where) : coarse(sheet_over_ball(cells)), fine(settled(), where) {
    fine.warm(steps);
    for (int k = 0; k < steps; ++k) fine.step(time_step);
  }
  sim::Scene settled() {
    while (coarse.run.time < 0.5) coarse.step(time_step);
    sim::Scene scene = sim::build_scene(sheet_over_ball(cells * by));
    const sim::HostState draped = coarse.run.solver->save();
    scene.start.cloth_position = refined(draped.cloth_position, cells, by);
    scene.start.cloth_velocity = refined(draped.cloth_velocity, cells, by);
    return scene;
  }
  Line line() const {
    Line line = line_of(fine, "hangs over a ball, a frame of 1/60 s");
    add_contacts(line, fine.run);
    return line;
  }
  Taken coarse, fine;
};

void shell_drape(const Emit& emit) {
  const Draped draped(Where::cpu);
  Line first = line_of(draped.coarse, "falls over a ball and hangs, half a second");
  add_contacts(first, draped.coarse.run);
  emit(first);
  Line line = draped.line();
  line.error = draped.fine.total.cpu_s / 2, line.gate = 24;
  line.error_of = "CPU s a frame by two cores";
  emit(line);
}

void shell_gpu(const Emit& emit) {
  if (!has_cuda(emit)) return;
  for (const int cells : {smallest, 182, 360, 708}) {
    Taken taken(flat_sheet(Flat::hangs, cells), Where::cuda);
    taken.warm(2);
    for (int k = 0; k < 10; ++k) taken.step(time_step);
    emit(line_of(taken, "shell that hangs"));
  }
}

void shell_gpu_layers(const Emit& emit) {
  if (!has_cuda(emit)) return;
  for (const int cells : {16, 69}) {  // 25,600 and 476,100 triangles
    Taken pile(layers_on_floor(50, cells), Where::cuda);
    pile.warm(5);
    for (int k = 0; k < 10; ++k) pile.step(time_step);
    Line line = line_of(pile, "50 layers on the floor");
    if (cells > 16) {
      line.error = 1e3 * median(pile.wall), line.gate = 5;
      line.error_of = "ms a step";
    }
    add_contacts(line, pile.run);
    emit(line);
  }
}

void shell_gpu_drape(const Emit& emit) {
  if (has_cuda(emit)) emit(Draped(Where::cuda).line());
}

/// A closed form at three resolutions.
struct Trial {
  std::string name;
  int coarsest;  // cells, doubled twice
  double gate;   // of the finest
  std::function<double(SheetMesh, int)> error;
};

std::vector<Trial> trials() {
  using namespace sim_tests;
  std::vector<Trial> all{
      {"elongation of a hanging sheet", 4, 1e-3,
       [](SheetMesh mesh, int cells) { return hanging_error(mesh, cells, 0.01); }},
      {"sag of a catenary", 12, 5e-3, catenary_error},
      {"deflection of a clamped plate", 10, 1e-2, plate_error},
      {"period of a cantilever's first mode", 10, 1e-2,
       [](SheetMesh mesh, int cells) { return mode_error(mesh, cells, 2.5e-3); }},
      {"period of a pendulum", 5, 5e-3, pendulum_error}};
  for (const int gamma : {1, 10, 100}) {
    // An unstructured mesh that is thinner cannot bend without stretching.
    const auto error = [gamma](SheetMesh mesh, int cells) {
      return cantilever_error(mesh, cells, gamma, mesh == SheetMesh::unstructured ? 100 : 300);
    };
    const double gate = gamma == 1 ? 0.02 : gamma == 10 ? 0.03 : 0.05;
    all.push_back({"drop of a cantilever, Gamma " + std::to_string(gamma), 10, gate, error});
  }
  return all;
}

void shell_work_precision(const Emit& emit) {
  for (const Trial& trial : trials()) {
    for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::unstructured}) {
      for (const int cells : {trial.coarsest, 2 * trial.coarsest, 4 * trial.coarsest}) {
        Line line;
        double error = 0;
        line.cost = measure([&] { error = trial.error(mesh, cells); });
        line.method =
            trial.name + (mesh == SheetMesh::diagonal ? ", right triangles" : ", unstructured");
        line.resolution = std::to_string(cells) + " cells";
        line.threads = hardware_threads();
        line.error = std::abs(error);
        line.error_of = "over that of the closed form, less 1";
        if (cells == 4 * trial.coarsest) line.gate = trial.gate;
        emit(line);
      }
    }
  }
}

const Registration scaling{"shell_scaling",
                           "time and memory of a shell's triangle to 259k, and of contact",
                           shell_scaling, InQuick::yes};
const Registration million{"shell_million", "the same of a million triangles",
                           [](const Emit& emit) {
                             flat_pair(Flat::hangs, {708, 2}, emit);
                           }};
const Registration layers{"shell_layers", "piles of ten and a hundred shells on a floor",
                          shell_layers};
const Registration drape{"shell_drape", "a frame of a fine shell that hangs over a ball",
                         shell_drape};
const Registration gpu{"shell_gpu", "shells on a CUDA device to a million triangles", shell_gpu};
const Registration gpu_layers{"shell_gpu_layers", "piles of fifty shells on a CUDA device",
                              shell_gpu_layers};
const Registration gpu_drape{"shell_gpu_drape", "shell_drape's fine shell on a CUDA device",
                             shell_gpu_drape};
const Registration precision{"shell_work_precision", "time and error of shells' closed forms",
                             shell_work_precision, InQuick::yes};

}  // namespace
}  // namespace drench::bench

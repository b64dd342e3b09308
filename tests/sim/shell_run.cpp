#include "tests/sim/shell_run.h"

#include <fmt/format.h>

#include "pipeline/contract/shot/shot_file.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {

namespace {

std::string numbers(const V3d& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }

sim::ShellSurface placed(const ShellSheet& sheet) {
  sim::ShellSurface s = flat_sheet(sheet.mesh, sheet.size);
  if (sheet.held) hold(s, sheet.held);
  s.uv.clear();
  for (V3d& x : s.rest) {
    s.uv.push_back(Imath::V2f(float(x.x), float(x.y)));
    x = sheet.shape ? sheet.shape(x) : sheet.corner + sheet.along * x.x + sheet.across * x.y;
  }
  return s;
}

std::string obj_of(const sim::ShellSurface& s) {
  std::string text;
  for (const V3d& x : s.rest) text += fmt::format("v {} {} {}\n", x.x, x.y, x.z);
  for (const auto& uv : s.uv) text += fmt::format("vt {} {}\n", uv.x, uv.y);
  for (const auto& t : s.triangle)
    text += fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

sim::Scene scene_of(const ShellSheet& sheet) {
  const test::TemporaryFolder folder;
  test::write_quickly(folder / "sheet.obj", obj_of(placed(sheet)));
  return sim::build_scene(parse_shot(shell_text(sheet, "sheet.obj"), folder / "scene.toml"));
}

ShellStatics statics_of(const ShellSheet& sheet) {
  const auto law = sim::cpu::orthotropic(sheet.young, sheet.young,
                                         sheet.young / (2 * (1 + sheet.poisson)), sheet.poisson);
  ShellStatics statics(placed(sheet),
                       {sheet.areal_density, sim::rigidity_of_plate(sheet.bend, sheet.poisson)},
                       {law, sim::cpu::strain_limit(sheet.stretch_limit, sheet.young), 0.});
  statics.add_gravity(sheet.gravity);
  return statics;
}

}  // namespace

std::string shell_text(const ShellSheet& sheet, const std::string& mesh) {
  std::string text = fmt::format(R"(
[shot]
frames = [1, 100]
gravity = {}
[domain]
min = [-2, -2, -2]
max = [2, 2, 2]
[[cloth]]
mesh = "{}"
weld = 0
model = "shell"
young_warp = {}
young_weft = {}
shear_modulus = {}
poisson = {}
bend_warp = {}
bend_weft = {}
bend_bias = {}
stretch_limit = {}
areal_density = {}
damping = {}
damping_time = {}
)",
                                 numbers(sheet.gravity), mesh, sheet.young, sheet.young,
                                 sheet.young / (2 * (1 + sheet.poisson)), sheet.poisson, sheet.bend,
                                 sheet.bend, sheet.bend, sheet.stretch_limit, sheet.areal_density,
                                 sheet.damping, sheet.damping_time);
  const sim::ShellSurface surface = placed(sheet);
  std::string pins;
  for (size_t v = 0; v < surface.held.size(); ++v)
    if (surface.held[v]) pins += fmt::format("{}{}", pins.empty() ? "" : ", ", v);
  if (!pins.empty()) text += "[[cloth.pin]]\nvertices = [" + pins + "]\n";
  return text;
}

ShellRun::ShellRun(const ShellSheet& sheet)
    : Stepper(scene_of(sheet)), surface(placed(sheet)), statics_(statics_of(sheet)) {
  flat_ = flat_sheet(sheet.mesh, sheet.size).rest;
  origin_ = V3d(scene.frame.origin[0], scene.frame.origin[1], scene.frame.origin[2]);
}

std::vector<V3d> ShellRun::places() const {
  const sim::HostState state = solver->save();
  std::vector<V3d> x;
  for (size_t v = 0; v < size(); ++v)
    x.push_back(at(state.cloth_position, v) + at(state.shell_rounding, v) + origin_);
  return x;
}

std::vector<V3d> ShellRun::velocities() const {
  const sim::HostState state = solver->save();
  std::vector<V3d> all;
  for (size_t v = 0; v < size(); ++v) all.push_back(at(state.cloth_velocity, v));
  return all;
}

void ShellRun::start_from(const std::vector<V3d>& places, const std::vector<V3d>& velocities) {
  sim::HostState state = scene.start;
  for (size_t v = 0; v < size(); ++v) {
    const V3d x = places[v] - origin_;
    const V3d& u = velocities[v];
    state.cloth_position.x[v] = float(x.x), state.cloth_position.y[v] = float(x.y),
    state.cloth_position.z[v] = float(x.z);
    state.cloth_velocity.x[v] = float(u.x), state.cloth_velocity.y[v] = float(u.y),
    state.cloth_velocity.z[v] = float(u.z);
  }
  load(state, {}, time);
  limits = solver->measure();
}

V3d ShellRun::mean(const std::function<bool(V3d)>& where) const {
  const std::vector<V3d> x = places();
  V3d sum(0);
  int count = 0;
  for (size_t v = 0; v < size(); ++v)
    if (where(flat_[v])) sum += x[v], ++count;
  return sum / count;
}

double ShellRun::energy() const {
  statics_.x = places();
  const std::vector<V3d> u = velocities();
  double energy = statics_.energy();
  for (size_t v = 0; v < size(); ++v) energy += 0.5 * statics_.rest().mass[v] * u[v].length2();
  return energy;
}

V3d ShellRun::momentum() const {
  const std::vector<V3d> u = velocities();
  V3d sum(0);
  for (size_t v = 0; v < size(); ++v) sum += u[v] * statics_.rest().mass[v];
  return sum;
}

V3d ShellRun::spin() const {
  const std::vector<V3d> x = places(), u = velocities();
  V3d centre(0), sum(0);
  double mass = 0;
  for (size_t v = 0; v < size(); ++v)
    centre += x[v] * statics_.rest().mass[v], mass += statics_.rest().mass[v];
  for (size_t v = 0; v < size(); ++v)
    sum += (x[v] - centre / mass).cross(u[v]) * statics_.rest().mass[v];
  return sum;
}

}  // namespace drench::sim_tests

// CPU against CUDA where sheets are shells: states bent and in contact from the start, and a few
// steps. Skipped, with the reason, where there is no GPU.

#if defined(DRENCH_HAS_CUDA)

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/same_state.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

constexpr double spacing = 0.01, thickness = 0.001;  // m
constexpr double post = 0.02;                        // m, radius of the cylinder of a mesh

Shot shells_alone() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.domain.min = V3d(-0.2), shot.domain.max = V3d(0.2);
  shot.fluid.spacing = spacing;
  return shot;
}

/// A square about the origin, at `height`.
Cloth& add_shell(Shot& shot, double size, double height, int cells) {
  Cloth& sheet = add_sheet(shot, size, height, cells);
  sheet.name = fmt::format("sheet{}", shot.cloth.size());
  sheet.model = ClothModel::shell;
  sheet.thickness = thickness;
  return sheet;
}

void bend_as_paper(Cloth& sheet) { sheet.bend_warp = sheet.bend_weft = sheet.bend_bias = 1e-3; }
void make_limp(Shot& shot) {
  for (Cloth& sheet : shot.cloth) sheet.bend_warp = sheet.bend_weft = sheet.bend_bias = 1e-9;
}
void part_sheets(Shot& shot) {
  for (Cloth& sheet : shot.cloth) sheet.self_collision = false;
}
void take_obstacles(Shot& shot) { shot.obstacle.clear(); }

// --- Where vertices start, by where the shot has them: m, m/s ------------------------------------

struct Start {
  V3d place, velocity{0};
};

/// On a cylinder along z.
Start rolled(V3d x) {
  const double radius = 0.04, angle = x.x / radius;
  return {V3d(radius * std::sin(angle), x.y - radius * (1 - std::cos(angle)), x.z)};
}
Start waved(V3d x) { return {x + V3d(0, 0.004 * std::sin(M_PI * x.x / 0.2), 0)}; }

/// Folded in two at x = 0, askew, the layers nearer than a thickness; the upper slides on the
/// lower.
Start folded(V3d x) {
  const double turn = 0.02;  // of the upper layer
  if (x.x < 0) return {x};
  const double c = std::cos(turn), s = std::sin(turn);
  const double up = std::min(1., x.x / 0.005) * 1.1 * thickness;
  return {V3d(-x.x * c + x.z * s, x.y + up, x.z * c + x.x * s), V3d(0.3, -0.2, 0.05)};
}

// --- Shots ---------------------------------------------------------------------------------------

/// Held at two corners.
Shot hanging(int cells) {
  Shot shot = shells_alone();
  Cloth& sheet = add_shell(shot, 0.1, 0, cells);
  bend_as_paper(sheet);
  sheet.pin.emplace_back().vertices = {0, uint32_t(cells)};
  return shot;
}

/// In a frame that begins to turn.
Shot turning() {
  Shot shot = hanging(8);
  shot.frame_rotation_deg.keys = {{1001, 0}, {1002, 30}};
  return shot;
}
void stop_turning(Shot& shot) { shot.frame_rotation_deg.keys = {{1001, 0}}; }

Shot strip() {
  Shot shot = shells_alone();
  Cloth& sheet = add_shell(shot, 0.12, 0, 24);
  sheet.corner = V3d(-0.06, 0, -0.01), sheet.v = V3d(0, 0, 0.02), sheet.cells = V2i(24, 4);
  sheet.young_warp = sheet.young_weft = 200;
  return shot;
}

/// A heavy sheet slides on one that is held along its edges.
Shot stacked() {
  Shot shot = shells_alone();
  pin_edges(add_shell(shot, 0.06, 0, 6));
  Cloth& upper = add_shell(shot, 0.05, 0.95 * thickness, 5);
  upper.corner.x += 0.0013, upper.corner.z += 0.0007;
  upper.u = V3d(0.05, 0, 0.002), upper.v = V3d(-0.002, 0, 0.05);
  upper.velocity = V3d(0.3, -0.2, 0.1), upper.areal_density = 5;
  return shot;
}

/// Two sheets that would go through each other within a step.
Shot clapping() {
  Shot shot = shells_alone();
  add_shell(shot, 0.06, 0, 6).velocity = V3d(0, 2, 0);
  Cloth& upper = add_shell(shot, 0.05, 0.0037, 4);
  upper.velocity = V3d(0.3, -2, 0), upper.corner += V3d(0.0013, 0, 0.0007);
  upper.u.y = 0.002;
  return shot;
}

/// Cells of two spacings: obstacles meet triangles between their vertices.
Shot coarse() {
  Shot shot = shells_alone();
  add_shell(shot, 0.12, 0, 6).velocity = V3d(0.2, -1, 0);
  return shot;
}
Shot on_a_ball() {
  Shot shot = coarse();
  add_sphere(shot, V3d(0.013, -0.009, 0.005), 0.006);
  return shot;
}
Shot on_a_corner() {
  Shot shot = coarse();
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(0.003, -0.055, 0.004));
  box.size = V3d(0.06), box.rotation_deg = V3d(45, 0, 35.2644), box.friction = 0.4;
  box.position.keys = {{1001, V3d(0.003, -0.055, 0.004)}, {1003, V3d(0.003, 0.025, 0.01)}};
  return shot;
}
/// The ball is an image of the one beyond the seam.
Shot across_a_seam() {
  Shot shot = on_a_ball();
  shot.domain.axis[0] = Axis::periodic;
  shot.cloth[0].corner.x += 0.2;
  shot.obstacle[0].position.keys[0].second.x -= 0.2;
  return shot;
}
/// Friction holds it.
Shot on_a_slope() {
  Shot shot = shells_alone();
  const V3d normal = V3d(-0.2, 1, 0).normalized(), down(normal.y, -normal.x, 0);
  Cloth& sheet = add_shell(shot, 0.1, 0, 8);
  sheet.u = down * 0.1, sheet.corner = normal * 0.0029 - (sheet.u + sheet.v) / 2;
  add_plane(shot, V3d(0), normal);
  return shot;
}
Shot thrown_on_a_corner() {
  Shot shot = on_a_corner();
  shot.cloth[0].velocity.y = -7;
  return shot;
}
Shot on_a_mesh() {
  Shot shot = coarse();
  Obstacle& cylinder = add_obstacle(shot, ObstacleType::mesh, V3d(0.003, -post - 0.002, 0));
  cylinder.mesh_file = bounding_mesh(post, 0.06);
  return shot;
}
Shot between_plates() {
  Shot shot = coarse();
  shot.cloth[0].velocity = V3d(0);
  for (const int side : {-1, 1}) {
    const V3d start(0.01, side * 0.0225, 0.005), end(0.01, side * 0.021, 0.005);
    Obstacle& plate = add_obstacle(shot, ObstacleType::box, start);
    plate.name = fmt::format("plate{}", side);
    plate.size = V3d(0.07, 0.04, 0.07), plate.rotation_deg = V3d(0, 25, 0);
    plate.position.keys = {{1001, start}, {1002, end}};
  }
  return shot;
}
/// Layers over a corner that comes up.
Shot layers_on_a_corner() {
  Shot shot = on_a_corner();
  shot.cloth.push_back(shot.cloth[0]);
  shot.cloth[1].name = "upper", shot.cloth[1].corner += V3d(0.001, 0.95 * thickness, 0.002);
  return shot;
}

/// One edge is shaken and turned, one follows a ball, a corner is soft and let go.
Shot pulled() {
  Shot shot = shells_alone();
  Cloth& sheet = add_shell(shot, 0.08, 0, 8);
  sheet.velocity = V3d(0, 1, 0);
  ClothPin& edge = sheet.pin.emplace_back();
  for (uint32_t v = 0; v < 9; ++v) edge.vertices.push_back(9 * v);
  edge.position.keys = {{1001, V3d(0)}, {1002, V3d(0.01, 0.02, 0)}};
  edge.rotation_deg.keys = {{1001, V3d(0)}, {1002, V3d(20, 0, 0)}};
  Obstacle& ball = add_obstacle(shot, ObstacleType::sphere, V3d(0.08, 0, 0));
  ball.radius = 0.02, ball.name = "ball";
  ball.position.keys = {{1001, V3d(0.08, 0, 0)}, {1002, V3d(0.08, 0.02, 0.01)}};
  ClothPin& carried = sheet.pin.emplace_back();
  carried.vertices = {8, 17}, carried.on = "ball";
  ClothPin& soft = sheet.pin.emplace_back();
  soft.vertices = {80}, soft.stiffness = 50, soft.release = 0.005;
  return shot;
}
void let_go(Shot& shot) { shot.cloth[0].pin.clear(); }

/// Two sheets that a seam draws together.
Shot sewn() {
  Shot shot = shells_alone();
  for (const int side : {-1, 1}) add_shell(shot, 0.05, 0, 5).corner.x += 0.03 * side;
  shot.cloth[0].pin.emplace_back().vertices = {0, 30};
  ClothSeam& seam = shot.cloth[0].seam.emplace_back();
  seam.edge = GridEdge::u1, seam.to = "sheet2", seam.to_edge = GridEdge::u0, seam.time = 0.02;
  return shot;
}
void rip(Shot& shot) { shot.cloth[0].seam.clear(); }

/// A mesh that is curved at rest.
Shot curved() {
  Shot shot = shells_alone();
  Cloth& sheet = shot.cloth.emplace_back();
  sheet.model = ClothModel::shell;
  sheet.mesh_file = std::filesystem::temp_directory_path() / "drench_cuda_arc.obj";
  std::string text;
  for (int j = 0; j <= 5; ++j)
    for (int i = 0; i <= 8; ++i)
      text +=
          fmt::format("v {} {} {}\n", 0.05 * std::sin(0.2 * i), 0.05 * std::cos(0.2 * i), 0.01 * j);
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i < 8; ++i) {
      const int a = 9 * j + i + 1;
      text += fmt::format("f {0} {1} {2}\nf {0} {2} {3}\n", a, a + 1, a + 10, a + 9);
    }
  }
  test::write_quickly(sheet.mesh_file, text);
  bend_as_paper(sheet);
  sheet.pin.emplace_back().vertices = {0, 9, 18, 27, 36, 45};
  return shot;
}

/// A sheet that is joined to itself across a periodic axis, in the wind.
Shot joined() {
  Shot shot = shells_alone();
  shot.domain.axis[0] = Axis::periodic;
  Cloth& sheet = add_shell(shot, 0.4, 0, 16);
  sheet.v = V3d(0, 0, 0.1), sheet.corner.z = -0.05, sheet.cells = V2i(16, 4);
  bend_as_paper(sheet);
  shot.wind.present = true, shot.wind.velocity = V3d(3, 4, 1);
  return shot;
}
/// The same on which a block falls across the seam.
Shot joined_under_water() {
  Shot shot = joined();
  shot.wind = {};
  shot.fluid.solver = FluidSolver::incompressible;
  ClothPin& edges = shot.cloth[0].pin.emplace_back();
  for (uint32_t k = 0; k < 17; ++k) edges.vertices.insert(edges.vertices.end(), {k, 68 + k});
  add_box(shot, V3d(0.17, 0.003, -0.03), {6, 4, 6}, V3d(0.2, -3, 0));
  return shot;
}
void calm(Shot& shot) { shot.wind = {}; }

/// A block falls on two layers that are held along their edges.
Shot under_water() {
  Shot shot = shells_alone();
  shot.fluid.solver = FluidSolver::incompressible;
  pin_edges(add_shell(shot, 0.12, 0, 8));
  pin_edges(add_shell(shot, 0.12, -1.05 * thickness, 8));
  shot.cloth[1].corner += V3d(0.001, 0, 0.002);
  add_box(shot, V3d(-0.03, 0.003, -0.03), {6, 4, 6}, V3d(0.2, -6, 0));
  return shot;
}
void take_water(Shot& shot) { shot.fluid.box.clear(); }

Shot on_a_rod_under_water() {
  Shot shot = under_water();
  shot.cloth.pop_back();
  Obstacle& rod = add_obstacle(shot, ObstacleType::box, V3d(0.004, -0.004, 0));
  rod.size = V3d(0.004, 0.004, 0.2), rod.rotation_deg = V3d(0, 20, 0);
  return shot;
}
Shot under_honey() {
  Shot shot = under_water();
  shot.cloth.pop_back();
  shot.fluid.kinematic_viscosity = 1e-2;
  for (Cloth& sheet : shot.cloth) sheet.slip = Slip::none;
  return shot;
}
void thin_honey(Shot& shot) { shot.fluid.kinematic_viscosity = 1e-6; }

// --- Comparison ----------------------------------------------------------------------------------

struct Situation {
  const char* name;
  Shot (*shot)();
  void (*without)(Shot&);  // takes away what it is about
  Start (*start)(V3d) = nullptr;
  int steps = 3;
  double dt = 2e-3;  // s
};
const Situation situations[] = {
    {"Hangs", [] { return hanging(8); }, make_limp, rolled},
    {"Turns", turning, stop_turning, rolled},
    {"Folded", strip, part_sheets, folded},
    {"Stacked", stacked, part_sheets, nullptr, 1},
    {"Claps", clapping, part_sheets},
    {"OnABall", on_a_ball, take_obstacles},
    {"OnACorner", on_a_corner, take_obstacles},
    {"AcrossASeam", across_a_seam, take_obstacles},
    {"OnASlope", on_a_slope, take_obstacles},
    {"ThrownOnACorner", thrown_on_a_corner, take_obstacles, nullptr, 2},
    {"OnAMesh", on_a_mesh, take_obstacles},
    {"BetweenPlates", between_plates, take_obstacles},
    {"LayersOnACorner", layers_on_a_corner, part_sheets, nullptr, 2},
    {"Pulled", pulled, let_go},
    {"Sewn", sewn, rip},
    {"Curved", curved, make_limp},
    {"Joined", joined, calm, waved},
    {"UnderWater", under_water, take_water, nullptr, 3, 8e-4},
    {"OnARodUnderWater", on_a_rod_under_water, take_water, nullptr, 2, 8e-4},
    {"UnderHoney", under_honey, thin_honey, nullptr, 2, 8e-4},
    {"JoinedUnderWater", joined_under_water, take_water, nullptr, 3, 8e-4},
    // Levels that one thread takes, and others.
    {"ManyLevels", [] { return hanging(24); }, make_limp, rolled},
};
void PrintTo(const Situation& s, std::ostream* out) { *out << s.name; }

sim::Scene scene_of(const Situation& situation, const Shot& shot) {
  const LevelSetMaker maker = [](const TriangleMesh&, double voxel, double band,
                                 const LevelSetBounds&) { return cylinder(post, voxel, band); };
  sim::Scene scene = sim::build_scene(shot, maker);
  // The same iterations on both devices, whichever side of a tolerance the last bit falls.
  scene.parameters.tolerance = 0, scene.parameters.most_iterations = 10;
  scene.parameters.viscous_tolerance = 0, scene.parameters.most_viscous_iterations = 10;
  scene.parameters.factors_sheets = false;  // as on the GPU
  if (!situation.start) return scene;
  sim::HostVec &x = scene.start.cloth_position, &u = scene.start.cloth_velocity;
  for (size_t v = 0; v < x.size(); ++v) {
    const sim::LocalFrame& f = scene.frame;
    const Start s =
        situation.start(V3d(f.to_world(0, x.x[v]), f.to_world(1, x.y[v]), f.to_world(2, x.z[v])));
    x.x[v] = f.to_local(0, s.place.x), x.y[v] = f.to_local(1, s.place.y);
    x.z[v] = f.to_local(2, s.place.z);
    if (scene.cloth.inverse_mass[v] == 0) continue;
    u.x[v] += float(s.velocity.x), u.y[v] += float(s.velocity.y), u.z[v] += float(s.velocity.z);
  }
  return scene;
}

using MakeSolver = decltype(&sim::cuda::make_solver);

sim::Stepper stepper(const sim::Scene& scene, MakeSolver make) {
  return {scene, make(scene.parameters, scene.cloth)};
}
sim::HostState after(const sim::Scene& scene, const Situation& situation, MakeSolver make) {
  sim::Stepper run = stepper(scene, make);
  for (int s = 0; s < situation.steps; ++s) run.step(situation.dt);
  return run.solver->save();
}

/// How two states differ, by column: of the fluid m, m/s, of the sheets m, m/s, m/s^2, N.
constexpr const char* compared[] = {
    "place", "velocity", "sheet's place", "sheet's velocity", "its acceleration", "forces inside"};
using Differences = std::array<double, std::size(compared)>;
constexpr size_t of_sheets_velocity = 3;

/// RMS. Particles are matched by id.
Differences difference(const sim::HostState& a, const sim::HostState& b) {
  Differences sum{};
  const auto add = [&sum](size_t k, const sim::HostVec& x, size_t p, const sim::HostVec& y,
                          size_t q) {
    sum[k] += (at(x, p) - at(y, q)).length2() / double(x.size());
  };
  const std::vector<int> of_a = place_of_id(a), of_b = place_of_id(b);
  for (size_t i = 0; i < std::min(of_a.size(), of_b.size()); ++i) {
    const auto p = size_t(of_a[i]), q = size_t(of_b[i]);
    add(0, a.position, p, b.position, q), add(1, a.velocity, p, b.velocity, q);
  }
  for (size_t v = 0; v < a.cloth_position.size(); ++v) {
    add(2, a.cloth_position, v, b.cloth_position, v);
    add(of_sheets_velocity, a.cloth_velocity, v, b.cloth_velocity, v);
    add(4, a.shell_acceleration, v, b.shell_acceleration, v);
    add(5, a.shell_internal, v, b.shell_internal, v);
  }
  for (double& d : sum) d = std::sqrt(d);
  return sum;
}

class ShellsOnCuda : public testing::TestWithParam<Situation> {
 protected:
  void SetUp() override {
    std::string reason;
    if (!sim::cuda::device_available(reason)) GTEST_SKIP() << "no usable GPU: " << reason;
    scene = scene_of(GetParam(), GetParam().shot());
  }
  sim::HostState on_cpu(const sim::Scene& of) const {
    return after(of, GetParam(), sim::cpu::make_solver);
  }
  sim::HostState on_cuda() const { return after(scene, GetParam(), sim::cuda::make_solver); }
  sim::Scene scene;
};

// Only rounding differs: no more than CPU runs that start an ulp apart do, twice. What the
// situation is about makes five times as much as that.
TEST_P(ShellsOnCuda, AgreesWithCpuToRounding) {
  const sim::HostState cpu = on_cpu(scene), gpu = on_cuda();
  ASSERT_EQ(cpu.id.size(), gpu.id.size());
  Differences noise{};
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const Differences one = difference(cpu, on_cpu(jostled(scene, seed)));
    for (size_t k = 0; k < noise.size(); ++k) noise[k] = std::max(noise[k], one[k]);
  }
  Shot without = GetParam().shot();
  GetParam().without(without);
  const Differences found = difference(cpu, gpu),
                    matters = difference(cpu, on_cpu(scene_of(GetParam(), without)));
  for (size_t k = 0; k < noise.size(); ++k) EXPECT_LE(found[k], 2 * noise[k]) << compared[k];
  EXPECT_GT(matters[of_sheets_velocity], 10 * noise[of_sheets_velocity]);
}

// No float atomics and fixed trees: nothing may depend on how blocks are scheduled.
TEST_P(ShellsOnCuda, GivesTheSameBitsInEveryRunAndResumed) {
  const Situation& situation = GetParam();
  sim::Stepper whole = stepper(scene, sim::cuda::make_solver),
               first = stepper(scene, sim::cuda::make_solver),
               second = stepper(scene, sim::cuda::make_solver);
  for (int s = 0; s < 3; ++s) whole.step(situation.dt);
  first.step(situation.dt), first.step(situation.dt);
  second.load(first.solver->save(), first.limits, first.time);
  second.step(situation.dt);
  expect_same_state(whole.solver->save(), second.solver->save());
}

// One of two sheets, both, and none: what sleeps stands, what wakes moves as on the CPU.
TEST(SheetsOnCuda, SleepAndWake) {
  std::string reason;
  if (!sim::cuda::device_available(reason)) GTEST_SKIP() << "no usable GPU: " << reason;
  for (const bool wet : {false, true}) {
    Shot shot = stacked();
    if (wet) add_box(shot, V3d(-0.02, 0.1, -0.02), {4, 4, 4});  // far above
    const Situation situation{.name = "", .shot = stacked, .without = part_sheets};
    const sim::Scene scene = scene_of(situation, shot);
    sim::Stepper gpu = stepper(scene, sim::cuda::make_solver),
                 cpu = stepper(scene, sim::cpu::make_solver);
    for (const std::vector<char>& asleep :
         {std::vector<char>{0, 1}, std::vector<char>{1, 1}, std::vector<char>{1, 0}}) {
      const sim::HostVec before = gpu.solver->cloth_positions();
      for (sim::Stepper* run : {&gpu, &cpu}) {
        run->solver->sleep(asleep);
        for (int k = 0; k < 2; ++k) run->solver->step(2e-3, 1);
      }
      const sim::HostVec after = gpu.solver->cloth_positions(),
                         also = cpu.solver->cloth_positions();
      double moved[2] = {0, 0}, apart = 0;
      for (size_t v = 0; v < after.size(); ++v) {
        double& most = moved[v < 49 ? 0 : 1];
        most = std::max(most, (at(after, v) - at(before, v)).length());
        apart = std::max(apart, (at(after, v) - at(also, v)).length());
      }
      for (size_t sheet = 0; sheet < 2; ++sheet) EXPECT_EQ(moved[sheet] == 0, asleep[sheet] == 1);
      EXPECT_LT(apart, 1e-5);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, ShellsOnCuda, testing::ValuesIn(situations),
                         [](const auto& situation) { return situation.param.name; });

}  // namespace
}  // namespace drench::sim_tests

#endif

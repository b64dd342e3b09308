// CPU against CUDA, the same source compiled twice. Skipped, with the reason, where there is no
// GPU.

#if defined(DRENCH_HAS_CUDA)

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sim/setup/scene.h"
#include "sim/solver.h"
#include "sim/stepper.h"
#include "tests/sim/support.h"

namespace drench {
namespace {

constexpr double spacing = 0.01;  // m

/// s, a third of the stable step of the scenes here.
double step_of(const sim::Parameters& p) { return p.incompressible ? 8e-4 : 1e-4; }

/// A block of 16 x 8 x 16 particles that falls at 1 m/s on a sheet of cotton pinned at its corners.
Shot pour_on_sheet() {
  Shot shot;
  shot.name = "cuda", shot.file = "cuda.toml";
  shot.domain.min = V3d(-0.2, 0, -0.2), shot.domain.max = V3d(0.2, 0.6, 0.2);
  shot.fluid.spacing = spacing;
  shot.fluid.box.push_back({V3d(-0.08, 0.215, -0.08), V3d(0.08, 0.295, 0.08), V3d(0, -1, 0)});
  Cloth cloth;
  cloth.corner = V3d(-0.15, 0.2, -0.15), cloth.u = V3d(0.3, 0, 0), cloth.v = V3d(0, 0, 0.3);
  cloth.cells = V2i(24, 24);
  ClothPin pin;
  pin.vertices = {0, 24, 600, 624};
  cloth.pin.push_back(pin);
  shot.cloth.push_back(cloth);
  return shot;
}

/// The block rests on the sheet, whose half thickness is 0.5 mm, and pushes it.
void let_down(Shot& shot) {
  for (double* y : {&shot.fluid.box[0].min.y, &shot.fluid.box[0].max.y}) *y -= 0.0145;
}
/// The water alone, on the domain's floor.
void without_sheet(Shot& shot) { shot.cloth.clear(), shot.domain.min.y = 0.215; }
void add_ball(Shot& shot, const V3d& centre, const V3d& end) {
  Obstacle ball;
  ball.name = "ball", ball.type = ObstacleType::sphere, ball.radius = 0.05;
  ball.position.keys = {{shot.timeline.first, centre}, {shot.timeline.first + 2, end}};
  shot.obstacle.push_back(ball);
}

/// What pour_on_sheet becomes, each with passes of its own.
struct Situation {
  const char* name;
  FluidSolver solver;
  void (*change)(Shot&);
};
constexpr FluidSolver compressible = FluidSolver::weakly_compressible,
                      projected = FluidSolver::incompressible;
void as_in_the_paper(Shot& shot) {
  shot.coupling.scheme = CouplingScheme::paper;
  shot.cloth[0].areal_density = 50;  // its vertices must be heavier than particles
}
const Situation situations[] = {
    {"Exact", compressible, [](Shot&) {}},
    {"ExactResting", compressible, let_down},
    {"Paper", compressible, as_in_the_paper},
    {"PaperResting", compressible, [](Shot& s) { as_in_the_paper(s), let_down(s); }},
    {"Resting", projected, let_down},
    {"Incompressible", projected, without_sheet},
    {"Strong", projected,
     [](Shot& s) {  // as much water under the sheet as over it
       s.fluid.box.push_back({V3d(-0.08, 0.105, -0.08), V3d(0.08, 0.185, 0.08), V3d(0, 1, 0)});
     }},
    {"Seam", projected,
     [](Shot& s) {  // in the middle of the block; the sheet is joined to itself
       s.domain.min.z = 0, s.domain.max.z = s.cloth[0].v.z;
       s.domain.axis[2] = Axis::periodic;
     }},
    {"Honey", projected, [](Shot& s) { without_sheet(s), s.fluid.kinematic_viscosity = 1e-2; }},
    {"Tense", projected,
     [](Shot& s) {
       without_sheet(s);
       s.fluid.surface_tension = 0.072, s.domain.contact_angle_deg = 60;
     }},
    {"AroundABall", projected,
     [](Shot& s) {
       without_sheet(s), add_ball(s, V3d(0, 0.25, 0.1), V3d(0, 0.25, 0));
       s.fluid.kinematic_viscosity = 1e-3, s.obstacle[0].slip = Slip::none;
     }},
    {"OnABall", projected, [](Shot& s) { add_ball(s, V3d(0, 0.14, 0), V3d(0, 0.14, 0)); }},
    {"NoSlipSheet", projected,
     [](Shot& s) { s.fluid.kinematic_viscosity = 1e-3, s.cloth[0].slip = Slip::none; }},
    {"Windy", projected,
     [](Shot& s) { s.wind.present = true, s.wind.velocity = V3d(9, 0, 0), s.wind.fluid_drag = 1; }},
    {"Drained", projected,
     [](Shot& s) {
       without_sheet(s);
       Sink drain;
       drain.shape.name = "drain", drain.shape.type = ObstacleType::sphere;
       drain.shape.radius = 0.03, drain.shape.position = V3d(0, 0.255, 0);
       s.sink.push_back(drain);
     }},
    {"Full", projected,
     [](Shot& s) {  // driven along a channel
       without_sheet(s);
       s.domain.min = s.fluid.box[0].min, s.domain.max = s.fluid.box[0].max;
       s.domain.axis[0] = Axis::periodic, s.gravity = V3d(2, -9.81, 0);
       s.fluid.box[0].velocity = V3d(0.5, 0, 0), s.fluid.kinematic_viscosity = 1e-3;
     }},
};
void PrintTo(const Situation& s, std::ostream* out) { *out << s.name; }

std::unique_ptr<sim::Solver> advance(const sim::Scene& scene, std::unique_ptr<sim::Solver> solver,
                                     int steps) {
  sim::Stepper run(scene, std::move(solver));
  const double dt = step_of(scene.parameters);
  for (int s = 0; s < steps; ++s) run.step(dt);
  return std::move(run.solver);
}
sim::HostState after(const sim::Scene& scene, std::unique_ptr<sim::Solver> solver, int steps) {
  return advance(scene, std::move(solver), steps)->save();
}
sim::HostState on_cpu(const sim::Scene& scene, int steps) {
  return after(scene, sim::cpu::make_solver(scene.parameters, scene.cloth), steps);
}
sim::HostState on_cuda(const sim::Scene& scene, int steps) {
  return after(scene, sim::cuda::make_solver(scene.parameters, scene.cloth), steps);
}

double distance(const sim::HostVec& a, size_t i, const sim::HostVec& b, size_t k) {
  const double x = double(a.x[i]) - b.x[k], y = double(a.y[i]) - b.y[k],
               z = double(a.z[i]) - b.z[k];
  return std::sqrt(x * x + y * y + z * z);
}

/// How two states differ, m: [0] particles, [1] vertices. Particles are matched by id: cells may
/// tie differently where a position differs in its last bit.
struct Differences {
  std::array<double, 2> largest{};
  int unmatched = 0;  // particles of the first state that the second lacks
};
Differences differences(const sim::HostState& a, const sim::HostState& b) {
  std::map<int, size_t> place;
  for (size_t k = 0; k < b.id.size(); ++k) place[b.id[k]] = k;
  Differences d;
  for (size_t i = 0; i < a.id.size(); ++i) {
    const auto there = place.find(a.id[i]);
    if (there == place.end()) {
      ++d.unmatched;
      continue;
    }
    d.largest[0] = std::max(d.largest[0], distance(a.position, i, b.position, there->second));
  }
  for (size_t v = 0; v < a.cloth_position.size(); ++v)
    d.largest[1] = std::max(d.largest[1], distance(a.cloth_position, v, b.cloth_position, v));
  return d;
}

double height(const sim::HostVec& position) {
  double sum = 0;
  for (float y : position.y) sum += y;
  return sum / double(position.size());
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}
bool same_bits(const sim::HostVec& a, const sim::HostVec& b) {
  return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}

class Cuda : public ::testing::TestWithParam<Situation> {
 protected:
  void SetUp() override {
    std::string reason;
    if (!sim::cuda::device_available(reason)) GTEST_SKIP() << "no usable GPU: " << reason;
    Shot shot = pour_on_sheet();
    shot.fluid.solver = GetParam().solver;
    GetParam().change(shot);
    scene = sim::build_scene(shot);
    // The same iterations on both devices, whichever side of a tolerance the last bit falls.
    scene.parameters.tolerance = 0, scene.parameters.most_iterations = 10;
    scene.parameters.viscous_tolerance = 0, scene.parameters.most_viscous_iterations = 10;
  }
  sim::Scene scene;
};

// Only rounding differs (fused multiply-adds, order of sums). Ten steps amplify it by about a
// hundred, to a ten-thousandth of a spacing, and contact in an incompressible fluid by more: twice
// what CPU runs that start an ulp apart differ by.
TEST_P(Cuda, AgreesWithCpuToRoundingAfterTenSteps) {
  const sim::HostState cpu = on_cpu(scene, 10), gpu = on_cuda(scene, 10);
  ASSERT_EQ(cpu.id.size(), gpu.id.size());
  const Differences found = differences(cpu, gpu);
  // Of two that are as near to a drain it may take either.
  if (cpu.id.size() == scene.start.position.size()) {
    EXPECT_EQ(found.unmatched, 0);
  }
  std::array<double, 2> noise{};
  for (uint64_t seed = 1; scene.parameters.incompressible && seed <= 10; ++seed) {
    const Differences one = differences(cpu, on_cpu(sim_tests::jostled(scene, seed), 10));
    for (const size_t k : {0, 1}) noise[k] = std::max(noise[k], one.largest[k]);
  }
  for (const size_t k : {0, 1}) {
    EXPECT_LT(found.largest[k], std::max(1e-4 * spacing, 2 * noise[k])) << (k ? "sheet" : "fluid");
  }
}

// Single particles diverge by then, means do not: 1 % of a spacing over a fall of about one
// spacing. What a drain has taken may differ by twice what it does between CPU runs that start an
// ulp apart.
TEST_P(Cuda, KeepsMeanHeightsOfCpuAfterHundredSteps) {
  const sim::HostState cpu = on_cpu(scene, 100), gpu = on_cuda(scene, 100);
  const auto off = [&](const sim::HostState& one) {
    return std::abs(int(one.id.size()) - int(cpu.id.size()));
  };
  int noise = 0;
  const bool drained = cpu.id.size() < scene.start.position.size();
  for (uint64_t seed = 1; drained && seed <= 10; ++seed)
    noise = std::max(noise, off(on_cpu(sim_tests::jostled(scene, seed), 100)));
  EXPECT_LE(off(gpu), 2 * noise);
  EXPECT_NEAR(height(cpu.position), height(gpu.position), 0.01 * spacing);
  if (scene.cloth.vertices() == 0) return;
  EXPECT_NEAR(height(cpu.cloth_position), height(gpu.cloth_position), 0.01 * spacing);
}

/// What probes of every kind read after ten steps.
std::vector<std::vector<double>> probed(const sim::Scene& scene,
                                        std::unique_ptr<sim::Solver> solver) {
  std::vector<sim::ProbeQuery> queries(6);
  queries[0].kind = sim::ProbeKind::height;
  queries[1].kind = sim::ProbeKind::wall_force, queries[1].axis = 1;
  queries[2].kind = sim::ProbeKind::inner_pressure;
  const double middle[3] = {0, 0.255, 0};  // m, of the block; drained of all but its rim
  for (int k = 0; k < 3; ++k) {
    for (const int q : {0, 2}) queries[q].place[k] = float(middle[k] - scene.parameters.origin[k]);
  }
  queries[0].place[0] += 0.06f;
  queries[2].radius = 0.03f, queries[2].rim = 0.01f, queries[2].extent = 1e-4f;
  queries[3].kind = sim::ProbeKind::energy;
  queries[4].kind = sim::ProbeKind::volume;
  queries[5].kind = sim::ProbeKind::cloth_force, queries[5].end = scene.cloth.vertices();
  solver = advance(scene, std::move(solver), 10);
  return solver->probe(queries);
}

// Within twice what CPU runs that start an ulp apart differ by. Some of a probe's figures are
// nothing but rounding of others, and a pressure of next to nothing that of the block's weight.
TEST_P(Cuda, ProbesReadTheSameAndTheSameBitsInEveryRun) {
  const auto on = [&](const sim::Scene& start, auto make) {
    return probed(start, make(scene.parameters, scene.cloth));
  };
  const auto cpu = on(scene, sim::cpu::make_solver), gpu = on(scene, sim::cuda::make_solver);
  auto noise = cpu;
  for (auto& answer : noise) std::fill(answer.begin(), answer.end(), 0.);
  const auto each = [&](const auto& f) {
    for (size_t q = 0; q < cpu.size(); ++q)
      for (size_t k = 0; k < cpu[q].size(); ++k) f(q, k);
  };
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const auto one = on(sim_tests::jostled(scene, seed), sim::cpu::make_solver);
    each([&](size_t q, size_t k) {
      noise[q][k] = std::max(noise[q][k], std::abs(one[q][k] - cpu[q][k]));
    });
  }
  each([&](size_t q, size_t k) {
    double largest = q == 2 ? 1000 * 9.81 * 0.08 : 0;  // Pa
    for (const double figure : cpu[q]) largest = std::max(largest, std::abs(figure));
    EXPECT_NEAR(cpu[q][k], gpu[q][k], 2 * noise[q][k] + 1e-4 * std::abs(cpu[q][k]) + 1e-6 * largest)
        << q << ", " << k;
  });
  EXPECT_EQ(gpu, on(scene, sim::cuda::make_solver));
}

// No float atomics and fixed trees: nothing may depend on how blocks are scheduled.
TEST_P(Cuda, GivesTheSameBitsInEveryRun) {
  scene.parameters.tolerance = 1e-4f, scene.parameters.most_iterations = 100;
  const sim::HostState a = on_cuda(scene, 100), b = on_cuda(scene, 100);
  EXPECT_EQ(a.id, b.id);
  EXPECT_TRUE(same_bits(a.position, b.position));
  EXPECT_TRUE(same_bits(a.velocity, b.velocity));
  EXPECT_TRUE(same_bits(a.cloth_position, b.cloth_position));
  EXPECT_TRUE(same_bits(a.cloth_velocity, b.cloth_velocity));
}

// Each on a queue of its own, with scratch of its own.
TEST_P(Cuda, GivesTheSameBitsBesideAnotherSolver) {
  Shot wave = pour_on_sheet();
  wave.fluid.solver = projected, without_sheet(wave);
  const sim::Scene other = sim::build_scene(wave);
  const auto stepper = [](const sim::Scene& of) {
    return sim::Stepper(of, sim::cuda::make_solver(of.parameters, of.cloth));
  };
  sim::Stepper beside = stepper(other), run = stepper(scene);
  for (int s = 0; s < 5; ++s) {
    beside.step(step_of(other.parameters));
    run.step(step_of(scene.parameters));
  }
  const sim::HostState alone = on_cuda(scene, 5), in_turns = run.solver->save();
  EXPECT_EQ(alone.id, in_turns.id);
  EXPECT_TRUE(same_bits(alone.position, in_turns.position));
  EXPECT_TRUE(same_bits(alone.cloth_position, in_turns.cloth_position));
}

INSTANTIATE_TEST_SUITE_P(Cases, Cuda, ::testing::ValuesIn(situations),
                         [](const auto& situation) { return situation.param.name; });

}  // namespace
}  // namespace drench

#endif

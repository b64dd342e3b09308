// CPU against CUDA, the same source compiled twice. Skipped, with the reason, where there is no
// GPU.

#if defined(DRENCH_HAS_CUDA)

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "sim/scene.h"
#include "sim/solver.h"

namespace drench {
namespace {

constexpr double spacing = 0.01;  // m

enum class Case { exact, paper, incompressible, strong, seam };

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

sim::HostState after(const sim::Scene& scene, std::unique_ptr<sim::Solver> solver, int steps) {
  solver->load(scene.start);
  const double dt = step_of(scene.parameters);
  const int substeps = std::max(1, int(std::ceil(dt / scene.parameters.cloth_dt_limit)));
  for (int s = 0; s < steps; ++s) solver->step(dt, substeps);
  return solver->save();
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

/// Particles are matched by id: cells may tie differently where a position differs in its last bit.
double largest_particle_difference(const sim::HostState& a, const sim::HostState& b) {
  std::vector<size_t> place(b.id.size());
  for (size_t k = 0; k < b.id.size(); ++k) place.at(b.id[k]) = k;
  double largest = 0;
  for (size_t i = 0; i < a.id.size(); ++i) {
    largest = std::max(largest, distance(a.position, i, b.position, place.at(a.id[i])));
  }
  return largest;
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

class Cuda : public ::testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    std::string reason;
    if (!sim::cuda::device_available(reason)) GTEST_SKIP() << "no usable GPU: " << reason;
    Shot shot = pour_on_sheet();
    shot.fluid.solver = GetParam() == Case::exact || GetParam() == Case::paper
                            ? FluidSolver::weakly_compressible
                            : FluidSolver::incompressible;
    if (GetParam() == Case::paper) {
      shot.coupling.scheme = CouplingScheme::paper;
      shot.cloth[0].areal_density = 50;  // its vertices must be heavier than particles
    }
    if (GetParam() == Case::incompressible) {
      shot.cloth.clear();
      shot.domain.min.y = 0.215;
    }
    if (GetParam() == Case::strong) {  // as much water under the sheet as over it
      shot.fluid.box.push_back({V3d(-0.08, 0.105, -0.08), V3d(0.08, 0.185, 0.08), V3d(0, 1, 0)});
    }
    if (GetParam() == Case::seam) {  // in the middle of the block; the sheet is joined to itself
      shot.domain.min.z = 0, shot.domain.max.z = shot.cloth[0].v.z;
      shot.domain.axis[2] = Axis::periodic;
    }
    scene = sim::build_scene(shot);
    // The same iterations on both devices, whichever side of a tolerance the last bit falls.
    scene.parameters.tolerance = 0, scene.parameters.most_iterations = 10;
  }
  sim::Scene scene;
};

// Only rounding differs (fused multiply-adds, order of sums). Ten steps amplify it by about a
// hundred.
TEST_P(Cuda, AgreesWithCpuWithinTenThousandthOfSpacingAfterTenSteps) {
  const sim::HostState cpu = on_cpu(scene, 10), gpu = on_cuda(scene, 10);
  ASSERT_EQ(cpu.id.size(), gpu.id.size());
  EXPECT_LT(largest_particle_difference(cpu, gpu), 1e-4 * spacing);
  for (size_t v = 0; v < cpu.cloth_position.size(); ++v) {
    ASSERT_LT(distance(cpu.cloth_position, v, gpu.cloth_position, v), 1e-4 * spacing) << v;
  }
}

// Single particles diverge by then, means do not: 1 % of a spacing over a fall of about one
// spacing.
TEST_P(Cuda, KeepsMeanHeightsOfCpuAfterHundredSteps) {
  const sim::HostState cpu = on_cpu(scene, 100), gpu = on_cuda(scene, 100);
  ASSERT_EQ(cpu.id.size(), gpu.id.size());
  EXPECT_NEAR(height(cpu.position), height(gpu.position), 0.01 * spacing);
  if (scene.cloth.vertices() == 0) return;
  EXPECT_NEAR(height(cpu.cloth_position), height(gpu.cloth_position), 0.01 * spacing);
}

/// What probes of every kind read after ten steps.
std::vector<double> probed(const sim::Scene& scene, std::unique_ptr<sim::Solver> solver) {
  std::vector<sim::ProbeQuery> queries(6);
  queries[0].kind = sim::ProbeKind::height;
  queries[1].kind = sim::ProbeKind::wall_force, queries[1].axis = 1;
  queries[2].kind = sim::ProbeKind::inner_pressure;
  queries[2].place[1] = float(0.255 - scene.parameters.origin[1]);
  queries[2].radius = 0.03f, queries[2].rim = 0.01f, queries[2].extent = 1e-4f;
  queries[3].kind = sim::ProbeKind::energy;
  queries[4].kind = sim::ProbeKind::volume;
  queries[5].kind = sim::ProbeKind::cloth_force, queries[5].end = scene.cloth.vertices();
  solver->load(scene.start);
  const double dt = step_of(scene.parameters);
  const int substeps = std::max(1, int(std::ceil(dt / scene.parameters.cloth_dt_limit)));
  for (int s = 0; s < 10; ++s) solver->step(dt, substeps);
  std::vector<double> all;
  for (const auto& answer : solver->probe(queries))
    all.insert(all.end(), answer.begin(), answer.end());
  return all;
}

TEST_P(Cuda, ProbesReadTheSameAndTheSameBitsInEveryRun) {
  const auto cuda = [&] {
    return probed(scene, sim::cuda::make_solver(scene.parameters, scene.cloth));
  };
  const std::vector<double> cpu =
                                probed(scene, sim::cpu::make_solver(scene.parameters, scene.cloth)),
                            gpu = cuda();
  ASSERT_EQ(cpu.size(), gpu.size());
  for (size_t k = 0; k < cpu.size(); ++k)
    EXPECT_NEAR(cpu[k], gpu[k], 1e-3 * std::abs(cpu[k]) + 1e-3) << k;
  EXPECT_EQ(gpu, cuda());
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

INSTANTIATE_TEST_SUITE_P(Cases, Cuda,
                         ::testing::Values(Case::exact, Case::paper, Case::incompressible,
                                           Case::strong, Case::seam),
                         [](const auto& scene) {
                           return scene.param == Case::exact    ? "Exact"
                                  : scene.param == Case::paper  ? "Paper"
                                  : scene.param == Case::strong ? "Strong"
                                  : scene.param == Case::seam   ? "Seam"
                                                                : "Incompressible";
                         });

}  // namespace
}  // namespace drench

#endif

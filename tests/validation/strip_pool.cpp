#include "tests/validation/strip_pool.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/sim/support.h"
#include "tests/validation/coupled.h"

namespace drench::validation {

using namespace sim_tests;

namespace {

constexpr double width = 0.3, depth = 0.1, gravity = 9.81, density = 1000;  // m, m, m/s^2, kg/m^3
constexpr double areal_density = 0.2, thickness = 1e-3;                     // kg/m^2, m
constexpr int around = 6;                                                   // spacings

Shot pool_on_strip(int across, ClothModel model, double offset) {
  const double a = width / across;
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -gravity, 0);
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = a;
  shot.domain.min = V3d(-width / 2, -0.5, 0), shot.domain.max = V3d(width / 2, 0.5, around * a);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::periodic};
  Cloth& sheet = add_sheet(shot, width, 0, across);
  sheet.corner.z = offset, sheet.v = V3d(0, 0, around * a), sheet.cells.y = around;
  make_light_cotton(sheet, model, areal_density);
  ClothPin pin;
  for (int j = 0; j <= around; ++j) {
    for (const int i : {0, across}) pin.vertices.push_back(uint32_t(j * (across + 1) + i));
  }
  sheet.pin.push_back(pin);
  add_box(shot, V3d(-width / 2, thickness / 2, offset),
          {across, int(std::lround(depth / a)), around});
  return shot;
}

/// What a slice of the sheet one cell wide is by symmetry: a chain of points in the plane, which
/// keeps its extent a along z, under the pressure of water that fills it to a level. Between
/// neighbours there are one adjacent spring and two diagonal ones, or the stress of a shell that
/// stretches one way. In double, brought to rest by kinetic damping.
class Chain {
 public:
  Chain(int across, double area, ClothModel model)
      : a_(width / across), area_(area), model_(model) {
    for (int i = 0; i <= across; ++i) x_.push_back({i * a_, 0});
  }
  /// m, heights of the points.
  std::vector<double> heights() {
    const size_t n = x_.size();
    std::vector<Point> velocity(n);
    const double stiffest = 8 * (adjacent + 2 * diagonal);  // N/m
    double last = 0;
    for (int step = 0; step < 200000; ++step) {
      const std::vector<Point> f = forces();
      double energy = 0, left = 0;
      for (size_t i = 1; i + 1 < n; ++i) {
        velocity[i].x += f[i].x / stiffest, velocity[i].y += f[i].y / stiffest;
        x_[i].x += velocity[i].x, x_[i].y += velocity[i].y;
        energy += velocity[i].x * velocity[i].x + velocity[i].y * velocity[i].y;
        left = std::max({left, std::abs(f[i].x), std::abs(f[i].y)});
      }
      if (energy < last) velocity.assign(n, {}), energy = 0;
      last = energy;
      if (step > 100 && left < 1e-9) break;
    }
    std::vector<double> y;
    for (const Point& p : x_) y.push_back(p.y);
    return y;
  }

 private:
  struct Point {
    double x = 0, y = 0;
  };
  std::vector<Point> forces() const {
    std::vector<Point> f(x_.size());
    double below = 0;
    for (size_t i = 0; i + 1 < x_.size(); ++i)
      below += (x_[i + 1].x - x_[i].x) * (height(i) + thickness / 2);
    const double level = (area_ + below) / width;
    for (size_t i = 0; i + 1 < x_.size(); ++i) {
      const double dx = x_[i + 1].x - x_[i].x, dy = x_[i + 1].y - x_[i].y;
      const double pull = pull_at(std::hypot(dx, dy));
      const double p = density * gravity * (level - height(i) - thickness / 2) * a_ / 2;
      const Point push{pull * dx, pull * dy}, load{p * dy, -p * dx};
      f[i].x += push.x + load.x, f[i].y += push.y + load.y;
      f[i + 1].x += load.x - push.x, f[i + 1].y += load.y - push.y;
    }
    for (Point& p : f) p.y -= areal_density * a_ * a_ * gravity;
    return f;
  }
  /// N/m, force over length of what joins two points that are `flat` m apart.
  double pull_at(double flat) const {
    if (model_ == ClothModel::shell)
      return young / (1 - poisson * poisson) * (flat * flat / (a_ * a_) - 1) / 2;
    const double slanted = std::hypot(flat, a_);
    return adjacent * (1 - a_ / flat) + 2 * diagonal * (1 - std::sqrt(2) * a_ / slanted);
  }
  double height(size_t i) const { return 0.5 * (x_[i].y + x_[i + 1].y); }

  double a_, area_;
  ClothModel model_;
  std::vector<Point> x_;
};

/// m under the pins, the mean of each line of nodes along z. @param spread  widened to the largest
/// difference within a line.
std::vector<double> lines(const sim::HostState& state, int across, double pinned, double& spread) {
  std::vector<double> mean;
  for (int i = 0; i <= across; ++i) {
    double low = 1e30, high = -1e30, sum = 0;
    for (int j = 0; j < around; ++j) {
      const double y = state.cloth_position.y[size_t(j * (across + 1) + i)] - pinned;
      low = std::min(low, y), high = std::max(high, y), sum += y / around;
    }
    spread = std::max(spread, high - low);
    mean.push_back(sum);
  }
  return mean;
}

}  // namespace

StripPool strip_pool(int across, double seconds, ClothModel model, double offset) {
  const Shot shot = pool_on_strip(across, model, offset);
  Stepper run(shot);
  StripPool pool;
  pool.particles = int(run.scene.start.id.size());
  const double a = shot.fluid.spacing;
  const std::vector<double> chain = Chain(across, pool.particles * a * a / around, model).heights();
  pool.static_sag = -*std::min_element(chain.begin(), chain.end());
  const double pinned = run.scene.start.cloth_position.y[0];
  std::vector<double> sum(chain.size(), 0.0);
  double samples = 0;
  sim::HostState state;
  while (run.time < seconds - 1e-9) {
    run.step(std::min(run.stable_dt(), seconds - run.time));
    if (run.limits.bad_particle >= 0 || run.limits.bad_vertex >= 0) return pool;
    pool.iterations += double(run.limits.iterations),
        pool.sweeps += double(run.limits.sheet_sweeps);
    if (run.time < 0.75 * seconds) continue;
    state = run.solver->save(), pool.spread = 0, ++samples;
    const std::vector<double> y = lines(state, across, pinned, pool.spread);
    for (size_t i = 0; i < y.size(); ++i) sum[i] += y[i];
  }
  for (size_t i = 0; i < sum.size(); ++i) {
    sum[i] /= samples;
    pool.sag = std::max(pool.sag, -sum[i]);
    pool.shape = std::max(pool.shape, std::abs(sum[i] - chain[i]) / pool.static_sag);
  }
  pool.steps = run.steps, pool.iterations /= run.steps, pool.sweeps /= run.steps;
  const auto& y = state.position.y;
  pool.lowest = *std::min_element(y.begin(), y.end()) - pinned + pool.sag;
  for (size_t i = 0; i < state.id.size(); ++i)
    pool.speed += at(state.velocity, i).length2() / double(state.id.size());
  pool.speed = std::sqrt(pool.speed);
  return pool;
}

}  // namespace drench::validation

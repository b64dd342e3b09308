#include "tests/stress/watch.h"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "tests/sim/crossings.h"

namespace drench::stress_tests {

namespace {

double wendland(double u) { return 10.5 / M_PI * u * u * u * u * (5 - 4 * u); }  // W h^3, u = 1 - q
double half_space(double q) {
  const double t = std::max(1 - q, 0.), t2 = t * t;
  return t2 * t2 * t2 * (3.5 - t * (4.5 - 1.5 * t));
}

/// Share of the walls, which are mirrors: sim/passes/pressure/image_walls.h has the derivation.
double wall_density(const sim::Parameters& p, const V3d& x) {
  double open = 1;
  for (int k = 0; k < 3; ++k) {
    if (!p.wall[k]) continue;
    for (const double distance : {x[k] - p.low[k], p.high[k] - x[k]})
      open -= open * p.wall_scale *
              half_space(std::max((2 * distance - 0.5 * p.spacing) / p.support_radius, 0.));
  }
  return 1 - open;
}

/// Particles by cells of a support, without a bound to where they are.
class Cells {
 public:
  Cells(const sim::HostState& state, double size) : state_(state), size_(size) {
    for (size_t i = 0; i < state.id.size(); ++i) {
      const V3d x = at(state.position, i);
      entry_.push_back({key(cell(x.x), cell(x.y), cell(x.z)), int(i)});
    }
    std::sort(entry_.begin(), entry_.end());
  }
  template <class Visit>
  void around(const V3d& x, const Visit& visit) const {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        // Keys of a line of cells along z follow each other.
        const int64_t from = key(cell(x.x) + dx, cell(x.y) + dy, cell(x.z) - 1);
        auto e = std::lower_bound(entry_.begin(), entry_.end(), std::pair(from, -1));
        for (; e != entry_.end() && e->first <= from + 2; ++e) visit(e->second);
      }
    }
  }

 private:
  int64_t cell(double x) const { return int64_t(std::floor(x / size_)) + (1 << 19); }
  static int64_t key(int64_t x, int64_t y, int64_t z) { return (x << 40) + (y << 20) + z; }
  const sim::HostState& state_;
  double size_;
  std::vector<std::pair<int64_t, int>> entry_;
};

/// Which triangles may stand between two particles.
class Screens {
 public:
  Screens(const sim::ClothTopology& cloth, const sim::HostState& state, double h)
      : cloth_(cloth), state_(state), h_(h) {
    for (int t = 0; t < cloth.triangles(); ++t) {
      double low = 1e30, high = -1e30;
      for (int k = 0; k < 3; ++k)
        low = std::min(low, corner(t, k).x), high = std::max(high, corner(t, k).x);
      by_low_x_.push_back({low, t}), widest_ = std::max(widest_, high - low);
    }
    std::sort(by_low_x_.begin(), by_low_x_.end());
  }
  /// Those whose box a support around the point meets.
  const std::vector<int>& near(const V3d& x) {
    near_.clear();
    auto e =
        std::lower_bound(by_low_x_.begin(), by_low_x_.end(), std::pair(x.x - h_ - widest_, -1));
    for (; e != by_low_x_.end() && e->first <= x.x + h_; ++e) {
      V3d low(1e30), high(-1e30);
      for (int k = 0; k < 3; ++k) {
        for (int c = 0; c < 3; ++c) {
          low[c] = std::min(low[c], corner(e->second, k)[c]);
          high[c] = std::max(high[c], corner(e->second, k)[c]);
        }
      }
      bool meets = true;
      for (int c = 0; c < 3; ++c) meets = meets && low[c] < x[c] + h_ && high[c] > x[c] - h_;
      if (meets) near_.push_back(e->second);
    }
    return near_;
  }
  bool hides(int t, const V3d& p, const V3d& q) const {
    const V3d a = corner(t, 0) - p, b = corner(t, 1) - p, c = corner(t, 2) - p, d = q - p;
    const V3d n = (b - a).cross(c - a);
    if ((n.dot(a) > 0) == (n.dot(a - d) > 0)) return false;
    const double u = d.dot(a.cross(b)), v = d.dot(b.cross(c)), w = d.dot(c.cross(a));
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
  }

 private:
  V3d corner(int t, int k) const { return at(state_.cloth_position, cloth_.corner[3 * t + k]); }
  const sim::ClothTopology& cloth_;
  const sim::HostState& state_;
  double h_, widest_ = 0;
  std::vector<std::pair<double, int>> by_low_x_;
  std::vector<int> near_;
};

bool is_finite(const sim::HostVec& v) {
  for (const auto* c : {&v.x, &v.y, &v.z}) {
    for (const float value : *c)
      if (!std::isfinite(value)) return false;
  }
  return true;
}

bool same_ids(const sim::HostState& state, size_t count) {
  std::vector<char> seen(count, 0);
  for (const int id : state.id) {
    if (id < 0 || size_t(id) >= count || seen[id]) return false;
    seen[id] = 1;
  }
  return state.id.size() == count;
}

double fastest(const sim::HostVec& v) {
  double most = 0;
  for (size_t i = 0; i < v.size(); ++i) most = std::max(most, at(v, i).length());
  return most;
}

double least(const std::vector<float>& v, double so_far) {
  for (const float value : v) so_far = std::min(so_far, double(value));
  return so_far;
}
double most(const std::vector<float>& v, double so_far) {
  for (const float value : v) so_far = std::max(so_far, double(value));
  return so_far;
}

}  // namespace

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

std::vector<double> densities(const sim::Scene& scene, const sim::HostState& state) {
  const sim::Parameters& p = scene.parameters;
  const double h = p.support_radius, a = p.spacing;
  const double unit = a * a * a / (h * h * h) / p.lattice_sum;
  const Cells cells(state, h);
  Screens screens(scene.cloth, state, h);
  std::vector<double> density(state.id.size());
  for (size_t i = 0; i < density.size(); ++i) {
    const V3d x = at(state.position, i);
    const std::vector<int>& near = screens.near(x);
    double sum = 0;
    cells.around(x, [&](int j) {
      const V3d y = at(state.position, j);
      const double r = (y - x).length();
      if (r >= h) return;
      for (const int t : near)
        if (screens.hides(t, x, y)) return;
      sum += wendland(1 - r / h);
    });
    density[i] = unit * sum + wall_density(p, x);
  }
  return density;
}

Watch::Watch(const Shot& shot, int sample_every) : run(shot), sample_every_(sample_every) {
  start();
}
Watch::Watch(sim::Scene scene, int sample_every)
    : run(std::move(scene)), sample_every_(sample_every) {
  start();
}
Watch::~Watch() { run.solver->observe_substeps({}); }

void Watch::start() {
  const sim::Parameters& p = run.scene.parameters;
  last_ = run.solver->save();
  figures_.particles = int(last_.id.size());
  closed_ = p.gravity[0] == 0 && p.gravity[1] == 0 && p.gravity[2] == 0;
  for (int k = 0; k < 3; ++k) {
    closed_ = closed_ && !p.wall[k];
    if (p.periodic[k]) period_[k] = double(p.high[k]) - double(p.low[k]);
  }
  for (const float m : run.scene.cloth.inverse_mass) closed_ = closed_ && m > 0;
  momentum_ = total_momentum(run.scene, last_);
  fastest_ = std::max(fastest(last_.velocity), fastest(last_.cloth_velocity));
  highest_ = most(last_.position.y, most(last_.cloth_position.y, -1e30));
  lowest_ = least(last_.position.y, least(last_.cloth_position.y, 1e30));
  energy_ = energy(last_);
  for (size_t i = 0; i < last_.id.size(); ++i) {
    mass_ += p.particle_mass, height_ += p.particle_mass * double(last_.position.y[i]);
    kinetic_ += 0.5 * p.particle_mass * at(last_.velocity, i).length2();
  }
  for (size_t v = 0; v < last_.cloth_velocity.size(); ++v)
    kinetic_ += 0.5 * run.scene.cloth.mass[v] * at(last_.cloth_velocity, v).length2();
  if (mass_ > 0) height_ /= mass_;
  run.solver->observe_substeps([this](const sim::HostState& state) { observe(state); });
}

double Watch::energy(const sim::HostState& state) {
  const sim::Parameters& p = run.scene.parameters;
  const sim::ClothTopology& c = run.scene.cloth;
  const V3d g(p.gravity[0], p.gravity[1], p.gravity[2]);
  double sum = 0;
  for (size_t i = 0; i < state.id.size(); ++i)
    sum += p.particle_mass * (0.5 * at(state.velocity, i).length2() - g.dot(at(state.position, i)));
  for (int v = 0; v < c.vertices(); ++v) {
    sum += c.mass[v] *
           (0.5 * at(state.cloth_velocity, v).length2() - g.dot(at(state.cloth_position, v)));
    for (int k = c.spring_start[v]; k < c.spring_start[v + 1]; ++k) {  // each stands in two rows
      V3d d = at(state.cloth_position, c.spring_end[k]) - at(state.cloth_position, v);
      if (c.spring_shift.size() > 0) d += at(c.spring_shift, size_t(k));
      const double stretch = d.length() - c.rest_length[k];
      sum += 0.25 * c.stiffness[k] * stretch * stretch;
    }
  }
  return sum;
}

void Watch::observe(const sim::HostState& state) {
  const double before = cpu_seconds();
  if (is_finite(state.position) && is_finite(state.cloth_position) &&
      same_ids(state, last_.id.size()))
    figures_.crossings += count_crossings(run.scene.cloth, last_, state, period_);
  last_ = state;
  observing_ += cpu_seconds() - before;
}

bool Watch::step(double dt) {
  const double before = cpu_seconds();
  observing_ = 0;
  run.step(dt);
  cpu_s_ += cpu_seconds() - before - observing_;
  if (run.scene.cloth.vertices() == 0) last_ = run.solver->save();  // nothing to observe
  measure();
  return figures_.finite;
}

bool Watch::until(double time) {
  while (figures_.finite && run.time < time - 1e-12) {
    const double rest = time - run.time;
    step(rest / std::ceil(rest / run.stable_dt() - 1e-9));
  }
  return figures_.finite;
}

bool Watch::steps(int count) {
  for (int k = 0; k < count && figures_.finite; ++k) step();
  return figures_.finite;
}

void Watch::measure() {
  const sim::Limits& l = run.limits;
  ++figures_.steps, figures_.time = run.time;
  figures_.capped += l.iterations >= run.scene.parameters.most_iterations;
  figures_.guard_hits = last_.guard_hits;
  figures_.finite = l.bad_particle < 0 && l.bad_vertex < 0 && is_finite(last_.position) &&
                    is_finite(last_.velocity) && is_finite(last_.cloth_position) &&
                    is_finite(last_.cloth_velocity);
  figures_.whole = figures_.whole && same_ids(last_, size_t(figures_.particles));
  if (!figures_.finite) return;
  last_speed_ = std::max(fastest(last_.velocity), fastest(last_.cloth_velocity));
  figures_.max_speed = std::max(figures_.max_speed, last_speed_);
  lowest_ = least(last_.position.y, least(last_.cloth_position.y, lowest_));
  gained_ = std::max(gained_, energy(last_) - energy_);
  if (closed_) {
    const double scale = momentum_scale(run.scene, last_, fastest_ / std::sqrt(2.));
    figures_.drift =
        std::max(figures_.drift, (total_momentum(run.scene, last_) - momentum_).length() / scale);
  }
  if (sample_every_ == 0 || figures_.steps <= 10 || figures_.steps % sample_every_ != 0) return;
  for (const double density : densities(run.scene, last_)) {
    const double over = std::max(density - 1, 0.);
    compression_ += over, ++samples_;
    figures_.worst = std::max(figures_.worst, over);
    if (over > 1e-3) compressed_.push_back(float(over));
  }
}

Figures Watch::figures() const {
  Figures f = figures_;
  const double g = std::abs(run.scene.parameters.gravity[1]);
  f.speed_bound = 3 * std::sqrt(2 * g * (highest_ - lowest_)) + fastest_;
  f.energy = gained_ / std::max(kinetic_ + mass_ * g * (height_ - lowest_), 1e-30);
  f.cpu_ms = 1e3 * cpu_s_ / std::max(f.steps, 1);
  f.mean = compression_ / std::max(samples_, 1.);
  std::vector<float> over = compressed_;
  const size_t from_top = size_t(1e-3 * samples_);
  if (from_top < over.size()) {
    std::nth_element(over.begin(), over.begin() + from_top, over.end(), std::greater<float>());
    f.p999 = over[from_top];
  }
  return f;
}

}  // namespace drench::stress_tests

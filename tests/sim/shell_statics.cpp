#include "tests/sim/shell_statics.h"

#include <numeric>

namespace drench::sim_tests {

using namespace sim::cpu;

namespace {

constexpr double forever = 1e30;
using V = Vec3<double>;

V of(const V3d& v) { return {v.x, v.y, v.z}; }
V3d from(const V& v) { return {v.x, v.y, v.z}; }

/// Curvatures of a patch less those of rest, and the normal they are along.
struct Bent {
  Curvature<V> kappa;
  TurningNormal<double> normal;
};

template <class Place>
Bent bent(const sim::BendingPatch& p, double area, const Place& place) {
  Curvature<V> kappa{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  for (int k = 0; k < int(p.node.size()); ++k) add_node(kappa, p.node[size_t(k)].weight, place(k));
  const TurningNormal<double> normal(place(0), place(1), place(2), area);
  return {beyond_rest(kappa, p.rest, normal.normal), normal};
}

}  // namespace

ShellStatics::ShellStatics(const sim::ShellSurface& surface, const sim::ShellConstants& constants,
                           const MembraneLaw<double>& law)
    : x(surface.rest),
      load(surface.rest.size(), V3d(0)),
      surface_(surface),
      rest_(sim::shell_rest(surface, constants)),
      law_(law) {}

void ShellStatics::add_gravity(V3d gravity) {
  for (size_t v = 0; v < load.size(); ++v) load[v] += gravity * rest_.mass[v];
}

V ShellStatics::place(const sim::BendingPatch& patch, int k) const {
  return of(x[size_t(patch.node[size_t(k)].index)] + patch.node[size_t(k)].shift);
}

SurfaceGradient<double> ShellStatics::gradient(size_t t) const {
  const auto& c = surface_.triangle[t];
  return surface_gradient(rest_.triangle[t], of(x[c[0]]), of(x[c[1]]), of(x[c[2]]));
}

double ShellStatics::energy() const {
  double energy = 0;
  for (size_t t = 0; t < rest_.triangle.size(); ++t) {
    const auto& r = rest_.triangle[t];
    const auto f = gradient(t);
    energy += r.area * law_.at(green_strain(f), {0, 0, 0}, forever).energy;
    const auto& p = rest_.patch[t];
    if (p.node.empty()) continue;
    const auto b = bent(p, r.area, [&](int k) { return place(p, k); });
    energy += bending_energy(r.area * p.share, rest_.bending, b.kappa);
  }
  for (size_t v = 0; v < x.size(); ++v) energy -= load[v].dot(x[v] - surface_.rest[v]);
  return energy;
}

std::vector<V3d> ShellStatics::forces() const {
  std::vector<V3d> force = load;
  for (size_t t = 0; t < rest_.triangle.size(); ++t) {
    const auto& corner = surface_.triangle[t];
    const auto& r = rest_.triangle[t];
    const auto f = gradient(t);
    const auto stress = law_.at(green_strain(f), {0, 0, 0}, forever).stress;
    for (int c = 0; c < 3; ++c) force[corner[c]] += from(membrane_force(r, f, stress, c));
    const auto& p = rest_.patch[t];
    if (p.node.empty()) continue;
    const auto b = bent(p, r.area, [&](int k) { return place(p, k); });
    const auto m = moment(rest_.bending, b.kappa);
    const double area = r.area * p.share;
    for (const sim::PatchNode& n : p.node) force[n.index] += from(bending_force(area, m, n.weight));
    for (int c = 0; c < 3; ++c)
      force[p.node[c].index] += from(turning_force(area, m, p.rest, b.normal, c));
  }
  for (size_t v = 0; v < x.size(); ++v)
    if (is_held(int(v))) force[v] = V3d(0);
  return force;
}

void ShellStatics::number_unknowns() {
  const int n = int(x.size());
  std::vector<int> order(size_t(n), 0);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return surface_.rest[a].x < surface_.rest[b].x; });
  unknown_.assign(size_t(n), -1);
  int next = 0;
  for (const int v : order)
    if (!is_held(v)) unknown_[v] = next, next += 3;
  std::vector<int> first(size_t(next), 0);
  std::iota(first.begin(), first.end(), 0);
  const auto join = [&](int a, int b) {
    if (unknown_[a] < 0 || unknown_[b] < 0) return;
    for (int i = 0; i < 3; ++i)
      first[unknown_[a] + i] = std::min(first[unknown_[a] + i], unknown_[b]);
  };
  for (size_t t = 0; t < rest_.patch.size(); ++t) {
    for (const int a : surface_.triangle[t])
      for (const int b : surface_.triangle[t]) join(a, b);
    for (const sim::PatchNode& a : rest_.patch[t].node)
      for (const sim::PatchNode& b : rest_.patch[t].node) join(a.index, b.index);
  }
  matrix_ = std::make_unique<Skyline>(first);
}

void ShellStatics::add_block(int a, int b, const Block3<double>& block) {
  const int row = unknown_[a], column = unknown_[b];
  if (row < 0 || column < 0 || column > row) return;
  const V rows[3] = {block.x, block.y, block.z};
  for (int i = 0; i < 3; ++i) {
    const double entry[3] = {rows[i].x, rows[i].y, rows[i].z};
    for (int j = 0; j < 3 && column + j <= row + i; ++j)
      matrix_->at(row + i, column + j) += entry[j];
  }
}

int ShellStatics::assemble(Tangent tangent) {
  if (!matrix_) number_unknowns();
  matrix_->clear();
  for (size_t t = 0; t < rest_.triangle.size(); ++t) {
    const auto& corner = surface_.triangle[t];
    const auto& r = rest_.triangle[t];
    const auto f = gradient(t);
    const auto answer = law_.at(green_strain(f), {0, 0, 0}, forever);
    const auto stress =
        tangent == Tangent::projected ? positive_part(answer.stress) : answer.stress;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        add_block(corner[a], corner[b], membrane_block(r, f, stress, answer.moduli, a, b));
    const auto& p = rest_.patch[t];
    for (const sim::PatchNode& a : p.node) {
      for (const sim::PatchNode& b : p.node) {
        const double w = bending_weight(r.area * p.share, rest_.bending, a.weight, b.weight);
        add_block(a.index, b.index, {{w, 0, 0}, {0, w, 0}, {0, 0, w}});
      }
    }
  }
  return matrix_->factor();
}

std::vector<double> ShellStatics::newton_step(const std::vector<V3d>& force) {
  if (assemble(Tangent::exact) > 0) assemble(Tangent::projected);
  std::vector<double> right(3 * x.size());
  size_t unknowns = 0;
  for (size_t v = 0; v < x.size(); ++v) {
    if (unknown_[v] < 0) continue;
    for (int i = 0; i < 3; ++i) right[size_t(unknown_[v] + i)] = force[v][i];
    unknowns += 3;
  }
  right.resize(unknowns);
  return matrix_->solve(right);
}

int ShellStatics::solve(double tolerance, int most_iterations) {
  double largest = 0;
  for (const V3d& f : load) largest = std::max(largest, f.length());
  double now = energy();
  for (int k = 0; k < most_iterations; ++k) {
    const std::vector<V3d> force = forces();
    double left = 0;
    for (const V3d& f : force) left = std::max(left, f.length());
    if (left <= tolerance * largest) return k;
    const std::vector<double> step = newton_step(force);
    const auto step_of = [&](size_t v) {
      const int u = unknown_[v];
      return u < 0 ? V3d(0) : V3d(step[u], step[u + 1], step[u + 2]);
    };
    double slope = 0;
    for (size_t v = 0; v < x.size(); ++v) slope += step_of(v).dot(force[v]);
    const std::vector<V3d> old = x;
    for (double share = 1;; share /= 2) {
      for (size_t v = 0; v < x.size(); ++v) x[v] = old[v] + step_of(v) * share;
      const double after = energy();
      const bool falls = after <= now - 1e-4 * share * slope + 1e-14 * std::abs(now);
      if (!falls && share > 1e-6) continue;
      now = after;
      break;
    }
  }
  return -1;
}

int ShellStatics::negative_eigenvalues() { return assemble(Tangent::exact); }

}  // namespace drench::sim_tests

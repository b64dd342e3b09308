#include "tests/surfacing/shapes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/surfacing/mesh_checks.h"

namespace drench::surfacing_scenes {
namespace {

using Imath::V3d;
using Imath::V3f;
using Imath::V3i;
constexpr double pi = std::numbers::pi;

bool everywhere(V3d) { return true; }

/// Even numbers from the generator's own bits: std's distributions differ between libraries.
V3d even_vector(std::mt19937& random, double half) {
  const auto even = [&] { return half * (static_cast<double>(random()) / 2147483648.0 - 1); };
  const double x = even(), y = even();
  return {x, y, even()};
}

V3d gradient(const Shape& shape, V3d p) {
  constexpr double step = 1e-3;
  V3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    V3d up = p, down = p;
    up[axis] += step, down[axis] -= step;
    slope[axis] = (shape.distance(up) - shape.distance(down)) / (2 * step);
  }
  return slope.normalized();
}

/// Points sorted into cells of one repulsion radius.
struct CellGrid {
  static constexpr double radius = 1.4;
  V3d low;
  V3i cells;
  std::vector<uint32_t> first, member;

  CellGrid(const std::vector<V3d>& points, V3d half) : low(-half - V3d(2 * radius)) {
    cells = V3i((half * 2 + V3d(5 * radius)) / radius);
    first.assign(static_cast<size_t>(cells.x) * cells.y * cells.z + 1, 0);
    for (const V3d& p : points) ++first[index(place(p)) + 1];
    for (size_t c = 1; c < first.size(); ++c) first[c] += first[c - 1];
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    member.resize(points.size());
    for (uint32_t i = 0; i < points.size(); ++i) member[next[index(place(points[i]))]++] = i;
  }
  V3i place(V3d p) const { return V3i((p - low) / radius); }
  size_t index(V3i c) const { return (static_cast<size_t>(c.z) * cells.y + c.y) * cells.x + c.x; }
};

V3d repulsion(const std::vector<V3d>& points, const CellGrid& grid, uint32_t i) {
  V3d sum(0);
  const V3i at = grid.place(points[i]);
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y) {
      const size_t row = grid.index(at + V3i(-1, y, z));
      for (uint32_t k = grid.first[row]; k < grid.first[row + 3]; ++k) {
        const V3d d = points[i] - points[grid.member[k]];
        const double r2 = d.length2();
        if (r2 == 0 || r2 >= CellGrid::radius * CellGrid::radius) continue;
        const double r = std::sqrt(r2), near = 1 - r / CellGrid::radius;
        sum += d * (near * near / r);
      }
    }
  return sum;
}

std::vector<V3d> deepest(const Shape& shape, V3d shift) {
  struct Point {
    double depth;
    V3d place;
  };
  std::vector<Point> points;
  const V3i half = V3i(shape.half) + V3i(2);
  for (int z = -half.z; z <= half.z; ++z)
    for (int y = -half.y; y <= half.y; ++y)
      for (int x = -half.x; x <= half.x; ++x) {
        const V3d p = V3d(x, y, z) + shift;
        if (const double d = shape.distance(p); d < 1.5) points.push_back({d, p});
      }
  const auto n = static_cast<long>(shape.particles());
  std::nth_element(points.begin(), points.begin() + n, points.end(),
                   [](const Point& a, const Point& b) { return a.depth < b.depth; });
  std::vector<V3d> chosen;
  for (long k = 0; k < n; ++k) chosen.push_back(points[static_cast<size_t>(k)].place);
  std::sort(chosen.begin(), chosen.end(), [](const V3d& a, const V3d& b) {
    return std::array{a.z, a.y, a.x} < std::array{b.z, b.y, b.x};
  });
  return chosen;
}

}  // namespace

Shape ball(double n) {
  const double r = ball_radius(static_cast<size_t>(n), 1);
  return {"ball", n, V3d(r), [r](V3d p) { return p.length() - r; }, everywhere};
}

Shape torus(double n) {
  const double major = std::cbrt(n / (2 * pi * pi * 0.16)), minor = 0.4 * major;
  const auto distance = [=](V3d p) {
    return std::hypot(std::hypot(p.x, p.z) - major, p.y) - minor;
  };
  return {"torus", n, V3d(major + minor, minor, major + minor), distance, everywhere};
}

Shape touching_balls(double n) {
  const double r = std::cbrt(3 * n / (8 * pi));
  const auto distance = [r](V3d p) {
    return (V3d(std::abs(p.x), p.y, p.z) - V3d(r, 0, 0)).length() - r;
  };
  // three spacings apart at x = 3: 2 (r - sqrt(r^2 - y^2)) with y from the circle
  const auto counts = [r](V3d p) { return std::abs(p.x) > std::sqrt(3 * r); };
  return {"touching balls", n, V3d(2 * r, r, r), distance, counts};
}

Shape jet(double n) {
  const double r = std::cbrt(n / (8 * pi + 4 * pi / 3)), half = 4 * r;
  const auto distance = [=](V3d p) {
    return (p - V3d(std::clamp(p.x, -half, half), 0, 0)).length() - r;
  };
  return {"jet", n, V3d(half + r, r, r), distance, everywhere};
}

Shape wavy_slab(double n) {
  // a square of whole waves has the volume of the flat box
  const double waves = std::max(2., std::round(std::cbrt(n) * 1.4 / 30)), side = 30 * waves;
  const double depth = n / (side * side), k = 2 * pi / 30;
  constexpr double high = 1.5;
  const auto to_top = [=](V3d p) {  // the foot by Newton's method along x and z
    double x = p.x, z = p.z, f = 0;
    for (int step = 0; step < 8; ++step) {
      f = high * std::sin(k * x) * std::cos(k * z);
      const double fx = high * k * std::cos(k * x) * std::cos(k * z);
      const double fz = -high * k * std::sin(k * x) * std::sin(k * z);
      x += (p.x - x + (p.y - f) * fx) / (1 + fx * fx);
      z += (p.z - z + (p.y - f) * fz) / (1 + fz * fz);
    }
    const double d = V3d(p.x - x, p.y - f, p.z - z).length();
    return p.y > high * std::sin(k * p.x) * std::cos(k * p.z) ? d : -d;
  };
  const auto distance = [=](V3d p) {
    return std::max({std::abs(p.x) - side / 2, std::abs(p.z) - side / 2, -depth - p.y, to_top(p)});
  };
  const auto counts = [=](V3d p) {
    return std::abs(p.x) < side / 2 - 3 && std::abs(p.z) < side / 2 - 3;
  };
  return {"wavy slab", n, V3d(side / 2, depth + high, side / 2), distance, counts};
}

std::vector<Shape> all_shapes(double n) {
  return {ball(n), torus(n), touching_balls(n), jet(n), wavy_slab(n)};
}

ParticleFrame relaxed(const Shape& shape, double spacing, int steps, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<V3d> points = deepest(shape, even_vector(random, 0.5));
  for (V3d& p : points) p += even_vector(random, 0.25);
  for (int step = 0; step < steps; ++step) {
    const CellGrid grid(points, shape.half);
    std::vector<V3d> moved(points.size());
    tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(points.size()), [&](uint32_t i) {
      V3d p = points[i] + 0.15 * repulsion(points, grid, i);
      if (const double beyond = shape.distance(p) + 0.5; beyond > 0)
        p -= beyond * gradient(shape, p);
      moved[i] = p;
    });
    points.swap(moved);
  }
  ParticleFrame frame;
  frame.spacing = static_cast<float>(spacing);
  for (const V3d& p : points) {
    frame.position.emplace_back(p * spacing);
    frame.velocity.push_back(V3f(float(p.z * spacing), 0, float(-p.x * spacing)));
  }
  return frame;
}

double ball_radius(size_t n, double spacing) {
  return spacing * std::cbrt(3 * static_cast<double>(n) / (4 * pi));
}

ParticleFrame relaxed_ball(size_t n, double spacing, int steps, uint32_t seed) {
  return relaxed(ball(static_cast<double>(n)), spacing, steps, seed);
}

ShapeError shape_error(const TriangleMesh& mesh, const Shape& shape, double spacing) {
  ShapeError error;
  double sum = 0, squares = 0, n = 0;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const V3d p = V3d(mesh.position[v]) / spacing;
    if (!shape.counts(p)) continue;
    const double distance = shape.distance(p);
    sum += distance, squares += distance * distance, ++n;
    error.max = std::max(error.max, std::abs(distance));
    const double cosine = std::clamp(gradient(shape, p).dot(V3d(mesh.normal[v])), -1., 1.);
    const double angle = std::acos(cosine) * 180 / pi;
    error.normal_mean += angle;
    error.normal_max = std::max(error.normal_max, angle);
  }
  error.bias = sum / n;
  error.scatter = std::sqrt(std::max(squares / n - error.bias * error.bias, 0.0));
  error.normal_mean /= n;
  const double volume = surfacing_checks::volume_of(mesh) / (spacing * spacing * spacing);
  error.volume = volume / static_cast<double>(shape.particles()) - 1;
  return error;
}

}  // namespace drench::surfacing_scenes

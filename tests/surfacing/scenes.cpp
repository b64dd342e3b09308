#include "tests/surfacing/scenes.h"

#include <Imath/ImathMatrix.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace drench::surfacing_scenes {
namespace {

using Imath::V2i;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;

/// Even numbers from the generator's own bits: std's distributions differ between libraries.
double even(std::mt19937& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
}

V3d even_vector(std::mt19937& random, double half) {
  const double x = even(random, -half, half), y = even(random, -half, half);
  return {x, y, even(random, -half, half)};
}

ParticleFrame frame_of(const std::vector<V3d>& points, double spacing) {  // points in spacings
  ParticleFrame frame;
  frame.spacing = static_cast<float>(spacing);
  for (const V3d& p : points) frame.position.emplace_back(p * spacing);
  frame.velocity.resize(points.size(), V3f(0));
  return frame;
}

}  // namespace

ParticleFrame two_balls(size_t n, double spacing, int steps, double gap) {
  ParticleFrame frame = relaxed_ball(n, spacing, steps, 1);
  ParticleFrame other = relaxed_ball(n, spacing, steps, 2);
  const double distance = 2 * ball_radius(n, spacing) + gap * spacing;
  for (V3f& p : other.position) p.x += static_cast<float>(distance);
  append(frame, other);
  return frame;
}

ParticleFrame shaken_box(V3f corner, V3i cells, double spacing, double shake, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<V3d> points;
  for (int z = 0; z < cells.z; ++z)
    for (int y = 0; y < cells.y; ++y)
      for (int x = 0; x < cells.x; ++x)
        points.push_back(V3d(corner) / spacing + V3d(x + 0.5, y + 0.5, z + 0.5) +
                         even_vector(random, shake));
  return frame_of(points, spacing);
}

ParticleFrame random_cloud(size_t n, double per_cell, double spacing, uint32_t seed) {
  std::mt19937 random(seed);
  const double half = 0.5 * std::cbrt(static_cast<double>(n) / per_cell);
  std::vector<V3d> points(n);
  for (V3d& p : points) p = even_vector(random, half);
  ParticleFrame frame = frame_of(points, spacing);
  for (V3f& v : frame.velocity) v = V3f(even_vector(random, 1));
  return frame;
}

ParticleFrame lone_particles(size_t count, double spacing, uint32_t seed) {
  std::mt19937 random(seed);
  const int edge = static_cast<int>(std::ceil(std::cbrt(static_cast<double>(count))));
  std::vector<V3d> points;
  for (size_t i = 0; i < count; ++i) {
    const int k = static_cast<int>(i);
    points.push_back(6.0 * V3d(k % edge, k / edge % edge, k / edge / edge) +
                     even_vector(random, 0.5));
  }
  return frame_of(points, spacing);
}

ParticleFrame sheet(V2i cells, double stretch, double spacing, double shake, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<V3d> points;
  for (int y = 0; y < cells.y; ++y)
    for (int x = 0; x < cells.x; ++x)
      points.push_back(V3d(x * stretch, y * stretch, 0) + even_vector(random, shake));
  return frame_of(points, spacing);
}

ParticleFrame askew(ParticleFrame frame, double angle) {
  Imath::M44d turn;
  turn.setAxisAngle(V3d(0.5, 0.6, -0.7).normalized(), angle);
  for (V3f& p : frame.position) p = V3f(V3d(p) * turn);
  return frame;
}

ParticleFrame splash(size_t n, double spacing, uint32_t seed) {
  std::mt19937 random(seed);
  const double wanted = static_cast<double>(n);
  const int depth = std::max(4, static_cast<int>(std::cbrt(wanted) / 4));
  const int width = static_cast<int>(std::sqrt(0.93 * wanted / depth));
  std::vector<V3d> points;
  const auto wave = [&](double x, double z) {
    return 1.5 * std::sin(0.21 * x) * std::cos(0.17 * z);
  };
  for (int z = 0; z < width; ++z)
    for (int x = 0; x < width; ++x)
      for (int y = 0; y < depth + wave(x, z); ++y)
        points.push_back(V3d(x, y, z) + even_vector(random, 0.3));
  // The crown: a cone that opens upwards, 1.05 spacings between its particles.
  const double radius = width * 0.25;
  const int around = static_cast<int>(2 * std::numbers::pi * radius / 1.05);
  const int layers = static_cast<int>(0.04 * wanted / around);
  for (int layer = 0; layer < layers; ++layer)
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around, r = radius + 0.3 * layer;
      points.push_back(V3d(width / 2.0 + r * std::cos(angle), depth + 1.0 * layer,
                           width / 2.0 + r * std::sin(angle)) +
                       even_vector(random, 0.1));
    }
  while (points.size() < n) {  // drops
    const V3d middle(even(random, 0, width), depth + even(random, 5, width),
                     even(random, 0, width));
    const double size = even(random, 0, 1);
    const int count = 1 + static_cast<int>(30 * size * size * size);
    const double drop = 0.62 * std::cbrt(count);
    for (int k = 0; k < count; ++k) {
      V3d p = even_vector(random, drop);
      while (p.length() > drop) p = even_vector(random, drop);
      points.push_back(middle + p);
    }
  }
  ParticleFrame frame = frame_of(points, spacing);
  for (V3f& v : frame.velocity) v = V3f(0, -1, 0) + V3f(even_vector(random, 0.5));
  return frame;
}

void shuffle(ParticleFrame& frame, uint32_t seed) {
  std::mt19937 random(seed);
  for (size_t i = frame.position.size(); i-- > 1;) {
    const size_t j = random() % (i + 1);
    std::swap(frame.position[i], frame.position[j]);
    std::swap(frame.velocity[i], frame.velocity[j]);
  }
}

void append(ParticleFrame& frame, const ParticleFrame& more) {
  frame.position.insert(frame.position.end(), more.position.begin(), more.position.end());
  frame.velocity.insert(frame.velocity.end(), more.velocity.begin(), more.velocity.end());
}

}  // namespace drench::surfacing_scenes

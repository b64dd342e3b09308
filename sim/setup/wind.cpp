#include "sim/setup/wind.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

constexpr double turn = 2 * std::numbers::pi;

/// Evenly over the sphere. std distributions differ by library.
V3d direction(std::mt19937& random) {
  const auto unit = [&] { return double(random()) / 4294967296.0; };
  const double z = 2 * unit() - 1, phi = turn * unit(), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace

Wind::Wind(const Shot& shot, const LocalFrame& frame)
    : velocity_(shot.wind.velocity),
      timeline_(shot.timeline),
      origin_(frame.origin[0], frame.origin[1], frame.origin[2]) {
  if (!(shot.wind.gust > 0)) return;
  std::mt19937 random(shot.seed);
  double energy = 0;  // m^2/s^2, the mean square of all
  for (int k = 0; k < WindNow::most_modes; ++k) {
    Mode mode;
    // Lengths from gust_size to a quarter; speeds go with the cube root of length (Kolmogorov).
    const double part = std::pow(4.0, -double(k) / (WindNow::most_modes - 1));
    const V3d along = direction(random);
    V3d across(0);
    while (across.length() < 0.1) across = direction(random).cross(along);
    mode.wave = along * (turn / (shot.wind.gust_size * part));
    mode.amplitude = across.normalized() * std::cbrt(part);
    mode.phase = turn * double(random()) / 4294967296.0;
    energy += 0.5 * mode.amplitude.length2();
    mode_.push_back(mode);
  }
  for (Mode& mode : mode_) mode.amplitude *= shot.wind.gust / std::sqrt(energy);
}

/// How far the mean wind has carried the gusts since the first frame, m.
V3d Wind::carried(double time) const {
  const double frames = time * timeline_.fps;
  if (velocity_.keys.size() < 2) return velocity_.at(timeline_.first) * time;
  const int parts = std::max(1, int(std::ceil(std::abs(frames) * 4)));
  V3d sum(0);
  for (int k = 0; k < parts; ++k)
    sum += velocity_.at(timeline_.first + frames * (k + 0.5) / parts) * (time / parts);
  return sum;
}

WindNow Wind::at(double time) const {
  WindNow now;
  const V3d velocity = velocity_.at(timeline_.first + time * timeline_.fps);
  for (int c = 0; c < 3; ++c) now.velocity[c] = float(velocity[c]);
  if (mode_.empty()) return now;
  const V3d shift = origin_ - carried(time);
  for (const Mode& mode : mode_) {
    const int k = now.modes++;
    const double rate = mode.wave.length() * mode.amplitude.length();  // rad/s
    const double phase = mode.phase + mode.wave.dot(shift) + rate * time;
    now.phase[k] = float(phase - turn * std::floor(phase / turn));
    for (int c = 0; c < 3; ++c)
      now.wave[k][c] = float(mode.wave[c]), now.amplitude[k][c] = float(mode.amplitude[c]);
  }
  return now;
}

}  // namespace drench::sim

#include "sim/setup/obstacle_images.h"

#include <algorithm>
#include <cmath>

#include "sim/parameters.h"

namespace drench::sim {

namespace {

using Imath::V3d;

constexpr double slack = 1e-6;  // of a period: what is as long as it goes all around
constexpr float endless = 1e9f, everywhere = 1e30f;  // m

/// The own axis that lies along an axis of the domain; -1 if none does.
int own_axis_along(const ObstaclePlacement& p, int axis) {
  for (int own = 0; own < 3; ++own) {
    if (std::abs(p.axis[1][3 * own + axis]) > 1 - 1e-6f) return own;
  }
  return -1;
}

}  // namespace

ObstacleImages::ObstacleImages(const Parameters& p) : margin_(2 * double(p.support_radius)) {
  for (int k = 0; k < 3; ++k) {
    low_[k] = p.low[k];
    period_[k] = p.periodic[k] ? double(p.high[k] - p.low[k]) : 0;  // as periods_of has it
  }
}

V3d ObstacleImages::wrapped(V3d point) const {
  for (int k = 0; k < 3; ++k) {
    if (period_[k] > 0) point[k] -= period_[k] * std::floor((point[k] - low_[k]) / period_[k]);
  }
  return point;
}

ObstacleImages::Range ObstacleImages::reach(const ObstaclePlacement& p, int axis) const {
  const double length = period_[axis], low = low_[axis] - margin_,
               high = low_[axis] + length + margin_;
  return {int(std::ceil((low - p.high[axis]) / length)),
          int(std::floor((high - p.low[axis]) / length))};
}

ObstacleImages::Image ObstacleImages::shifted(const ObstaclePlacement& placement,
                                              const V3d& shift) const {
  Image image{placement, shift};
  ObstaclePlacement& p = image.placement;
  for (int k = 0; k < 3; ++k) {
    if (shift[k] == 0) continue;
    for (float* x : {&p.centre[0][k], &p.centre[1][k], &p.low[k], &p.high[k]})
      *x = float(double(*x) + shift[k]);
  }
  return image;
}

std::vector<ObstacleImages::Image> ObstacleImages::of(const ObstaclePlacement& placement,
                                                      const V3d& extent) const {
  if (!any() || placement.shape == ObstacleShape::plane) return {{placement, V3d(0)}};
  // Near the domain to begin with: bodies that go around for long keep their digits.
  V3d centre(placement.centre[1][0], placement.centre[1][1], placement.centre[1][2]);
  const V3d home = wrapped(centre) - centre;
  ObstaclePlacement p = shifted(placement, home).placement;
  Range images[3] = {};
  for (int k = 0; k < 3; ++k) {
    if (period_[k] == 0) continue;
    images[k] = reach(p, k);
    if (extent[k] < period_[k] * (1 - slack)) continue;
    const int own = own_axis_along(p, k);
    if (p.shape == ObstacleShape::box && own >= 0) {
      p.half[own] = endless;
    } else if (p.shape == ObstacleShape::field) {
      p.around = true, p.joined[k][0] = images[k].first, p.joined[k][1] = images[k].last;
      for (int c = 0; c < 3; ++c) p.period[k][c] = p.axis[1][3 * c + k] * float(period_[k]);
    } else {
      continue;
    }
    images[k] = {0, 0};
    p.low[k] = -everywhere, p.high[k] = everywhere;
  }
  std::vector<Image> all;
  for (int z = images[2].first; z <= images[2].last; ++z) {
    for (int y = images[1].first; y <= images[1].last; ++y) {
      for (int x = images[0].first; x <= images[0].last; ++x) {
        all.push_back(shifted(p, V3d(x, y, z) * period_));
        all.back().shift += home;
      }
    }
  }
  return all;
}

}  // namespace drench::sim

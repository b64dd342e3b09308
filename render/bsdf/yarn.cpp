#include "render/bsdf/yarn.h"

#include <cstdint>

namespace drench::render {

namespace {

constexpr int lattice_points = 987, lattice_step = 610;  // a Fibonacci lattice

/// What facets that mirror all return, by visible normals.
float returned(const YarnFacets& facets, const V3f& o) {
  const float visible = facets.bound(o) * o.z + facets.stretch(o);
  double sum = 0;
  for (int k = 0; k < lattice_points; ++k) {
    const V2f u((float(int64_t(k) * lattice_step % lattice_points) + 0.5f) / lattice_points,
                (float(k) + 0.5f) / lattice_points);
    const V3f i = facets.sample(o, u);
    if (i.z > 0) sum += double(facets.masking(o, i) * i.z * visible / 2);
  }
  return float(sum / lattice_points);
}

}  // namespace

YarnTable::YarnTable(float alpha) : facets_{alpha} {
  for (int row = 0; row <= rows; ++row) {
    const double root = std::max(double(row) / rows, 1e-3);
    const float cos = float(root * root), sin = std::sqrt(1 - cos * cos);
    for (int column = 0; column <= columns; ++column) {
      const float angle = 0.5f * pi * float(column) / columns;
      albedo_[size_t(row)][size_t(column)] =
          returned(facets_, {sin * std::cos(angle), sin * std::sin(angle), cos});
    }
  }
  constexpr int steps = 1024, angles = 48;
  double sum = 0;
  for (int k = 0; k < steps; ++k)
    for (int angle = 0; angle < angles; ++angle) {
      const float cos = (float(k) + 0.5f) / steps;
      sum += double(2 * cos * at(cos, (float(angle) + 0.5f) / angles)) / steps / angles;
    }
  mean_ = float(sum);
}

float YarnTable::at(const V3f& o) const {
  return at(std::abs(o.z), std::atan2(std::abs(o.y), std::abs(o.x)) * (2 / pi));
}

/// @param angle  from along the yarn, 0, to across it, 1
float YarnTable::at(float cos, float angle) const {
  const float x = std::sqrt(std::clamp(cos, 0.f, 1.f)) * rows, y = angle * columns;
  const int row = std::min(int(x), rows - 1), column = std::min(int(y), columns - 1);
  const float s = x - float(row), t = y - float(column);
  const auto between = [t, column](const auto& of) {
    return of[size_t(column)] + (of[size_t(column) + 1] - of[size_t(column)]) * t;
  };
  const float low = between(albedo_[size_t(row)]), high = between(albedo_[size_t(row) + 1]);
  return low + (high - low) * s;
}

}  // namespace drench::render

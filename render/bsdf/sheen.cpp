#include "render/bsdf/sheen.h"

#include <cstdint>

namespace drench::render {

namespace {

constexpr int lattice_points = 1597, lattice_step = 987;  // a Fibonacci lattice

}  // namespace

SheenTable::SheenTable(float roughness) : lobe_{1 / roughness, 1} {
  float most = 1;
  for (int node = 0; node <= nodes; ++node) {
    const float root = float(node) / nodes, cos = root * root;
    const V3f o(std::sqrt(1 - cos * cos), 0, cos);
    double sum = 0;
    for (int k = 0; k < lattice_points; ++k) {
      const float around =
          (float(int64_t(k) * lattice_step % lattice_points) + 0.5f) / lattice_points;
      const V3f i =
          SheenLobe::sample({(float(k) + 0.5f) / lattice_points, 0.5f * around});  // even in y
      sum += double(lobe_.over_cos(o, i) * i.z / SheenLobe::pdf());
    }
    albedo_[size_t(node)] = float(sum / lattice_points);
    most = std::max(most, albedo_[size_t(node)]);
  }
  lobe_.gain = 1 / most;
  for (float& albedo : albedo_) albedo *= lobe_.gain;
  constexpr int steps = 4096;
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const double cos = (k + 0.5) / steps;
    sum += 2 * cos * double(at(float(cos))) / steps;
  }
  mean_ = float(sum);
}

float SheenTable::at(float cos) const {
  const float x = std::sqrt(std::clamp(cos, 0.f, 1.f)) * nodes;
  const int k = std::min(int(x), nodes - 1);
  const float t = x - float(k);
  return albedo_[size_t(k)] + (albedo_[size_t(k) + 1] - albedo_[size_t(k)]) * t;
}

}  // namespace drench::render

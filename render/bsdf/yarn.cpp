#include "render/bsdf/yarn.h"

#include <cstdint>

namespace drench::render {

namespace {

constexpr int kPoints = 987, kTurn = 610;  // a Fibonacci lattice

/// What facets that mirror all return, by visible normals.
float returned(const YarnFacets& facets, const V3f& o) {
  const float visible = facets.bound(o) * o.z + facets.stretch(o);
  double sum = 0;
  for (int k = 0; k < kPoints; ++k) {
    const V2f u((float(int64_t(k) * kTurn % kPoints) + 0.5f) / kPoints,
                (float(k) + 0.5f) / kPoints);
    const V3f i = facets.sample(o, u);
    if (i.z > 0) sum += double(facets.masking(o, i) * i.z * visible / 2);
  }
  return float(sum / kPoints);
}

}  // namespace

YarnTable::YarnTable(float alpha) : facets_{alpha} {
  for (int row = 0; row <= kRows; ++row) {
    const double root = std::max(double(row) / kRows, 1e-3);
    const float cos = float(root * root), sin = std::sqrt(1 - cos * cos);
    for (int column = 0; column <= kColumns; ++column) {
      const float turn = 0.5f * kPi * float(column) / kColumns;
      share_[size_t(row)][size_t(column)] =
          returned(facets_, {sin * std::cos(turn), sin * std::sin(turn), cos});
    }
  }
  constexpr int kSteps = 1024, kTurns = 48;
  double sum = 0;
  for (int k = 0; k < kSteps; ++k)
    for (int turn = 0; turn < kTurns; ++turn) {
      const float cos = (float(k) + 0.5f) / kSteps;
      sum += double(2 * cos * at(cos, (float(turn) + 0.5f) / kTurns)) / kSteps / kTurns;
    }
  mean_ = float(sum);
}

float YarnTable::at(const V3f& o) const {
  return at(std::abs(o.z), std::atan2(std::abs(o.y), std::abs(o.x)) * (2 / kPi));
}

/// @param turn  from along the yarn, 0, to across it, 1
float YarnTable::at(float cos, float turn) const {
  const float x = std::sqrt(std::clamp(cos, 0.f, 1.f)) * kRows, y = turn * kColumns;
  const int row = std::min(int(x), kRows - 1), column = std::min(int(y), kColumns - 1);
  const float s = x - float(row), t = y - float(column);
  const auto between = [t, column](const auto& of) {
    return of[size_t(column)] + (of[size_t(column) + 1] - of[size_t(column)]) * t;
  };
  const float low = between(share_[size_t(row)]), high = between(share_[size_t(row) + 1]);
  return low + (high - low) * s;
}

}  // namespace drench::render

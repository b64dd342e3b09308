#include "render/light/environment_suns.h"

#include <array>
#include <limits>
#include <numbers>

#include "render/color/color.h"

namespace drench::render {

namespace {

/// Radiance, in means of what is no brighter, from which light may be a sun's: one path of 64 that
/// meets less by chance adds at most half to its pixel.
constexpr double min_contrast = 32;
/// sr, a disc of 6.5 degrees: of directions that leave a surface one in 600 meets what is larger.
constexpr double max_solid_angle = 0.01;
/// Of all light of the map. There are so at most a hundred suns, which every light sample weighs.
constexpr double min_fraction = 0.01;

/// Integrals of a row's tent, which a bilinear lookup weighs its texels with, over the polar angle.
struct RowMoments {
  double sine = 0, sine2 = 0, sine_cosine = 0;
};

RowMoments moments_of_row(int row, int rows) {
  static constexpr std::array<std::pair<double, double>, 3> gauss{
      {{0.1127016653792583, 5. / 18}, {0.5, 8. / 18}, {0.8872983346207417, 5. / 18}}};
  RowMoments out;
  const double step = std::numbers::pi / rows, middle = (row + 0.5) * step;
  for (const int side : {-1, 1}) {
    const bool pole = side < 0 ? row == 0 : row == rows - 1;  // the last row reaches it undimmed
    const double reach = pole ? step / 2 : step;
    for (const auto& [at, weight] : gauss) {
      const double angle = middle + side * at * reach;
      const double w = weight * reach * (pole ? 1 : 1 - at);
      out.sine += w * std::sin(angle);
      out.sine2 += w * std::sin(angle) * std::sin(angle);
      out.sine_cosine += w * std::sin(angle) * std::cos(angle);
    }
  }
  return out;
}

using Region = std::vector<uint32_t>;  // texels

class SunExtractor {
 public:
  SunExtractor(SkyMap& map, float rotation) : map_(map), rotation_(rotation) {
    for (int r = 0; r < map.height; ++r) rows_.push_back(moments_of_row(r, map.height));
    total_ = sum_below(std::numeric_limits<double>::infinity()).light;
  }

  std::vector<ExtractedSun> extract() {
    const double threshold = min_contrast * background();
    Region bright;
    for (uint32_t t = 0; t < map_.texel.size(); ++t)
      if (luminance(map_.texel[t]) > threshold) bright.push_back(t);
    std::vector<ExtractedSun> suns;
    if (bright.empty()) return suns;
    state_.resize(map_.texel.size());
    std::vector<Region> regions;
    find_regions(bright, threshold, regions);
    for (const Region& region : regions) suns.push_back(extract_sun(region));
    return suns;
  }

 private:
  struct Sum {
    double light = 0, solid_angle = 0;  // luminance x sr, sr
  };

  double step() const { return 2 * std::numbers::pi / map_.width; }
  double solid_angle(uint32_t texel) const {
    return rows_[texel / uint32_t(map_.width)].sine * step();
  }

  Sum sum_below(double limit) const {
    Sum sum;
    for (int r = 0; r < map_.height; ++r) {
      Sum row;
      for (int c = 0; c < map_.width; ++c) {
        const double light = luminance(map_.texel[size_t(r) * map_.width + c]);
        if (!(light <= limit)) continue;
        row.light += light;
        row.solid_angle += 1;
      }
      sum.light += row.light * rows_[r].sine * step();
      sum.solid_angle += row.solid_angle * rows_[r].sine * step();
    }
    return sum;
  }

  /// Mean of all that is at most min_contrast times as bright as it.
  double background() const {
    double mean = total_ / (4 * std::numbers::pi);
    for (int round = 0; round < 64; ++round) {
      const Sum sum = sum_below(min_contrast * mean);
      const double next = sum.solid_angle > 0 ? sum.light / sum.solid_angle : 0;
      if (!(next < mean)) break;
      mean = next;
    }
    return mean;
  }

  /// Calls f(texel) for the eight around a texel that there are.
  template <class F>
  void for_each_beside(uint32_t texel, F f) const {
    const int column = int(texel) % map_.width, row = int(texel) / map_.width;
    for (int dr = -1; dr <= 1; ++dr)
      for (int dc = -1; dc <= 1; ++dc) {
        if (row + dr < 0 || row + dr >= map_.height || (dr == 0 && dc == 0)) continue;
        f(uint32_t((row + dr) * map_.width + (column + dc + map_.width) % map_.width));
      }
  }

  /// The connected regions above a threshold that are suns; one that is too large may have suns in
  /// it, above a higher threshold.
  void find_regions(const Region& among, double threshold, std::vector<Region>& suns) {
    std::vector<Region> too_large;
    for (const uint32_t t : among)
      state_[t] = luminance(map_.texel[t]) > threshold ? waiting : outside;
    for (const uint32_t seed : among) {
      if (state_[seed] != waiting) continue;
      Region region{seed};
      state_[seed] = outside;
      for (size_t k = 0; k < region.size(); ++k)
        for_each_beside(region[k], [&](uint32_t t) {
          if (state_[t] != waiting) return;
          state_[t] = outside;
          region.push_back(t);
        });
      double size = 0, light = 0;
      for (const uint32_t t : region) {
        size += solid_angle(t);
        light += solid_angle(t) * luminance(map_.texel[t]);
      }
      if (light < min_fraction * total_) continue;
      (size <= max_solid_angle ? suns : too_large).push_back(std::move(region));
    }
    for (const Region& region : too_large) find_regions(region, 2 * threshold, suns);
  }

  /// Mean of the texels that a region touches.
  V3f around(const Region& region) {
    for (const uint32_t t : region) state_[t] = inside;
    Imath::V3d sum(0);
    double size = 0;
    for (const uint32_t t : region)
      for_each_beside(t, [&](uint32_t beside) {
        if (state_[beside] == inside) return;
        sum += Imath::V3d(map_.texel[beside]) * solid_angle(beside);
        size += solid_angle(beside);
      });
    for (const uint32_t t : region) state_[t] = outside;
    return size > 0 ? V3f(sum / size) : V3f(0);
  }

  /// Integral of direction over the tent of a texel.
  Imath::V3d moment(uint32_t texel) const {
    const RowMoments& row = rows_[texel / uint32_t(map_.width)];
    const double angle = (texel % uint32_t(map_.width) + 0.5) / map_.width - rotation_ - 0.5;
    const double half = step() / 2, phi = angle * 2 * std::numbers::pi;
    const double across = row.sine2 * step() * std::pow(std::sin(half) / half, 2);
    return {across * std::sin(phi), row.sine_cosine * step(), -across * std::cos(phi)};
  }

  ExtractedSun extract_sun(const Region& region) {
    const V3f left = around(region);
    Imath::V3d vector[3] = {Imath::V3d(0), Imath::V3d(0), Imath::V3d(0)}, toward(0);
    double sum = 0, square = 0;
    for (const uint32_t t : region) {
      V3f more;
      for (int c = 0; c < 3; ++c) more[c] = std::max(map_.texel[t][c] - left[c], 0.f);
      map_.texel[t] -= more;
      const Imath::V3d m = moment(t);
      for (int c = 0; c < 3; ++c) vector[c] += m * double(more[c]);
      const double light = luminance(more);
      toward += m * light;
      sum += light * solid_angle(t);
      square += light * light * solid_angle(t);
    }
    toward.normalize();
    ExtractedSun out;
    out.toward = V3f(toward);
    for (int c = 0; c < 3; ++c) out.irradiance[c] = float(std::max(vector[c].dot(toward), 0.));
    out.solid_angle = float(sum * sum / square);  // that of a disc, if it is one
    return out;
  }

  enum State : uint8_t { outside, waiting, inside };

  SkyMap& map_;
  double rotation_;
  std::vector<RowMoments> rows_;
  double total_ = 0;
  std::vector<State> state_;  // of each texel
};

}  // namespace

std::vector<ExtractedSun> extract_suns(SkyMap& map, float rotation) {
  return SunExtractor(map, rotation).extract();
}

}  // namespace drench::render

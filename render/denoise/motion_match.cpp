#include "render/denoise/motion_match.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace drench::render {

namespace {

/// Pixels by which the motion there and back may miss: half of one is lost to rounding each time,
/// and what speeds up, or turns, comes back elsewhere by a part of its motion.
constexpr float max_missed = 1.5f, missed_fraction = 0.25f;
/// Squared difference of guides, about 1 in size, that one surface may have between frames, and
/// beyond it in units of their variance.
constexpr float max_difference = 0.25f, noise_factor = 9;

struct PixelPosition {
  int x = 0, y = 0;
  bool inside = false;
};

/// The pixel that a motion from a pixel ends in, the nearest of the picture if it is none.
PixelPosition arrival(const NoisyPicture& picture, int x, int y, Side side) {
  const size_t p = size_t(y) * size_t(picture.width) + size_t(x);
  const float u = float(x) + picture.motion[int(side)][0][p];
  const float v = float(y) + picture.motion[int(side)][1][p];
  const float right = float(picture.width - 1), bottom = float(picture.height - 1);
  const bool inside =  // not so of what is not finite
      u > -0.5f && v > -0.5f && u < right + 0.5f && v < bottom + 0.5f;
  if (!std::isfinite(u) || !std::isfinite(v)) return {x, y, false};
  return {int(std::lround(std::clamp(u, 0.f, right))), int(std::lround(std::clamp(v, 0.f, bottom))),
          inside};
}

bool leads_back(const NoisyPicture& from, const NoisyPicture& to, size_t p, size_t q, Side side) {
  const int there = int(side), back = 1 - there;
  float missed = 0, length = 0;
  const float offset[2] = {float(int(q % size_t(to.width)) - int(p % size_t(from.width))),
                           float(int(q / size_t(to.width)) - int(p / size_t(from.width)))};
  for (int c = 0; c < 2; ++c) {
    const float m = offset[c] + to.motion[back][c][q];
    missed += m * m;
    length += from.motion[there][c][p] * from.motion[there][c][p];
  }
  return std::sqrt(missed) <= max_missed + missed_fraction * std::sqrt(length);
}

bool looks_alike(const NoisyPicture& from, const NoisyPicture& to, size_t p, size_t q) {
  float unlike = 0, noise = 0;
  for (size_t f = 0; f < from.feature.size(); ++f) {
    const float scale = to.unit(f) / from.unit(f);
    const float d = from.feature[f][p] - scale * to.feature[f][q];
    unlike += d * d;
    noise += from.feature_variance[f][p] + scale * scale * to.feature_variance[f][q];
  }
  return unlike <= max_difference + noise_factor * noise;
}

}  // namespace

PixelMatch match_pixels(const NoisyPicture& from, const NoisyPicture& to, Side side) {
  const size_t pixels = size_t(from.width) * size_t(from.height);
  PixelMatch match{std::vector<int32_t>(pixels), NoisyPicture::Plane(pixels)};
  tbb::parallel_for(0, from.height, [&](int y) {
    for (int x = 0; x < from.width; ++x) {
      const size_t p = size_t(y) * size_t(from.width) + size_t(x);
      const PixelPosition end = arrival(from, x, y, side);
      const size_t q = size_t(end.y) * size_t(to.width) + size_t(end.x);
      match.pixel[p] = int32_t(q);
      match.same[p] =
          end.inside && leads_back(from, to, p, q, side) && looks_alike(from, to, p, q) ? 1.f : 0.f;
    }
  });
  return match;
}

PixelMatch chained(const PixelMatch& first, const PixelMatch& next) {
  PixelMatch out = first;
  for (size_t p = 0; p < out.pixel.size(); ++p) {
    const size_t between = size_t(first.pixel[p]);
    out.pixel[p] = next.pixel[between];
    out.same[p] *= next.same[between];
  }
  return out;
}

}  // namespace drench::render

#include "render/denoise/denoise.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

#include "render/denoise/fireflies.h"
#include "render/denoise/motion_match.h"

namespace drench::render {

namespace {

using Plane = NoisyPicture::Plane;

constexpr int tile_size = 32;     // pixels a side of what is worked on at once
constexpr int window_radius = 7;  // of the window
constexpr int beside_radius = 4;  // of that in a frame before or after
constexpr int guide_radius = 3;   // of that in which a guide is smoothed
constexpr int patch_radius = 3;   // of the patches compared
constexpr int guide_padding = guide_radius + 1;
constexpr int padding = window_radius + patch_radius;
constexpr int padded_size = tile_size + 2 * padding;
constexpr int compared_size = tile_size + 2 * patch_radius;
/// Patches this many standard deviations apart (squared) count little.
constexpr float bandwidth2 = 1;
constexpr float min_variance = 1e-10f;
constexpr float min_guide_variance = 1e-6f;
/// Ridge of a feature without noise, in units of its square.
constexpr float ridge = 1e-4f;
/// Weight from which a neighbour's colour is one that a fit may have.
constexpr float min_weight = 0.01f;
constexpr int max_features = 9;              // with the two of the position in the picture
constexpr int max_terms = max_features + 1;  // and the constant
constexpr int max_columns = max_terms + 3;   // and the colours

using TileRow = std::array<float, tile_size>;

/// One plane around a tile, the picture's edge pixels repeated beyond it.
struct Padded {
  std::array<float, padded_size * padded_size> value;

  /// @param at  value of a pixel of the picture
  template <class At>
  void take(const At& at, int x0, int y0, int width, int height) {
    for (int y = 0; y < padded_size; ++y)
      for (int x = 0; x < padded_size; ++x)
        value[size_t(y * padded_size + x)] =
            at(size_t(std::clamp(y0 + y - padding, 0, height - 1)) * size_t(width) +
               size_t(std::clamp(x0 + x - padding, 0, width - 1)));
  }
  /// Row of the tile's coordinates, which start at 0 within the padding.
  const float* row(int x, int y) const {
    return &value[size_t((y + padding) * padded_size + x + padding)];
  }
};

/// A picture whose pixels join the windows, with the motion to it from the picture that is
/// denoised.
struct Source {
  const NoisyPicture* picture;
  const PixelMatch* match;  // null: that picture itself
  int reach;                // of the window in it
};

/// A tile of one source, where its pixels are in the picture that is denoised.
struct TileInput {
  TileInput(const Source& source, const NoisyPicture& target, int x0, int y0)
      : feature(target.feature.size()),
        feature_variance(target.feature.size()),
        reach(source.reach) {
    const auto take = [&](Padded& to, const Plane& from, float scale) {
      const auto at = [&](size_t p) {
        return source.match ? scale * from[size_t(source.match->pixel[p])] : from[p];
      };
      to.take(at, x0, y0, target.width, target.height);
    };
    const NoisyPicture& picture = *source.picture;
    for (int c = 0; c < 3; ++c) {
      for (int h = 0; h < 2; ++h) take(half[h][c], picture.half[h][c], 1);
      take(variance[c], picture.variance[c], 1);
    }
    for (size_t f = 0; f < feature.size(); ++f) {
      const float scale = picture.unit(f) / target.unit(f);
      take(feature[f], picture.feature[f], scale);
      take(feature_variance[f], picture.feature_variance[f], scale * scale);
    }
    const auto counts = [&](size_t p) { return source.match ? source.match->same[p] : 1.f; };
    same.take(counts, x0, y0, target.width, target.height);
  }

  Padded half[2][3], variance[3];
  std::vector<Padded> feature, feature_variance;
  Padded same;  // 0: counts nothing
  int reach;
};

/// Sums over 2 patch_radius + 1 values in a row, and then in a column.
void sum_patches(const std::array<float, compared_size * compared_size>& distance,
                 std::array<float, tile_size * tile_size>& out) {
  std::array<float, compared_size * tile_size> rows;
  for (int y = 0; y < compared_size; ++y)
    for (int x = 0; x < tile_size; ++x) {
      float sum = 0;
      for (int k = 0; k <= 2 * patch_radius; ++k)
        sum += distance[size_t(y * compared_size + x + k)];
      rows[size_t(y * tile_size + x)] = sum;
    }
  for (int y = 0; y < tile_size; ++y)
    for (int x = 0; x < tile_size; ++x) {
      float sum = 0;
      for (int k = 0; k <= 2 * patch_radius; ++k) sum += rows[size_t((y + k) * tile_size + x)];
      out[size_t(y * tile_size + x)] = sum;
    }
}

using TileWeight = std::array<float, tile_size * tile_size>;

/// How much the pixel of `other` at an offset counts for each of the tile, by the looks of one
/// half.
void weigh(const TileInput& tile, const TileInput& other, int half, int dx, int dy,
           TileWeight& weight) {
  std::array<float, compared_size * compared_size> distance{};
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < compared_size; ++y) {
      const float *a = tile.half[half][c].row(-patch_radius, y - patch_radius),
                  *b = other.half[half][c].row(dx - patch_radius, y - patch_radius + dy),
                  *va = tile.variance[c].row(-patch_radius, y - patch_radius),
                  *vb = other.variance[c].row(dx - patch_radius, y - patch_radius + dy);
      float* out = &distance[size_t(y * compared_size)];
      for (int x = 0; x < compared_size; ++x) {
        const float d = a[x] - b[x];
        out[x] += (d * d - (va[x] + std::min(va[x], vb[x]))) /
                  (min_variance + bandwidth2 * (va[x] + vb[x]));
      }
    }
  sum_patches(distance, weight);
  constexpr float per_value = 1.f / (3 * (2 * patch_radius + 1) * (2 * patch_radius + 1));
  for (float& w : weight) w = std::exp(-std::max(0.f, w * per_value));
  for (int y = 0; y < tile_size; ++y) {
    const float* same = other.same.row(dx, y + dy);
    for (int x = 0; x < tile_size; ++x) weight[size_t(y * tile_size + x)] *= same[x];
  }
}

/// Sums of the normal equations for a row of pixels: the upper triangle of terms x (terms +
/// colours).
struct NormalEquations {
  std::array<std::array<TileRow, max_columns>, max_terms> sum;
  std::array<TileRow, max_features> noise;  // variance of features, weighed
};

/// The least and the most of each colour in a row's windows, of what counts there.
struct Range {
  std::array<TileRow, 3> low, high;

  void clear() {
    for (TileRow& row : low) row.fill(std::numeric_limits<float>::max());
    for (TileRow& row : high) row.fill(std::numeric_limits<float>::lowest());
  }
  void add(size_t c, const float* colour, const float* weight) {
    for (size_t x = 0; x < tile_size; ++x) {
      const bool counts = weight[x] > min_weight;
      low[c][x] = counts && colour[x] < low[c][x] ? colour[x] : low[c][x];
      high[c][x] = counts && colour[x] > high[c][x] ? colour[x] : high[c][x];
    }
  }
  /// A fit beside a glint may lead anywhere; no colour lies beyond those it comes from.
  float bound(size_t c, size_t x, float colour) const {
    return std::max(0.f, std::clamp(colour, low[c][x], std::max(low[c][x], high[c][x])));
  }
};

/// Solves for one pixel by Cholesky's factors. @return the constants: the colours at the pixel
std::array<float, 3> solve(const NormalEquations& equations, int x, int terms) {
  double a[max_terms][max_columns];
  for (int i = 0; i < terms; ++i)
    for (int j = i; j < terms + 3; ++j)
      a[i][j] = double(equations.sum[size_t(i)][size_t(j)][size_t(x)]);
  const double total = a[0][0];
  for (int i = 1; i < terms; ++i)
    a[i][i] += double(equations.noise[size_t(i - 1)][size_t(x)]) + ridge * total;
  for (int i = 0; i < terms; ++i)
    for (int k = i + 1; k < terms; ++k) {
      const double factor = a[i][k] / a[i][i];
      for (int j = k; j < terms + 3; ++j) a[k][j] -= factor * a[i][j];
    }
  std::array<float, 3> out;
  for (int c = 0; c < 3; ++c) {
    double v[max_terms];
    for (int i = terms - 1; i >= 0; --i) {
      v[i] = a[i][terms + c];
      for (int j = i + 1; j < terms; ++j) v[i] -= a[i][j] * v[j];
      v[i] /= a[i][i];
    }
    out[size_t(c)] = float(v[0]);
  }
  return out;
}

/// Calls with the offsets of a window.
template <class Visit>
void for_each_offset(int reach, const Visit& visit) {
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) visit(dx, dy);
}

class TileDenoiser {
 public:
  /// @param sources  first the picture itself
  TileDenoiser(const std::vector<Source>& sources, int x0, int y0)
      : picture_(*sources[0].picture), x0_(x0), y0_(y0), terms_(int(picture_.feature.size()) + 3) {
    size_t offsets = 0;
    tile_.reserve(sources.size());
    for (const Source& source : sources) {
      tile_.emplace_back(source, picture_, x0, y0);
      offsets += size_t((2 * source.reach + 1) * (2 * source.reach + 1));
    }
    weight_.resize(offsets);
  }

  void run(std::vector<Plane>& out) {
    for (int h = 0; h < 2; ++h) {
      size_t k = 0;
      for (const TileInput& other : tile_)
        for_each_offset(other.reach, [&](int dx, int dy) {
          weigh(tile_[0], other, 1 - h, dx, dy, weight_[k++]);
        });
      for (int y = 0; y < std::min(tile_size, picture_.height - y0_); ++y) fit_row(h, y, out);
    }
  }

 private:
  void fit_row(int half, int y, std::vector<Plane>& out) {
    for (auto& row : equations_.sum)
      for (TileRow& sum : row) sum.fill(0);
    for (TileRow& noise : equations_.noise) noise.fill(0);
    range_.clear();
    size_t k = 0;
    for (const TileInput& other : tile_)
      for_each_offset(other.reach, [&](int dx, int dy) {
        add_neighbour(other, half, y, dx, dy, &weight_[k++][size_t(y * tile_size)]);
      });
    for (int x = 0; x < std::min(tile_size, picture_.width - x0_); ++x) {
      const std::array<float, 3> colour = solve(equations_, x, terms_);
      const size_t pixel = size_t(y0_ + y) * size_t(picture_.width) + size_t(x0_ + x);
      for (size_t c = 0; c < 3; ++c) out[c][pixel] += 0.5f * range_.bound(c, size_t(x), colour[c]);
    }
  }

  void add_neighbour(const TileInput& other, int half, int y, int dx, int dy, const float* weight) {
    std::array<TileRow, max_columns> term;
    term[0].fill(1);
    term[1].fill(float(dx) / window_radius);
    term[2].fill(float(dy) / window_radius);
    for (size_t f = 0; f < other.feature.size(); ++f) {
      const float *here = tile_[0].feature[f].row(0, y), *there = other.feature[f].row(dx, y + dy),
                  *noise = other.feature_variance[f].row(dx, y + dy);
      TileRow& sum = equations_.noise[f + 2];
      for (int x = 0; x < tile_size; ++x) {
        term[f + 3][size_t(x)] = there[x] - here[x];
        sum[size_t(x)] += weight[x] * noise[x];
      }
    }
    for (size_t c = 0; c < 3; ++c) {
      const float* there = other.half[half][c].row(dx, y + dy);
      std::copy(there, there + tile_size, term[size_t(terms_) + c].begin());
      range_.add(c, there, weight);
    }
    for (size_t i = 0; i < size_t(terms_); ++i) {
      TileRow weighed;
      for (size_t x = 0; x < tile_size; ++x) weighed[x] = weight[x] * term[i][x];
      for (size_t j = i; j < size_t(terms_) + 3; ++j) {
        TileRow& sum = equations_.sum[i][j];
        for (size_t x = 0; x < tile_size; ++x) sum[x] += weighed[x] * term[j][x];
      }
    }
  }

  const NoisyPicture& picture_;
  int x0_, y0_, terms_;
  std::vector<TileInput> tile_;     // of each source
  std::vector<TileWeight> weight_;  // of each offset in each
  NormalEquations equations_;
  Range range_;
};

/// Mean of the 3 x 3 pixels around each: the few samples of one tell its variance badly.
void smooth_variance(NoisyPicture& picture) {
  for (Plane& variance : picture.variance) {
    const Plane told = variance;
    for_each_window(picture.width, picture.height, 1, [&](size_t p, const auto& window) {
      float sum = 0;
      for (const size_t q : window) sum += told[q];
      variance[p] = sum / float(window.size());
    });
  }
}

/// The picture itself, the frames before it and those after it.
class Sources {
 public:
  Sources(const NoisyPicture& picture, const Neighbours& neighbours)
      : list_{{&picture, nullptr, window_radius}} {
    const size_t before = neighbours.before.size(), after = neighbours.after.size();
    matches_.reserve(before + after);
    add(picture, neighbours.before, Side::before);
    add(picture, neighbours.after, Side::after);
  }
  const std::vector<Source>& list() const { return list_; }

 private:
  void add(const NoisyPicture& picture, const std::vector<NoisyPicture>& frames, Side side) {
    const NoisyPicture* from = &picture;
    for (const NoisyPicture& to : frames) {
      PixelMatch step = match_pixels(*from, to, side);
      matches_.push_back(from == &picture ? std::move(step) : chained(matches_.back(), step));
      list_.push_back({&to, &matches_.back(), beside_radius});
      from = &to;
    }
  }

  std::vector<PixelMatch> matches_;
  std::vector<Source> list_;
};

/// One guide of a source, where its pixels are in the picture that is denoised; beyond that
/// picture's edge its edge pixels, which count nothing there.
struct GuidePlanes {
  GuidePlanes(const NoisyPicture& picture, const Source& source, size_t f)
      : stride(picture.width + 2 * guide_padding) {
    const NoisyPicture& from = *source.picture;
    const float scale = from.unit(f) / picture.unit(f);
    for (int v = -guide_padding; v < picture.height + guide_padding; ++v)
      for (int u = -guide_padding; u < picture.width + guide_padding; ++u) {
        const int x = std::clamp(u, 0, picture.width - 1), y = std::clamp(v, 0, picture.height - 1);
        const size_t p = size_t(y) * size_t(picture.width) + size_t(x);
        const size_t q = source.match ? size_t(source.match->pixel[p]) : p;
        value.push_back(scale * from.feature[f][q]);
        variance.push_back(scale * scale * from.feature_variance[f][q]);
        const float same = source.match ? source.match->same[p] : 1.f;
        counts.push_back(u == x && v == y ? same : 0.f);
      }
  }
  size_t at(int x, int y) const {
    return size_t(y + guide_padding) * size_t(stride) + size_t(x + guide_padding);
  }

  int stride;
  Plane value, variance, counts;
};

/// Sums for a row of pixels.
struct GuideRow {
  explicit GuideRow(int width)
      : total(size_t(width), 0.f), mean(total), scatter(total), unlike(size_t(width) + 2) {}

  /// Adds the pixels at an offset, by how far apart patches of 3 x 3 pixels are in units of their
  /// noise and less what that explains; single pixels would be judged by their own noise, which the
  /// mean then kept.
  void add(const GuidePlanes& here, const GuidePlanes& there, int y, int dx, int dy) {
    std::fill(unlike.begin(), unlike.end(), 0.f);
    for (int j = -1; j <= 1; ++j) {
      const size_t p = here.at(-1, y + j), q = there.at(dx - 1, y + dy + j);
      const float *a = &here.value[p], *b = &there.value[q];
      const float *va = &here.variance[p], *vb = &there.variance[q];
      for (size_t x = 0; x < unlike.size(); ++x) {
        const float d = a[x] - b[x];
        unlike[x] += (d * d - (va[x] + std::min(va[x], vb[x]))) /
                     (9 * (min_guide_variance + bandwidth2 * (va[x] + vb[x])));
      }
    }
    const size_t q = there.at(dx, y + dy);
    const float *value = &there.value[q], *variance = &there.variance[q],
                *counts = &there.counts[q];
    for (size_t x = 0; x < total.size(); ++x) {
      const float far = std::clamp(unlike[x] + unlike[x + 1] + unlike[x + 2], 0.f, 16.f);
      float weight = 1 - far / 16;  // to the 16th: nearly exp(-far), and quick
      for (int k = 0; k < 4; ++k) weight *= weight;
      weight *= counts[x];
      total[x] += weight;
      mean[x] += weight * value[x];
      scatter[x] += weight * weight * variance[x];
    }
  }

  Plane total, mean, scatter, unlike;
};

/// Mean of a guide over the pixels around each, of all sources, where patches look alike, and the
/// mean's variance.
std::pair<Plane, Plane> smooth_guide(const std::vector<Source>& sources, size_t f) {
  const NoisyPicture& picture = *sources[0].picture;
  std::vector<GuidePlanes> planes;
  for (const Source& source : sources) planes.emplace_back(picture, source, f);
  std::pair<Plane, Plane> out{picture.feature[f], picture.feature_variance[f]};
  tbb::parallel_for(0, picture.height, [&](int y) {
    GuideRow row(picture.width);
    for (const GuidePlanes& there : planes)
      for (int dy = -guide_radius; dy <= guide_radius; ++dy)
        for (int dx = -guide_radius; dx <= guide_radius; ++dx) row.add(planes[0], there, y, dx, dy);
    const size_t first = size_t(y) * size_t(picture.width);
    for (size_t x = 0; x < row.total.size(); ++x) {
      out.first[first + x] = row.mean[x] / row.total[x];
      out.second[first + x] = row.scatter[x] / (row.total[x] * row.total[x]);
    }
  });
  return out;
}

/// Smooths the guides of all sources: those of the picture that is denoised by all frames, those of
/// its neighbours by each alone.
void smooth_guides(const std::vector<Source>& sources, NoisyPicture& picture,
                   Neighbours& neighbours) {
  std::vector<NoisyPicture*> frames{&picture};
  for (std::vector<NoisyPicture>* side : {&neighbours.before, &neighbours.after})
    for (NoisyPicture& frame : *side) frames.push_back(&frame);
  std::vector<std::pair<Plane, Plane>> smooth;
  const size_t guides = picture.feature.size();
  for (size_t k = 0; k < frames.size(); ++k)
    for (size_t f = 0; f < guides; ++f)
      smooth.push_back(
          smooth_guide(k == 0 ? sources : std::vector<Source>{{frames[k], nullptr, 0}}, f));
  for (size_t k = 0; k < frames.size(); ++k)
    for (size_t f = 0; f < guides; ++f)
      std::tie(frames[k]->feature[f], frames[k]->feature_variance[f]) =
          std::move(smooth[k * guides + f]);
}

/// @return glints, which are not in it any more
std::vector<Plane> prepare(NoisyPicture& picture) {
  std::vector<Plane> glints = suppress_fireflies(picture);
  smooth_variance(picture);
  return glints;
}

}  // namespace

std::vector<Plane> denoise(NoisyPicture picture, Neighbours neighbours) {
  std::vector<Plane> out = prepare(picture);
  for (std::vector<NoisyPicture>* side : {&neighbours.before, &neighbours.after})
    for (NoisyPicture& frame : *side) prepare(frame);
  const Sources sources(picture, neighbours);
  smooth_guides(sources.list(), picture, neighbours);
  const int columns = (picture.width + tile_size - 1) / tile_size;
  const int rows = (picture.height + tile_size - 1) / tile_size;
  tbb::parallel_for(
      tbb::blocked_range<int>(0, columns * rows, 1),
      [&](const tbb::blocked_range<int>& range) {
        for (int t = range.begin(); t < range.end(); ++t)
          TileDenoiser(sources.list(), t % columns * tile_size, t / columns * tile_size).run(out);
      },
      tbb::simple_partitioner{});
  return out;
}

}  // namespace drench::render

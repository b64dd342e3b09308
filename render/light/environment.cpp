#include "render/light/environment.h"

#include <fmt/format.h>

#include "render/color/color.h"
#include "render/texture/texture.h"

namespace drench::render {

namespace {

/// Cells of the sampling table of an environment without a map.
constexpr int gradient_columns = 1, gradient_rows = 64;

float row_cosine(int row, int rows) { return float(std::cos(std::numbers::pi * row / rows)); }

}  // namespace

AliasTable::AliasTable(const std::vector<float>& weights)
    : bins_(weights.size()), probability_(weights.size()) {
  const size_t n = weights.size();
  double total = 0;
  for (float w : weights) total += w;
  std::vector<double> scaled(n);
  std::vector<uint32_t> small, large;
  for (size_t k = 0; k < n; ++k) {
    const double p = total > 0 ? weights[k] / total : 1.0 / double(n);
    probability_[k] = float(p);
    scaled[k] = p * double(n);
    (scaled[k] < 1 ? small : large).push_back(uint32_t(k));
  }
  while (!small.empty() && !large.empty()) {
    const uint32_t low = small.back(), high = large.back();
    small.pop_back();
    bins_[low] = {float(scaled[low]), high};
    scaled[high] -= 1 - scaled[low];
    if (scaled[high] < 1) {
      large.pop_back();
      small.push_back(high);
    }
  }
  for (uint32_t k : small) bins_[k] = {1, k};
  for (uint32_t k : large) bins_[k] = {1, k};
}

uint32_t AliasTable::sample(float& u) const {
  const float scaled = u * float(bins_.size());
  const uint32_t bin = std::min(uint32_t(scaled), uint32_t(bins_.size() - 1));
  const float within = std::min(scaled - float(bin), one_minus_epsilon);
  const Bin& b = bins_[bin];
  if (within < b.keep) {
    u = std::min(within / b.keep, one_minus_epsilon);
    return bin;
  }
  u = std::min((within - b.keep) / (1 - b.keep), one_minus_epsilon);
  return b.other;
}

Environment::Environment(const Light& light, Sampling sampling, PictureMemory& memory)
    : scale_(light.radiance),
      horizon_(light.radiance * light.horizon),
      ground_(light.radiance * light.below),
      rotation_(float(light.rotation_deg / 360 - std::floor(light.rotation_deg / 360))) {
  if (!light.map.empty()) {
    read_map(light, memory);
    if (light.split_suns) suns_ = extract_suns(map_, rotation_);
    for (ExtractedSun& sun : suns_) sun.irradiance *= scale_;
  }
  const int columns = is_map() ? map_.width : gradient_columns;
  const int rows = is_map() ? map_.height : gradient_rows;
  V3f sum(0);
  for (int r = 0; r < rows; ++r) {
    const float weight = (row_cosine(r, rows) - row_cosine(r + 1, rows)) / 2 / float(columns);
    V3f row(0);
    for (int c = 0; c < columns; ++c)
      row += is_map() ? map_.texel[size_t(r) * columns + c] * scale_
                      : radiance(from_map({0.5f, (float(r) + 0.5f) / float(rows)}));
    sum += row * weight;
  }
  mean_ = sum;
  if (sampling == Sampling::on) build_tables(columns, rows);
}

void Environment::read_map(const Light& light, PictureMemory& memory) {
  const uint64_t before = memory.taken();
  const Texture picture = read_sky(light.map, memory);
  const uint64_t of_picture = memory.taken() - before;
  // The map and its tables of what is drawn.
  memory.take(
      light.map,
      fmt::format("{} x {} texels of light '{}'", picture.width(), picture.height(), light.name),
      picture.texels() * (sizeof(V3f) + AliasTable::bytes_per_entry));
  map_ = {picture.width(), picture.height(), {}};
  map_.texel.resize(picture.texels());
  for (size_t p = 0; p < map_.texel.size(); ++p) {
    V3f& texel = map_.texel[p];
    texel = picture.texel(p);
    // Colours outside ACEScg's gamut come out of a conversion a little negative: no light, not a
    // fault.
    for (int c = 0; c < 3; ++c) texel[c] = std::max(texel[c], 0.f);
  }
  memory.give_back(of_picture);
}

void Environment::build_tables(int columns, int rows) {
  columns_ = columns;
  rows_ = rows;
  std::vector<float> row_weight(rows), cell(columns);
  for (int r = 0; r < rows; ++r) {
    // Lookups are bilinear, so a texel lights the cells around it: weigh each with its neighbours.
    double total = 0;
    for (int c = 0; c < columns; ++c) {
      float sum = 0;
      for (int dr = -1; dr <= 1; ++dr)
        for (int dc = -1; dc <= 1; ++dc) {
          const V2f uv((float(c + dc) + 0.5f) / float(columns),
                       (float(std::clamp(r + dr, 0, rows - 1)) + 0.5f) / float(rows));
          sum += luminance(radiance(from_map(uv)));
        }
      cell[c] = sum;
      total += sum;
    }
    column_tables_.emplace_back(cell);
    row_weight[r] = float(total) * (row_cosine(r, rows) - row_cosine(r + 1, rows));
  }
  row_table_ = AliasTable(row_weight);
}

V2f Environment::to_map(const V3f& d) const {
  const float u = std::atan2(d.x, -d.z) / (2 * pi) + 0.5f + rotation_;
  return {u - std::floor(u), std::acos(std::clamp(d.y, -1.f, 1.f)) / pi};
}

V3f Environment::from_map(const V2f& uv) const {
  const float phi = (uv.x - rotation_ - 0.5f) * 2 * pi;
  const float sin = std::sin(uv.y * pi);
  return {sin * std::sin(phi), std::cos(uv.y * pi), -sin * std::cos(phi)};
}

V3f Environment::radiance(const V3f& d) const {
  if (!is_map()) {
    if (d.y < 0) return ground_;
    const float t = 1 - std::min(d.y, 1.f), rise = t * t * t;  // most change lies near the horizon
    return scale_ * (1 - rise) + horizon_ * rise;
  }
  const V2f uv = to_map(d);
  const float x = uv.x * float(map_.width) - 0.5f, y = uv.y * float(map_.height) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y), s = x - x0, t = y - y0;
  const auto texel = [&](int c, int r) {
    c = (c + map_.width) % map_.width;
    r = std::clamp(r, 0, map_.height - 1);
    return map_.texel[size_t(r) * map_.width + c];
  };
  const int c = int(x0), r = int(y0);
  return ((texel(c, r) * (1 - s) + texel(c + 1, r) * s) * (1 - t) +
          (texel(c, r + 1) * (1 - s) + texel(c + 1, r + 1) * s) * t) *
         scale_;
}

DirectionSample Environment::sample(const V2f& u) const {
  float in_row = u.y, in_column = u.x;
  const int row = int(row_table_.sample(in_row));
  const int column = int(column_tables_[row].sample(in_column));
  const float top = row_cosine(row, rows_), bottom = row_cosine(row + 1, rows_);
  const float y = top + (bottom - top) * in_row;
  const float phi = ((float(column) + in_column) / float(columns_) - rotation_ - 0.5f) * 2 * pi;
  const float sin = std::sqrt(std::max(0.f, 1 - y * y));
  const float solid_angle = 2 * pi / float(columns_) * (top - bottom);
  return {{sin * std::sin(phi), y, -sin * std::cos(phi)},
          row_table_.probability(row) * column_tables_[row].probability(column) / solid_angle};
}

float Environment::pdf(const V3f& direction) const {
  const V2f uv = to_map(direction);
  const int row = std::min(int(uv.y * float(rows_)), rows_ - 1);
  const int column = std::min(int(uv.x * float(columns_)), columns_ - 1);
  const float solid_angle =
      2 * pi / float(columns_) * (row_cosine(row, rows_) - row_cosine(row + 1, rows_));
  return row_table_.probability(row) * column_tables_[row].probability(column) / solid_angle;
}

}  // namespace drench::render

#pragma once
// Signed distance to an obstacle and its normal, analytic or from a level set. Positions in its own
// frame are named `own`.

#include "pipeline/contract/geometry/level_set.h"
#include "sim/backend/vec3.h"
#include "sim/obstacle_placement.h"

namespace drench::sim::DRENCH_BACKEND {

/// A LevelSet (pipeline/contract/geometry/level_set.h) in the memory of the backend.
struct FieldView {
  const int* block;
  const float* value;
  float inverse_voxel, voxel, band;
  int low[3], blocks[3];

  /// Trilinear; plus or minus the band beyond it. m
  DRENCH_HD float operator()(Vec3<float> own) const {
    const float x[3] = {own.x * inverse_voxel, own.y * inverse_voxel, own.z * inverse_voxel};
    int corner[3], at[3];
    float f[3];
    for (int k = 0; k < 3; ++k) {
      if (!(x[k] > 8.f * float(low[k])) || !(x[k] < 8.f * float(low[k] + blocks[k]))) return band;
      const float cell = floorf(x[k]);
      const int index = int(cell) - 8 * low[k];
      f[k] = x[k] - cell, at[k] = index >> 3, corner[k] = index & 7;
      if (at[k] >= blocks[k]) return band;  // rounding at the upper end
    }
    const int b = block[(at[2] * blocks[1] + at[1]) * blocks[0] + at[0]];
    if (b < 0) return b == -1 ? band : -band;
    const float* v = value + 729 * long(b) + 81 * corner[2] + 9 * corner[1] + corner[0];
    const float x00 = v[0] + f[0] * (v[1] - v[0]), x10 = v[9] + f[0] * (v[10] - v[9]);
    const float x01 = v[81] + f[0] * (v[82] - v[81]), x11 = v[90] + f[0] * (v[91] - v[90]);
    const float y0 = x00 + f[1] * (x10 - x00), y1 = x01 + f[1] * (x11 - x01);
    return y0 + f[2] * (y1 - y0);
  }
};

/// Without pointers.
inline FieldView field_view(const LevelSet& set) {
  FieldView view{.block = nullptr,
                 .value = nullptr,
                 .inverse_voxel = 1.f / set.voxel,
                 .voxel = set.voxel,
                 .band = set.band,
                 .low = {},
                 .blocks = {}};
  for (int k = 0; k < 3; ++k) view.low[k] = set.low[k], view.blocks[k] = set.blocks[k];
  return view;
}

DRENCH_HD float sign_of(float x) { return x < 0.f ? -1.f : 1.f; }

/// Distance to a box and its gradient; inside, along the axis of the nearest face.
struct BoxDistance {
  float distance;
  Vec3<float> normal;
  float beyond[3];  // m, signed distance to the slab of each axis

  DRENCH_HD BoxDistance(Vec3<float> own, const float (&half)[3]) {
    const float x[3] = {own.x, own.y, own.z};
    float out[3], n[3] = {0.f, 0.f, 0.f};
    int nearest = 0;
    for (int k = 0; k < 3; ++k) {
      beyond[k] = fabsf(x[k]) - half[k], out[k] = max0(beyond[k]);
      if (beyond[k] > beyond[nearest]) nearest = k;
    }
    const float length = sqrtf(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    distance = beyond[nearest] > 0.f ? length : beyond[nearest];
    if (beyond[nearest] > 0.f) {
      for (int k = 0; k < 3; ++k) n[k] = sign_of(x[k]) * out[k] / length;
    } else {
      n[nearest] = sign_of(x[nearest]);
    }
    normal = {n[0], n[1], n[2]};
  }
};

struct ObstacleView : ObstaclePlacement {
  FieldView field[2];

  DRENCH_HD Vec3<float> own_axis(int when, int k) const {
    return {axis[when][3 * k], axis[when][3 * k + 1], axis[when][3 * k + 2]};
  }
  DRENCH_HD Vec3<float> to_own(int when, Vec3<float> x) const {
    const Vec3<float> d{x.x - centre[when][0], x.y - centre[when][1], x.z - centre[when][2]};
    return {dot(own_axis(when, 0), d), dot(own_axis(when, 1), d), dot(own_axis(when, 2), d)};
  }
  DRENCH_HD Vec3<float> turn(int when, Vec3<float> own) const {
    return own_axis(when, 0) * own.x + own_axis(when, 1) * own.y + own_axis(when, 2) * own.z;
  }
  DRENCH_HD Vec3<float> to_frame(int when, Vec3<float> own) const {
    return turn(when, own) + Vec3<float>{centre[when][0], centre[when][1], centre[when][2]};
  }

  /// m, negative inside. @param mix  0 the first level set .. 1 the second.
  DRENCH_HD_CALL float distance(Vec3<float> own, float mix) const {
    if (shape == ObstacleShape::plane) return own.y;
    if (shape == ObstacleShape::sphere) return length(own) - half[0];
    if (shape == ObstacleShape::box) return BoxDistance(own, half).distance;
    if (!around) return field_distance(own, mix);
    float least = 1e30f;
    for (int i = joined[0][0]; i <= joined[0][1]; ++i) {
      for (int j = joined[1][0]; j <= joined[1][1]; ++j) {
        for (int k = joined[2][0]; k <= joined[2][1]; ++k) {
          const Vec3<float> to_image =
              period_along(0) * float(i) + period_along(1) * float(j) + period_along(2) * float(k);
          least = minimum(least, field_distance(own - to_image, mix));
        }
      }
    }
    return least;
  }
  DRENCH_HD float field_distance(Vec3<float> own, float mix) const {
    const float first = field[0](own);
    return deform > 0.f ? first + mix * (field[1](own) - first) : first;
  }
  DRENCH_HD Vec3<float> period_along(int k) const {
    return {period[k][0], period[k][1], period[k][2]};
  }

  /// Of the distance, over points `step` m off to either side along each axis. A loop, because a
  /// distance is long.
  struct CentralDifferences {
    Vec3<float> rise{0.f, 0.f, 0.f};  // from one side to the other
    float sum = 0.f;                  // of all six
  };
  DRENCH_HD CentralDifferences central_differences(Vec3<float> own, float step, float mix) const {
    CentralDifferences all;
    for (int k = 0; k < 3; ++k) {
      const Vec3<float> off{k == 0 ? step : 0.f, k == 1 ? step : 0.f, k == 2 ? step : 0.f};
      float side[2];
      for (int s = 0; s < 2; ++s) side[s] = distance(s == 0 ? own - off : own + off, mix);
      all.sum = all.sum + side[0] + side[1];
      const float rise = side[1] - side[0];
      if (k == 0) all.rise.x = rise;
      if (k == 1) all.rise.y = rise;
      if (k == 2) all.rise.z = rise;
    }
    return all;
  }

  /// Unit, away from the solid; zero deep inside a level set, where nothing is known.
  DRENCH_HD_CALL Vec3<float> normal(Vec3<float> own, float mix) const {
    if (shape == ObstacleShape::plane) return {0.f, 1.f, 0.f};
    if (shape == ObstacleShape::box) return BoxDistance(own, half).normal;
    if (shape == ObstacleShape::field)
      own = central_differences(own, 0.5f * field[0].voxel, mix).rise;
    const float size = length(own);
    return size > 0.f ? own * (1.f / size) : Vec3<float>{0.f, 0.f, 0.f};
  }

  /// Whether a path from a to b may come as near as `reach`.
  DRENCH_HD bool near_path(Vec3<float> a, Vec3<float> b, float reach) const {
    return minimum(a.x, b.x) < high[0] + reach && maximum(a.x, b.x) > low[0] - reach &&
           minimum(a.y, b.y) < high[1] + reach && maximum(a.y, b.y) > low[1] - reach &&
           minimum(a.z, b.z) < high[2] + reach && maximum(a.z, b.z) > low[2] - reach;
  }
};

struct ObstacleViews {
  const ObstacleView* obstacle;
  int count;
};

}  // namespace drench::sim::DRENCH_BACKEND

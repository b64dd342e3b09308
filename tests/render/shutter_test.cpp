// The course of the shutter, what deforms while it is open, and rows that are exposed one after the
// other, against streaks and means by definition.

#include <gtest/gtest.h>

#include "render/film/filter.h"
#include "render/sampler.h"
#include "render/scene/camera.h"
#include "tests/render/strip.h"

namespace drench::render::test {
namespace {

/// Fraction of the light that has come by a time, for fractions of opening and closing.
double come_by(double time, double opening, double closing) {
  constexpr int steps = 4000;
  double by = 0, all = 0;
  for (int k = 0; k < steps; ++k) {
    const double t = (k + 0.5) / steps;
    const double rise = opening > 0 ? std::min(t / opening, 1.) : 1;
    const double fall = closing > 0 ? std::min((1 - t) / closing, 1.) : 1;
    const double open = std::min(rise, fall);
    all += open;
    if (t < time) by += open;
  }
  return by / all;
}

TEST(ShutterCurve, DrawsTimesAsItIsOpen) {
  for (const auto& [opening, closing] :
       {std::pair(0., 0.), {0.25, 0.25}, {0.5, 0.5}, {0.1, 0.6}, {0., 1.}, {1., 0.}}) {
    Camera camera;
    camera.shutter_opening = opening;
    camera.shutter_closing = closing;
    const ShutterCurve curve(camera);
    for (const float u : {0.f, 0.01f, 0.2f, 0.37f, 0.5f, 0.81f, 0.99f, one_minus_epsilon}) {
      const float t = curve.time(u, 0.3f);
      EXPECT_GE(t, 0);
      EXPECT_LE(t, 1);
      EXPECT_NEAR(come_by(t, opening, closing), u, 1e-3) << opening << ' ' << closing;
    }
  }
}

TEST(ShutterCurve, OfAnEvenGlobalShutterIsTheNumberItselfToTheBit) {
  const ShutterCurve curve{Camera{}};
  for (uint32_t k = 0; k < 4096; ++k) {
    const float u = unit_float(hash_bits(k));
    EXPECT_EQ(curve.time(u, float(k) / 4096), u);
  }
}

TEST(ShutterCurve, RefusesWhatClosesBeforeItIsOpen) {
  Camera camera;
  camera.shutter_opening = 0.6;
  camera.shutter_closing = 0.5;
  EXPECT_THROW(ShutterCurve{camera}, Error);
  camera.shutter_closing = 0.2;
  camera.rolling_shutter = -0.1;
  EXPECT_THROW(ShutterCurve{camera}, Error);
}

TEST(ShutterCurve, FadesTheStreakOfAMovingStrip) {
  constexpr double strip_width = 4, travel = 24;
  for (const auto& [opening, closing] : {std::pair(0.5, 0.5), {0.1, 0.6}}) {
    Strip strip(strip_width, travel);
    strip.shot.camera.shutter_opening = opening;
    strip.shot.camera.shutter_closing = closing;
    const std::vector<double> dark =
        darkness_of_columns(render_frame(strip.shot, 1001, strip.geometry));
    // It covers x while its middle, at (t - 1/2) travel, is within half a width of it.
    const auto coverage = [&](double x) {
      const double from = (x - strip_width / 2) / travel + 0.5,
                   to = (x + strip_width / 2) / travel + 0.5;
      return come_by(to, opening, closing) - come_by(from, opening, closing);
    };
    const PixelFilter filter;
    double sum = 0;
    for (int column = 0; column < 64; ++column) {
      double expected = 0;
      for (int q = 0; q < 64; ++q)
        expected += coverage(column + 0.5 - 32 + filter.offset({(q + 0.5f) / 64, 0.5f}).x) / 64;
      EXPECT_NEAR(dark[column], expected, 0.01) << column;
      sum += dark[column];
    }
    EXPECT_NEAR(sum, strip_width, 0.01 * strip_width);
  }
}

/// Green of each pixel and what it varies by, from pictures of several seeds.
struct Spread {
  static constexpr int pictures = 16;
  std::vector<double> mean, variance;  // of the mean

  /// @param picture  Film(seed)
  template <class Picture>
  explicit Spread(const Picture& picture) {
    for (uint32_t seed = 0; seed < pictures; ++seed) {
      const Film film = picture(seed);
      mean.resize(film.rgba.size() / 4), variance.resize(mean.size());
      for (size_t p = 0; p < mean.size(); ++p) {
        const double v = film.rgba[4 * p + 1];
        mean[p] += v / pictures, variance[p] += v * v / pictures;
      }
    }
    for (size_t p = 0; p < mean.size(); ++p)
      variance[p] = (variance[p] - mean[p] * mean[p]) / (pictures - 1);
  }
};

/// A chequered ball that shears, bulges and stretches: every vertex has a velocity of its own.
struct Deforming {
  Shot shot = plain_shot(64, 24);
  FrameGeometry geometry;

  Deforming() {
    shot.render.motion_blur = true;
    shot.camera.position = V3d(0, 0, 6);
    shot.camera.target = V3d(0, 0, 0);
    shot.light = {sky(1)};
    Material chequer = diffuse("chequer", 0.9f);
    chequer.checker = true;
    chequer.checker_size = 0.4;
    shot.material = {chequer};
    Obstacle ball;
    ball.name = "ball";
    ball.material = "chequer";
    shot.obstacle = {ball};
    TriangleMesh mesh = sphere_mesh(3);
    for (size_t k = 0; k < mesh.position.size(); ++k) {
      const V3f p = mesh.position[k];
      mesh.uv.push_back({p.x, p.y});
      mesh.velocity[k] = V3f(1.5f * p.y, p.x * p.x, 2 * p.z) * float(shot.timeline.fps);
    }
    geometry.obstacle = {{"ball", mesh}};
  }
  /// By its velocities, `gain` times as large.
  Film blurred(uint32_t seed, float gain) const {
    Shot seen = shot;
    seen.render.seed = seed;
    FrameGeometry faster = geometry;
    for (V3f& v : faster.obstacle[0].mesh.velocity) v *= gain;
    return render_frame(seen, 1001, faster);
  }
  /// As it stands between its shapes where the shutter opens and closes. @param time  0 to 1
  FrameGeometry still(double time) const {
    FrameGeometry out = geometry;
    TriangleMesh& mesh = out.obstacle[0].mesh;
    for (size_t k = 0; k < mesh.position.size(); ++k) {
      const V3f per_frame = mesh.velocity[k] * float(1 / shot.timeline.fps);
      const V3f open = mesh.position[k] + per_frame * float(shot.camera.shutter_open),
                close = mesh.position[k] + per_frame * float(shot.camera.shutter_close);
      mesh.position[k] = open + (close - open) * float(time);
    }
    mesh.velocity.clear();
    return out;
  }
  Film mean_of_stills(uint32_t seed) const {
    constexpr int still_count = 64;
    Shot seen = shot;
    seen.render.motion_blur = false;
    seen.render.samples = 4;
    Film sum{seen.render.width, seen.render.height, {}};
    for (int k = 0; k < still_count; ++k) {
      seen.render.seed = 1000 + seed * still_count + uint32_t(k);
      const Film film = render_frame(seen, 1001, still((k + 0.5) / still_count));
      sum.rgba.resize(film.rgba.size());
      for (size_t p = 0; p < film.rgba.size(); ++p) sum.rgba[p] += film.rgba[p] / still_count;
    }
    return sum;
  }
};

// Squares of differences and their variances, summed over the picture: their ratio is 1 give or
// take a tenth, 1.5 five standard deviations away. Velocities that are a tenth too large make
// it 2.8.
TEST(VelocityBlur, OfWhatDeformsIsTheMeanOfStillsBetweenItsTwoShapes) {
  const Deforming ball;
  const Spread stills([&](uint32_t seed) { return ball.mean_of_stills(seed); });
  const auto off_stills = [&](float gain) {
    const Spread blurred([&](uint32_t seed) { return ball.blurred(seed, gain); });
    double square = 0, variance = 0;
    for (size_t p = 0; p < stills.mean.size(); ++p) {
      square += std::pow(blurred.mean[p] - stills.mean[p], 2);
      variance += blurred.variance[p] + stills.variance[p];
    }
    return square / variance;
  };
  EXPECT_LT(off_stills(1), 1.5);
  EXPECT_GT(off_stills(1.1f), 2);
}

TEST(RollingShutter, SlantsAMovingStripByItsLatenessAndBlursItNoMore) {
  constexpr double strip_width = 4, travel = 8, late = 1.5;
  Strip strip(strip_width, travel);
  strip.shot.camera.rolling_shutter = late;
  const Film film = render_frame(strip.shot, 1001, strip.geometry);
  const PixelFilter filter;
  double filter_square = 0;
  for (int q = 0; q < 4096; ++q)
    filter_square += std::pow(filter.offset({(q + 0.5f) / 4096, 0.5f}).x, 2) / 4096;
  // Slant within a row's filter, uniform strip and uniform travel: their variances add.
  const double slope = late * travel / 16;
  const double variance =
      (strip_width * strip_width + travel * travel) / 12 + (1 + slope * slope) * filter_square;
  for (int y = 2; y < 14; ++y) {  // rows whose filter does not reach beyond the film
    double sum = 0, moment = 0, square = 0;
    for (int x = 0; x < 64; ++x) {
      const double dark = 1 - film.rgba[4 * size_t(y * 64 + x)], at = x + 0.5 - 32;
      sum += dark, moment += dark * at, square += dark * at * at;
    }
    const double middle = moment / sum;
    EXPECT_NEAR(sum, strip_width, 0.02 * strip_width) << y;
    EXPECT_NEAR(middle, slope * (y + 0.5), 0.15) << y;
    EXPECT_NEAR(square / sum - middle * middle, variance, 0.06 * variance) << y;
  }
}

TEST(RollingShutter, KeepsTheFirstRowOnTimeForAMovingCameraToo) {
  // A pan seen by rows: the camera that moves left is the strip that moves right.
  Strip strip(4, 8), still(4, 0);
  still.shot.camera.rolling_shutter = strip.shot.camera.rolling_shutter = 1;
  const double reach = 8 * Strip::pixel / 2;
  for (Animated<V3d>* key : {&still.shot.camera.position, &still.shot.camera.target}) {
    const V3d middle = key->keys.front().second;
    key->keys = {{1000.75, middle + V3d(reach, 0, 0)}, {1001.75, middle - V3d(3 * reach, 0, 0)}};
  }
  const Film a = render_frame(strip.shot, 1001, strip.geometry),
             b = render_frame(still.shot, 1001, still.geometry);
  for (int y = 0; y < 16; ++y) {
    double difference = 0;
    for (int x = 0; x < 64; ++x)
      difference += std::abs(a.rgba[4 * size_t(y * 64 + x)] - b.rgba[4 * size_t(y * 64 + x)]);
    EXPECT_LT(difference, 0.03 * 4) << y;
  }
}

}  // namespace
}  // namespace drench::render::test

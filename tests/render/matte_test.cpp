// Frames that go over a plate: clear backgrounds, see-through water, holdouts and shadow catchers
// against closed forms and against the picture itself.

#include "render/film/matte.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "tests/render/support.h"

namespace drench::render::test {
namespace {

const FilmLayer& layer_of(const Film& film, const std::string& name) {
  for (const FilmLayer& layer : film.layer)
    if (layer.name == name) return layer;
  throw std::runtime_error("no layer " + name);
}

double over(const Film& film, size_t pixel, size_t colour, double plate) {
  return film.rgba[4 * pixel + colour] + (1 - double(film.rgba[4 * pixel + 3])) * plate;
}

size_t pixels_of(const Film& film) { return film.rgba.size() / 4; }

void add_obstacle(Shot& shot, FrameGeometry& geometry, const std::string& name, TriangleMesh mesh,
                  Matte matte = Matte::none) {
  Obstacle obstacle;
  obstacle.name = obstacle.material = name;
  obstacle.matte = matte;
  shot.obstacle.push_back(obstacle);
  geometry.obstacle.push_back({name, std::move(mesh)});
}

/// Water, a mirror and a sheet over a piece of ground, some sky to be seen around them.
struct Bowl {
  Shot shot = plain_shot(16, 24);
  FrameGeometry geometry;

  Bowl() {
    add_ground(shot, 0.5f, 1);
    shot.material.push_back(dielectric("water", 1.333, V3f(0.5f, 0.2f, 0.1f)));
    shot.material.push_back(diffuse("mirror", 0.9f));
    shot.material.back().type = MaterialType::metal;
    shot.light = {sky(0.7f)};
    shot.camera.position = V3d(0, 1.2, 3);
    shot.camera.target = V3d(0, 0.3, 0);
    geometry.fluid = sphere_mesh(4);
    for (V3f& p : geometry.fluid.position)
      p = V3f(0.6f * p.x, 0.4f * p.y + 0.5f + 0.05f * std::sin(8 * p.x), 0.5f * p.z);
    geometry.fluid.normal.clear();
    add_obstacle(shot, geometry, "mirror", box_mesh({0.5f, 0.3f, -0.4f}, {1.2f, 1.1f, -0.3f}));
    geometry.cloth = {{"cloth", sheet_mesh(4, [](float x, float) { return 0.2f * x; })}};
  }
};

/// The same sky as a plate is the same picture: what is seen of it directly is left out, and all
/// else of it stays.
void expect_sky_as_plate(const Shot& shot, const FrameGeometry& geometry) {
  Shot clear = shot;
  clear.render.background = Background::clear;
  const Film whole = render_frame(shot, 1001, geometry), film = render_frame(clear, 1001, geometry);
  int empty = 0, partly = 0;
  for (size_t p = 0; p < pixels_of(film); ++p) {
    const float alpha = film.rgba[4 * p + 3];
    empty += alpha == 0;
    partly += alpha > 0 && alpha < 1;
    for (size_t c = 0; c < 3; ++c) {
      if (alpha == 0) {
        EXPECT_EQ(film.rgba[4 * p + c], 0);
      }
      // Alpha by colour is another thing: see OpacityTintsThePlate.
      if (shot.render.refraction_alpha == RefractionAlpha::opaque) {
        EXPECT_NEAR(over(film, p, c, 0.7), whole.rgba[4 * p + c], 1e-5) << p;
      }
    }
  }
  EXPECT_GT(empty, 50);
  EXPECT_GT(partly, 20);
}

TEST(ClearBackground, LeavesOutTheSkyAndNothingElse) {
  Bowl bowl;
  expect_sky_as_plate(bowl.shot, bowl.geometry);
}

TEST(ClearBackground, HidesTheSunsDisc) {
  Shot shot = plain_shot(4, 4);
  Light sun;
  sun.type = LightType::sun;
  sun.direction = {0, 0, 1};
  sun.angle_deg = 90;
  shot.light = {sun};
  aim_narrow(shot, {0, 1, 0}, {0, 1, -1});
  EXPECT_GT(channel_mean(render_frame(shot, 1001, {}), 0).value, 0.1);
  shot.render.background = Background::clear;
  for (const float value : render_frame(shot, 1001, {}).rgba) EXPECT_EQ(value, 0);
}

/// A slab of water, 0.5 m thick, seen at right angles before a sky of 1.
Shot slab_shot(double ior, const V3f& absorption, int samples) {
  Shot shot = plain_shot(samples);
  shot.material = {dielectric("water", ior, absorption)};
  shot.light = {sky(1)};
  shot.render.background = Background::clear;
  shot.render.refraction_alpha = RefractionAlpha::transparent;
  shot.layers.opacity = true;
  aim_narrow(shot, {0, 3, 0}, {0, 0, 0});
  return shot;
}

FrameGeometry slab() {
  FrameGeometry geometry;
  geometry.fluid = box_mesh({-5, 0, -5}, {5, 0.5f, 5});
  return geometry;
}

// Nothing is reflected: beauty is black, and a plate P is seen as P e^(-s d).
TEST(SeeThroughWater, OpacityTintsThePlate) {
  const V3f absorption(1, 0.32f, 0.13f);
  const Film film = render_frame(slab_shot(1, absorption, 1), 1001, slab());
  const std::vector<float>& opacity = layer_of(film, "opacity").value;
  for (size_t p = 0; p < pixels_of(film); ++p) {
    double mean = 0;
    for (size_t c = 0; c < 3; ++c) {
      const double kept = std::exp(-0.5 * absorption[int(c)]);
      EXPECT_EQ(film.rgba[4 * p + c], 0);
      EXPECT_NEAR(1 - opacity[3 * p + c], kept, 1e-5);
      mean += kept / 3;
    }
    EXPECT_NEAR(1 - film.rgba[4 * p + 3], mean, 1e-5);
  }
}

// R of one side 0.02037, of the slab with all paths within it 2 R / (1 + R): that much of the sky
// above is in the beauty, the rest is left to the plate. Paths that come back out of the top are
// no plate.
TEST(SeeThroughWater, ReflectsWhatASlabReflects) {
  const double one = std::pow(0.333 / 2.333, 2), slab_reflects = 2 * one / (1 + one);
  Shot shot = slab_shot(1.333, V3f(0), 1024);
  const Film film = render_frame(shot, 1001, slab());
  const Mean alpha = channel_mean(film, 3), beauty = channel_mean(film, 1);
  EXPECT_LT(alpha.error, 0.01 * slab_reflects);
  EXPECT_NEAR(alpha.value, slab_reflects, bound(alpha));
  EXPECT_NEAR(beauty.value, slab_reflects, bound(beauty));
  // Over a plate like the sky it is the sky; in every sample where one branch is followed.
  Film whole = film;
  for (size_t p = 0; p < pixels_of(film); ++p) whole.rgba[4 * p] = float(over(film, p, 1, 1));
  const Mean over_sky = channel_mean(whole, 0);
  EXPECT_NEAR(over_sky.value, 1, bound(over_sky));
  RenderOptions options;
  options.first_interface = FirstInterface::one;
  const Film one_branch = render_frame(shot, 1001, slab(), options);
  for (size_t p = 0; p < pixels_of(film); ++p) EXPECT_NEAR(over(one_branch, p, 1, 1), 1, 1e-5);

  shot.render.refraction_alpha = RefractionAlpha::opaque;
  const Film opaque = render_frame(shot, 1001, slab());
  EXPECT_EQ(channel_mean(opaque, 3).value, 1);
  EXPECT_NEAR(channel_mean(opaque, 1).value, 1, 1e-5);
}

// A prism of angle A turns what comes down on its slope by asin(n sin(A - asin(sin A / n))): 8.7
// degrees at A = 25 degrees, where the plate is seen, 17.4 at 45, where the sky is.
TEST(SeeThroughWater, ShowsThePlateWhereItBendsTheViewALittle) {
  for (const double angle : {25., 45.}) {
    const Shot shot = slab_shot(1.333, V3f(0), 64);
    FrameGeometry geometry;
    geometry.fluid = box_mesh({-1, -2, -1}, {1, 0, 1});
    for (V3f& p : geometry.fluid.position)
      if (p.y == 0) p.y = float(std::tan(angle * pi64 / 180)) * p.x;
    geometry.fluid.normal.clear();
    const Mean alpha = channel_mean(render_frame(shot, 1001, geometry), 3);
    if (angle < 30) {
      EXPECT_LT(alpha.value, 0.1);
      EXPECT_GT(alpha.value, 0.02);
    } else {
      EXPECT_EQ(alpha.value, 1);
    }
  }
}

TEST(SeeThroughWater, OverTheSkyIsThePictureByColour) {
  Bowl bowl;
  const Film whole = render_frame(bowl.shot, 1001, bowl.geometry);
  bowl.shot.render.refraction_alpha = RefractionAlpha::transparent;
  expect_sky_as_plate(bowl.shot, bowl.geometry);
  bowl.shot.render.background = Background::clear;
  bowl.shot.layers.opacity = true;
  const Film film = render_frame(bowl.shot, 1001, bowl.geometry);
  const std::vector<float>& opacity = layer_of(film, "opacity").value;
  for (size_t p = 0; p < pixels_of(film); ++p)
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(film.rgba[4 * p + c] + (1 - opacity[3 * p + c]) * 0.7f, whole.rgba[4 * p + c],
                  1e-5)
          << p;
}

// A camera under water that looks up at 60 degrees sees the floor mirrored by the surface: no plate
// is there.
TEST(SeeThroughWater, SeenFromWithinMirrorsStayMirrors) {
  Shot shot = slab_shot(1.333, V3f(0), 4);
  aim_narrow(shot, {0, 0.25, 0}, {1.7, 1.25, 0});
  FrameGeometry geometry;
  geometry.fluid = box_mesh({-50, -50, -50}, {50, 0.5f, 50});
  const Film film = render_frame(shot, 1001, geometry);
  EXPECT_EQ(channel_mean(film, 3).value, 1);
}

TEST(Holdout, IsAHoleThatAllElseKnows) {
  Bowl bowl;
  bowl.shot.light.push_back(panel({0.5, 3, 0.5}, 0.3, 0.3, 10));
  const Film whole = render_frame(bowl.shot, 1001, bowl.geometry);
  bowl.shot.obstacle[0].matte = Matte::holdout;
  bowl.shot.layers.cryptomatte = bowl.shot.layers.depth = true;
  const Film film = render_frame(bowl.shot, 1001, bowl.geometry);
  int holes = 0, same = 0;
  for (size_t p = 0; p < pixels_of(film); ++p) {
    const float* now = &film.rgba[4 * p];
    const bool hole = now[3] == 0;
    holes += hole;
    same += std::equal(now, now + 4, &whole.rgba[4 * p]);
    if (!hole) continue;
    EXPECT_EQ(std::max({now[0], now[1], now[2]}), 0);
    EXPECT_GT(layer_of(film, "depth").value[p], 1e9f);
    EXPECT_EQ(layer_of(film, "CryptoObject00").value[4 * p + 1], 0);
  }
  EXPECT_GT(holes, 3);
  EXPECT_GT(same, 400);
  EXPECT_LT(same + holes, int(pixels_of(film)));  // its rims
}

// Behind clear water it is a hole as far as the water lets it be.
TEST(Holdout, IsAHoleThroughClearWater) {
  Shot shot = slab_shot(1, V3f(0.8f), 1);
  shot.render.background = Background::sky;
  shot.material.push_back(diffuse("floor", 0.5f));
  FrameGeometry geometry = slab();
  add_obstacle(shot, geometry, "floor", box_mesh({-5, -1, -5}, {5, -0.5f, 5}), Matte::holdout);
  const Film film = render_frame(shot, 1001, geometry);
  EXPECT_NEAR(channel_mean(film, 3).value, 1 - std::exp(-0.4), 1e-5);
  EXPECT_EQ(channel_mean(film, 1).value, 0);
}

/// A catcher seen at the origin under a lamp.
Shot catcher_shot(const Light& lamp, int samples) {
  Shot shot = plain_shot(samples);
  add_ground(shot, 0.4f);
  shot.ground.matte = Matte::shadow_catcher;
  shot.light = {lamp};
  shot.material.push_back(diffuse("card", 0));
  aim_narrow(shot, {1, 0.5, 0}, {0, 0, 0});
  return shot;
}

/// A black card that hides all lamps at x < 0 from the origin.
FrameGeometry with_card(Shot& shot) {
  FrameGeometry geometry;
  add_obstacle(shot, geometry, "card", box_mesh({-9, 1, -9}, {0, 1.01f, 9}));
  return geometry;
}

// Half of a lamp above the origin is hidden: half of its light.
TEST(ShadowCatcher, HasHalfTheShadowOfHalfALamp) {
  Light disk;
  disk.type = LightType::disk;
  disk.name = "disk";
  disk.center = {0, 2, 0};
  disk.radius = 0.4;
  disk.radiance = V3f(5, 3, 2);
  for (const Light& lamp : {panel({0, 2, 0}, 0.4, 0.3, 5), disk}) {
    Shot shot = catcher_shot(lamp, 256);
    const Film film = render_frame(shot, 1001, with_card(shot));
    const Mean alpha = channel_mean(film, 3);
    EXPECT_LT(alpha.error, 0.003);
    EXPECT_NEAR(alpha.value, 0.5, bound(alpha));
    for (size_t c = 0; c < 3; ++c) EXPECT_LT(channel_mean(film, int(c)).value, 1e-6);
  }
}

TEST(ShadowCatcher, WithoutObjectsIsNothingToTheBit) {
  Shot shot = catcher_shot(panel({0, 2, 0}, 0.4, 0.3, 5), 16);
  shot.light.push_back(sky(0.5f));
  FrameGeometry geometry;
  shot.material.push_back(diffuse("rock", 0.6f));
  add_obstacle(shot, geometry, "rock", box_mesh({-0.5f, 0, -0.5f}, {-0.1f, 1, 0.5f}),
               Matte::holdout);  // in the plate as its shadow is
  shot.layers.cryptomatte = true;
  const Film film = render_frame(shot, 1001, geometry);
  for (const float value : film.rgba) EXPECT_EQ(value, 0);
  for (const float value : layer_of(film, "CryptoObject00").value) EXPECT_EQ(value, 0);
}

// What shines onto it is added: the lantern alone lights the ground, and its light is all there is.
TEST(ShadowCatcher, AddsTheLightOfObjects) {
  Shot shot = catcher_shot(sky(0), 64);
  shot.material.push_back(diffuse("glow", 0.f));
  shot.material.back().emission = V3f(3, 2, 1);
  FrameGeometry geometry;
  add_obstacle(shot, geometry, "glow", box_mesh({-0.5f, 1, -0.5f}, {0.5f, 1.2f, 0.5f}));
  const Film film = render_frame(shot, 1001, geometry);
  // A square of half size a above a corner of each quarter: F = 4 x (1/2pi)(2 x/sqrt(1+x^2)
  // atan(x/sqrt(1+x^2))) with x = a/h = 0.5.
  const double x = 0.5, root = std::sqrt(1 + x * x);
  const double form = 4 / (2 * pi64) * 2 * x / root * std::atan(x / root);
  for (int c = 0; c < 3; ++c) {
    const Mean beauty = channel_mean(film, c);
    EXPECT_NEAR(beauty.value, 0.4 * form * (3 - c), bound(beauty));
  }
  EXPECT_EQ(channel_mean(film, 3).value, 0);
}

/// A ball of water and a lantern over a catcher, by a lamp, a coloured sky and photons.
struct Scenery {
  Shot shot = plain_shot(64, 24);
  FrameGeometry geometry;

  Scenery() {
    add_ground(shot, 0.5f);
    shot.light = {panel({0.6, 2.5, 0.2}, 0.25, 0.25, 30), sky(1)};
    shot.light[1].radiance = V3f(0.2f, 0.3f, 0.5f);
    shot.light[1].horizon = shot.light[1].radiance;
    shot.light[1].below = shot.light[1].radiance;
    shot.material.push_back(dielectric("water", 1.333, V3f(2, 0.6f, 0.2f)));
    shot.material.push_back(diffuse("red", 0));
    shot.material.back().reflectance = V3f(0.7f, 0.1f, 0.05f);
    geometry.fluid = sphere_mesh(4);
    for (V3f& p : geometry.fluid.position) p = p * 0.35f + V3f(0, 0.8f, 0);
    add_obstacle(shot, geometry, "red", box_mesh({-0.9f, 0, -0.6f}, {-0.5f, 0.7f, -0.2f}));
    shot.camera.position = V3d(0, 3, 2.4);
    shot.camera.target = V3d(-0.2, 0, 0);
    shot.render.photons = 2;
    shot.layers.depth = shot.layers.opacity = true;
  }
};

// Over the picture of the empty catcher, the picture: where nothing else is seen to the rounding of
// the sums, shadows, coloured bounces and caustics alike.
TEST(ShadowCatcher, OverItselfIsThePicture) {
  Scenery scene;
  const Film whole = render_frame(scene.shot, 1001, scene.geometry);
  const Film plate = render_frame(scene.shot, 1001, {});
  scene.shot.ground.matte = Matte::shadow_catcher;
  const Film film = render_frame(scene.shot, 1001, scene.geometry);
  int open = 0, dark = 0, bright = 0;
  for (size_t p = 0; p < pixels_of(film); ++p) {
    for (size_t c = 0; c < 3; ++c) EXPECT_GE(film.rgba[4 * p + c], -1e-6);
    if (layer_of(film, "depth").value[p] < 1e9f) continue;
    ++open;
    dark += film.rgba[4 * p + 3] > 0.3f;
    bright += film.rgba[4 * p + 1] > 0.1f;
    for (size_t c = 0; c < 3; ++c) {
      const float behind = (1 - layer_of(film, "opacity").value[3 * p + c]) * plate.rgba[4 * p + c];
      EXPECT_NEAR(film.rgba[4 * p + c] + behind, whole.rgba[4 * p + c],
                  1e-5 * (1 + whole.rgba[4 * p + c]))
          << p;
      const float* opacity = &layer_of(film, "opacity").value[3 * p];
      EXPECT_NEAR(film.rgba[4 * p + 3], (opacity[0] + opacity[1] + opacity[2]) / 3, 1e-5);
    }
  }
  EXPECT_GT(open, 250);
  EXPECT_GT(dark, 20);
  EXPECT_GE(bright, 3);
}

TEST(ShadowCatcher, HasTheSameBitsOnAnyThreadsAndInACrop) {
  Scenery scene;
  scene.shot.ground.matte = Matte::shadow_catcher;
  scene.shot.render.samples = 8;
  scene.shot.layers.opacity = true;
  const auto on_threads = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return render_frame(scene.shot, 1001, scene.geometry);
  };
  const Film one = on_threads(1), many = on_threads(5);
  EXPECT_EQ(one.rgba, many.rgba);
  EXPECT_EQ(layer_of(one, "opacity").value, layer_of(many, "opacity").value);
  scene.shot.render.crop_min = {4, 8};
  scene.shot.render.crop_max = {23, 21};
  const Film part = render_frame(scene.shot, 1001, scene.geometry);
  for (int y = 0; y < part.height; ++y)
    for (int x = 0; x < part.width; ++x)
      for (int c = 0; c < 4; ++c)
        EXPECT_EQ(part.rgba[4 * size_t(y * part.width + x) + size_t(c)],
                  one.rgba[4 * size_t((y + 8) * one.width + x + 4) + size_t(c)]);
}

TEST(ShadowCatcher, LightGroupsSumToTheBeauty) {
  Scenery scene;
  scene.shot.ground.matte = Matte::shadow_catcher;
  scene.shot.layers.light_groups = true;
  const Film film = render_frame(scene.shot, 1001, scene.geometry);
  for (size_t p = 0; p < pixels_of(film); ++p)
    for (size_t c = 0; c < 3; ++c) {
      double sum = 0, size = 0;
      for (const FilmLayer& layer : film.layer)
        if (layer.name.starts_with("light_")) {
          sum += layer.value[3 * p + c];
          size += std::abs(layer.value[3 * p + c]);
          EXPECT_GE(layer.value[3 * p + c], -1e-6);
        }
      EXPECT_NEAR(sum, film.rgba[4 * p + c], 1e-5 * (size + 0.1)) << p;
    }
}

// Alpha of half a lamp again, by few samples: the denoiser takes most of its noise away, and keeps
// the mean.
TEST(ShadowCatcher, IsDenoisedInAlphaToo) {
  Shot shot = catcher_shot(panel({0, 2, 0}, 0.4, 0.3, 5), 16);
  shot.render.width = shot.render.height = 48;
  shot.render.photons = 0;
  const FrameGeometry geometry = with_card(shot);
  const Film noisy = render_frame(shot, 1001, geometry);
  shot.render.denoise = true;
  const Film clean = render_frame(shot, 1001, geometry);
  const double n = double(pixels_of(clean));
  const Mean before = channel_mean(noisy, 3), after = channel_mean(clean, 3);
  EXPECT_LT(after.error * std::sqrt(n), 0.5 * before.error * std::sqrt(n));
  EXPECT_NEAR(after.value, 0.5, 4 * before.error);
}

/// Summed squares of what alpha is off, 0.04, and its sum, of the columns from 0 to 20.
std::pair<double, double> slab_alpha(const Film& film) {
  double off = 0, sum = 0;
  for (size_t y = 0; y < 48; ++y)
    for (size_t x = 0; x < 20; ++x) {
      const double alpha = film.rgba[4 * (y * 48 + x) + 3];
      off += (alpha - 0.04) * (alpha - 0.04);
      sum += alpha;
    }
  return {off, sum};
}

// The same of water that reflects one sample in 25, before a clear background and before a catcher:
// over a white plate it was noise, and what is beside it stays empty.
TEST(SeeThroughWater, IsDenoisedInAlphaToo) {
  Shot shot = slab_shot(1.333, V3f(0), 64);
  shot.render.width = shot.render.height = 48;
  shot.camera.fov_deg = 40;
  FrameGeometry geometry;
  geometry.fluid = box_mesh({-2, 0, -2}, {0, 0.5f, 2});
  for (const bool catcher : {false, true}) {
    if (catcher) {
      add_ground(shot, 0.5f);  // far below, where the slab has no shadow
      shot.ground.height = -2000;
      shot.ground.half_size = 1e5;
      shot.ground.matte = Matte::shadow_catcher;
    }
    shot.render.denoise = false;
    const auto [off, sum] = slab_alpha(render_frame(shot, 1001, geometry));
    shot.render.denoise = true;
    const Film clean = render_frame(shot, 1001, geometry);
    const auto [off_clean, sum_clean] = slab_alpha(clean);
    EXPECT_LT(off_clean, 0.2 * off);  // measured 0.1
    EXPECT_NEAR(sum_clean, sum, 0.05 * sum);
    const std::vector<float>& opacity = layer_of(clean, "opacity").value;
    for (size_t p = 0; p < pixels_of(clean); ++p) {
      EXPECT_NEAR(opacity[3 * p], clean.rgba[4 * p + 3], 1e-5);
      if (p % 48 >= 28) {
        EXPECT_NEAR(clean.rgba[4 * p + 3], 0, catcher ? 1e-3 : 0);
      }
    }
  }
}

// Where objects change nothing there is no noise, so that no sample beyond the first 32 is spent.
TEST(ShadowCatcher, TakesSamplesWhereItsShadowsAreNoisy) {
  Shot shot = catcher_shot(panel({0, 2, 0}, 0.4, 0.3, 5), 256);
  shot.render.error = 1e-5;
  RenderStats stats;
  render_frame(shot, 1001, {}, &stats);
  EXPECT_EQ(stats.camera_samples, 32u * 16 * 16);
  EXPECT_EQ(stats.relative_mse, 0);
  const FrameGeometry geometry = with_card(shot);
  shot.render.error = 0;
  shot.render.samples = 32;
  render_frame(shot, 1001, geometry, &stats);
  EXPECT_GT(stats.relative_mse, 0);
  shot.render.error = stats.relative_mse / 4;
  shot.render.samples = 4096;
  render_frame(shot, 1001, geometry, &stats);
  EXPECT_GT(stats.camera_samples, 48u * 16 * 16);
  EXPECT_LT(stats.relative_mse, 1.5 * shot.render.error);
}

// Seen through clear water it is as dark as the water and its own shadow make it.
TEST(ShadowCatcher, IsSeenThroughClearWater) {
  Shot shot = catcher_shot(panel({0, 2, 0}, 0.4, 0.3, 5), 4);
  shot.material.push_back(dielectric("water", 1, V3f(0.8f)));
  shot.render.refraction_alpha = RefractionAlpha::transparent;
  FrameGeometry geometry;
  geometry.fluid = box_mesh({0.2f, -1, -1}, {0.4f, 1, 1});  // before it, not over it
  aim_narrow(shot, {1, 0.5, 0}, {-0.5, 0, 0});
  const Film film = render_frame(shot, 1001, geometry);
  const double length = 0.2 * std::sqrt(1.5 * 1.5 + 0.5 * 0.5) / 1.5;
  EXPECT_NEAR(channel_mean(film, 3).value, 1 - std::exp(-0.8 * length), 1e-3);
}

}  // namespace
}  // namespace drench::render::test

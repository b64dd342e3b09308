// Water that lies on cloth: where its mesh is tagged as contact, no air comes between.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/render/support.h"

namespace drench::render::test {
namespace {

constexpr double water_index = 1.333;

/// Reflectance of the surface from below, at an angle.
double reflectance_from_water(double angle) {
  const double sine = water_index * std::sin(angle);
  if (sine >= 1) return 1;
  const double in = std::cos(angle), out = std::sqrt(1 - sine * sine);
  const double s = (water_index * in - out) / (water_index * in + out),
               p = (water_index * out - in) / (water_index * out + in);
  return 0.5 * (s * s + p * p);
}

/// Of diffuse light from below.
double diffuse_reflectance_from_water() {
  constexpr int n = 20000;
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    const double angle = (k + 0.5) / n * std::numbers::pi / 2;
    sum += reflectance_from_water(angle) * std::sin(2 * angle) * std::numbers::pi / 2 / n;
  }
  return sum;
}

/// A slab of water 0.05 m high and 40 m wide, 1 mm above a sheet, in light of radiance 1 from
/// everywhere, seen straight from above.
struct WetCloth {
  Shot shot = plain_shot(4096, 8);
  FrameGeometry geometry;

  WetCloth(float reflectance, float transmittance) {
    Material cloth = diffuse("cotton", reflectance);
    cloth.type = MaterialType::cloth;
    cloth.transmittance = V3f(transmittance);
    shot.material = {dielectric("water", water_index), cloth};
    shot.fluid.material = "water";
    shot.light = {sky(1)};
    shot.render.depth = 60;
    aim_narrow(shot, {0, 5, 0}, {0, 0, 0});
    geometry.fluid = box_mesh({-20, -0.05f, -20}, {20, 0, 20});
    geometry.fluid.contact = {0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0};  // the lower face
    TriangleMesh sheet = flat_mesh(sheet_mesh(2, [](float, float) { return 0.f; }));
    for (V3f& p : sheet.position) p = V3f(20 * p.x, -0.051f, 20 * p.z);
    geometry.cloth = {{"cloth", sheet}};
  }
};

// Saunderson 1942 for uniform light: from the cloth comes B = rho (1 - r) / (1 - rho r), r the
// diffuse reflectance of the surface from below; seen from above F + (1 - F) B. With air between,
// which a slab of glass would have, it would be 0.49 in place of 0.36.
TEST(WaterOnCloth, IsAsBrightAsSaundersonsFormula) {
  constexpr double rho = 0.5;
  const WetCloth wet(rho, 0);
  const double r = diffuse_reflectance_from_water(), f = reflectance_from_water(0),
               b = rho * (1 - r) / (1 - rho * r);
  const Mean mean = channel_mean(render_frame(wet.shot, 1001, wet.geometry), 0);
  EXPECT_LT(mean.error, 0.003);
  EXPECT_NEAR(mean.value, f + (1 - f) * b, bound(mean));
}

// What the cloth lets through goes between water and air on either side: nothing is lost or made.
TEST(WaterOnCloth, HidesInAFurnaceWithItsCloth) {
  for (const double above : {5., -5.}) {
    WetCloth wet(0.6f, 0.4f);
    aim_narrow(wet.shot, {0, above, 0}, {0, 0, 0});
    wet.shot.render.depth = 400;
    const Mean mean = channel_mean(render_frame(wet.shot, 1001, wet.geometry), 0);
    EXPECT_NEAR(mean.value, 1, bound(mean) + 1e-3);
  }
}

// Fluid that falls on a sheet has its top below its contact before the shutter closes: no column of
// water reaches from there to the camera.
TEST(WaterOnCloth, TurnedInsideOutHasNoDepth) {
  WetCloth wet(0.5f, 0);
  wet.shot.render.samples = 256;
  for (V3f& p : wet.geometry.fluid.position) p.y = p.y > -0.01f ? -0.0508f : -0.05f;
  wet.shot.material[0].absorption = V3f(2, 1, 0);
  const Film film = render_frame(wet.shot, 1001, wet.geometry);
  const double blue = channel_mean(film, 2).value;
  EXPECT_GT(blue, 0.2);
  EXPECT_NEAR(channel_mean(film, 0).value, blue, 0.02 * blue);
}

}  // namespace
}  // namespace drench::render::test

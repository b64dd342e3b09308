// White furnaces: in uniform light of radiance 1, whatever absorbs nothing cannot be seen.

#include <gtest/gtest.h>

#include "tests/render/support.h"

namespace drench::render::test {
namespace {

Shot furnace(int samples) {
  Shot shot = plain_shot(samples, 24);
  shot.camera.position = V3d(0, 0.6, 4);
  shot.camera.target = V3d(0, 0, 0);
  shot.light = {sky(1)};
  return shot;
}

void expect_one(const Film& film) {
  for (int c = 0; c < 3; ++c) {
    const Mean mean = channel_mean(film, c);
    EXPECT_NEAR(mean.value, 1, bound(mean)) << "channel " << c;
  }
}

TEST(Furnace, HidesWhiteDiffuseSphere) {
  Shot shot = furnace(64);
  shot.material = {diffuse("white", 1)};
  shot.fluid.material = "white";
  // Flat normals: smooth ones lose what they point through the real surface, by design.
  expect_one(render_frame(shot, 1001, {flat_mesh(sphere_mesh(4)), {}}));
}

TEST(Furnace, HidesWhiteSphereWithSkySampledAsLight) {
  Shot shot = furnace(64);
  shot.material = {diffuse("white", 1)};
  shot.fluid.material = "white";
  RenderOptions options;
  options.environment = EnvironmentSampling::always;
  expect_one(render_frame(shot, 1001, {flat_mesh(sphere_mesh(4)), {}}, options));
}

TEST(Furnace, HidesClothThatReflectsAndTransmitsEverything) {
  Shot shot = furnace(64);
  Material cloth = diffuse("cotton", 0.7f);
  cloth.type = MaterialType::cloth;
  cloth.transmittance = V3f(0.3f);
  shot.material = {cloth};
  const TriangleMesh sheet = flat_mesh(sheet_mesh(8, [](float, float) { return 0.f; }));
  expect_one(render_frame(shot, 1001, {{}, {{"cloth", sheet}}}));
}

TEST(Furnace, DarkensClothByWhatItAbsorbs) {
  // A flat sheet sees only sky, from both sides: R + T of it comes back.
  Shot shot = furnace(64);
  Material cloth = diffuse("cotton", 0.5f);
  cloth.type = MaterialType::cloth;
  cloth.transmittance = V3f(0.2f, 0.1f, 0.f);
  shot.material = {cloth};
  aim_narrow(shot, {0, 4, 1}, {0, 0, 0}, 1);
  const TriangleMesh sheet = flat_mesh(sheet_mesh(8, [](float, float) { return 0.f; }));
  const Film film = render_frame(shot, 1001, {{}, {{"cloth", sheet}}});
  for (int c = 0; c < 3; ++c) {
    const Mean mean = channel_mean(film, c);
    EXPECT_NEAR(mean.value, 0.5 + cloth.transmittance[c], bound(mean));
  }
}

TEST(Furnace, HidesClearDielectricSphere) {
  Shot shot = furnace(64);
  shot.material = {dielectric("water", 1.333)};
  expect_one(render_frame(shot, 1001, {sphere_mesh(5), {}}));
}

TEST(Furnace, HidesClearDielectricSphereWithBothBranchesFollowed) {
  Shot shot = furnace(64);
  shot.material = {dielectric("water", 2.4)};
  RenderOptions options;
  options.first_interface = FirstInterface::both;
  expect_one(render_frame(shot, 1001, {sphere_mesh(5), {}}, options));
}

}  // namespace
}  // namespace drench::render::test

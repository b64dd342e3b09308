// Pictures of metal, coats, rough glass and mapped normals, against closed forms and among
// estimators.

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "render/integrator/path.h"
#include "render/scene/scene.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

Material rough_glass(const std::string& name, double roughness, double ior = 1.5) {
  Material m = dielectric(name, ior);
  m.roughness = roughness;
  return m;
}

Material metal(const std::string& name, float reflectance, double roughness) {
  Material m = diffuse(name, reflectance);
  m.type = MaterialType::metal;
  m.roughness = roughness;
  return m;
}

Material coated(const std::string& name, float reflectance, double roughness) {
  Material m = metal(name, reflectance, roughness);
  m.type = MaterialType::coated;
  m.ior = 1.5;
  return m;
}

ObstacleFrame obstacle(Shot& shot, const std::string& name, const TriangleMesh& mesh) {
  shot.obstacle.emplace_back();
  shot.obstacle.back().name = shot.obstacle.back().material = name;
  return {name, mesh};
}

TriangleMesh ball(const V3f& center, float radius, int levels = 4) {
  TriangleMesh mesh = sphere_mesh(levels);
  for (V3f& p : mesh.position) p = p * radius + center;
  return mesh;
}

Shot furnace(const Material& material) {
  Shot shot = plain_shot(64, 24);
  shot.camera.position = V3d(0, 0.6, 4);
  shot.camera.target = V3d(0, 0, 0);
  shot.light = {sky(1)};
  shot.render.depth = 64;
  shot.material = {material};
  shot.fluid.material = material.name;
  return shot;
}

// In uniform light a ball of what absorbs nothing cannot be seen, after any number of reflections
// within. Half a percent is what tables may err by.
TEST(GlossyFurnace, HidesABall) {
  std::vector<Material> materials{metal("white", 1, 0), metal("white", 1, 0.5),
                                  coated("white", 1, 0.4)};
  for (const double roughness : {0.1, 0.3, 0.6, 1.})
    for (const double ior : {1.1, 1.5, 2.4})
      materials.push_back(rough_glass("white", roughness, ior));
  for (const Material& material : materials)
    for (const EnvironmentSampling sampling :
         {EnvironmentSampling::automatic, EnvironmentSampling::always}) {
      RenderOptions options;
      options.environment = sampling;
      const Film film =
          render_frame(furnace(material), 1001, {flat_mesh(sphere_mesh(4)), {}}, options);
      const Mean mean = channel_mean(film, 1);
      EXPECT_NEAR(mean.value, 1, bound(mean) + 0.005)
          << int(material.type) << ' ' << material.roughness << ' ' << material.ior;
    }
}

// Smooth normals on triangles lose what they would send through the real surface, and no more.
TEST(GlossyFurnace, KeepsNearlyAllWithSmoothNormals) {
  for (const Material& material : {metal("white", 1, 0.5), coated("white", 1, 0.3),
                                   rough_glass("white", 0.5), metal("white", 1, 0)}) {
    const Film film = render_frame(furnace(material), 1001, {sphere_mesh(4), {}});
    const Mean mean = channel_mean(film, 1);
    EXPECT_LT(mean.value, 1 + bound(mean) + 0.001) << int(material.type);
    EXPECT_GT(mean.value, 0.985) << int(material.type);
  }
}

// A ball of rough glass that sinks into smooth water: its surface has two indices outside.
TEST(GlossyFurnace, HidesRoughGlassInWater) {
  for (const V3d& from : {V3d(0, 3, 3), V3d(0.1, 1.2, 0), V3d(0.1, 0.6, 0), V3d(1, 0.4, 1)}) {
    Shot shot = furnace(dielectric("water", 1.333));
    shot.material.push_back(rough_glass("glass", 0.5));
    FrameGeometry geometry{box_mesh({-3, -0.1f, -3}, {3, 0.8f, 3}), {}};
    geometry.obstacle = {obstacle(shot, "glass", flat_mesh(ball({0, 0.9f, 0}, 0.35f)))};
    shot.camera.position = from;
    shot.camera.target = V3d(0, 0.85, 0.02);
    const Mean mean = channel_mean(render_frame(shot, 1001, geometry), 1);
    EXPECT_NEAR(mean.value, 1, bound(mean) + 0.005) << from;
  }
}

// 2 R1 / (1 + R1) of a slab, as of smooth water (FresnelSlab), when facets are nearly one.
TEST(RoughSlab, ReflectsAsTheSmoothOneWhenNearlySmooth) {
  const double one_face = std::pow(0.333 / 2.333, 2);
  for (const double roughness : {0.01, 0.03, 0.1}) {
    Shot shot = plain_shot(512);
    shot.material = {rough_glass("water", roughness, 1.333)};
    aim_narrow(shot, {0, 5, 0}, {0, 0, 0});
    shot.light = {panel({0, 10., 0}, 9, 9, 1)};
    const FrameGeometry slab{box_mesh({-10, -0.5f, -10}, {10, 0, 10}), {}};
    const Mean mean = channel_mean(render_frame(shot, 1001, slab), 0);
    EXPECT_LT(mean.error, 0.002);
    EXPECT_NEAR(mean.value, 2 * one_face / (1 + one_face), bound(mean) + 1e-4) << roughness;
  }
}

/// A lamp and a floor with something on it.
struct Stage {
  Shot shot = plain_shot(64, 12);
  FrameGeometry geometry;

  Stage() {
    add_ground(shot, 0.5f, 6);
    shot.camera.position = V3d(0.5, 1.4, 2);
    shot.camera.target = V3d(0, 0.3, 0);
    shot.camera.fov_deg = 30.0;
    shot.light = {panel({0.5, 2, 0.4}, 0.4, 0.4, 6), sky(0.2f)};
  }
  void stand(const Material& material, const TriangleMesh& mesh) {
    shot.material.push_back(material);
    geometry.obstacle.push_back(obstacle(shot, material.name, mesh));
  }
};

void expect_all_estimators_alike(const Stage& stage, double most_error = 0.02) {
  RenderOptions both, light, surface;
  light.estimator = Estimator::light_only;
  surface.estimator = Estimator::bsdf_only;
  const Mean a = mean_over_seeds(stage.shot, stage.geometry, both, 16);
  const Mean b = mean_over_seeds(stage.shot, stage.geometry, light, 16);
  const Mean c = mean_over_seeds(stage.shot, stage.geometry, surface, 16);
  EXPECT_LT(b.error, most_error * a.value);
  EXPECT_LT(c.error, most_error * a.value);
  EXPECT_NEAR(a.value, b.value, 4 * std::hypot(a.error, b.error));
  EXPECT_NEAR(a.value, c.value, 4 * std::hypot(a.error, c.error));
}

TEST(GlossyLight, IsTheSameByAllEstimators) {
  for (const Material& material :
       {rough_glass("thing", 0.5), rough_glass("thing", 0.8, 2), metal("thing", 0.8f, 0.5),
        coated("thing", 0.4f, 0.5), metal("thing", 0.8f, 0), coated("thing", 0.4f, 0)}) {
    Stage stage;
    stage.stand(material, ball({0, 0.4f, 0}, 0.4f));
    expect_all_estimators_alike(stage);
  }
}

TEST(GlossyLight, IsTheSameByAllEstimatorsOnACoatedFloorUnderASheet) {
  Stage stage;
  stage.shot.material[0] = coated("ground", 0.5f, 0.4);
  stage.shot.material.push_back(metal("cotton", 0.7f, 0.6));
  TriangleMesh sheet = sheet_mesh(
      12, [](float x, float z) { return 0.5f + 0.1f * std::sin(5 * x) * std::cos(4 * z); });
  for (V3f& p : sheet.position) p = V3f(0.6f * p.x, p.y, 0.6f * p.z);
  stage.geometry.cloth = {{"cloth", sheet}};
  expect_all_estimators_alike(stage);
}

// A lamp within the ball: lights are sampled through the surface from outside, and inside it.
TEST(GlossyLight, IsTheSameByAllEstimatorsWithALampInside) {
  Stage stage;
  Light lamp;
  lamp.type = LightType::sphere;
  lamp.center = {0, 0.5, 0};
  lamp.radius = 0.2;
  lamp.radiance = V3f(5);
  stage.shot.light.push_back(lamp);
  stage.stand(rough_glass("thing", 0.6), ball({0, 0.5f, 0}, 0.45f));
  expect_all_estimators_alike(stage);
}

/// What a flat mirror of rough facets, seen from straight above, shows of a square lamp of half
/// size 1 at 1 m that it faces: radiance times the integral of the lobe, by quadrature.
TEST(GlossyLight, OfASquareIsTheIntegralOverIt) {
  const double alpha = 0.4;
  double expected = 0, white = 0;
  constexpr int steps = 800;
  const auto lobe = [&](double tan2) {  // D G / (4 cos cos) cos of a half vector for cos(o) = 1
    const double cos = 1 / std::sqrt(1 + tan2), half2 = (1 - cos) / (1 + cos);  // tan^2(t/2)
    const double h2 = 1 / (1 + half2),
                 d = alpha * alpha / (pi64 * h2 * h2) / std::pow(alpha * alpha + half2, 2);
    const double lambda = (std::sqrt(1 + alpha * alpha * tan2) - 1) / 2;
    return d / (1 + lambda) / 4;
  };
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const double x = -1 + 2 * (i + 0.5) / steps, z = -1 + 2 * (j + 0.5) / steps;
      const double r2 = 1 + x * x + z * z;  // the lamp is 1 m above
      expected += lobe(x * x + z * z) / (r2 * std::sqrt(r2)) * 4 / steps / steps;
    }
  for (int k = 0; k < 100000; ++k) {
    const double cos = (k + 0.5) / 100000;
    white += lobe(1 / (cos * cos) - 1) * 2 * pi64 / 100000;
  }
  Shot shot = plain_shot(256);
  shot.material = {metal("ground", 1, std::sqrt(alpha))};
  shot.ground.present = true;
  aim_narrow(shot, {0, 0.5, 0}, {0, 0, 0});
  shot.light = {panel({0, 1, 0}, 1, 1, 1)};
  const Mean mean = channel_mean(render_frame(shot, 1001, {}), 1);
  EXPECT_LT(mean.error, 0.002);
  EXPECT_NEAR(mean.value, expected / white, bound(mean) + 0.001);
}

/// A floor under a smooth pane that all light of the lamp passes: photons bring what then lies on
/// something diffuse, paths what came by way of rough glass or metal, or goes on by a coat.
struct UnderAPane : Stage {
  UnderAPane(const V3d& camera, const V3d& target) {
    shot.render.width = shot.render.height = 8;
    shot.render.samples = 512;
    shot.light = {panel({1.2, 3, 0}, 0.5, 0.5, 15), sky(0.2f)};
    shot.camera.position = camera;
    shot.camera.target = target;
    shot.camera.fov_deg = 12.0;
    stand(dielectric("smooth", 1.5), box_mesh({-3, 1.4f, -3}, {3, 1.5f, 3}));
  }
  void expect_photons_to_give_what_paths_give() const { expect_photons_as_paths(shot, geometry); }
};

TEST(GlossyPhotons, LeaveToPathsWhatRoughGlassSendsOn) {
  UnderAPane scene({1.5, 1.2, 0}, {-0.2, 0, 0});
  scene.stand(rough_glass("rough", 0.4), ball({0.1f, 0.6f, 0}, 0.35f));
  scene.expect_photons_to_give_what_paths_give();
}

TEST(GlossyPhotons, LeaveToPathsWhatMetalReflects) {
  UnderAPane scene({1, 1.2, 0}, {-0.3, 0, 0});
  scene.stand(metal("metal", 0.9f, 0.4), box_mesh({-0.7f, 0, -1}, {-0.6f, 1, 1}));
  scene.expect_photons_to_give_what_paths_give();
}

// Where the coat mirrors the lamp.
TEST(GlossyPhotons, LeaveToPathsWhatCoatsReflect) {
  UnderAPane scene({-0.48, 1.2, 0}, {0, 0, 0});
  scene.shot.material[0] = coated("ground", 0.4f, 0.4);
  scene.expect_photons_to_give_what_paths_give();
}

// What rough glass alone lets through: no photon starts, and the picture keeps its light.
TEST(GlossyPhotons, LeaveRoughBodiesToPaths) {
  Stage stage;
  stage.shot.camera.position = V3d(2.5, 2.5, 0);
  stage.shot.camera.target = V3d(-0.3, 0, 0);
  stage.shot.camera.fov_deg = 15.0;
  stage.shot.render.samples = 256;
  stage.shot.light = {panel({0.4, 3, 0.3}, 0.5, 0.5, 15)};
  stage.stand(rough_glass("rough", 0.3), ball({0, 0.7f, 0}, 0.4f));
  const Film paths = render_frame(stage.shot, 1001, stage.geometry);
  stage.shot.render.photons = 6;
  EXPECT_EQ(render_frame(stage.shot, 1001, stage.geometry).rgba, paths.rgba);
  EXPECT_GT(channel_mean(paths, 1).value, 0.1);
}

Stage everything() {
  Stage stage;
  stage.shot.render.width = stage.shot.render.height = 40;
  stage.shot.render.samples = 8;
  stage.shot.material[0] = coated("ground", 0.5f, 0.3);
  stage.stand(dielectric("smooth", 1.5), ball({-0.5f, 0.3f, 0.3f}, 0.3f));
  stage.stand(rough_glass("rough", 0.4), ball({0.2f, 0.3f, 0.4f}, 0.3f));
  stage.stand(metal("metal", 0.8f, 0.3), ball({0.1f, 0.5f, -0.5f}, 0.4f));
  return stage;
}

TEST(GlossyBits, AreTheSameForAnyNumberOfThreads) {
  Stage stage = everything();
  stage.shot.render.photons = 1;
  const auto on_threads = [&](int threads) {
    const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 16);
    tbb::task_arena arena(threads);
    Film film;
    arena.execute([&] { film = render_frame(stage.shot, 1001, stage.geometry); });
    return film;
  };
  const Film one = on_threads(1);
  for (const int threads : {2, 16}) EXPECT_EQ(on_threads(threads).rgba, one.rgba) << threads;
}

// Of a frame that has none of it no variant with facets is chosen; a smooth roughness changes
// nothing, nor does the variant itself (`RenderedBits` switches all on).
TEST(GlossyBits, AreOthersOnlyWhereSomethingIsGlossy) {
  Stage stage;
  stage.stand(dielectric("thing", 1.5), ball({0, 0.4f, 0}, 0.4f));
  const auto features = [&] { return Scene(stage.shot, 1001, stage.geometry, {}).features(); };
  EXPECT_FALSE(features() & Feature::glossy);
  const Film smooth = render_frame(stage.shot, 1001, stage.geometry);
  stage.shot.material.back().roughness = 0.009;
  EXPECT_FALSE(features() & Feature::glossy);
  EXPECT_EQ(render_frame(stage.shot, 1001, stage.geometry).rgba, smooth.rgba);
  stage.shot.material.back().roughness = 0.1;
  EXPECT_TRUE(features() & Feature::glossy);
  EXPECT_NE(render_frame(stage.shot, 1001, stage.geometry).rgba, smooth.rgba);
  for (const MaterialType type : {MaterialType::metal, MaterialType::coated}) {
    stage.shot.material.back().type = type;
    EXPECT_TRUE(features() & Feature::glossy);
  }
}

/// A 2 x 2 picture of one normal, as bytes or as floats.
std::filesystem::path map_of(const TemporaryFolder& folder, const V3f& n, bool exr) {
  if (exr) {
    const std::filesystem::path path = folder / "normal.exr";
    Film film{2, 2, {}};
    for (int p = 0; p < 4; ++p)
      for (int c = 0; c < 4; ++c) film.rgba.push_back(c < 3 ? 0.5f + 0.5f * n[c] : 1.f);
    write_exr(path, film, {});
    return path;
  }
  const std::filesystem::path path = folder / "normal.png";
  std::vector<uint8_t> rgb;
  for (int p = 0; p < 4; ++p)
    for (int c = 0; c < 3; ++c) rgb.push_back(uint8_t(std::lround(128 + 127 * n[c])));
  write_png(path, 2, 2, rgb);
  return path;
}

// A mirror whose map leans a normal by a shows what lies at 2 a, along u for the map's x and along
// v for its y: on the ground along x and z, on a sheet as its coordinates run. The lamps there are
// of one colour each, so that the mirror's side is seen; 2 degrees across, 1 % of the lean is 0.3.
TEST(NormalMap, LeansMirrorsAlongItsCoordinates) {
  const TemporaryFolder folder;
  const double lean = 0.25;
  const auto lamp = [&](double x, double z, const V3f& color) {
    Light light;
    light.type = LightType::sphere;
    light.radius = 0.2;
    light.center = {4 * std::tan(2 * lean) * x, 4, 4 * std::tan(2 * lean) * z};
    light.radiance = color;
    return light;
  };
  const V3f colors[4] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}};
  Shot shot = plain_shot(4, 4);
  shot.light = {lamp(1, 0, colors[0]), lamp(-1, 0, colors[1]), lamp(0, 1, colors[2]),
                lamp(0, -1, colors[3])};
  aim_narrow(shot, {0.1, 3, 0.1}, {0.1, 0, 0.1});
  const TriangleMesh sheet = sheet_mesh(2, [](float, float) { return 0.f; });
  TriangleMesh turned = sheet;  // u along -z, v along x: mirrored
  for (size_t k = 0; k < turned.uv.size(); ++k) turned.uv[k] = {-sheet.uv[k].y, sheet.uv[k].x};
  const double s = std::sin(lean), c = std::cos(lean);
  const V3f leans[4] = {{float(s), 0, float(c)},
                        {float(-s), 0, float(c)},
                        {0, float(s), float(c)},
                        {0, float(-s), float(c)}};
  for (const bool exr : {true, false})
    for (int k = 0; k < 4; ++k) {
      Material mirror = metal("cotton", 1, 0);
      mirror.normal_map = map_of(folder, leans[k], exr);
      shot.material = {mirror, mirror};
      shot.material[1].name = "ground";
      const auto seen = [&](const FrameGeometry& geometry) {
        const Film film = render_frame(shot, 1001, geometry);
        return V3f(film.rgba[0], film.rgba[1], film.rgba[2]);
      };
      EXPECT_EQ(seen({{}, {{"cloth", sheet}}}), colors[k]) << k << exr;
      // Its u is -z and its v is x.
      const int there[4] = {3, 2, 0, 1};
      EXPECT_EQ(seen({{}, {{"cloth", turned}}}), colors[there[k]]) << k << exr;
      shot.ground.present = true;
      EXPECT_EQ(seen({}), colors[k]) << k << exr;
      shot.ground.present = false;
    }
}

TEST(NormalMap, ThatIsFlatChangesNothing) {
  const TemporaryFolder folder;
  for (const Material& material :
       {metal("cotton", 0.8f, 0.4), coated("cotton", 0.5f, 0.3), diffuse("cotton", 0.5f)}) {
    Stage stage;
    stage.shot.material.push_back(material);
    const TriangleMesh sheet =
        sheet_mesh(8, [](float x, float z) { return 0.3f + 0.1f * std::sin(3 * x + z); });
    stage.geometry.cloth = {{"cloth", sheet}};
    const Film plain = render_frame(stage.shot, 1001, stage.geometry);
    stage.shot.material.back().normal_map = map_of(folder, {0, 0, 1}, false);
    const Film mapped = render_frame(stage.shot, 1001, stage.geometry);
    // The normal is scaled to unit length once more: a few pixels may see a path turn out
    // otherwise.
    int differ = 0;
    for (size_t k = 0; k < plain.rgba.size(); ++k)
      differ += std::abs(plain.rgba[k] - mapped.rgba[k]) > 1e-3f * (plain.rgba[k] + 0.01f);
    EXPECT_LT(differ, 12);
  }
}

// A closed box of mirror or clear glass whose map leans every normal by 63 degrees, in a furnace:
// all reflections are turned out of the surface, so that none is lost, and nothing goes astray.
TEST(NormalMap, SendsNothingThroughTheSurface) {
  const TemporaryFolder folder;
  for (const Material& material : {metal("white", 1, 0), rough_glass("white", 0)}) {
    Shot shot = furnace(material);
    shot.material[0].normal_map = map_of(folder, {0.8f, -0.4f, 0.45f}, true);
    TriangleMesh box = box_mesh({-1, -1, -1}, {1, 1, 1});
    for (int face = 0; face < 6; ++face)
      for (const V2f& uv : {V2f(0, 0), V2f(1, 0), V2f(0, 1), V2f(1, 1)}) box.uv.push_back(uv);
    RenderOptions options;
    options.first_interface = FirstInterface::one;  // no roulette: each sample is 1
    const Film film = render_frame(shot, 1001, {box, {}}, options);
    for (size_t p = 0; p < film.rgba.size(); p += 4) EXPECT_NEAR(film.rgba[p], 1, 1e-4);
  }
}

}  // namespace
}  // namespace drench::render::test

// Pictures of fabric against closed forms and among estimators.

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "pipeline/contract/files/mesh_file.h"
#include "render/bsdf/bsdf_fabric.h"
#include "render/integrator/path.h"
#include "render/scene/scene.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

Material fabric(float reflectance, float transmittance) {
  Material m = diffuse("cotton", reflectance);
  m.type = MaterialType::cloth;
  m.transmittance = V3f(transmittance);
  return m;
}

TriangleMesh flat_sheet(int cells = 4) {
  return sheet_mesh(cells, [](float, float) { return 0.f; });
}

/// Wetness that rises along x from 0 at -1 to 1 at 1.
void soak_along_x(TriangleMesh& mesh) {
  mesh.wetness.clear();
  for (const V3f& p : mesh.position) mesh.wetness.push_back(std::clamp((p.x + 1) / 2, 0.f, 1.f));
}

struct Draped {
  Shot shot = plain_shot(64, 12);
  FrameGeometry geometry;

  explicit Draped(const Material& material) {
    add_ground(shot, 0.5f, 6);
    shot.material.push_back(material);
    shot.camera.position = V3d(0.5, 1.8, 2);
    shot.camera.target = V3d(0, 0.5, 0);
    shot.camera.fov_deg = 30.0;
    shot.light = {panel({0.5, 2.5, 0.4}, 0.5, 0.5, 6), sky(0.2f)};
    TriangleMesh sheet = sheet_mesh(
        12, [](float x, float z) { return 0.6f + 0.1f * std::sin(5 * x) * std::cos(4 * z); });
    soak_along_x(sheet);
    geometry.cloth = {{"cloth", sheet}};
  }
};

// Under a sky of 1 a sheet shows its albedo: from dry to wet in proportion, whatever the triangles.
TEST(WetSheet, IsAsBrightAsItsShareOfWater) {
  Shot shot = plain_shot(256, 8);
  shot.light = {sky(1)};
  shot.material = {fabric(0.55f, 0.2f)};
  shot.material[0].film_roughness = 0.3;
  TriangleMesh sheet = flat_sheet(3);
  soak_along_x(sheet);
  const AlbedoTable film = AlbedoTable::dielectric(0.09f, 1.333f);
  FabricPoint soaked;
  soaked.dry = {V3f(0.55f), V3f(0.2f)};
  soaked.wet = wet_colours(soaked.dry, WetFibres(1.333));
  soaked.wetness = 1, soaked.film_alpha = 0.09f, soaked.film_eta = 1.333f, soaked.film = &film;
  const V3f up(0, 1, 0);
  const double wet = FabricBsdf(up, up, up, soaked).albedo().x;
  for (const double x : {-0.99, -0.4, 0.1, 0.7, 0.99}) {
    aim_narrow(shot, {x, 3, 0.2}, {x, 0, 0.2});
    const Mean mean = channel_mean(render_frame(shot, 1001, {{}, {{"cloth", sheet}}}), 0);
    const double w = (x + 1) / 2;
    EXPECT_NEAR(mean.value, (1 - w) * 0.75 + w * wet, bound(mean) + 0.002) << x;
  }
}

TEST(WetSheet, HasTheBitsOfADryOneWhereItIsDry) {
  Draped with(fabric(0.5f, 0.2f));
  Draped without = with;
  TriangleMesh &sheet = with.geometry.cloth[0].mesh, &plain = without.geometry.cloth[0].mesh;
  plain.wetness.clear();
  sheet.wetness.assign(sheet.position.size(), 0.f);
  const auto features = [](const Draped& d) {
    return Scene(d.shot, 1001, d.geometry, {}).features();
  };
  EXPECT_FALSE(features(without) & Feature::glossy);
  EXPECT_FALSE(features(with) & Feature::glossy);
  const Film dry = render_frame(without.shot, 1001, without.geometry);
  EXPECT_EQ(render_frame(with.shot, 1001, with.geometry).rgba, dry.rgba);
  soak_along_x(sheet);
  EXPECT_TRUE(features(with) & Feature::glossy);
  EXPECT_NE(render_frame(with.shot, 1001, with.geometry).rgba, dry.rgba);
}

TEST(WetSheet, ComesFromItsFile) {
  const TemporaryFolder folder;
  Draped scene(fabric(0.5f, 0.2f));
  const Film film = render_frame(scene.shot, 1001, scene.geometry);
  write_mesh(folder / "cloth.ply", scene.geometry.cloth[0].mesh);
  scene.geometry.cloth[0].mesh = read_mesh(folder / "cloth.ply");
  EXPECT_EQ(render_frame(scene.shot, 1001, scene.geometry).rgba, film.rgba);
}

TEST(WetSheet, ThatCannotBeIsRefused) {
  Draped scene(fabric(0.5f, 0.2f));
  const auto error = [&]() -> std::string {
    try {
      render_frame(scene.shot, 1001, scene.geometry);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(error(), "");
  std::vector<float>& wetness = scene.geometry.cloth[0].mesh.wetness;
  wetness[7] = 1.5f;
  for (const char* word : {"cloth 'cloth'", "vertex 7", "1.5", "0 to 1"})
    EXPECT_NE(error().find(word), std::string::npos) << error();
  wetness.pop_back();
  EXPECT_NE(error().find("values of wetness"), std::string::npos) << error();
}

/// With fuzz, yarns and, from one side to the other, water.
Material everything(float reflectance, float transmittance) {
  Material m = fabric(reflectance, transmittance);
  m.sheen = V3f(0.4f, 0.3f, 0.2f);
  m.yarn_specular = V3f(0.2f, 0.3f, 0.4f);
  return m;
}

TEST(FabricLight, IsTheSameByAllEstimators) {
  for (const Material& material : {fabric(0.5f, 0.3f), everything(0.5f, 0.3f)}) {
    const Draped scene(material);
    expect_estimators_agree(scene.shot, scene.geometry);
  }
}

// Yarns have no direction without uv.
TEST(FabricYarns, NeedTextureCoordinates) {
  Draped scene(everything(0.5f, 0.3f));
  scene.geometry.cloth[0].mesh.uv.clear();
  try {
    render_frame(scene.shot, 1001, scene.geometry);
    FAIL() << "no error";
  } catch (const Error& e) {
    for (const char* word : {"cloth 'cloth'", "'cotton'", "yarn_specular", "u and v"})
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
  }
}

// Satin shows a lamp as a cross, a line across each family of yarns, which turns with the weave.
TEST(FabricYarns, RunAlongTheClothsCoordinates) {
  Material satin = fabric(0, 0);
  satin.yarn_specular = V3f(1);
  satin.yarn_roughness = 0.2;
  Shot shot = plain_shot(64, 8);
  shot.material = {satin};
  TriangleMesh sheet = flat_sheet();
  const auto seen = [&](const V3d& lamp) {
    shot.light = {panel(lamp, 0.1, 0.1, 1)};
    aim_narrow(shot, {0, 5, 0}, {0, 0, 0});
    return channel_mean(render_frame(shot, 1001, {{}, {{"cloth", sheet}}}), 0).value;
  };
  const V3d along_x(1.5, 2, 0), along_z(0, 2, 1.5), between(1.06, 2, 1.06);
  EXPECT_GT(seen(along_x), 20 * seen(between));
  EXPECT_GT(seen(along_z), 20 * seen(between));
  for (V2f& uv : sheet.uv) uv = {uv.x + uv.y, uv.x - uv.y};
  EXPECT_GT(seen(between), 20 * seen(along_x));
}

// Nothing is seen of white sheets in uniform light, however wet, in air and in water.
TEST(FabricFurnace, HidesASheet) {
  for (const bool in_water : {false, true}) {
    Draped scene(everything(0.6f, 0.4f));
    scene.shot.ground.present = false;
    scene.shot.light = {sky(1)};
    scene.shot.render.depth = 200;
    if (in_water) {
      scene.shot.material.push_back(dielectric("water", 1.333));
      scene.geometry.fluid = box_mesh({-3, 0, -3}, {3, 1.2f, 3});
    }
    // Flat triangles: smooth normals lose what they would send through the real surface.
    TriangleMesh& sheet = scene.geometry.cloth[0].mesh;
    sheet = flat_mesh(sheet);
    for (const V3f& p : sheet.position) sheet.uv.push_back({p.x, p.z});
    soak_along_x(sheet);
    const Mean mean = channel_mean(render_frame(scene.shot, 1001, scene.geometry), 1);
    EXPECT_NEAR(mean.value, 1, bound(mean) + 0.005) << in_water;
  }
}

/// A wet sheet under a pane that all light of the lamp passes: photons bring what lies on the
/// sheet.
TEST(FabricPhotons, GiveThePictureThatPathsGive) {
  Draped scene(everything(0.5f, 0.3f));
  scene.shot.render.width = scene.shot.render.height = 8;
  scene.shot.render.samples = 512;
  scene.shot.light = {panel({1.2, 3, 0}, 0.5, 0.5, 15), sky(0.2f)};
  scene.shot.camera.position = V3d(1, 1.2, 0);
  scene.shot.camera.target = V3d(-0.1, 0.6, 0);
  scene.shot.camera.fov_deg = 12.0;
  scene.shot.material.push_back(dielectric("smooth", 1.5));
  scene.shot.obstacle.emplace_back();
  scene.shot.obstacle.back().name = scene.shot.obstacle.back().material = "smooth";
  scene.geometry.obstacle = {{"smooth", box_mesh({-3, 1.4f, -3}, {3, 1.5f, 3})}};
  expect_photons_as_paths(scene.shot, scene.geometry);
}

TEST(FabricBits, AreTheSameForAnyNumberOfThreads) {
  Draped scene(everything(0.5f, 0.3f));
  scene.shot.render.width = scene.shot.render.height = 48;
  scene.shot.render.samples = 8;
  const auto on_threads = [&](int threads) {
    const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 16);
    tbb::task_arena arena(threads);
    Film film;
    arena.execute([&] { film = render_frame(scene.shot, 1001, scene.geometry); });
    return film;
  };
  const Film one = on_threads(1);
  for (const int threads : {2, 16}) EXPECT_EQ(on_threads(threads).rgba, one.rgba) << threads;
}

}  // namespace
}  // namespace drench::render::test

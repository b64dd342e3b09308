#include "pipeline/contract/shot/shot_file.h"

#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "pipeline/contract/shot/colour.h"
#include "pipeline/contract/shot/shot_table.h"
#include "pipeline/contract/shot/shot_text.h"
#include "tests/contract/shot_samples.h"

namespace drench {
namespace {

using test::full_shot;
using test::TemporaryFolder;
using test::write_shot_files;

class ShotFile : public testing::Test {
 protected:
  void SetUp() override { write_shot_files(folder_); }
  Shot parse(const std::string& text, const ShotOptions& options = {}) const {
    return parse_shot(text, folder_ / "scene.toml", options);
  }
  TemporaryFolder folder_;
};

constexpr const char* smallest = "[[fluid.box]]\nmin = [0, 0, 0]\nmax = [0.1, 0.1, 0.1]\n";

TEST_F(ShotFile, TakesEveryDefaultFromTheShotItself) {
  const Shot shot = parse(smallest);
  Shot plain;
  plain.name = "scene";
  plain.fluid.box.push_back({.min = {0, 0, 0}, .max = V3d(0.1)});
  plain.material = shot.material;
  EXPECT_EQ(shot_lock(shot), shot_lock(plain));
  EXPECT_EQ(shot.material.size(), 3u);
}

TEST_F(ShotFile, PutsEveryValueInItsPlace) {
  const Shot shot = parse(full_shot());
  EXPECT_EQ(shot.name, "scene");
  EXPECT_EQ(shot.timeline.last, 1024);
  EXPECT_EQ(shot.preroll, 0.5);
  EXPECT_EQ(shot.seed, 7u);
  EXPECT_EQ(shot.domain.axis[2], Axis::open);
  EXPECT_EQ(shot.domain.axis[0], Axis::walls);
  EXPECT_EQ(shot.fluid.box.at(0).max, V3d(0.5, 0.3, 0.5));
  EXPECT_EQ(shot.fluid.emitter.at(0).speed, 2);
  EXPECT_EQ(shot.fluid.drops.at(0).count, 4);
  EXPECT_EQ(shot.cloth.at(1).mesh_file, folder_ / "flag.obj");
  EXPECT_EQ(shot.camera.position.keys.size(), 2u);
  EXPECT_EQ(shot.camera.target.interpolation, Interpolation::smooth);
  EXPECT_EQ(shot.light.at(1).name, "light2");
  EXPECT_EQ(shot.light.at(3).type, LightType::environment);
  EXPECT_TRUE(shot.ground.present);
  EXPECT_EQ(shot.file, folder_ / "scene.toml");
}

// Half way between two keys a smooth track stands at the mean, and half as far into it at
// t^2 (3 - 2 t) = 0.15625 for t = 1/4.
TEST_F(ShotFile, MovesTheCameraAlongItsKeys) {
  const Shot shot = parse(full_shot());
  EXPECT_NEAR(shot.camera.position.at(1012.5).x, 0.5, 1e-12);
  EXPECT_NEAR(shot.camera.position.at(1001 + 23 / 4.0).x, 0.15625, 1e-12);
  EXPECT_EQ(shot.camera.position.at(900).x, 0);
  EXPECT_EQ(shot.camera.position.at(2000).x, 1);
}

// On an 8 x 6 grid vertex j 9 + i: the corners 0, 8, 54, 62 and the edge j = 0, which is 0 to 8.
TEST_F(ShotFile, FindsTheVerticesOfNamedPins) {
  const Shot shot = parse(full_shot());
  ASSERT_EQ(shot.cloth[0].pin.size(), 2u);
  EXPECT_EQ(shot.cloth[0].pin[1].vertices,
            (std::vector<uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 54, 62}));
  const auto pins = [&](const std::string& name) {
    const Shot sheet = parse("[[cloth]]\ncells = [2, 1]\npins = \"" + name + "\"\n");
    return sheet.cloth[0].pin[0].vertices;
  };
  EXPECT_EQ(pins("edge_u0"), (std::vector<uint32_t>{0, 3}));
  EXPECT_EQ(pins("edge_u1"), (std::vector<uint32_t>{2, 5}));
  EXPECT_EQ(pins("edge_v1"), (std::vector<uint32_t>{3, 4, 5}));
  EXPECT_EQ(pins("rim"), (std::vector<uint32_t>{0, 1, 2, 3, 4, 5}));
}

// A shell of cotton unless a key of springs is given or the fluid cannot take one along.
TEST_F(ShotFile, MakesAShellOfASheetWhereItCan) {
  const auto sheet = [&](const std::string& before, const std::string& key) {
    return parse(before + "[[cloth]]\n" + key).cloth[0];
  };
  EXPECT_EQ(sheet("", "").model, ClothModel::shell);
  EXPECT_EQ(sheet("", "").areal_density, 0.15);
  EXPECT_EQ(sheet("", "areal_density = 0.3\n").areal_density, 0.3);
  EXPECT_EQ(sheet("", "model = \"springs\"\n").model, ClothModel::springs);
  for (const char* key : {"adjacent_stiffness = 1\n", "diagonal_stiffness = 1\n",
                          "spring_damping = 0\n", "retardation_time = 0\n"})
    EXPECT_EQ(sheet("", key).model, ClothModel::springs) << key;
  EXPECT_EQ(sheet("[coupling]\nscheme = \"paper\"\n", "").model, ClothModel::springs);
  EXPECT_EQ(sheet("[fluid]\nsolver = \"weakly_compressible\"\n", "").model, ClothModel::springs);
  EXPECT_EQ(sheet("[fluid]\nsolver = \"incompressible\"\n", "").model, ClothModel::shell);
}

TEST_F(ShotFile, AppliesAQualityAndResolvesPinsOnItsGrid) {
  const Shot preview = parse(full_shot(), {.quality = "preview", .set = {}});
  EXPECT_EQ(preview.fluid.spacing, 0.04);
  EXPECT_EQ(preview.render.width, 96);
  EXPECT_EQ(preview.render.height, RenderSettings{}.height);
  // A 4 x 2 grid: corners 0, 4, 10, 14 and the edge 0 to 4.
  EXPECT_EQ(preview.cloth[0].pin[1].vertices, (std::vector<uint32_t>{0, 1, 2, 3, 4, 10, 14}));
  EXPECT_EQ(parse(full_shot()).fluid.spacing, 0.02);
}

TEST_F(ShotFile, AppliesOverridesAfterTheQuality) {
  const Shot shot = parse(
      full_shot(), {.quality = "preview",
                    .set = {"fluid.spacing=0.05", "cloth.flag.damping = 2", "light.1.radius=0.3",
                            "surface.smoothing=3", "camera.fov_deg=[[1, 20], [2, 30]]"}});
  EXPECT_EQ(shot.fluid.spacing, 0.05);
  EXPECT_EQ(shot.cloth[1].damping, 2);
  EXPECT_EQ(shot.light[1].radius, 0.3);
  EXPECT_EQ(shot.surface.smoothing, 3);
  EXPECT_EQ(shot.camera.fov_deg.keys.size(), 2u);
  EXPECT_EQ(shot.render.width, 96);
}

TEST_F(ShotFile, LocksToAShotThatReadsTheSame) {
  for (const char* quality : {"final", "preview"}) {
    const Shot shot = parse(full_shot(), {.quality = quality, .set = {"shot.preroll=0.1"}});
    const std::string lock = shot_lock(shot);
    const Shot again = parse_shot(lock, folder_ / "elsewhere/shot.lock.toml");
    EXPECT_EQ(shot_lock(again), lock);
    EXPECT_EQ(again.name, shot.name);
    EXPECT_EQ(again.cloth[1].mesh_file, shot.cloth[1].mesh_file);
    for (const Stage stage : {Stage::simulate, Stage::mesh, Stage::foam, Stage::render}) {
      EXPECT_EQ(stage_settings_digest(again, stage), stage_settings_digest(shot, stage));
    }
  }
}

TEST_F(ShotFile, ReadsColoursAsAcesOrSrgb) {
  const Shot shot = parse(full_shot());
  const V3f canvas = acescg_from_srgb(V3d(200, 180, 40) / 255.0);
  EXPECT_EQ(shot.material.at(3).reflectance, canvas);
  EXPECT_EQ(shot.material[3].sheen, V3f(0.2f, 0.2f, 0.3f));
  EXPECT_EQ(shot.material[3].sheen_roughness, 0.25);
  EXPECT_EQ(shot.material[3].yarn_specular, V3f(0.1f, 0.1f, 0.05f));
  EXPECT_EQ(shot.material[3].yarn_roughness, 0.5);
  EXPECT_EQ(shot.material[3].gap, 0.05);
  EXPECT_EQ(shot.material[3].film_roughness, 0.35);
  const Shot hex =
      parse(full_shot(), {.quality = "final", .set = {"material.canvas.reflectance=\"#c8b428\""}});
  EXPECT_EQ(hex.material.at(3).reflectance, canvas);
  const Shot direct = parse(
      full_shot(), {.quality = "final", .set = {"material.canvas.reflectance=[0.5, 0.25, 0]"}});
  EXPECT_EQ(direct.material.at(3).reflectance, V3f(0.5f, 0.25f, 0));
}

TEST_F(ShotFile, RedefinesABuiltInMaterialFromItsOwnValues) {
  const Shot shot = parse(full_shot());
  EXPECT_EQ(shot.material.size(), 4u);
  EXPECT_EQ(shot.material[0].name, "water");
  EXPECT_EQ(shot.material[0].type, MaterialType::dielectric);
  EXPECT_EQ(shot.material[0].ior, 1.333);
  EXPECT_EQ(shot.material[0].absorption, V3f(0.5f, 0.1f, 0.05f));
}

TEST_F(ShotFile, StartsWithAShotThatIsValidInEveryQuality) {
  const std::string text = starting_shot("first");
  const Shot shot = parse(text);
  EXPECT_EQ(shot.name, "first");
  EXPECT_TRUE(shot.fluid.present());
  EXPECT_EQ(shot.cloth.at(0).pin.at(0).vertices.size(), 4u);
  EXPECT_LT(parse(text, {.quality = "preview", .set = {}}).render.width, shot.render.width);
  EXPECT_NE(test::error_of([] { starting_shot("../evil"); }).find("'/'"), std::string::npos);
}

/// One object of every section, as a shot has it before anything is read.
std::map<std::string_view, void*> fresh_objects(Shot& shot) {
  shot.fluid.box.resize(1), shot.fluid.sphere.resize(1), shot.fluid.emitter.resize(1);
  shot.fluid.volume.resize(1), shot.sink.resize(1);
  shot.fluid.drops.resize(1), shot.cloth.resize(1), shot.cloth[0].pin.resize(1);
  shot.cloth[0].seam.resize(1);
  shot.probe.resize(1), shot.light.resize(1), shot.material.resize(1);
  std::map<std::string_view, void*> objects;
  shot_table::for_each_object(shot, [&](const auto& section, void* object, const std::string&) {
    objects[section.name] = object;
  });
  return objects;
}

// What need not be given stands at its default; names and pins say which thing they are of.
TEST_F(ShotFile, ReferenceIsAValidShotAtItsDefaults) {
  const std::string text = reference_shot("all");
  Shot fresh, shot = parse(text);
  const auto objects = fresh_objects(fresh);
  size_t compared = 0;
  shot_table::for_each_object(
      shot, [&](const auto& section, void* object, const std::string& path) {
        if (path.starts_with("material[") && path < "material[3]") return;  // the built-in ones
        for (const shot_table::Parameter* p : shot_table::parameters_of(section.name)) {
          const bool given = p->required || p->fixed || p->key == "name" || !p->field;
          if (given || section.name == "cloth.pin") continue;
          if (!shot_table::applies(*p, section, object)) continue;
          if (path == "probe[3]" && p->key == "position") continue;  // a tip is on its sheet
          EXPECT_EQ(shot_table::value_text(*p, p->field(object)),
                    shot_table::value_text(*p, p->field(objects.at(section.name))))
              << path << '.' << p->key;
          ++compared;
        }
      });
  EXPECT_GT(compared, 80u);
  EXPECT_LT(parse(text, {.quality = "preview", .set = {}}).render.width, shot.render.width);
  EXPECT_NE(test::error_of([] { reference_shot("../evil"); }).find("'/'"), std::string::npos);
}

TEST_F(ShotFile, ReferenceHoldsEveryKeyWithUnitAndMeaning) {
  std::istringstream lines(reference_shot("all"));
  std::map<std::string, std::string> comment;  // by "section.key"
  std::string section;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# [[")) line.erase(0, 2);  // sections that do not go together
    if (line.starts_with('[')) section = line.substr(line.find_first_not_of('['));
    section = section.substr(0, section.find(']'));
    const size_t equals = line.find(" = "), note = line.find("  # ");
    if (line.starts_with('[') || equals == std::string::npos || note == std::string::npos) continue;
    const size_t key = line.starts_with("# ") ? 2 : 0;
    comment[section + "." + line.substr(key, equals - key)] += line.substr(note);
  }
  for (const shot_table::Parameter& p : shot_table::parameters()) {
    const std::string& text = comment[std::string(p.section) + "." + std::string(p.key)];
    EXPECT_NE(text.find(p.description), std::string::npos) << p.section << '.' << p.key;
    EXPECT_NE(text.find(p.unit), std::string::npos) << p.section << '.' << p.key;
    EXPECT_EQ(text.find("required") != std::string::npos, p.required) << p.section << '.' << p.key;
  }
}

TEST_F(ShotFile, IsDocumentedByThePageInDocs) {
  if (read_text(DRENCH_SOURCE_DIR "/docs/shots.md") == shot_reference_markdown()) return;
  const auto fresh = std::filesystem::temp_directory_path() / "drench_shots.md";
  write_file_whole(fresh, shot_reference_markdown());
  ADD_FAILURE() << "docs/shots.md is out of date: cp " << fresh.string() << " docs/shots.md";
}

}  // namespace
}  // namespace drench

#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/contract/shot/shot_table.h"
#include "tests/contract/shot_samples.h"

namespace drench {
namespace {

using shot_table::Kind;
using shot_table::Parameter;
using shot_table::Section;
using test::TemporaryFolder;

template <class T>
T& as(void* field) {
  return *static_cast<T*>(field);
}

/// Changes a value to another one of its kind; `file` is put in place of a path.
void change(const Parameter& p, void* field, const std::filesystem::path& file) {
  switch (p.kind) {
    case Kind::boolean:
      as<bool>(field) = !as<bool>(field);
      break;
    case Kind::integer:
      as<int>(field) += 1;
      break;
    case Kind::natural:
      as<uint32_t>(field) += 1;
      break;
    case Kind::number:
      as<double>(field) += 0.125;
      break;
    case Kind::text:
    case Kind::label:
    case Kind::name:
      as<std::string>(field) += "x";
      break;
    case Kind::path:
    case Kind::mesh_files:
      as<std::filesystem::path>(field) = file;
      break;
    case Kind::choice: {
      int index = 0;
      std::memcpy(&index, field, sizeof index);
      index = (index + 1) % int(p.choices.size());
      std::memcpy(field, &index, sizeof index);
      break;
    }
    case Kind::vector:
      as<V3d>(field).z += 0.125;
      break;
    case Kind::colour:
    case Kind::spectrum:
      as<V3f>(field).y += 0.125f;
      break;
    case Kind::cells:
      as<V2i>(field).y += 1;
      break;
    case Kind::frames:
      as<Timeline>(field).first -= 1;
      break;
    case Kind::number_track:
      as<Animated<double>>(field).keys.back().second += 0.125;
      break;
    case Kind::vector_track:
      as<Animated<V3d>>(field).keys.back().second.x += 0.125;
      break;
    case Kind::track_mode:
      as<Animated<V3d>>(field).interpolation =
          as<Animated<V3d>>(field).interpolation == Interpolation::linear ? Interpolation::smooth
                                                                          : Interpolation::linear;
      break;
    case Kind::vertices:
      as<std::vector<uint32_t>>(field).push_back(1);
      break;
    case Kind::box:
      as<std::optional<std::pair<V3d, V3d>>>(field) = {{V3d(7), V3d(8)}};
      break;
    case Kind::place:
      as<std::optional<V3d>>(field) = V3d(7);
      break;
    case Kind::grid_pins:
      FAIL() << "has no field";
  }
}

std::set<Stage> changed_stages(const Shot& before, const Shot& after) {
  std::set<Stage> changed;
  for (const Stage stage :
       {Stage::simulate, Stage::mesh, Stage::foam, Stage::render, Stage::denoise}) {
    if (stage_settings_digest(before, stage) != stage_settings_digest(after, stage)) {
      changed.insert(stage);
    }
  }
  return changed;
}

std::set<Stage> stages_of(unsigned bits) {
  std::set<Stage> stages;
  if (bits & shot_table::simulate) stages.insert(Stage::simulate);
  if (bits & shot_table::mesh) stages.insert(Stage::mesh);
  if (bits & shot_table::foam) stages.insert(Stage::foam);
  if (bits & shot_table::render) stages.insert(Stage::render);
  if (bits & shot_table::denoise) stages.insert(Stage::denoise);
  return stages;
}

class ShotDigest : public testing::Test {
 protected:
  void SetUp() override {
    test::write_shot_files(folder_);
    write_file_whole(folder_ / "other.obj", "v 0 0 0\nv 2 0 0\nv 0 0 1\nf 1 2 3\n");
    shot_ = parse_shot(test::full_shot(), folder_ / "scene.toml");
  }
  TemporaryFolder folder_;
  Shot shot_;
};

TEST_F(ShotDigest, ChangesForExactlyTheStagesOfEachRow) {
  Shot everything = shot_;
  for (const ObstacleType type :
       {ObstacleType::plane, ObstacleType::box, ObstacleType::sphere, ObstacleType::mesh}) {
    everything.obstacle.emplace_back().type = type;  // beside cloth, as no shot that is read has it
    everything.sink.emplace_back().shape.type = type;
  }
  everything.material.emplace_back().type = MaterialType::metal;
  everything.cloth.emplace_back().model = ClothModel::shell;
  everything.cloth.emplace_back().model = ClothModel::springs;
  size_t seen = 0;
  for (const Parameter& p : shot_table::parameters()) {
    if (p.field == nullptr) continue;
    Shot copy = everything;
    bool found = false;
    shot_table::for_each_object(
        copy, [&](const Section& section, void* object, const std::string&) {
          if (found || section.name != p.section || !shot_table::applies(p, section, object))
            return;
          change(p, p.field(object), folder_ / "other.obj");
          found = true;
        });
    ASSERT_TRUE(found) << "the sample has no " << p.section << "." << p.key;
    EXPECT_EQ(changed_stages(everything, copy), stages_of(p.stages)) << p.section << "." << p.key;
    ++seen;
  }
  EXPECT_GT(seen, 90u);
}

// What each section is for decides who reads it, whatever the table says.
TEST_F(ShotDigest, FollowsWhatTheSectionsAreFor) {
  const std::set<std::string_view> looks{"camera", "light", "material", "ground", "render"};
  const std::set<std::string_view> physics{
      "domain", "fluid.box", "fluid.sphere", "fluid.emitter", "fluid.drops", "fluid.volume",
      "wind",   "sink",      "cloth.pin",    "cloth.seam",    "coupling",    "probe"};
  for (const Parameter& p : shot_table::parameters()) {
    const bool holds_water = p.section == "ground" && (p.key == "present" || p.key == "height");
    if (p.key == "denoise_frames" || p.key == "denoiser") {
      EXPECT_EQ(p.stages, shot_table::denoise);
    } else if (looks.contains(p.section)) {
      EXPECT_EQ(p.stages, shot_table::render | (holds_water ? shot_table::mesh : 0u)) << p.key;
    }
    if (physics.contains(p.section)) {
      EXPECT_EQ(p.stages, shot_table::simulate) << p.key;
    }
    if (p.section == "surface") {
      EXPECT_EQ(p.stages & ~shot_table::mesh, 0u) << p.key;
    }
    if (p.section == "foam") {
      EXPECT_EQ(p.stages, shot_table::foam) << p.key;
    }
    if (p.key == "material") {
      EXPECT_EQ(p.stages, shot_table::render) << p.section;
    }
  }
}

TEST_F(ShotDigest, StaysWhenTheShotGetsLongerAndWhenItMoves) {
  Shot longer = shot_;
  longer.timeline.last += 100;
  EXPECT_TRUE(changed_stages(shot_, longer).empty());
  const TemporaryFolder elsewhere;
  test::write_shot_files(elsewhere);
  const Shot moved = parse_shot(test::full_shot(), elsewhere / "scene.toml");
  EXPECT_TRUE(changed_stages(shot_, moved).empty());
}

TEST_F(ShotDigest, ChangesWithTheContentOfFiles) {
  const Digest simulated = stage_settings_digest(shot_, Stage::simulate);
  const Digest rendered = stage_settings_digest(shot_, Stage::render);
  write_file_whole(folder_ / "flag.obj", "v 0 0 0\nv 3 0 0\nv 0 0 1\nf 1 2 3\n");
  EXPECT_NE(stage_settings_digest(shot_, Stage::simulate), simulated);
  EXPECT_EQ(stage_settings_digest(shot_, Stage::render), rendered);
  write_file_whole(folder_ / "weave.png", "another texture");
  EXPECT_NE(stage_settings_digest(shot_, Stage::render), rendered);
}

TEST_F(ShotDigest, ChangesTheSimulationOnlyWhenPinsChange) {
  const Shot pinned = parse_shot(test::full_shot(), folder_ / "scene.toml",
                                 {.quality = "final", .set = {"cloth.sheet.pins=\"rim\""}});
  EXPECT_EQ(changed_stages(shot_, pinned), std::set<Stage>{Stage::simulate});
}

TEST_F(ShotDigest, OfALightThatIsAddedChangesTheRenderOnly) {
  Shot lit = shot_;
  lit.light.emplace_back();
  EXPECT_EQ(changed_stages(shot_, lit), std::set<Stage>{Stage::render});
}

}  // namespace
}  // namespace drench

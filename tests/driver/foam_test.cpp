// Foam in the driver: frame after frame, from files alone; nothing at all where there is none.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/foam_file.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/plan_text.h"
#include "surfacing/foam.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/driver/folder.h"
#include "tests/driver/tiny_shot.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

using test::digests_in;
using test::Event;
using test::flip_bit_quietly;
using test::make_toy;
using test::Mark;
using test::TemporaryFolder;
using test::TinyShot;
using test::ToySettings;
using test::ToyStages;

struct Made : ToyStages {
  Made(const ToySettings& settings, const TemporaryFolder& folder) : ToyStages(settings) {
    make_toy(settings, *this, folder.path());
  }
};

ToySettings foamy() {
  ToySettings settings;
  settings.foam = true;
  return settings;
}

std::vector<int> range(int first, int last) {
  std::vector<int> frames;
  for (int frame = first; frame <= last; ++frame) frames.push_back(frame);
  return frames;
}

std::map<std::string, std::string> undisturbed(const ToySettings& settings) {
  const TemporaryFolder folder;
  const Made made(settings, folder);
  return digests_in(folder.path());
}

TEST(FoamSteps, ComeInOrderAfterTheirFluidAndBeforeTheirPictures) {
  const TemporaryFolder folder;
  const Made stages(foamy(), folder);
  EXPECT_EQ(stages.frames(Step::foam), range(1, 25));
  const std::vector<Event> events = stages.events();
  const auto at = [&](Step step, int frame, Mark mark) {
    return std::find_if(events.begin(), events.end(), [&](const Event& e) {
      return e.step == step && e.frame == frame && e.mark == mark;
    });
  };
  for (int frame = 2; frame <= 25; ++frame) {
    EXPECT_LT(at(Step::simulate, frame, Mark::end), at(Step::foam, frame, Mark::begin));
    EXPECT_LT(at(Step::foam, frame - 1, Mark::end), at(Step::foam, frame, Mark::begin));
    EXPECT_LT(at(Step::foam, frame, Mark::end), at(Step::render, frame, Mark::begin));
  }
  const Made again(foamy(), folder);
  EXPECT_TRUE(again.events().empty());
}

TEST(FoamSteps, AreAllMadeUpToTheFramesAskedFor) {
  const TemporaryFolder folder;
  ToySettings settings = foamy();
  settings.frames = {4, 8};
  const Made stages(settings, folder);
  EXPECT_EQ(stages.frames(Step::foam), range(1, 8));
  std::vector<int> rendered = stages.frames(Step::render);  // two at once, in either order
  std::sort(rendered.begin(), rendered.end());
  EXPECT_EQ(rendered, settings.frames);
  // And go on from there.
  const Made more(foamy(), folder);
  EXPECT_EQ(more.frames(Step::foam), range(9, 25));
  std::map<std::string, std::string> found = digests_in(folder.path());
  for (const auto& [file, digest] : undisturbed(foamy()))
    if (file.starts_with("mesh/") || file.starts_with("render/")) {
      EXPECT_EQ(found[file], digest) << file;
    }
}

TEST(FoamSteps, ResumeAsIfNothingHadHappened) {
  const TemporaryFolder folder;
  ToyStages first(foamy());
  first.hook = [](Step step, int frame) {
    if (step == Step::foam && frame == 7) throw Error("the disk is gone");
  };
  EXPECT_THROW(make_toy(foamy(), first, folder.path()), Error);
  const Made second(foamy(), folder);
  EXPECT_EQ(second.frames(Step::foam), range(7, 25));
  EXPECT_EQ(digests_in(folder.path()), undisturbed(foamy()));
}

TEST(FoamSteps, MakeADamagedFrameAgainAndNothingElse) {
  for (const bool remove : {false, true}) {
    const TemporaryFolder folder;
    { const Made made(foamy(), folder); }
    const std::map<std::string, std::string> before = digests_in(folder.path());
    const std::filesystem::path file = folder.path() / layout::foam(6);
    if (remove)
      std::filesystem::remove(file);
    else
      test::put_text(file, "garbage");
    const Made again(foamy(), folder);
    EXPECT_EQ(again.frames(Step::foam), (std::vector<int>{6}));
    EXPECT_EQ(again.count(Step::render) + again.count(Step::mesh), 0);
    EXPECT_EQ(digests_in(folder.path()), before);
  }
}

// Damage that neither size nor time shows is found by the frame that starts from the file.
TEST(FoamSteps, NeverStartFromADamagedFrame) {
  const TemporaryFolder folder;
  { const Made made(foamy(), folder); }
  const std::map<std::string, std::string> before = digests_in(folder.path());
  flip_bit_quietly(folder.path() / layout::foam(6));
  std::filesystem::remove(folder.path() / layout::foam(7));
  const Made again(foamy(), folder);
  EXPECT_EQ(again.frames(Step::foam), (std::vector<int>{6, 7}));
  EXPECT_EQ(digests_in(folder.path()), before);
}

TEST(FoamSteps, FollowTheirOwnSettingsAndTheFluidAlone) {
  const TemporaryFolder folder;
  { const Made made(foamy(), folder); }
  ToySettings settings = foamy();
  settings.foam_rate = 0.5;
  const Made rate(settings, folder);
  EXPECT_EQ(rate.count(Step::simulate) + rate.count(Step::mesh), 0);
  EXPECT_EQ(rate.frames(Step::foam), range(1, 25));
  EXPECT_EQ(rate.count(Step::render), 24);  // of the first frame the foam comes out the same
  settings.camera = "right";
  const Made camera(settings, folder);
  EXPECT_EQ(camera.count(Step::foam), 0);
  settings.mesh_digits = 3;
  const Made mesh(settings, folder);
  EXPECT_EQ(mesh.count(Step::foam), 0);
}

TEST(FoamSteps, CostNothingWhereThereIsNone) {
  const TemporaryFolder folder;
  const Made stages(ToySettings{}, folder);
  EXPECT_EQ(stages.count(Step::foam), 0);
  for (const auto& [file, digest] : digests_in(folder.path()))
    EXPECT_EQ(file.find("foam"), std::string::npos);
  // What is made without foam is the same as with it, but the pictures; and off again is off.
  const std::map<std::string, std::string> off = digests_in(folder.path());
  const Made on(foamy(), folder);
  EXPECT_EQ(on.count(Step::simulate) + on.count(Step::mesh), 0);
  const Made off_again(ToySettings{}, folder);
  EXPECT_EQ(off_again.count(Step::foam), 0);
  const std::map<std::string, std::string> now = digests_in(folder.path());
  for (const auto& [file, digest] : off) EXPECT_EQ(now.at(file), digest) << file;
}

// ---- the real stages

// From its level set, voxels of half a spacing; the mesh itself lies up to 0.4 mm inside its ball.
TEST(FoamOfAShot, StopsAtMeshes) {
  const TemporaryFolder folder;
  Shot shot;
  shot.fluid.spacing = 0.01;
  shot.gravity = V3d(0);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  Obstacle ball;
  ball.type = ObstacleType::mesh;
  ball.mesh_file = folder / "ball.ply";
  ball.scale = 0.1;
  ball.position = V3d(0.3, 1, 0);
  write_mesh(ball.mesh_file, test::unit_sphere(48, 96));
  shot.obstacle = {ball};
  ParticleFrame fluid;
  fluid.spacing = 0.01f;
  for (const float height : {0.f, 0.03f, 0.08f}) {
    FoamFrame foam;
    foam.spacing = 0.01f, foam.next_id = 1;
    foam.position.emplace_back(0.f, 1 + height, 0.f), foam.velocity.emplace_back(5.f, 0.f, 0.f);
    foam.id.push_back(0), foam.age.push_back(0), foam.radius.push_back(0.001f);
    foam.kind.push_back(FoamKind::spray);
    for (int frame = 1002; frame < 1005; ++frame)
      foam = foam_frame(shot, frame, foam, fluid, fluid, make_level_set);
    EXPECT_EQ(foam.velocity[0], V3f(0));
    EXPECT_LT(foam.position[0].x, 0.3f);
    EXPECT_NEAR((foam.position[0] - V3f(0.3f, 1, 0)).length(), 0.101, 0.001) << height;
  }
}

Targets targets_of_shot(const TinyShot& shot, const std::vector<std::string>& set) {
  return targets_of(read_shot(shot.file(), {.set = set}), {1001, 1002},
                    {Step::simulate, Step::mesh, Step::foam, Step::render}, "cpu");
}

TEST(FoamOfAShot, ChangesNoKeyWhileItIsOff) {
  const TinyShot shot;
  const Targets plain = targets_of_shot(shot, {});
  const Targets off = targets_of_shot(shot, {"foam.lifetime=7", "foam.radius=0.5"});
  const Targets on = targets_of_shot(shot, {"foam.present=true"});
  EXPECT_FALSE(off.has_foam);
  EXPECT_TRUE(on.has_foam);
  for (const Targets& other : {off, on}) {
    EXPECT_EQ(plain.simulate.digest, other.simulate.digest);
    EXPECT_EQ(plain.mesh.digest, other.mesh.digest);
    EXPECT_EQ(plain.render.digest, other.render.digest);
  }
  EXPECT_EQ(possible_inputs(rule_of(Step::render), plain, 1001),
            possible_inputs(rule_of(Step::render), off, 1001));
  EXPECT_NE(possible_inputs(rule_of(Step::render), plain, 1001),
            possible_inputs(rule_of(Step::render), on, 1001));
  EXPECT_EQ(plan_text(make_plan(plain, {}, 1012)), plan_text(make_plan(off, {}, 1012)));
  EXPECT_EQ(plan_text(make_plan(plain, {}, 1012)).find("foam"), std::string::npos);
}

TEST(FoamOfAShot, HasAKeyThatFollowsWallsAndGravityButNoProbe) {
  const TinyShot shot;
  const auto key = [&](const std::string& change) {
    return targets_of_shot(shot, {"foam.present=true", change}).foam.digest;
  };
  const Digest plain = key("foam.present=true");
  EXPECT_NE(key("shot.gravity=[0,-5,0]"), plain);
  EXPECT_NE(key("domain.max=[0.2,0.5,0.2]"), plain);
  EXPECT_NE(key("foam.rise_speed=0.3"), plain);
  EXPECT_NE(key("shot.seed=9"), plain);
  EXPECT_EQ(key("probe.gauge.position=[0.1,0,0]"), plain);
  EXPECT_EQ(key("render.samples=3"), plain);
}

const std::vector<std::string> much_foam{
    "--set", "foam.present=true", "--set", "foam.threshold=0.05", "--set", "foam.trapped_air=40"};

std::vector<std::string> with(std::vector<std::string> words,
                              const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(FoamOfAShot, IsTheSameForAnyThreadsAndAfterAStop) {
  const TinyShot one, two, cut;
  ASSERT_EQ(one.run("run", with(much_foam, {"--threads", "1"})).code, 0);
  ASSERT_EQ(two.run("run", with(much_foam, {"--threads", "2"})).code, 0);
  EXPECT_EQ(one.digests(), two.digests());
  const FoamFrame last = read_foam(one.out() / layout::foam(1012));
  EXPECT_GT(last.next_id, 50u);
  for (int end = 1003; end <= 1012; end += 3)
    ASSERT_EQ(cut.run("run", with(much_foam, {"--frames", fmt::format("1001-{}", end)})).code, 0);
  EXPECT_EQ(read_text(cut.out() / layout::foam(1012)), read_text(one.out() / layout::foam(1012)));
}

TEST(FoamOfAShot, IsDrawnAndSaysWhenItsFilesAreMissing) {
  const TinyShot shot(3);
  ASSERT_EQ(shot.run("run").code, 0);
  const std::string without = read_text(shot.out() / "render/tiny.1003.exr");
  // A later stage alone needs the file of the frame and says who makes it.
  const test::Ended alone = shot.run("render", much_foam);
  EXPECT_EQ(alone.code, 1);
  EXPECT_NE(alone.err.find("mesh/foam.1001.vdb"), std::string::npos) << alone.err;
  EXPECT_NE(alone.err.find("drench mesh"), std::string::npos) << alone.err;
  ASSERT_EQ(shot.run("mesh", much_foam).code, 0);
  ASSERT_EQ(shot.run("render", much_foam).code, 0);
  // Its header names what it was made of.
  EXPECT_NE(read_text(shot.out() / "render/tiny.1003.exr").find("mesh/foam.1003.vdb"),
            std::string::npos);
  ASSERT_EQ(shot.run("run").code, 0);
  EXPECT_EQ(read_text(shot.out() / "render/tiny.1003.exr"), without);
}

}  // namespace
}  // namespace drench

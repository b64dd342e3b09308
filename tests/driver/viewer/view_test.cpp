// The viewer: what it sends of a frame, to whom, and what a browser makes of it.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "pipeline/driver/viewer/view_data.h"
#include "tests/driver/served_page.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;
using Imath::V3f;
using nlohmann::json;

template <class T>
T value_at(const std::string& bytes, size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

constexpr size_t particles_head = 52, particle_size = 10;

ParticleFrame some_particles(size_t count) {
  ParticleFrame frame;
  for (size_t i = 0; i < count; ++i) {
    const auto t = float(i);
    frame.position.emplace_back(std::sin(t), 2 * std::cos(0.7f * t), 0.1f * std::sin(1.3f * t));
    frame.velocity.emplace_back(0, -t / float(count), 0);
    frame.density.push_back(1000 + t);
    frame.id.push_back(uint32_t(i));
  }
  return frame;
}

V3f position_in(const std::string& bytes, size_t k) {
  V3f p;
  for (int c = 0; c < 3; ++c) {
    const auto low = value_at<float>(bytes, 12 + 4 * size_t(c)),
               size = value_at<float>(bytes, 24 + 4 * size_t(c));
    const auto share =
        value_at<uint16_t>(bytes, particles_head + particle_size * k + 2 * size_t(c));
    p[c] = low + size * float(share) / 65535;
  }
  return p;
}

TEST(ViewParticles, AreWhereTheyWere) {
  const ParticleFrame frame = some_particles(500);
  const std::string bytes = view_particles(frame, 1000);
  ASSERT_EQ(bytes.size(), particles_head + 500 * particle_size);
  EXPECT_EQ(value_at<uint32_t>(bytes, 4), 500u);
  EXPECT_EQ(value_at<uint32_t>(bytes, 8), 500u);
  EXPECT_FLOAT_EQ(value_at<float>(bytes, 36), 499.f / 500);  // largest speed
  EXPECT_FLOAT_EQ(value_at<float>(bytes, 40), 1000);         // densities
  EXPECT_FLOAT_EQ(value_at<float>(bytes, 44), 1499);
  std::vector<bool> found(500);
  for (size_t k = 0; k < 500; ++k) {
    // The density tells which it is.
    const auto share = value_at<uint8_t>(bytes, particles_head + particle_size * k + 7);
    bool near = false;
    for (size_t i = 0; i < 500 && !near; ++i) {
      if (found[i] || std::abs(double(i) / 499 - share / 255.0) > 0.5 / 255 + 1e-6) continue;
      near = (position_in(bytes, k) - frame.position[i]).length() < 1e-4f;
      if (near) found[i] = true;
    }
    EXPECT_TRUE(near) << k;
  }
}

/// Fewer are the beginning of more, spread evenly, and the same ones in the next frame.
TEST(ViewParticles, AreSentInAnOrderOfWhichAnyBeginningWillDo) {
  const ParticleFrame frame = some_particles(4000);
  const std::string all = view_particles(frame, 4000), some = view_particles(frame, 400);
  EXPECT_EQ(some.substr(particles_head), all.substr(particles_head, 400 * particle_size));
  double mean = 0;
  for (size_t k = 0; k < 400; ++k)
    mean += value_at<uint8_t>(some, particles_head + particle_size * k + 7) / 255.0 / 400;
  EXPECT_NEAR(mean, 0.5, 0.05);
  ParticleFrame turned = frame;
  std::reverse(turned.position.begin(), turned.position.end());
  std::reverse(turned.velocity.begin(), turned.velocity.end());
  std::reverse(turned.density.begin(), turned.density.end());
  std::reverse(turned.id.begin(), turned.id.end());
  EXPECT_EQ(view_particles(turned, 400), some);
}

TEST(ViewParticles, MayBeNone) { EXPECT_EQ(view_particles({}, 100).size(), particles_head); }

TEST(ViewMesh, HasNormalsAndStretch) {
  TriangleMesh mesh;
  mesh.position = {V3f(0, 0, 0), V3f(1.1f, 0, 0), V3f(0, 0, -1)};
  mesh.rest_position = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 0, -1)};
  mesh.wetness = {0, 0.5f, 1};
  mesh.triangle = {{0, 1, 2}};
  const std::string bytes = view_mesh(mesh, ViewMesh::sheet);
  ASSERT_EQ(bytes.size(), 16u + 3 * (12 + 4 + 8) + 12);
  EXPECT_FLOAT_EQ(value_at<float>(bytes, 16 + 12), 1.1f);
  EXPECT_EQ(value_at<int8_t>(bytes, 16 + 36 + 1), 127);  // upwards
  EXPECT_NEAR(value_at<float>(bytes, 16 + 48), 0.1f, 1e-6f);
  EXPECT_FLOAT_EQ(value_at<float>(bytes, 16 + 48 + 12), 0.5f);
  EXPECT_EQ(value_at<uint32_t>(bytes, 16 + 72 + 8), 2u);
}

/// A shot that was run.
struct RunShot {
  RunShot() { EXPECT_EQ(shot.run("run").code, 0); }
  TinyShot shot{3};
};

/// A shot that was run, and its viewer.
struct Viewed : RunShot, ServedPage {
  Viewed() : ServedPage({"view", shot.out().string()}, shot.folder()) {}
};

TEST(Viewer, SendsTheFramesOfTheFolder) {
  Viewed viewed;
  const json scene = json::parse(viewed.body(viewed.root + "scene.json"));
  EXPECT_EQ(scene["shot"], "tiny");
  ASSERT_EQ(scene["frames"].size(), 3u);
  EXPECT_EQ(scene["frames"][2]["sheets"], json::array({true}));
  EXPECT_EQ(value_at<uint32_t>(viewed.body(viewed.root + "particles?frame=1002&most=20"), 8), 20u);
  EXPECT_EQ(value_at<uint32_t>(viewed.body(viewed.root + "cloth?frame=1002&sheet=0"), 4), 49u);
  EXPECT_GT(value_at<uint32_t>(viewed.body(viewed.root + "fluid?frame=1003"), 8), 100u);
  viewed.program->send(SIGTERM);
  EXPECT_EQ(viewed.program->wait().code, 0);
}

TEST(Viewer, TellsNothingToStrangersAndNothingElseToAnybody) {
  const Viewed viewed;
  EXPECT_EQ(viewed.status("/"), 403);
  EXPECT_EQ(viewed.status("/scene.json"), 403);
  EXPECT_EQ(viewed.status("/" + std::string(32, '0') + "/scene.json"), 403);
  EXPECT_EQ(viewed.status(viewed.root.substr(0, viewed.root.size() - 2) + "/scene.json"), 403);
  EXPECT_EQ(viewed.status(viewed.root + "scene.json", {{"Host", "elsewhere.example"}}), 403);
  for (const std::string path :
       {"../manifest.jsonl", "%2e%2e/%2e%2e/etc/passwd", "shot.lock.toml",
        "sim/cloth.flag.1001.ply", "particles", "particles?frame=", "particles?frame=1",
        "particles?frame=1001x", "particles?frame=../../etc/passwd",
        "particles?frame=99999999999999999999", "cloth?frame=1001", "cloth?frame=1001&sheet=-1",
        "cloth?frame=1001&sheet=1", "cloth?frame=1001&sheet=flag", "cloth?frame=1001&sheet=%00",
        "//etc/passwd", "\\..\\x"})
    EXPECT_EQ(viewed.status(viewed.root + path), 404) << path;
  const httplib::Result page = viewed.client->Get(viewed.root);
  EXPECT_NE(page->get_header_value("Content-Security-Policy").find("default-src 'none'"),
            std::string::npos);
  EXPECT_EQ(page->get_header_value("Access-Control-Allow-Origin"), "");
  EXPECT_EQ(page->body.find("http"), std::string::npos);
}

TEST(Viewer, SaysWhenAFrameIsNotThereAnyMore) {
  const Viewed viewed;
  std::filesystem::remove(viewed.shot.out() / "sim/particles.1002.vdb");
  EXPECT_EQ(viewed.status(viewed.root + "particles?frame=1002&most=10"), 404);
}

TEST(Viewer, RefusesAFolderThatHoldsNoRun) {
  const TemporaryFolder folder;
  const Ended ended = run_program(DRENCH_PROGRAM, {"view", folder.path().string()}, folder.path());
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("shot.lock.toml"), std::string::npos) << ended.err;
}

TEST(Viewer, ShowsParticlesInABrowser) {
  if (::access("/usr/bin/chromium", X_OK) != 0) GTEST_SKIP() << "needs chromium";
  const Viewed viewed;
  Ended ended;
  // A browser at a loaded machine may be asked for its page before it has it.
  for (int k = 0; k < 4 && ended.out.find("88 particles") == std::string::npos; ++k) {
    ended = run_program(
        "/usr/bin/chromium",
        {"--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--no-first-run", "--user-data-dir=" + (viewed.shot.folder() / "profile").string(),
         "--virtual-time-budget=8000", "--dump-dom", viewed.url},
        viewed.shot.folder());
  }
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_NE(ended.out.find("<title>tiny</title>"), std::string::npos) << ended.out.substr(0, 400);
  EXPECT_NE(ended.out.find("88 particles"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace drench

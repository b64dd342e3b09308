// Every scene of shots/ is valid in every quality it names, and can be started.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>
#include <sstream>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/shot/shot_file.h"
#include "sim/setup/scene.h"

namespace drench {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> shot_files() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(DRENCH_SOURCE_DIR "/shots")) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Names of all [quality.NAME] and [quality.NAME.section] tables, and `final`.
std::set<std::string> qualities_of(const std::string& text) {
  static const std::regex header(R"re((?:^|\n)[ \t]*\[quality\.([A-Za-z0-9_-]+|"[^"\n]+"))re");
  std::set<std::string> names{"final"};
  for (std::sregex_iterator at(text.begin(), text.end(), header), end; at != end; ++at) {
    names.insert((*at)[1]);
  }
  return names;
}

// Below, an empty folder would have nothing to fail on.
TEST(Shots, AreThere) { EXPECT_FALSE(shot_files().empty()); }

TEST(Shots, AreValidInEveryQualityLockToTheSameAndStart) {
  for (const fs::path& file : shot_files()) {
    for (const std::string& quality : qualities_of(read_text(file))) {
      SCOPED_TRACE(file.filename().string() + ", " + quality);
      try {
        const Shot shot = read_shot(file, {.quality = quality, .set = {}});
        EXPECT_EQ(shot.name, file.stem().string());
        EXPECT_FALSE(shot.light.empty());
        const std::string lock = shot_lock(shot);
        const Shot again = parse_shot(lock, file.parent_path() / "shot.lock.toml");
        EXPECT_EQ(shot_lock(again), lock);
        for (const Stage stage : {Stage::simulate, Stage::mesh, Stage::render}) {
          EXPECT_EQ(stage_settings_digest(again, stage), stage_settings_digest(shot, stage));
        }
        const sim::Scene scene =
            sim::build_scene(shot, make_level_set);  // checks overlaps, meshes and sources
        EXPECT_EQ(scene.sheet.size(), shot.cloth.size());
        EXPECT_TRUE(!scene.start.id.empty() || !shot.fluid.emitter.empty() || !shot.cloth.empty());
      } catch (const Error& error) {
        ADD_FAILURE() << error.what();
      }
    }
  }
}

// What init writes can be simulated, not only read.
TEST(Shots, OfInitCanBeStarted) {
  for (const std::string& text : {starting_shot("first"), reference_shot("all")}) {
    const Shot shot = parse_shot(text, "init.toml");
    const sim::Scene scene = sim::build_scene(shot);
    EXPECT_FALSE(shot.cloth.empty());
    EXPECT_EQ(scene.sheet.size(), shot.cloth.size());
    EXPECT_FALSE(scene.start.id.empty());
  }
}

// ./run makes the preview unless told otherwise: it must differ from the final.
TEST(Shots, HaveACheaperPreview) {
  for (const fs::path& file : shot_files()) {
    SCOPED_TRACE(file.filename().string());
    ASSERT_TRUE(qualities_of(read_text(file)).contains("preview"));
    const RenderSettings whole = read_shot(file).render,
                         preview = read_shot(file, {.quality = "preview", .set = {}}).render;
    EXPECT_LT(int64_t(preview.width) * preview.height * preview.samples,
              int64_t(whole.width) * whole.height * whole.samples);
  }
}

// The first line says what a shot shows; the folder's page lists it.
TEST(Shots, SayWhatTheyShow) {
  const std::string page = read_text(DRENCH_SOURCE_DIR "/shots/README.md");
  for (const fs::path& file : shot_files()) {
    EXPECT_TRUE(read_text(file).starts_with("# ")) << file;
    EXPECT_NE(page.find(fmt::format("`{}`", file.stem().string())), std::string::npos) << file;
  }
}

/// The picture in a shot's row of the folder's page; empty where there is none.
std::string picture_in_row(const std::string& page, const std::string& shot) {
  static const std::regex picture(R"re(src="\.\./docs/images/gallery/([a-z0-9_]+\.jpg)")re");
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (line.find(fmt::format("`{}`", shot)) == std::string::npos) continue;
    if (std::regex_search(line, found, picture)) return found[1];
  }
  return {};
}

// Each row of that page has a JPEG of at most 80 KB that shots/gallery knows how to make again, and
// no picture lies there that none shows.
TEST(Shots, HaveAPicture) {
  const fs::path folder = DRENCH_SOURCE_DIR "/docs/images/gallery";
  const std::string page = read_text(DRENCH_SOURCE_DIR "/shots/README.md");
  const std::string script = read_text(DRENCH_SOURCE_DIR "/shots/gallery");
  std::set<std::string> seen;
  for (const fs::path& file : shot_files()) {
    SCOPED_TRACE(file.filename().string());
    const std::string name = picture_in_row(page, file.stem().string());
    ASSERT_FALSE(name.empty());
    ASSERT_TRUE(fs::is_regular_file(folder / name)) << name;
    EXPECT_LE(fs::file_size(folder / name), 80000u) << name;
    EXPECT_TRUE(read_text(folder / name).starts_with("\xff\xd8\xff")) << name;
    const std::string frame = fmt::format("\"{}\": ", fs::path(name).stem().string());
    EXPECT_NE(script.find(frame), std::string::npos) << frame;
    seen.insert(name);
  }
  for (const auto& entry : fs::directory_iterator(folder)) {
    EXPECT_TRUE(seen.contains(entry.path().filename().string())) << entry.path();
  }
}

}  // namespace
}  // namespace drench

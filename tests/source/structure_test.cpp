// How the folders hang together, read from the sources: who may include whom and which library,
// that every folder says what it holds, and how long a file is at most.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace drench {
namespace {

namespace fs = std::filesystem;
const fs::path root = DRENCH_SOURCE_DIR;

struct Rule {
  std::string folder;              // with all below it, but for what a longer rule is about
  std::vector<std::string> takes;  // folders with all below them, "folder/" alone, or single files
};

/// Sources of the repository by folder. A new direction is a change of architecture: it belongs
/// here and into the README of its folder.
const std::vector<Rule> folder_rules = {
    {"pipeline/contract", {"pipeline/contract"}},
    {"sim", {"sim", "pipeline/contract"}},
    {"sim/backend", {"sim/backend", "pipeline/contract/error.h", "sim/solver.h"}},
    {"sim/neighbours",
     {"sim/neighbours", "sim/backend", "sim/", "pipeline/contract/error.h",
      "sim/passes/coupling/polygon_grid.h", "sim/passes/motion/domain_walls.h",
      "sim/passes/obstacle/drain.h"}},
    {"sim/setup",
     {"sim/setup", "sim/", "sim/neighbours", "pipeline/contract", "sim/backend/backend.h",
      "sim/passes/coupling/geometry.h", "sim/passes/obstacle/obstacle_distance.h",
      "sim/passes/cloth/shell_bending.h", "sim/passes/cloth/shell_membrane.h"}},
    {"sim/passes",
     {"sim/passes", "sim/", "sim/neighbours", "sim/backend",
      "pipeline/contract/geometry/level_set.h"}},
    {"surfacing", {"surfacing", "pipeline/contract"}},
    {"render", {"render", "pipeline/contract"}},
    {"pipeline/driver", {"pipeline", "sim/", "sim/setup", "surfacing", "render", "build_id.h"}},
    {"examples", {"pipeline/contract", "sim/", "sim/setup", "surfacing", "render"}},
    {"tests", {""}},
};

/// Libraries by the start of what is included; all others any folder may include.
const std::vector<Rule> library_rules = {
    {"openvdb/", {"pipeline/contract/files", "pipeline/contract/geometry"}},
    {"embree", {"render"}},
    {"OpenEXR/", {"render"}},
    {"OpenColorIO/", {"render/display"}},
    {"tbb/", {"pipeline", "sim/backend", "surfacing", "render"}},
    {"cub/", {"sim/backend"}},
    {"cuda", {"sim/backend"}},
    {"toml++/", {"pipeline/contract/shot", "pipeline/driver"}},
    {"CLI/", {"pipeline/driver"}},
};

bool starts_with(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

bool is_within(const std::string& file, const std::string& folder) {
  return folder.empty() || file == folder || starts_with(file, folder + "/");
}

/// Whether `place`, which is written as in Rule::takes, holds a file.
bool holds(const std::string& place, const std::string& file) {
  if (place.ends_with('/')) return fs::path(file).parent_path().string() + "/" == place;
  return is_within(file, place);
}

bool any_holds(const std::vector<std::string>& places, const std::string& file) {
  return std::any_of(places.begin(), places.end(),
                     [&](const std::string& place) { return holds(place, file); });
}

const Rule* rule_of(const std::string& file) {
  const Rule* longest = nullptr;
  for (const Rule& rule : folder_rules) {
    if (!is_within(file, rule.folder)) continue;
    if (!longest || rule.folder.size() > longest->folder.size()) longest = &rule;
  }
  return longest;
}

/// Relative to the root, of the folders that hold code.
std::vector<std::string> sources() {
  std::vector<std::string> found;
  for (const char* folder : {"pipeline", "sim", "surfacing", "render", "examples", "tests"}) {
    if (!fs::is_directory(root / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension().string();
      for (const char* code : {".h", ".cpp", ".cu", ".py"}) {
        if (extension == code) found.push_back(fs::relative(entry.path(), root).string());
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

struct Include {
  std::string file, named;
  int line = 0;
  bool own = false;  // "in quotes": of this repository
};

std::vector<Include> includes() {
  const std::regex form(R"re(\s*#\s*include\s*(["<])([^">]+)[">].*)re");
  std::vector<Include> found;
  for (const std::string& file : sources()) {
    const std::vector<std::string> lines = lines_of(root / file);
    for (size_t k = 0; k < lines.size(); ++k) {
      std::smatch match;
      if (lines[k].find('#') == std::string::npos || !std::regex_match(lines[k], match, form))
        continue;
      found.push_back(
          {.file = file, .named = match[2], .line = int(k + 1), .own = match[1] == "\""});
    }
  }
  return found;
}

std::string place_of(const Include& include) {
  return include.file + ":" + std::to_string(include.line) + " includes " + include.named;
}

TEST(Structure, FoldersIncludeOnlyWhatTheirRuleSays) {
  int seen = 0;
  for (const Include& include : includes()) {
    if (!include.own) continue;
    const Rule* rule = rule_of(include.file);
    ASSERT_NE(rule, nullptr) << include.file << " is in no folder of folder_rules";
    EXPECT_TRUE(any_holds(rule->takes, include.named))
        << place_of(include) << ", which " << rule->folder << " must not know";
    ++seen;
  }
  EXPECT_GT(seen, 500);  // the sources were found
}

TEST(Structure, IncludesOfOurOwnNameTheFileFromTheRoot) {
  for (const Include& include : includes()) {
    if (!include.own || include.named == "build_id.h") continue;  // which the build writes
    EXPECT_TRUE(fs::exists(root / include.named)) << place_of(include);
  }
}

TEST(Structure, LibrariesStayWhereTheyAreWrapped) {
  for (const Include& include : includes()) {
    if (include.own || is_within(include.file, "tests")) continue;
    for (const Rule& rule : library_rules) {
      if (!starts_with(include.named, rule.folder)) continue;
      EXPECT_TRUE(any_holds(rule.takes, include.file)) << place_of(include);
    }
  }
}

// An exception that nothing needs any more would let the next one in.
TEST(Structure, EveryExceptionIsNeeded) {
  const std::vector<Include> all = includes();
  for (const Rule& rule : folder_rules) {
    for (const std::string& file : rule.takes) {
      if (!file.ends_with(".h") || file == "build_id.h") continue;
      EXPECT_TRUE(std::any_of(all.begin(), all.end(),
                              [&](const Include& include) {
                                return include.named == file && rule_of(include.file) == &rule;
                              }))
          << rule.folder << " no longer includes " << file << ": take it out of folder_rules";
    }
  }
}

// Families of passes and the like stand in the table of the folder above.
TEST(Structure, EveryFolderOfSourcesIsDescribed) {
  std::vector<std::string> folders;
  for (const std::string& file : sources()) {
    const std::string folder = fs::path(file).parent_path().string();
    if (is_within(folder, "tests")) continue;  // they mirror the tree
    if (folders.empty() || folders.back() != folder) folders.push_back(folder);
  }
  for (const std::string& folder : folders) {
    if (fs::exists(root / folder / "README.md")) continue;
    const fs::path path = folder;
    const std::string name = '`' + path.filename().string() + '`';
    bool named = false;
    for (const std::string& line : lines_of(root / path.parent_path() / "README.md"))
      named = named || line.find(name) != std::string::npos;
    EXPECT_TRUE(named) << folder << " has no README.md and is in no table of the folder above";
  }
}

// Data that no test compares with say nothing.
TEST(Structure, EveryFileOfValidationDataIsRead) {
  std::string tests;
  for (const std::string& file : sources()) {
    if (!is_within(file, "tests")) continue;
    for (const std::string& line : lines_of(root / file)) tests += line;
  }
  for (const auto& entry : fs::directory_iterator(root / "tests/validation/data")) {
    const std::string name = '"' + entry.path().filename().string() + '"';
    EXPECT_NE(tests.find(name), std::string::npos) << name;
  }
}

// But for two that are tables of PTX's instructions, in its manual's order.
TEST(Structure, NoFileHasMoreThanSixHundredLines) {
  const std::vector<std::string> tables{"tests/gpu/emulator/ptx.h",
                                        "tests/gpu/emulator/translate.py"};
  for (const std::string& file : sources()) {
    const size_t lines = lines_of(root / file).size();
    if (any_holds(tables, file))
      EXPECT_GT(lines, 600u) << file << " needs no exception";
    else
      EXPECT_LE(lines, 600u) << file << ": split it by what it is about";
  }
}

}  // namespace
}  // namespace drench

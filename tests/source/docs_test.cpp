// Documents: whatever they link to or name is there. Names of tests and decisions too, since a page
// that sends its reader nowhere is worse than none.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace drench {
namespace {

namespace fs = std::filesystem;
const fs::path root = DRENCH_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Of the repository, without what is built in it.
std::vector<fs::path> files_of(const std::string& extension) {
  std::vector<fs::path> files;
  for (auto it = fs::recursive_directory_iterator(root); it != fs::end(it); ++it) {
    const std::string name = it->path().filename().string();
    if (it->is_directory() && (name.starts_with("build") || name.starts_with(".") || name == "out"))
      it.disable_recursion_pending();
    else if (it->path().extension() == extension)
      files.push_back(it->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Outside of code and formulas, in which brackets are no links.
std::string prose(std::string text) {
  for (const char* other : {"```[^`]*```", "`[^`\\n]*`", "\\$\\$[^$]*\\$\\$", "\\$[^$\\n]*\\$"})
    text = std::regex_replace(text, std::regex(other), "");
  return text;
}

std::vector<std::string> matches(const std::string& text, const std::regex& what) {
  std::vector<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), what), end; it != end; ++it)
    found.push_back((*it)[1]);
  return found;
}

/// The anchor of a heading, as GitHub makes it.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading) {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-')
      anchor += char(std::tolower(static_cast<unsigned char>(c)));
    else if (c == ' ')
      anchor += '-';
  }
  return anchor;
}

std::set<std::string> anchors_of(const fs::path& file) {
  static const std::regex heading("(?:^|\\n)#+ ([^\\n]+)");
  std::set<std::string> anchors;
  for (const std::string& text : matches(text_of(file), heading)) anchors.insert(anchor_of(text));
  return anchors;
}

TEST(Docs, LinkToWhatIsThere) {
  static const std::regex link("\\]\\(([^)\\s]+)\\)"), image("src=\"([^\"]+)\"");
  int links = 0;
  for (const fs::path& file : files_of(".md")) {
    const std::string text = prose(text_of(file));
    std::vector<std::string> targets = matches(text, link);
    for (const std::string& source : matches(text, image)) targets.push_back(source);
    for (const std::string& target : targets) {
      if (target.starts_with("http")) continue;
      ++links;
      const size_t mark = target.find('#');
      const std::string path = target.substr(0, mark);
      const fs::path there = path.empty() ? file : file.parent_path() / path;
      ASSERT_TRUE(fs::exists(there)) << file << " links to " << target;
      if (mark == target.npos) continue;
      EXPECT_TRUE(anchors_of(there).contains(target.substr(mark + 1)))
          << file << " links to " << target;
    }
  }
  EXPECT_GT(links, 100);
}

// Sources in backquotes, from the root, from where the page is, or by the end of their path; NAME
// stands for others.
TEST(Docs, NameFilesThatExist) {
  static const std::regex named("`([\\w/.-]+\\.(?:h|cpp|cu|py|md|toml))`");
  // By runs, or by who reads the page.
  const std::set<std::string> made{"shot.lock.toml", "scene.toml",     "rain.toml", "dam.toml",
                                   "dip.toml",       "pour_over.toml", "wring.toml"};
  std::vector<std::string> files;
  for (const char* ending : {".h", ".cpp", ".cu", ".py", ".md", ".toml"})
    for (const fs::path& file : files_of(ending)) files.push_back(file.string());
  int names = 0;
  for (const fs::path& page : files_of(".md"))
    for (const std::string& name : matches(text_of(page), named)) {
      if (name.find("NAME") != name.npos || made.contains(name)) continue;
      ++names;
      EXPECT_TRUE(fs::exists(page.parent_path() / name) ||
                  std::any_of(files.begin(), files.end(),
                              [&](const std::string& file) { return file.ends_with('/' + name); }))
          << page << " names " << name;
    }
  EXPECT_GT(names, 500);
}

/// "Suite.Case" of all tests.
std::set<std::string> test_names() {
  static const std::regex test("TEST(?:_F|_P)?\\(\\s*(\\w+),\\s*(\\w+)\\)");
  std::set<std::string> names;
  for (const char* ending : {".cpp", ".cu", ".h"})
    for (const fs::path& file : files_of(ending)) {
      const std::string text = text_of(file);
      for (std::sregex_iterator it(text.begin(), text.end(), test), end; it != end; ++it)
        names.insert((*it)[1].str() + '.' + (*it)[2].str());
    }
  return names;
}

// `Suite.Case` and `Suite.Ca*` in backquotes, and --gtest_filter='Suite...'.
TEST(Docs, NameTestsThatExist) {
  static const std::regex quoted("`(?:\\w+/)?([A-Z]\\w+\\.(?:[A-Z]\\w*\\*?|\\*))`"),
      filter("gtest_filter='?\\*?([A-Z]\\w+)");
  const std::set<std::string> tests = test_names();
  const auto any = [&](const auto& holds) {
    return std::any_of(tests.begin(), tests.end(), holds);
  };
  int names = 0;
  for (const fs::path& page : files_of(".md")) {
    const std::string text = text_of(page);
    for (const std::string& name : matches(text, quoted)) {
      ++names;
      const std::string start = name.substr(0, name.find('*'));
      EXPECT_TRUE(start == name ? tests.contains(name) : any([&](const std::string& t) {
        return t.starts_with(start);
      })) << page
          << " names the test " << name;
    }
    for (const std::string& part : matches(text, filter))
      EXPECT_TRUE(any([&](const std::string& t) { return t.find(part) != t.npos; }))
          << page << " filters tests by " << part;
  }
  EXPECT_GT(names, 100);
}

}  // namespace
}  // namespace drench

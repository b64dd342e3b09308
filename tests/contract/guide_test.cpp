// The guide's blocks of TOML: whole shots are shots without a warning, parts of shots have keys
// that there are.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/contract/shot/shot_table.h"
#include "pipeline/contract/shot/toml.h"
#include "pipeline/contract/shot/unit_check.h"
#include "pipeline/contract/shot/view_check.h"

namespace drench {
namespace {

namespace fs = std::filesystem;
const fs::path guide = fs::path(DRENCH_SOURCE_DIR) / "docs/guide";

struct Block {
  fs::path page;
  std::string text;
  bool is_shot() const { return text.find("[shot]\nname") != text.npos; }
};

std::vector<Block> blocks() {
  static const std::regex toml("```toml\n([^`]*)```");
  std::vector<Block> found;
  for (const fs::directory_entry& page : fs::directory_iterator(guide)) {
    std::ostringstream text;
    text << std::ifstream(page.path()).rdbuf();
    const std::string whole = text.str();
    for (std::sregex_iterator it(whole.begin(), whole.end(), toml), end; it != end; ++it)
      found.push_back({page.path().filename(), (*it)[1]});
  }
  return found;
}

TEST(Guide, ShotsAreShotsWithoutAWarning) {
  int shots = 0;
  for (const Block& block : blocks()) {
    if (!block.is_shot()) continue;
    ++shots;
    const auto has = [&](const char* part) { return block.text.find(part) != block.text.npos; };
    for (const char* quality : {"final", "preview"}) {
      if (quality == std::string("preview") && !has("[quality.preview")) continue;
      forget_warnings();
      // Where the meshes and pictures are that our own shots name.
      const Shot shot = parse_shot(block.text, fs::path(DRENCH_SOURCE_DIR) / "shots/x.toml",
                                   {.quality = quality});
      warn_of_units(shot);
      if (has("[[light]]")) warn_of_empty_pictures(shot);  // else it is measured alone
      for (const LoggedWarning& warning : logged_warnings())
        ADD_FAILURE() << block.page << ' ' << shot.name << ": " << warning.text;
    }
  }
  forget_warnings();
  EXPECT_GE(shots, 4);
}

/// Keys of a table that a section does not have; tables in it are sections of their own.
void find_unknown(const toml::table& table, const std::string& section,
                  std::vector<std::string>& unknown) {
  for (auto&& [key, node] : table) {
    const std::string name(key.str()), inner = section.empty() ? name : section + "." + name;
    if (shot_table::find_section(inner)) {
      if (const toml::table* one = node.as_table()) find_unknown(*one, inner, unknown);
      if (const toml::array* many = node.as_array())
        for (const toml::node& one : *many)
          if (one.is_table()) find_unknown(*one.as_table(), inner, unknown);
    } else if (!shot_table::find_parameter(section, name)) {
      unknown.push_back(inner);
    }
  }
}

TEST(Guide, PartsHaveKeysThatThereAre) {
  int parts = 0;
  for (const Block& block : blocks()) {
    toml::table table;
    ASSERT_NO_THROW(table = toml::parse(block.text)) << block.page << block.text;
    table.erase("quality");  // shots are tried with theirs above
    const bool has_sections =
        block.text.find('[') == 0 || block.text.find("\n[") != block.text.npos;
    if (!has_sections) continue;  // keys of a section that the text names
    ++parts;
    std::vector<std::string> unknown;
    find_unknown(table, "", unknown);
    EXPECT_TRUE(unknown.empty()) << block.page << ": " << unknown.front() << "\n" << block.text;
  }
  EXPECT_GT(parts, 50);
}

}  // namespace
}  // namespace drench

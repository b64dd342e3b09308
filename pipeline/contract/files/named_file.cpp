#include "pipeline/contract/files/named_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/log.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

fs::path absolute(const fs::path& folder, const std::string& word) {
  // The folder of a shot that is given as a bare name is empty, and nothing has no absolute path.
  return (fs::absolute(folder.empty() ? "." : folder) / fs::path(word)).lexically_normal();
}

/// Of the pattern of a sequence its folder is looked for.
bool leads_somewhere(const fs::path& file) {
  std::error_code code;
  return fs::exists(file, code) || (is_sequence(file) && fs::exists(file.parent_path(), code));
}

}  // namespace

fs::path named_file(const fs::path& folder, const std::string& word) {
  const fs::path file = absolute(folder, word);
  std::error_code code;
  if (word.find('\\') == word.npos || fs::exists(file, code)) return file;
  std::string slashed = word;
  std::replace(slashed.begin(), slashed.end(), '\\', '/');
  const fs::path other = absolute(folder, slashed);
  if (!leads_somewhere(other)) return file;
  log_warning("shot", fmt::format("{}: taken as {}; write paths with slashes", word, slashed));
  return other;
}

std::string hint_on_name(const std::string& word) {
  const bool other_sequence = word.find('#') != word.npos || word.find("$F") != word.npos ||
                              word.find('%') != word.npos || word.find("<UDIM>") != word.npos;
  if (other_sequence) return " (a file for every frame is written with %04d in its name)";
  if (word.find('\\') != word.npos) return " (folders are parted by slashes)";
  return "";
}

}  // namespace drench

// drench verify: every file against the manifest. Reads only, so that it may run beside a run and
// on a folder of someone else.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/printable.h"
#include "pipeline/driver/commands.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/output_folder.h"
#include "pipeline/driver/standard_output.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

struct Findings {
  size_t files = 0;
  std::vector<std::string> bad;         // missing or damaged
  std::vector<std::string> unreadable;  // of which nothing is known
  std::string why_unreadable;           // of the first
  std::vector<std::string> unlisted;
  int damaged_records = 0;
};

bool is_bad(const fs::path& folder, const Record& record, Findings& findings) {
  try {
    return !has_recorded_digest(folder, record);
  } catch (const Error& error) {
    if (findings.unreadable.empty()) findings.why_unreadable = error.what();
    findings.unreadable.push_back(record.file);
    return false;
  }
}

Findings look_at(const fs::path& folder) {
  Findings findings;
  const Manifest manifest(folder / layout::manifest);
  findings.damaged_records = manifest.damaged_lines() - (manifest.is_torn() ? 1 : 0);
  std::vector<std::string> suspects;
  for (const auto& [file, record] : manifest.records()) {
    ++findings.files;
    if (is_bad(folder, record, findings)) suspects.push_back(file);
  }
  try {
    findings.unlisted = unlisted_files(folder, manifest);
  } catch (const Error& error) {
    if (findings.why_unreadable.empty()) findings.why_unreadable = error.what();
  }
  if (suspects.empty()) return findings;
  // A run beside this may have replaced or dropped what looked damaged: its records tell.
  const Manifest now(folder / layout::manifest);
  for (const std::string& file : suspects) {
    const std::optional<Record> record = now.find(file);
    if (record && is_bad(folder, *record, findings)) findings.bad.push_back(file);
  }
  return findings;
}

std::string text_of(const Findings& findings) {
  std::string text;
  for (const std::string& file : findings.bad)
    text += fmt::format("missing or damaged  {}\n", printable(file, Lines::one));
  for (const std::string& file : findings.unreadable)
    text += fmt::format("not readable        {}\n", printable(file, Lines::one));
  for (const std::string& file : findings.unlisted)
    text += fmt::format("not listed          {}\n", printable(file, Lines::one));
  return text +
         fmt::format(
             "{} files, {} missing or damaged{}\n", findings.files, findings.bad.size(),
             findings.damaged_records == 0
                 ? ""
                 : fmt::format(", {} damaged lines of the manifest", findings.damaged_records));
}

}  // namespace

void verify_command(const fs::path& folder, OutputFormat format) {
  if (!fs::exists(folder / layout::manifest)) {
    throw Error(fmt::format("{}: holds no manifest.jsonl; give the output folder of a run",
                            folder.string()));
  }
  const Findings findings = look_at(folder);
  if (format == OutputFormat::json) {
    print(json_line({{"files", findings.files},
                     {"bad", findings.bad},
                     {"unreadable", findings.unreadable},
                     {"unlisted", findings.unlisted},
                     {"damaged_records", findings.damaged_records}}));
  } else {
    print(text_of(findings));
  }
  if (!findings.bad.empty()) {
    throw Error(fmt::format(
        "{}: {} of {} files are missing or damaged, the first is {}; `drench run SHOT --verify` "
        "makes those again that its shot has and goes on without damaged checkpoints",
        folder.string(), findings.bad.size(), findings.files, findings.bad.front()));
  }
  const std::string manifest = (folder / layout::manifest).string();
  if (findings.damaged_records > 0) {
    throw Error(
        fmt::format("{}: {} of its lines are damaged, and what they named was not checked; "
                    "`drench run SHOT` drops them and checks or makes again what they named",
                    manifest, findings.damaged_records));
  }
  if (findings.files == 0 && !findings.unlisted.empty()) {
    throw Error(
        fmt::format("{}: lists none of the {} files here, so that nothing was checked; "
                    "`drench run SHOT` makes them again",
                    manifest, findings.unlisted.size()));
  }
  if (!findings.why_unreadable.empty()) {
    throw Error(fmt::format("{}: {} of {} files could not be checked. {}", folder.string(),
                            findings.unreadable.size(), findings.files, findings.why_unreadable));
  }
}

}  // namespace drench

#pragma once
// Shot files: strict TOML. One table of parameters parses, checks, documents and hashes them all.

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/contract/hash.h"
#include "pipeline/contract/shot/shot.h"

namespace drench {

struct ShotOptions {
  std::string quality = "final";  // applies [quality.NAME]; final is the shot as written
  std::vector<std::string> set;   // "section.key=value", value in TOML
};

/// Reads and checks a shot. Paths inside are relative to the shot's folder.
/// @throws Error naming file, line, key, value, limits and, for an unknown key, the nearest valid
/// one.
Shot read_shot(const std::filesystem::path& file, const ShotOptions& options = {});
/// The same from text; `file` is only named in errors and used to resolve paths.
Shot parse_shot(const std::string& text, const std::filesystem::path& file,
                const ShotOptions& options = {});

/// The resolved shot as TOML, every key of the table present, in the table's order: shot.lock.toml.
/// parse_shot(lock) gives the same shot.
std::string shot_lock(const Shot& shot);

enum class Stage { simulate, mesh, foam, render, denoise };
/// Hash of the settings this stage reads and no others (frames excluded; keys are per frame).
Digest stage_settings_digest(const Shot& shot, Stage stage);

/// The parameter table as Markdown (docs/shots.md), a commented starting shot (`drench init`), and
/// a valid shot of every key with its form, limits and meaning (`drench init --reference`).
/// @throws Error if no shot can have the name.
std::string shot_reference_markdown();
std::string starting_shot(const std::string& name);
std::string reference_shot(const std::string& name);

}  // namespace drench

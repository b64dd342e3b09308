#pragma once
// Files that a shot names.

#include <filesystem>
#include <string>

namespace drench {

/// The file a shot in `folder` means. Names of Windows with a back slash are taken with a slash,
/// with a warning, where the name as it stands leads nowhere.
/// @return absolute; the file need not exist, and may be the pattern of a sequence.
std::filesystem::path named_file(const std::filesystem::path& folder, const std::string& word);

/// What a name that leads nowhere could have meant; empty, or " (...)" to stand behind it.
std::string hint_on_name(const std::string& word);

}  // namespace drench

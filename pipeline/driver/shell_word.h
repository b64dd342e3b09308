#pragma once

#include <string>

namespace drench {

/// A word as a POSIX shell takes it: in quotes where it has to be.
std::string shell_word(const std::string& word);

}  // namespace drench

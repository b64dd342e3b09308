#pragma once
// What building a scene says: its warnings, and why it is refused.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pipeline/contract/error.h"
#include "sim/setup/scene.h"

namespace drench::sim_tests {

inline std::vector<std::string> warnings(const Shot& shot) {
  return sim::warnings_of(sim::build_scene(shot).report);
}

/// The text of the Error that building it throws; empty if it throws none.
inline std::string refusal(const Shot& shot) {
  try {
    sim::build_scene(shot);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

inline void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << word << " in: " << text;
}

}  // namespace drench::sim_tests

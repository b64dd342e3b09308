#pragma once
// What a check warns of in a pool.

#include <gtest/gtest.h>

#include <string>

#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_file.h"

namespace drench::test {

/// Texts of all warnings that a check has of a pool in a tank of 1 m with more of a shot behind it.
inline std::string warned_of_pool(void (*check)(const Shot&), const std::string& more) {
  forget_warnings();
  testing::internal::CaptureStderr();
  const Shot shot = parse_shot(R"(
[domain]
min = [0, 0, 0]
max = [1, 1, 1]
[fluid]
spacing = 0.05
[[fluid.box]]
min = [0, 0, 0]
max = [1, 0.3, 1]
)" + more,
                               "pool.toml");
  check(shot);
  testing::internal::GetCapturedStderr();
  std::string all;
  for (const LoggedWarning& warning : logged_warnings()) all += warning.text + "\n";
  forget_warnings();
  return all;
}

inline bool tells(const std::string& text, const std::string& word) {
  return text.find(word) != std::string::npos;
}

}  // namespace drench::test

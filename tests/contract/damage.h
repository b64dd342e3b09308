#pragma once
// What must notice damage, shown many kinds of it.

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "pipeline/contract/files/files.h"
#include "tests/temporary_folder.h"

namespace drench::test {

/// Expects that `read` names the file for each of `count` copies of `file` beside it, of which
/// every third is cut off somewhere and the others have one bit flipped.
inline void expect_damage_is_noticed(
    const std::filesystem::path& file, int count,
    const std::function<void(const std::filesystem::path&)>& read) {
  const std::string whole = read_text(file);
  const std::filesystem::path copy = file.parent_path() / "damaged.vdb";
  std::mt19937 random(3);
  for (int i = 0; i < count; ++i) {
    std::string damaged = whole;
    if (i % 3 == 0) {
      damaged.resize(random() % whole.size());
    } else {
      damaged[random() % whole.size()] ^= char(1 << random() % 8);
    }
    write_quickly(copy, damaged);
    const std::string text = error_of([&] { read(copy); });
    EXPECT_NE(text.find("damaged.vdb"), std::string::npos) << text;
  }
}

}  // namespace drench::test

// Shots as TOML: what parses is written as a lock and parses to the same lock.

#include <cstdlib>

#include "pipeline/contract/shot/shot_file.h"
#include "tests/fuzz/file_under_test.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace drench;
  static const fuzz::FileUnderTest quiet(".toml");
  return fuzz::expect_errors_only([&] {
    const std::string text(reinterpret_cast<const char*>(bytes), size);
    const std::string lock = shot_lock(parse_shot(text, "fuzz.toml"));
    if (shot_lock(parse_shot(lock, "fuzz.toml")) != lock) std::abort();
  });
}

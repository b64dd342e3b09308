// Manifests: a line that is taken is written as the same line.

#include <cstdlib>

#include "pipeline/driver/manifest.h"
#include "tests/fuzz/file_under_test.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace drench;
  static const fuzz::FileUnderTest file(".jsonl");
  return fuzz::expect_errors_only([&] {
    const Manifest manifest(file.holding(bytes, size));
    for (const auto& [name, record] : manifest.records())
      if (!parse_manifest_line(manifest_line(record))) std::abort();
  });
}

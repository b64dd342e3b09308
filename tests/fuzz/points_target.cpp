// Caches of particles and foam: columns are all of one length.

#include <cstdlib>

#include "pipeline/contract/files/foam_file.h"
#include "pipeline/contract/files/particles_file.h"
#include "tests/fuzz/file_under_test.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace drench;
  static const fuzz::FileUnderTest file(".vdb");
  const std::filesystem::path& path = file.holding(bytes, size);
  fuzz::expect_errors_only([&] {
    const ParticleFrame frame = read_particles(path);
    if (frame.velocity.size() != frame.position.size()) std::abort();
  });
  return fuzz::expect_errors_only([&] {
    const FoamFrame frame = read_foam(path);
    if (frame.velocity.size() != frame.position.size()) std::abort();
  });
}

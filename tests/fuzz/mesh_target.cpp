// Meshes: every corner of what is read is one of its vertices, at a finite place.

#include <cmath>
#include <cstdlib>

#include "pipeline/contract/files/mesh_file.h"
#include "tests/fuzz/file_under_test.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace drench;
  static const fuzz::FileUnderTest file(FUZZ_EXTENSION);
  return fuzz::expect_errors_only([&] {
    const TriangleMesh mesh = read_mesh(file.holding(bytes, size), CornerData::uv_and_normal);
    for (const auto& t : mesh.triangle) {
      for (const uint32_t v : {t.x, t.y, t.z}) {
        if (v >= mesh.position.size()) std::abort();
        const auto& p = mesh.position[v];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) std::abort();
      }
    }
  });
}

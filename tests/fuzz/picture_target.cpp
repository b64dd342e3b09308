// Textures and skies: what is read has a size and samples for all of it.

#include <cstdlib>

#include "render/texture/picture.h"
#include "tests/fuzz/file_under_test.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace drench;
  static const fuzz::FileUnderTest file(FUZZ_EXTENSION);
  return fuzz::expect_errors_only([&] {
    render::PictureMemory memory(4u << 20);
    const render::Raster picture =
        render::read_picture(file.holding(bytes, size), render::PictureUse::colour, memory);
    if (picture.pixels() == 0 ||
        picture.bytes.size() < picture.pixels() * render::bytes_of(picture.sample))
      std::abort();
  });
}

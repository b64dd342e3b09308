// Open Image Denoise: what is said where it is missing, what reaches a library with its interface,
// and, where the real one is installed, how much noise it takes away.

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

#include "render/denoise/oidn.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::error_of;
namespace {

using Plane = NoisyPicture::Plane;

/// Of every plane another value, of every pixel, too.
NoisyPicture numbered(int width, int height) {
  NoisyPicture picture;
  picture.width = width;
  picture.height = height;
  const size_t pixels = size_t(width) * size_t(height);
  const auto plane = [&](float first) {
    Plane out(pixels);
    for (size_t p = 0; p < pixels; ++p) out[p] = first + float(p) / 1024;
    return out;
  };
  for (int c = 0; c < 3; ++c) {
    picture.half[0][c] = plane(float(c + 1));
    picture.half[1][c] = plane(float(c + 3));
  }
  for (int f = 0; f < 7; ++f) picture.feature.push_back(plane(float(f) / 8));
  return picture;
}

TEST(Oidn, SaysWhereItLookedAndWhatToDo) {
  const std::string error = error_of([] { OpenImageDenoise("/nowhere/libOpenImageDenoise.so"); });
  for (const char* part : {"/nowhere/libOpenImageDenoise.so", "LD_LIBRARY_PATH", "regression"})
    EXPECT_NE(error.find(part), std::string::npos) << error;
}

TEST(Oidn, RefusesALibraryThatIsAnother) {
  const std::string error = error_of([] { OpenImageDenoise("libm.so.6"); });
  EXPECT_NE(error.find("oidnNewDevice"), std::string::npos) << error;
}

TEST(Oidn, HandsEveryPlaneToItsPlaceAndReleasesAll) {
  for (const char* file : {OIDN_DOUBLE, OIDN_DOUBLE_1}) {
    void* held = dlopen(file, RTLD_NOW);
    ASSERT_NE(held, nullptr) << dlerror();
    const auto alive = reinterpret_cast<int (*)()>(dlsym(held, "oidn_double_alive"));
    {
      const OpenImageDenoise library(file);
      EXPECT_EQ(library.version(), 20301);
      const NoisyPicture picture = numbered(5, 3);
      const std::vector<Plane> clean = library.denoise(picture);
      ASSERT_EQ(clean.size(), 3u);
      for (size_t c = 0; c < 3; ++c)
        for (size_t p = 0; p < 15; ++p) {
          const float at = float(p) / 1024, albedo = float(c) / 8 + at,
                      normal = float(c + 3) / 8 + at;
          EXPECT_NEAR(clean[c][p], float(c + 2) + at + 10 * albedo + 100 * normal, 1e-4f);
        }
      EXPECT_EQ(alive(), 1);
    }
    EXPECT_EQ(alive(), 0);
    dlclose(held);
  }
}

TEST(Oidn, PassesOnWhatTheLibraryRefuses) {
  const std::string error = error_of([] { OpenImageDenoise(OIDN_DOUBLE).denoise(numbered(1, 4)); });
  EXPECT_NE(error.find("out of memory for one pixel"), std::string::npos) << error;
}

TEST(Oidn, TakesNoiseAwayWhereItIsInstalled) {
  std::unique_ptr<OpenImageDenoise> library;
  try {
    library = std::make_unique<OpenImageDenoise>();
  } catch (const Error& error) {
    GTEST_SKIP() << error.what();
  }
  NoisyPicture picture = numbered(64, 64);
  for (Plane& feature : picture.feature) std::fill(feature.begin(), feature.end(), 0.5f);
  std::mt19937 random(1);
  std::normal_distribution<float> scatter(1, 0.2f);
  for (auto& half : picture.half)
    for (Plane& plane : half)
      for (float& value : plane) value = scatter(random);
  double squares = 0;
  for (const Plane& plane : library->denoise(picture))
    for (const float value : plane) squares += (value - 1) * (value - 1) / (3 * 64 * 64.);
  EXPECT_LT(squares, 0.2 * 0.2 / 2 / 20);
}

}  // namespace
}  // namespace drench::render::test

#include "pipeline/driver/contact_sheet.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <set>

#include "pipeline/contract/error.h"
#include "pipeline/driver/movie.h"
#include "render/display/view_transform.h"
#include "tests/driver/folder.h"

namespace drench {
namespace {

using test::TemporaryFolder;

render::Film flat(int width, int height, float value) {
  render::Film film{width, height, std::vector<float>(4 * size_t(width) * height, value)};
  for (size_t k = 3; k < film.rgba.size(); k += 4) film.rgba[k] = 1;
  return film;
}

std::vector<NumberedImage> frames_in(const std::filesystem::path& folder, int count, int width,
                                     int height) {
  std::vector<NumberedImage> images;
  for (int k = 0; k < count; ++k) {
    const std::filesystem::path file = folder / (std::to_string(k) + ".exr");
    render::write_exr(file, flat(width, height, 0.02f * float(k + 1)), {});
    images.push_back({1001 + k, file});
  }
  return images;
}

// A flat frame stays flat when averaged: outside its number a thumbnail has the one colour that the
// view transform gives for it.
TEST(ContactSheet, ShowsEachFramesOwnColour) {
  const TemporaryFolder folder;
  const int width = 240, height = 135;
  const auto images = frames_in(folder.path(), 6, width, height);
  const Picture sheet = contact_sheet(images);
  std::set<int> seen;
  for (size_t k = 3 * size_t(sheet.width) * 100; k + 3 <= sheet.rgb.size(); k += 3) {
    seen.insert(sheet.rgb[k]);
  }
  for (int k = 0; k < 6; ++k) {
    const uint8_t expected = render::ViewTransform()(flat(1, 1, 0.02f * float(k + 1)))[0];
    bool found = false;  // half floats of the file: a level of 8-bit rounding
    for (int level = expected - 1; level <= expected + 1; ++level) found |= seen.contains(level);
    EXPECT_TRUE(found) << k;
  }
}

TEST(ContactSheet, HasRoomForEveryFrameUpToItsLimit) {
  const TemporaryFolder folder;
  for (const int count : {1, 2, 5, 7}) {
    const Picture sheet = contact_sheet(frames_in(folder.path(), count, 32, 18));
    const int columns = (sheet.width - 4) / (32 + 4), rows = (sheet.height - 4) / (18 + 4);
    EXPECT_GE(columns * rows, count);
    EXPECT_LT((rows - 1) * columns, count) << "an empty row";
    EXPECT_EQ(sheet.rgb.size(), 3 * size_t(sheet.width) * sheet.height);
  }
}

// The font's only oracle is that a reader can tell its characters apart.
TEST(ContactSheet, DrawsEveryCharacterDifferently) {
  std::set<std::string> pictures;  // as strings: g++ 12 warns about vectors of bytes
  for (const char c : std::string("0123456789-")) {
    Picture picture{12, 12, std::vector<uint8_t>(3 * 144, 100)};
    draw_number(picture, 2, 2, 1, std::string(1, c));
    pictures.insert(std::string(picture.rgb.begin(), picture.rgb.end()));
  }
  EXPECT_EQ(pictures.size(), 11u);
}

TEST(ContactSheet, CutsNumbersOffAtTheEdge) {
  Picture picture{8, 8, std::vector<uint8_t>(3 * 64, 0)};
  draw_number(picture, -3, -3, 2, "1001");
  draw_number(picture, 6, 6, 3, "-42");
  EXPECT_EQ(picture.rgb.size(), 3 * 64u);
}

TEST(ContactSheet, NamesAFrameThatCannotBeRead) {
  const TemporaryFolder folder;
  auto images = frames_in(folder.path(), 2, 32, 18);
  test::put_text(images[1].file, "not an image");
  EXPECT_THROW(contact_sheet(images), Error);
}

/// What ffprobe says about the video stream: "width,height,frames".
std::string probed(const std::filesystem::path& file) {
  const std::string command =
      "ffprobe -v error -count_frames -select_streams v -show_entries "
      "stream=width,height,nb_read_frames -of csv=p=0 '" +
      file.string() + "'";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  char text[64]{};
  return pipe && std::fgets(text, sizeof text, pipe.get()) ? text : "";
}

// 4:2:0 has no odd sizes: 33 x 19 becomes 32 x 18. A second movie has the same bytes.
TEST(Movie, HoldsEveryFrameAndIsReproducible) {
  if (!find_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const TemporaryFolder folder;
  const auto images = frames_in(folder.path(), 9, 33, 19);
  const WrittenFile first = write_movie(folder.path() / "a.mp4", images, 24, {});
  const WrittenFile second = write_movie(folder.path() / "b.mp4", images, 24, {});
  EXPECT_EQ(first.digest, second.digest);
  EXPECT_EQ(probed(first.path), "32,18,9\n");
}

TEST(Movie, LeavesNothingBehindWhenStopped) {
  if (!find_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const TemporaryFolder folder;
  const auto images = frames_in(folder.path(), 3, 32, 18);
  EXPECT_THROW(write_movie(folder.path() / "out/a.mp4", images, 24, [] { return false; }), Stopped);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "out"));
}

TEST(Movie, RefusesFramesOfDifferentSizes) {
  if (!find_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const TemporaryFolder folder;
  auto images = frames_in(folder.path(), 2, 32, 18);
  render::write_exr(images[1].file, flat(34, 18, 0.1f), {});
  EXPECT_THROW(write_movie(folder.path() / "a.mp4", images, 24, {}), Error);
}

}  // namespace
}  // namespace drench

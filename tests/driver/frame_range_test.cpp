#include "pipeline/driver/frame_range.h"

#include <gtest/gtest.h>

#include "pipeline/contract/error.h"

namespace drench {
namespace {

const Timeline film{1001, 1010, 24};
const Timeline around_zero{-5, 5, 24};
using Frames = std::vector<int>;

TEST(FrameRange, ReadsEveryForm) {
  EXPECT_EQ(parse_frames("1003", film), (Frames{1003}));
  EXPECT_EQ(parse_frames("1001-1003", film), (Frames{1001, 1002, 1003}));
  EXPECT_EQ(parse_frames("1001-1006x2", film), (Frames{1001, 1003, 1005}));
  EXPECT_EQ(parse_frames("1002x4", film), (Frames{1002, 1006, 1010}));
  EXPECT_EQ(parse_frames("1009, 1001-1003,1002", film), (Frames{1001, 1002, 1003, 1009}));
}

TEST(FrameRange, TakesSignsAsPartOfNumbers) {
  EXPECT_EQ(parse_frames("-5--3", around_zero), (Frames{-5, -4, -3}));
  EXPECT_EQ(parse_frames("-1-1", around_zero), (Frames{-1, 0, 1}));
}

TEST(FrameRange, AllowsFramesAfterTheShotsLast) {
  EXPECT_EQ(parse_frames("1010-1012", film), (Frames{1010, 1011, 1012}));
}

TEST(FrameRange, RefusesWhatIsNoRange) {
  for (const char* text : {"", ",", "1001,", "a", "1001-", "1001-b", "1001-1003x", "1001-1003x0",
                           "1001-1003x-1", "1001 - 1003", "1003-1001", "1000-1003", "99999999999",
                           "1001-1003y2", "1001--1", "0x10", "1001-2147483647"}) {
    EXPECT_THROW(parse_frames(text, film), Error) << text;
  }
}

// The largest int as last frame must neither overflow nor run for ever.
TEST(FrameRange, ReachesTheLargestIntWithoutOverflow) {
  EXPECT_EQ(parse_frames("2147483646-2147483647", film), (Frames{2147483646, 2147483647}));
  EXPECT_EQ(parse_frames("1001-2147483647x2147482646", film), (Frames{1001, 2147483647}));
}

TEST(FrameRange, NamesTheItemInItsError) {
  try {
    parse_frames("1001-1003,1009-1005", film);
    FAIL() << "a backwards range was taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("1009-1005"), std::string::npos) << error.what();
  }
}

// What format_frames writes, parse_frames reads back: every subset of ten frames.
TEST(FrameRange, WritesWhatItReads) {
  for (unsigned subset = 1; subset < 1024; ++subset) {
    Frames frames;
    for (int k = 0; k < 10; ++k) {
      if (subset >> k & 1) frames.push_back(1001 + k);
    }
    EXPECT_EQ(parse_frames(format_frames(frames), film), frames) << format_frames(frames);
  }
}

TEST(FrameRange, WritesTheShortForms) {
  EXPECT_EQ(format_frames(all_frames(film)), "1001-1010");
  EXPECT_EQ(format_frames({1001, 1003, 1005}), "1001-1005x2");
  EXPECT_EQ(format_frames({1001, 1009}), "1001, 1009");
  EXPECT_EQ(format_frames({}), "");
}

}  // namespace
}  // namespace drench

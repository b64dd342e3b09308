#include "pipeline/contract/log.h"

#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace drench {
namespace {

class Warnings : public ::testing::Test {
 protected:
  Warnings() { forget_warnings(); }
  ~Warnings() override {
    set_on_warning(OnWarning::go_on);
    forget_warnings();
  }
};

TEST_F(Warnings, AreWrittenOnceACauseAndCounted) {
  testing::internal::CaptureStderr();
  log_warning("sim", "frame 1: cut short", "cut short");
  log_warning("mesh", "a.obj: 3 faces left out");
  log_warning("sim", "frame 2: cut short", "cut short");
  log_warning("mesh", "a.obj: 3 faces left out");
  log_warning("mesh", "b.obj: 3 faces left out");
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_NE(text.find("sim warning: frame 1: cut short\n"), std::string::npos) << text;
  EXPECT_EQ(text.find("frame 2"), std::string::npos) << text;
  const std::vector<LoggedWarning> all = logged_warnings();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].text, "frame 1: cut short");
  EXPECT_EQ(all[0].times, 2u);
  EXPECT_EQ(all[1].times, 2u);
  EXPECT_EQ(all[2].times, 1u);
}

TEST_F(Warnings, AreErrorsOnRequest) {
  set_on_warning(OnWarning::fail);
  EXPECT_EQ(test::error_of([] { log_warning("mesh", "a.obj: 3 faces left out"); }),
            "a.obj: 3 faces left out");
}

// The frames of a sequence share a cause, other files do not.
TEST_F(Warnings, OfASequenceAreOne) {
  testing::internal::CaptureStderr();
  log_file_warning("mesh", "a/wave.0009.obj", "9 faces left out");
  log_file_warning("mesh", "a/wave.0010.obj", "12 faces left out");
  log_file_warning("mesh", "a/wave.0010.obj", "12 corners left out");
  log_file_warning("mesh", "b/wave.0010.obj", "12 faces left out");
  testing::internal::GetCapturedStderr();
  const std::vector<LoggedWarning> warnings = logged_warnings();
  ASSERT_EQ(warnings.size(), 3u);
  EXPECT_EQ(warnings[0].times, 2u);
  EXPECT_EQ(warnings[0].text, "a/wave.0009.obj: 9 faces left out");
}

}  // namespace
}  // namespace drench

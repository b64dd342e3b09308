// A build without OpenColorIO says so when it is asked for.

#include <gtest/gtest.h>

#include "pipeline/contract/error.h"
#include "render/display/view_transform.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::error_of;
namespace {

TEST(OcioView, SaysWhatToInstall) {
  const std::string error = error_of([] { ViewTransform({"", "Monitor", ""}); });
  EXPECT_NE(error.find("libopencolorio-dev"), std::string::npos);
  EXPECT_EQ(ViewTransform(ViewSettings{}).key(), "");
}

}  // namespace
}  // namespace drench::render::test

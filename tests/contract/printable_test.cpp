#include "pipeline/contract/shot/printable.h"

#include <gtest/gtest.h>

namespace drench {
namespace {

TEST(Printable, LeavesTextAloneAndEscapesWhatSteersATerminal) {
  for (const std::string text : {"", "plain", "Größe 5 µm, 水, 🌊", "a\tb", "\\x1b"})
    EXPECT_EQ(printable(text, Lines::one), text);
  EXPECT_EQ(printable("\x1b[31mred", Lines::one), "\\x1b[31mred");
  EXPECT_EQ(printable("a\nb", Lines::many), "a\nb");
  EXPECT_EQ(printable("a\nb", Lines::one), "a\\x0ab");
  EXPECT_EQ(printable("\r\b\x7f", Lines::many), "\\x0d\\x08\\x7f");
  EXPECT_EQ(printable(std::string_view("\0", 1), Lines::many), "\\x00");
  EXPECT_EQ(printable("\xc2\x9b", Lines::one), "\\xc2\\x9b");           // CSI of C1
  EXPECT_EQ(printable("\xe2\x80\xae", Lines::one), "\\xe2\\x80\\xae");  // right-to-left override
  EXPECT_EQ(printable("a\xff\xfe", Lines::one), "a\\xff\\xfe");
}

// Table 3-7 of the Unicode standard, its borders.
TEST(Printable, KnowsUtf8) {
  for (const char* text : {"\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xee\x80\x80",
                           "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf"})
    EXPECT_TRUE(is_utf8(text)) << text;
  for (const char* text :
       {"\x80", "\xc0\x80", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf",
        "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xe2\x80", "\xc3", "\xff", "a\xe2z"}) {
    EXPECT_FALSE(is_utf8(text)) << text;
    EXPECT_EQ(printable(text, Lines::one).find_first_of("\x80\xc0\xff"), std::string::npos);
  }
}

}  // namespace
}  // namespace drench

#include "core/io/print_error.h"

#include <gtest/gtest.h>

namespace groundray::print_error_test {
namespace {

TEST(Printable, ControlCharactersAndBrokenUtf8AreEscaped) {
  EXPECT_EQ(printable("a\tb\nmüde \u20ac \U0001f600 °"), "a\tb\nmüde \u20ac \U0001f600 °");
  EXPECT_EQ(printable("\x1b[2J\r\a\b\x7f"), "\\x1b[2J\\x0d\\x07\\x08\\x7f");
  EXPECT_EQ(printable(std::string_view("\0x", 2)), "\\x00x");
  EXPECT_EQ(printable("\x9b"
                      "31m"),
            "\\x9b31m");  // CSI in Latin-1
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\xc2\\x9b31m");                      // and in UTF-8
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b");  // overlong
  EXPECT_EQ(printable("\xe0\x80\x9b"), "\\xe0\\x80\\x9b");
  EXPECT_EQ(printable("\xf0\x80\x80\x9b"), "\\xf0\\x80\\x80\\x9b");
  EXPECT_EQ(printable("\xe2\x82"), "\\xe2\\x82");  // truncated
  EXPECT_EQ(printable("\xff"), "\\xff");
}

TEST(Printable, NothingThatATerminalObeysIsLeft) {
  for (int first = 0; first < 256; ++first) {
    for (int second = 0; second < 256; ++second) {
      const std::string text{static_cast<char>(first), static_cast<char>(second), 'x'};
      const std::string shown = printable(text);
      for (std::size_t i = 0; i < shown.size(); ++i) {
        const auto byte = static_cast<unsigned char>(shown[i]);
        EXPECT_TRUE(byte >= ' ' || byte == '\n' || byte == '\t') << first << ' ' << second;
        EXPECT_NE(byte, 0x7f);
        if (byte < 0x80) continue;
        // What is left of the other half of Latin-1 are pairs that are letters in UTF-8.
        ASSERT_LT(i + 1, shown.size());
        const auto next = static_cast<unsigned char>(shown[++i]);
        EXPECT_TRUE(byte >= 0xc2 && byte < 0xe0 && (next & 0xc0) == 0x80);
        EXPECT_FALSE(byte == 0xc2 && next < 0xa0);
      }
    }
  }
}

}  // namespace
}  // namespace groundray::print_error_test

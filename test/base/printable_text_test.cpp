#include "base/printable_text.h"

#include <gtest/gtest.h>

#include <string>

namespace walker {
namespace {

TEST(PrintableText, KeepsValidText) {
  for (const std::string text : {"", "plain", "a \\ b", "\xC3\xA9", "\xE2\x82\xAC 5",
                                 "\xF0\x9F\x90\xBE", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(printable(text), text);
    EXPECT_EQ(to_utf8(text), text);
    EXPECT_TRUE(is_utf8(text));
  }
}

TEST(PrintableText, EscapesControlCharacters) {
  EXPECT_EQ(printable("a\nb\r\t\x1b[31m\x7f"), "a\\nb\\x0d\\t\\x1b[31m\\x7f");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "\\xc2\\x9b31m");  // U+009B (CSI) is equivalent to ESC [
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(to_utf8("a\nb\x1b"), "a\nb\x1b");
  EXPECT_EQ(to_utf8(std::string("a\0b", 3)), "a\\x00b");
}

TEST(PrintableText, EscapesInvalidUtf8) {
  const std::pair<std::string, std::string> cases[] = {
      {"\xFF", "\\xff"},
      {"a\x80z", "a\\x80z"},
      {"\xC3", "\\xc3"},                             // truncated
      {"\xE2\x82", "\\xe2\\x82"},                    // truncated
      {"\xC0\xAF", "\\xc0\\xaf"},                    // overlong
      {"\xE0\x80\xAF", "\\xe0\\x80\\xaf"},           // overlong
      {"\xF0\x80\x80\xAF", "\\xf0\\x80\\x80\\xaf"},  // overlong
      {"\xED\xA0\x80", "\\xed\\xa0\\x80"},           // UTF-16 surrogate
      {"\xF4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"},  // above U+10FFFF
      {"\xF5\x80\x80\x80", "\\xf5\\x80\\x80\\x80"},
      {"\xC3(\xC3\xA9", "\\xc3(\xC3\xA9"},
  };
  for (const auto& [bytes, text] : cases) {
    EXPECT_EQ(printable(bytes), text);
    EXPECT_EQ(to_utf8(bytes), text);
    EXPECT_FALSE(is_utf8(bytes));
  }
}

TEST(PrintableText, TruncatesTheMiddle) {
  EXPECT_EQ(printable("0123456789", 10), "0123456789");
  EXPECT_EQ(printable("01234567890", 10), "01234 [... 1 bytes left out ...] 67890");
  const std::string huge(1 << 20, 'x');
  EXPECT_LT(printable("begin" + huge + "end").size(), 1100U);
  EXPECT_EQ(printable("begin" + huge + "end").rfind("beginxxx", 0), 0U);
  // Shortening keeps characters whole.
  EXPECT_EQ(printable("\xE2\x82\xAC\xE2\x82\xAC\xE2\x82\xAC", 8),
            "\xE2\x82\xAC [... 3 bytes left out ...] \xE2\x82\xAC");
  EXPECT_EQ(to_utf8(huge), huge);
}

}  // namespace
}  // namespace walker

// Connection headers: round trip and malformed input.
#include "wire/tcpros.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "error_message.h"

namespace walker::tcpros {
namespace {

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

std::string refusal(const std::string& header) {
  const Bytes bytes = bytes_of(header);
  return message_of<std::runtime_error>([&] { parse_header(bytes.data(), bytes.size()); });
}

const std::string kField("\x03\0\0\0a=b", 7);

TEST(ConnectionHeader, IsWrittenInRosFormat) {
  Bytes bytes = bytes_of("before");
  append_header({{"a", "b"}, {"long", ""}}, bytes);
  EXPECT_EQ(bytes, bytes_of("before" + std::string("\x10\0\0\0", 4) + kField +
                            std::string("\x05\0\0\0long=", 9)));
}

TEST(ConnectionHeader, IsReadBack) {
  const Fields fields{{"service", "/a/b"}, {"md5sum", "*"}, {"empty", ""}, {"equation", "x=y=z"}};
  Bytes bytes;
  append_header(fields, bytes);
  ASSERT_EQ(load_length(bytes.data()), bytes.size() - kLengthBytes);
  EXPECT_EQ(parse_header(bytes.data() + kLengthBytes, bytes.size() - kLengthBytes), fields);
}

TEST(ConnectionHeader, MayBeEmpty) { EXPECT_TRUE(parse_header(nullptr, 0).empty()); }

TEST(ConnectionHeader, RejectsMalformedFields) {
  EXPECT_EQ(refusal(kField), "nothing thrown");
  EXPECT_EQ(refusal(kField.substr(0, 6)), "connection header: a field is longer than the header");
  EXPECT_EQ(refusal(kField.substr(0, 3)), "connection header: a field is longer than the header");
  EXPECT_EQ(refusal("\xff\xff\xff\xff" + kField),
            "connection header: a field is longer than the header");
  EXPECT_EQ(refusal(std::string("\x03\0\0\0abc", 7)),
            "connection header: a field is not of the form name=value");
  EXPECT_EQ(refusal(std::string("\x02\0\0\0=b", 6)),
            "connection header: a field is not of the form name=value");
  EXPECT_EQ(refusal(kField + kField), "connection header: a comes twice");
}

}  // namespace
}  // namespace walker::tcpros

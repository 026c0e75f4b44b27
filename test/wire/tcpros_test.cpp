// Serialized messages and connection headers: round trip, malformed and truncated input.
#include "wire/tcpros.h"

#include <gtest/gtest.h>

#include "error_message.h"

namespace walker::tcpros {
namespace {

MessageReader reader_of(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), "the message"};
}

template <typename Read>
std::string refusal(const std::string& bytes, const Read& read) {
  MessageReader reader = reader_of(bytes);
  return message_of<std::runtime_error>([&] { read(reader); });
}

const std::string kText("\x03\0\0\0abc", 7);
const std::string kNumbers("\x02\0\0\0\x01\0\x02\0", 8);
constexpr const char* kEnds = "the message ends within a field";

TEST(MessageReader, ReadsFieldsInOrder) {
  const std::string bytes = kText + kNumbers + "\xff";
  MessageReader reader = reader_of(bytes);
  EXPECT_EQ(reader.text(), "abc");
  std::vector<std::uint16_t> numbers;
  reader.read_array(numbers);
  EXPECT_EQ(numbers, (std::vector<std::uint16_t>{1, 2}));
  EXPECT_EQ(reader.size(), 1U);
  EXPECT_EQ(message_of<std::runtime_error>([&] { reader.finish(); }),
            "the message is longer than its type");
  EXPECT_EQ(reader.number<std::int8_t>(), -1);
  reader.finish();
}

TEST(MessageReader, RejectsTruncatedFields) {
  const auto text = [](MessageReader& reader) { reader.text(); };
  const auto numbers = [](MessageReader& reader) {
    std::vector<std::uint16_t> values;
    reader.read_array(values);
  };
  EXPECT_EQ(refusal(kText, text), "nothing thrown");
  EXPECT_EQ(refusal(kNumbers, numbers), "nothing thrown");
  for (std::size_t size = 0; size < kText.size(); ++size) {
    const std::string bytes = kText.substr(0, size);
    EXPECT_EQ(refusal(bytes, text), kEnds) << size;
    MessageReader reader = reader_of(bytes);
    EXPECT_FALSE(reader.try_text()) << size;
    EXPECT_EQ(reader.size(), size) << "it has not advanced";
  }
  for (std::size_t size = 0; size < kNumbers.size(); ++size) {
    EXPECT_EQ(refusal(kNumbers.substr(0, size), numbers), kEnds) << size;
  }
}

TEST(MessageReader, ChecksCounts) {
  const std::string bytes("\xff\xff\xff\xff\x01\0\x02\0", 8);
  std::vector<std::uint16_t> values{7};
  EXPECT_EQ(refusal(bytes, [&](MessageReader& reader) { reader.read_array(values); }), kEnds);
  EXPECT_EQ(values, std::vector<std::uint16_t>{7});
  EXPECT_EQ(refusal(bytes, [](MessageReader& reader) { reader.count(1); }), kEnds);
}

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

// Values of the parameter with the reserved time, as servers and other programs write them.
#include "server/time/reserved_until.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>
#include <string>

#include "error_message.h"

namespace walker {
namespace {

constexpr std::uint64_t kSecond = 1'000'000'000;

xml_rpc::Value parsed(const std::string& xml) {
  return xml_rpc::parse_answer("<?xml version=\"1.0\"?><methodResponse><params><param>" + xml +
                               "</param></params></methodResponse>");
}

std::string pair(const std::string& one, const std::string& other) {
  return "<value><array><data><value>" + one + "</value><value>" + other +
         "</value></data></array></value>";
}

std::string refusal(const std::string& xml) {
  return message_of<std::invalid_argument>([&] { read_reserved_until(parsed(xml)); });
}

TEST(ReservedUntil, IsReadAsItWasWritten) {
  for (const std::uint64_t time :
       {std::uint64_t{0}, std::uint64_t{1}, kSecond - 1, 17 * kSecond + 20'000'000,
        2147483647 * kSecond + 5, 2147483648 * kSecond, 4294967295 * kSecond + kSecond - 1}) {
    EXPECT_EQ(read_reserved_until(parsed(to_reserved_until(time))), time);
  }
}

/// `rosparam set` and launch files write these types.
TEST(ReservedUntil, IsReadAsAPersonWritesIt) {
  EXPECT_EQ(read_reserved_until(parsed(pair("<int>3</int>", "<int>4</int>"))), 3 * kSecond + 4);
  EXPECT_EQ(read_reserved_until(parsed(pair("<double>3.0</double>", "<i4>0</i4>"))), 3 * kSecond);
  EXPECT_EQ(read_reserved_until(parsed(pair("<string>3.0e0</string>", "4e0"))), 3 * kSecond + 4);
}

TEST(ReservedUntil, WhatIsNoTimeIsRefusedWithItsNameValueAndWhatIsAllowed) {
  const std::string begin = "parameter /walker_sim_clock/reserved_until = ";
  const std::string rule =
      ": must be [seconds, nanoseconds], whole numbers from 0 to 4294967295 and from 0 to "
      "999999999, as a server writes it; without it time begins at 0: rosparam delete "
      "/walker_sim_clock/reserved_until";
  EXPECT_EQ(refusal("<value><string>soon</string></value>"), begin + "\"soon\"" + rule);
  EXPECT_EQ(refusal("<value>" + std::string(200, 'x') + "</value>"),
            begin + "\"" + std::string(60, 'x') + "...\"" + rule);
  EXPECT_EQ(refusal("<value><int>5</int></value>"), begin + "5" + rule);
  EXPECT_EQ(refusal("<value><boolean>1</boolean></value>"), begin + "1" + rule);
  EXPECT_EQ(refusal("<value><array><data></data></array></value>"), begin + "[]" + rule);
  EXPECT_EQ(refusal("<value><struct><member><name>s</name><value><i4>1</i4></value></member>"
                    "</struct></value>"),
            begin + "{1}" + rule);
  EXPECT_EQ(refusal("<value><array><data><value><i4>5</i4></value></data></array></value>"),
            begin + "[5]" + rule);
  const struct {
    const char *one, *other, *text;
  } cases[] = {
      {"<i4>-1</i4>", "<i4>0</i4>", "[-1, 0]"},
      {"<i4>5</i4>", "<i4>-1</i4>", "[5, -1]"},
      {"<i4>5</i4>", "<i4>1000000000</i4>", "[5, 1000000000]"},
      {"<i8>4294967296</i8>", "<i4>0</i4>", "[4294967296, 0]"},
      {"<i8>9223372036854775807</i8>", "<i4>0</i4>", "[9223372036854775807, 0]"},
      {"<double>nan</double>", "<i4>0</i4>", "[nan, 0]"},
      {"<double>inf</double>", "<i4>0</i4>", "[inf, 0]"},
      {"<double>-0.5</double>", "<i4>0</i4>", "[-0.5, 0]"},
      {"<double>1e300</double>", "<i4>0</i4>", "[1e300, 0]"},
      {"<double>2.5</double>", "<i4>0</i4>", "[2.5, 0]"},
      {"<double>soon</double>", "<i4>0</i4>", "[soon, 0]"},
      {"<boolean>1</boolean>", "<i4>0</i4>", "[1, 0]"},
      {"<string>5 s</string>", "<i4>0</i4>", "[\"5 s\", 0]"},
      {"<string>2.5e0</string>", "<i4>0</i4>", "[\"2.5e0\", 0]"},
  };
  for (const auto& one : cases) {
    std::string expected = begin;
    expected += one.text;
    expected += rule;
    EXPECT_EQ(refusal(pair(one.one, one.other)), expected);
  }
}

}  // namespace
}  // namespace walker

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

TEST(ReservedUntil, SurvivesARoundTrip) {
  for (const std::uint64_t time :
       {std::uint64_t{0}, std::uint64_t{1}, kSecond - 1, 17 * kSecond + 20'000'000,
        2147483647 * kSecond + 5, 2147483648 * kSecond, 4294967295 * kSecond + kSecond - 1}) {
    EXPECT_EQ(read_reserved_until(parsed(to_reserved_until(time))), time);
  }
}

TEST(ReservedUntil, AcceptsTheTypesOfRosparamAndLaunchFiles) {
  EXPECT_EQ(read_reserved_until(parsed(pair("<int>3</int>", "<int>4</int>"))), 3 * kSecond + 4);
  EXPECT_EQ(read_reserved_until(parsed(pair("<double>3.0</double>", "<i4>0</i4>"))), 3 * kSecond);
  EXPECT_EQ(read_reserved_until(parsed(pair("<string>3.0e0</string>", "4e0"))), 3 * kSecond + 4);
}

TEST(ReservedUntil, RejectsOtherValues) {
  const struct {
    std::string xml, text;
  } cases[] = {
      {"<value><string>soon</string></value>", "\"soon\""},
      {"<value>" + std::string(200, 'x') + "</value>", "\"" + std::string(60, 'x') + "...\""},
      {"<value><int>5</int></value>", "5"},
      {"<value><boolean>1</boolean></value>", "1"},
      {"<value><array><data></data></array></value>", "[]"},
      {"<value><struct><member><name>s</name><value><i4>1</i4></value></member></struct></value>",
       "{1}"},
      {"<value><array><data><value><i4>5</i4></value></data></array></value>", "[5]"},
      {"<value><array><data><value>1</value><value>2</value><value>3</value><value>4</value>"
       "<value>5</value><value>6</value></data></array></value>",
       R"(["1", "2", "3", "4", ...])"},
      {pair("<i4>-1</i4>", "<i4>0</i4>"), "[-1, 0]"},
      {pair("<i4>5</i4>", "<i4>-1</i4>"), "[5, -1]"},
      {pair("<i4>5</i4>", "<i4>1000000000</i4>"), "[5, 1000000000]"},
      {pair("<i8>4294967296</i8>", "<i4>0</i4>"), "[4294967296, 0]"},
      {pair("<i8>9223372036854775807</i8>", "<i4>0</i4>"), "[9223372036854775807, 0]"},
      {pair("<double>nan</double>", "<i4>0</i4>"), "[nan, 0]"},
      {pair("<double>inf</double>", "<i4>0</i4>"), "[inf, 0]"},
      {pair("<double>-0.5</double>", "<i4>0</i4>"), "[-0.5, 0]"},
      {pair("<double>1e300</double>", "<i4>0</i4>"), "[1e300, 0]"},
      {pair("<double>2.5</double>", "<i4>0</i4>"), "[2.5, 0]"},
      {pair("<double>soon</double>", "<i4>0</i4>"), "[soon, 0]"},
      {pair("<boolean>1</boolean>", "<i4>0</i4>"), "[1, 0]"},
      {pair("<string>5 s</string>", "<i4>0</i4>"), R"(["5 s", 0])"},
      {pair("<string>2.5e0</string>", "<i4>0</i4>"), R"(["2.5e0", 0])"},
  };
  for (const auto& [xml, text] : cases) {
    EXPECT_EQ(message_of<std::invalid_argument>([&xml = xml] { read_reserved_until(parsed(xml)); }),
              "parameter /walker_sim_clock/reserved_until = " + text +
                  ": must be [seconds, nanoseconds], integers in [0, 4294967295] and [0, "
                  "999999999]; a server writes it. To restart time at 0: rosparam delete "
                  "/walker_sim_clock/reserved_until");
  }
}

}  // namespace
}  // namespace walker

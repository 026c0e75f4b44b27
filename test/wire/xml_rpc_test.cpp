// XML-RPC: masters' answers and malformed input.
#include "wire/xml_rpc.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "error_message.h"

namespace walker::xml_rpc {
namespace {

using Kind = Value::Kind;

std::string answer(const std::string& value) {
  return "<?xml version='1.0'?>\n<methodResponse>\n<params>\n<param>\n" + value +
         "\n</param>\n</params>\n</methodResponse>\n";
}

std::string refusal(const std::string& xml) {
  return message_of<std::runtime_error>([&] { parse_answer(xml); });
}

TEST(XmlRpc, EscapesTheArgumentsOfACall) {
  EXPECT_EQ(make_call("lookupService", {"/me", "a<b>&\"c'"}),
            "<?xml version=\"1.0\"?>\n<methodCall><methodName>lookupService</methodName><params>"
            "<param><value><string>/me</string></value></param>"
            "<param><value><string>a&lt;b&gt;&amp;&quot;c&apos;</string></value></param>"
            "</params></methodCall>\n");
}

TEST(XmlRpc, ReadsValuesOfAllTypes) {
  const Value value = parse_answer(
      answer("<value><array><data><value><int>-3</int></value><value><i4>7</i4></value>"
             "<value><boolean>1</boolean></value><value><double>0.5</double></value>"
             "<value><string>a &lt;b&gt; &amp;</string></value><value> bare </value>"
             "<value></value><value><string/></value><value><string></string></value>"
             "<value><array><data/></array></value>"
             "<value><array><data></data></array></value></data></array></value>"));
  ASSERT_EQ(value.kind, Kind::array);
  ASSERT_EQ(value.elements.size(), 11U);
  EXPECT_EQ(value.elements[0].kind, Kind::integer);
  EXPECT_EQ(value.elements[0].integer, -3);
  EXPECT_EQ(value.elements[1].integer, 7);
  EXPECT_EQ(value.elements[2].kind, Kind::boolean);
  EXPECT_EQ(value.elements[2].text, "1");
  EXPECT_EQ(value.elements[3].kind, Kind::floating);
  EXPECT_EQ(value.elements[3].text, "0.5");
  EXPECT_EQ(value.elements[4].text, "a <b> &");
  EXPECT_EQ(value.elements[5].text, " bare ");
  for (std::size_t i = 6; i < 9; ++i) {
    EXPECT_EQ(value.elements[i].kind, Kind::text);
    EXPECT_EQ(value.elements[i].text, "");
  }
  EXPECT_TRUE(value.elements[9].elements.empty());
  EXPECT_EQ(value.elements[10].kind, Kind::array);
}

TEST(XmlRpc, ReadsTheMembersOfAStructure) {
  const Value value = parse_answer(
      answer("<value><struct><member><name>a</name><value><int>1</int></value></member>"
             "<member><name>b</name><value>two</value></member></struct></value>"));
  ASSERT_EQ(value.kind, Kind::structure);
  ASSERT_EQ(value.elements.size(), 2U);
  EXPECT_EQ(value.elements[0].integer, 1);
  EXPECT_EQ(value.elements[1].text, "two");
}

TEST(XmlRpc, ThrowsAFault) {
  for (const auto& [text, reason] :
       {std::pair("Too many", "Too many"), std::pair("", "a fault without a text")}) {
    const std::string xml =
        "<methodResponse><fault><value><struct><member><name>faultCode</name><value><int>4</int>"
        "</value></member><member><name>faultString</name><value><string>" +
        std::string(text) + "</string></value></member></struct></value></fault></methodResponse>";
    EXPECT_EQ(message_of<Fault>([&] { parse_answer(xml); }), reason);
  }
}

TEST(XmlRpc, RejectsMalformedXml) {
  const std::string good = answer("<value><int>1</int></value>");
  EXPECT_EQ(refusal(good), "nothing thrown");
  EXPECT_EQ(refusal(""), "not an XML-RPC answer: no <methodResponse> at byte 0");
  EXPECT_EQ(refusal("<html>404</html>"), "not an XML-RPC answer: no <methodResponse> at byte 0");
  const std::string zero = answer(std::string("<value>1") + '\0' + "2</value>");
  EXPECT_EQ(refusal(zero).rfind("not an XML-RPC answer: a zero byte at byte ", 0), 0U);
  EXPECT_EQ(refusal("<?xml version='1.0'"),
            "not an XML-RPC answer: an XML declaration without its end at byte 5");
  for (std::size_t size = 1; size + 1 < good.size(); ++size) {
    EXPECT_NE(refusal(good.substr(0, size)), "nothing thrown") << size << " bytes of it";
  }
  EXPECT_NE(refusal(good + "x").find("something after the end"), std::string::npos);
  for (const char* value :
       {"<value><int>1x</int></value>", "<value><int></int></value>", "<value><int>1</i4></value>",
        "<value><int/></value>", "<value><int>99999999999999999999</int></value>",
        "<value><float>1</float></value>", "<value>&copy;</value>", "<value>&</value>",
        "<int>1</int>", "<value><array><value>1</value></array></value>",
        "<value><struct><member><value>1</value></member></struct></value>"}) {
    EXPECT_EQ(refusal(answer(value)).rfind("not an XML-RPC answer: ", 0), 0U) << value;
  }
}

TEST(XmlRpc, BoundsTheNestingDepth) {
  std::string begin;
  for (int i = 0; i < 100000; ++i) begin += "<value><array><data>";
  EXPECT_NE(refusal("<methodResponse><params><param>" + begin).find("nested"), std::string::npos);
}

}  // namespace
}  // namespace walker::xml_rpc

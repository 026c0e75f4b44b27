// Service lookups at masters that answer correctly, wrongly, slowly or not at all.
#include "wire/master.h"

#include <gtest/gtest.h>

#include <thread>
#include <utility>

#include "client/scripted_server.h"
#include "error_message.h"
#include "walker_sim/client.h"

namespace walker::test {
namespace {

TimePoint in_seconds(double seconds) {
  return std::chrono::steady_clock::now() +
         std::chrono::duration_cast<TimePoint::duration>(std::chrono::duration<double>(seconds));
}

constexpr double kTimeout = 30;  // [s] only a hang takes this long

/// Returns the result of a look-up at a master that plays `script`: an address or the error.
std::string outcome(const ScriptedServer::Script& script, double seconds = kTimeout) {
  const ScriptedServer master({script});
  const std::string uri = "http://" + master.address();
  try {
    return look_up_service(uri, "/walker_sim/step", Deadline(in_seconds(seconds))).text();
  } catch (const ConnectionError& error) {
    const std::string whom = "ROS master " + uri + ": ";
    EXPECT_EQ(error.what(), whom + (error.what() + whom.size()));
    return error.what() + whom.size();
  }
}

ScriptedServer::Script saying(const std::string& text) {
  return [text](Peer& peer) {
    peer.take_post();
    peer.give(text);
  };
}

const std::string kFound = xml_answer(1, "rosrpc URI", "rosrpc://walker:4242");

TEST(Uri, IsParsed) {
  EXPECT_EQ(parse_uri("http://localhost:11311", "http").text(), "localhost:11311");
  EXPECT_EQ(parse_uri("http://10.0.0.1:65535/", "http").text(), "10.0.0.1:65535");
  EXPECT_EQ(parse_uri("rosrpc://[::1]:80", "rosrpc").host, "::1");
  EXPECT_EQ(parse_uri("rosrpc://fe80::1:80", "rosrpc").host, "fe80::1");  // as roscpp writes it
}

TEST(Uri, RejectsOtherForms) {
  for (const char* uri : {"", "localhost:11311", "https://a:1", "http://a", "http://a:",
                          "http://:1", "http://a:0", "http://a:65536", "http://a:-1", "http://a:1x",
                          "http://a:1/path", "http://a b:1", "http://[]:1", "http://u@a:1"}) {
    EXPECT_EQ(message_of<std::invalid_argument>([&] { parse_uri(uri, "http"); }),
              "\"" + std::string(uri) + "\"; must be http://HOST:PORT");
  }
}

TEST(LookUp, FindsTheServiceInAnAnswerInPieces) {
  std::string asked;
  EXPECT_EQ(outcome([&](Peer& peer) {
              asked = peer.take_post();
              for (const char c : http_answer(kFound)) peer.give(std::string(1, c));
            }),
            "walker:4242");
  EXPECT_NE(asked.find("<methodName>lookupService</methodName>"), std::string::npos) << asked;
  EXPECT_NE(asked.find("<string>/walker_sim/step</string>"), std::string::npos) << asked;
}

TEST(LookUp, AcceptsOtherFormsOfAnAnswer) {
  const std::string length = std::to_string(kFound.size());
  EXPECT_EQ(outcome(saying("HTTP/1.0 200 OK\r\n\r\n" + kFound)), "walker:4242");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\nCONTENT-LENGTH:" + length + "\n\n" + kFound)),
            "walker:4242");
  std::string fields;
  for (int i = 0; i < 9000; ++i) fields += "a: b\r\n";
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\n" + fields + "Content-Length: " + length +
                           "\r\n\r\n" + kFound)),
            "walker:4242");
}

TEST(LookUp, NamesTheUnknownService) {
  EXPECT_EQ(outcome(saying(http_answer(xml_answer(-1, "un\xFFknown", "")))),
            "it does not know /walker_sim/step (un\\xffknown): is the server running, under this "
            "name, and in a version that has this service?");
}

TEST(LookUp, RejectsAnswersOfAnotherType) {
  const auto xml = [](const std::string& value) {
    return http_answer("<methodResponse><params><param><value>" + value +
                       "</value></param></params></methodResponse>");
  };
  for (const char* value :
       {"1", "<array><data></data></array>",
        "<array><data><value>1</value><value>a</value><value>b</value></data></array>"}) {
    EXPECT_EQ(outcome(saying(xml(value))), "its answer to lookupService is not [code, text, URI]");
  }
  EXPECT_EQ(outcome(saying(http_answer(xml_answer(1, "", "http://a:1")))),
            "\"http://a:1\"; must be rosrpc://HOST:PORT");
  EXPECT_EQ(outcome(saying(http_answer("<methodResponse>"))),
            "not an XML-RPC answer: no <params> at byte 16");
}

TEST(LookUp, RejectsMalformedHttp) {
  const std::string ok = "HTTP/1.1 200 OK\r\n";
  const auto repeated = [](const std::string& field) {
    std::string fields;
    while (fields.size() < 2 << 20) fields += field;
    return fields;
  };
  const std::pair<std::string, std::string> cases[] = {
      {"SSH-2.0\r\n", "it begins with SSH-2.0"},
      {"", "EOF in its header"},
      {ok + "Content-Length: 4", "EOF in its header"},
      {ok + "nonsense\r\n\r\n", "a header field without a colon: nonsense"},
      {ok + "Content-Length: 99\r\n\r\n<methodR", "EOF after 8 of 99 bytes"},
      {ok + "Content-Length: 99999999999\r\n\r\n",
       "a length of 99999999999 bytes; must be at most 1 MiB"},
      {ok + "Content-Length: -1\r\n\r\n", "the length \"-1\""},
      {ok + "Content-Length: 4\r\nContent-Length: 5\r\n\r\nabcde", "two lengths, 4 and 5"},
      {ok + "Transfer-Encoding: chunked\r\n\r\n", "the transfer encoding chunked is not supported"},
      {ok + "\r\n" + std::string(2 << 20, 'x'), "more than 1 MiB"},
      {std::string(2 << 20, 'x'), "a header of more than 64 KiB"},
      {ok + repeated("a: b\r\n"), "a header of more than 64 KiB"},
      {ok + repeated("a: " + std::string(4000, 'b') + "\r\n"), "a header of more than 64 KiB"},
  };
  for (const auto& [answer, reason] : cases) {
    EXPECT_EQ(outcome(saying(answer)), "not an HTTP answer: " + reason);
  }
  EXPECT_EQ(outcome(saying("HTTP/1.1 500 Internal error\r\n\r\n")),
            "HTTP status 500 Internal error");
}

TEST(LookUp, TimesOutAtTheDeadline) {
  // Bytes that trickle in do not extend the deadline: in the header, its fields, the body. The
  // first master is silent.
  for (const char* begin :
       {"", "HTTP", "HTTP/1.1 200 OK\r\na: ", "HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n",
        "HTTP/1.1 200 OK\r\n\r\n"}) {
    const auto drip = [begin](Peer& peer) {
      peer.take_post();
      peer.give(begin);
      const TimePoint until = in_seconds(kTimeout);
      while (std::chrono::steady_clock::now() < until && !peer.has_ended()) {
        if (*begin != 0) peer.give("x");
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    };
    EXPECT_EQ(outcome(drip, 0.05), "timed out; is it running, and is this its ROS_MASTER_URI?");
  }
}

TEST(LookUp, NamesAMasterThatIsNotRunning) {
  const std::string uri = "http://127.0.0.1:" + std::to_string(dead_port());
  EXPECT_EQ(
      message_of<ConnectionError>(
          [&] { look_up_service(uri, "/walker_sim/step", Deadline(in_seconds(kTimeout))); }),
      "ROS master " + uri + ": Connection refused; is it running, and is this its ROS_MASTER_URI?");
  const std::string unknown = message_of<ConnectionError>([&] {
    look_up_service("http://no-such-host.invalid:1", "/walker_sim/step",
                    Deadline(in_seconds(kTimeout)));
  });
  EXPECT_EQ(unknown.rfind("ROS master http://no-such-host.invalid:1: ", 0), 0U) << unknown;
}

}  // namespace
}  // namespace walker::test

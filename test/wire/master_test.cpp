// Service look-ups at masters that answer correctly, wrongly, slowly or not at all.
#include "wire/master.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <thread>

#include "client/scripted_server.h"
#include "error_message.h"
#include "walker_sim/client.h"

namespace walker {
namespace {

using test::Peer;
using test::ScriptedServer;

TimePoint in_seconds(double seconds) {
  return std::chrono::steady_clock::now() +
         std::chrono::duration_cast<TimePoint::duration>(std::chrono::duration<double>(seconds));
}

constexpr double kPatience = 30;  // [s] only a hang takes this long

/// Returns the result of a look-up at a master that plays `script`: an address or the error.
std::string outcome(const ScriptedServer::Script& script, double seconds = kPatience) {
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

const std::string kFound = test::xml_answer(1, "rosrpc URI", "rosrpc://walker:4242");

std::string parse_error(const std::string& uri) {
  return message_of<std::invalid_argument>([&] { parse_uri(uri, "http"); });
}

TEST(Uri, IsTakenApart) {
  EXPECT_EQ(parse_uri("http://localhost:11311", "http").text(), "localhost:11311");
  EXPECT_EQ(parse_uri("http://10.0.0.1:65535/", "http").text(), "10.0.0.1:65535");
  EXPECT_EQ(parse_uri("rosrpc://[::1]:80", "rosrpc").host, "::1");
  EXPECT_EQ(parse_uri("rosrpc://fe80::1:80", "rosrpc").host, "fe80::1");  // as roscpp writes it
}

TEST(Uri, IsRefusedWhereItIsNotOne) {
  for (const char* uri : {"", "localhost:11311", "https://a:1", "http://a", "http://a:",
                          "http://:1", "http://a:0", "http://a:65536", "http://a:-1", "http://a:1x",
                          "http://a:1/path", "http://a b:1", "http://[]:1", "http://u@a:1"}) {
    EXPECT_EQ(parse_error(uri), "\"" + std::string(uri) + "\"; must be http://HOST:PORT");
  }
}

TEST(LookUp, AsksForTheServiceAndFindsIt) {
  std::string asked;
  EXPECT_EQ(outcome([&](Peer& peer) {
              asked = peer.take_post();
              peer.give(test::http_answer(kFound));
            }),
            "walker:4242");
  EXPECT_NE(asked.find("<methodName>lookupService</methodName>"), std::string::npos) << asked;
  EXPECT_NE(asked.find("<string>/walker_sim/step</string>"), std::string::npos) << asked;
}

TEST(LookUp, TakesChunksAndAnswersUpToTheEnd) {
  const std::string head = "HTTP/1.1 200 OK\r\n";
  const std::string rest = kFound.substr(5);
  char size[16];
  std::snprintf(size, sizeof(size), "%zX", rest.size());
  EXPECT_EQ(outcome(saying(head + "Transfer-Encoding: chunked\r\n\r\n5;x=y\r\n" +
                           kFound.substr(0, 5) + "\r\n" + size + "\r\n" + rest + "\r\n0\r\n\r\n")),
            "walker:4242");
  EXPECT_EQ(outcome(saying("HTTP/1.0 200 OK\r\n\r\n" + kFound)), "walker:4242");
  EXPECT_EQ(
      outcome(saying(head + "CONTENT-LENGTH:" + std::to_string(kFound.size()) + "\n\n" + kFound)),
      "walker:4242");
}

TEST(LookUp, TakesAnswersThatComeInPieces) {
  EXPECT_EQ(outcome([](Peer& peer) {
              peer.take_post();
              for (const char c : test::http_answer(kFound)) peer.give(std::string(1, c));
            }),
            "walker:4242");
}

TEST(LookUp, SaysWhatTheMasterDoesNotKnow) {
  EXPECT_EQ(outcome(saying(test::http_answer(test::xml_answer(-1, "no provider", "")))),
            "it does not know /walker_sim/step (no provider): is the server running, under this "
            "name, and in a version that has this service?");
}

TEST(LookUp, RefusesAnswersOfAnotherKind) {
  const auto xml = [](const std::string& value) {
    return test::http_answer("<methodResponse><params><param><value>" + value +
                             "</value></param></params></methodResponse>");
  };
  for (const char* value :
       {"1", "<array><data></data></array>",
        "<array><data><value>1</value><value>a</value><value>b</value></data></array>"}) {
    EXPECT_EQ(outcome(saying(xml(value))), "its answer to lookupService is not [code, text, URI]");
  }
  EXPECT_EQ(outcome(saying(test::http_answer(test::xml_answer(1, "", "http://a:1")))),
            "\"http://a:1\"; must be rosrpc://HOST:PORT");
  EXPECT_EQ(outcome(saying(test::http_answer("<methodResponse>"))),
            "not an XML-RPC answer: no <params> at byte 16");
}

TEST(LookUp, RefusesWhatIsNotHttp) {
  EXPECT_EQ(outcome(saying("HTTP/1.1 500 Internal error\r\n\r\n")),
            "HTTP status 500 Internal error");
  EXPECT_EQ(outcome(saying("SSH-2.0\r\n")), "not an HTTP answer: it begins SSH-2.0");
  EXPECT_EQ(outcome(saying("")), "not an HTTP answer: it ends in its header");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\nContent-Length: 4")),
            "not an HTTP answer: it ends in its header");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\nnonsense\r\n\r\n")),
            "not an HTTP answer: a header field without a colon: nonsense");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\nContent-Length: 99\r\n\r\n<methodR")),
            "not an HTTP answer: it ends after 8 of 99 bytes");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\nContent-Length: 99999999999\r\n\r\n")),
            "not an HTTP answer: a length of 99999999999 bytes");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\nContent-Length: -1\r\n\r\n")),
            "not an HTTP answer: the length \"-1\"");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nFFFFFFFF\r\n")),
            "not an HTTP answer: a length of 4294967295 bytes");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n1\r\nab\r\n")),
            "not an HTTP answer: a chunk that does not end where it should");
  EXPECT_EQ(outcome(saying("HTTP/1.1 200 OK\r\n\r\n" + std::string(2 << 20, 'x'))),
            "not an HTTP answer: more than 1 MiB");
  EXPECT_EQ(outcome(saying(std::string(2 << 20, 'x'))),
            "not an HTTP answer: a line of more than 8 KiB");
}

/// Sends `begin`, then repeats `text` until the client closes, for 10 s at most.
ScriptedServer::Script repeating(const std::string& begin, const std::string& text) {
  return [begin, text](Peer& peer) {
    peer.take_post();
    peer.give(begin);
    std::string many;
    while (many.size() < (1 << 16)) many += text;
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (std::chrono::steady_clock::now() < until && !peer.has_ended()) peer.give(many);
  };
}

TEST(LookUp, TakesAHeaderOfSomeLengthOnly) {
  const std::string head = "HTTP/1.1 200 OK\r\n";
  EXPECT_EQ(outcome(repeating(head, "a: b\r\n")),
            "not an HTTP answer: more than 100 header fields");
  EXPECT_EQ(outcome(repeating(head, "a: " + std::string(4000, 'b') + "\r\n")),
            "not an HTTP answer: lines of more than 64 KiB around its body");
  EXPECT_EQ(outcome(repeating(head + "Transfer-Encoding: chunked\r\n\r\n", "1\r\nx\r\n")),
            "not an HTTP answer: lines of more than 64 KiB around its body");
  std::string fields;
  for (int i = 0; i < 99; ++i) fields += "a: b\r\n";
  EXPECT_EQ(outcome(saying(head + fields + test::http_answer(kFound).substr(head.size()))),
            "not an HTTP answer: more than 100 header fields");
  EXPECT_EQ(outcome(saying(head + fields.substr(12) + "Content-Length: " +
                           std::to_string(kFound.size()) + "\r\n\r\n" + kFound)),
            "walker:4242");
}

TEST(LookUp, RefusesALengthThatIsInDoubt) {
  const std::string head = "HTTP/1.1 200 OK\r\n";
  EXPECT_EQ(outcome(saying(head + "Content-Length: 4\r\nContent-Length: 5\r\n\r\nabcde")),
            "not an HTTP answer: two lengths, 4 and 5");
  EXPECT_EQ(outcome(saying(head + "Transfer-Encoding: gzip, chunked\r\n\r\n")),
            "not an HTTP answer: the transfer encoding gzip, chunked");
}

TEST(LookUp, GivesUpAtTheDeadline) {
  const auto silent = [](Peer& peer) { peer.sees_end(); };
  EXPECT_EQ(outcome(
                [&](Peer& peer) {
                  peer.take_post();
                  silent(peer);
                },
                0.05),
            "timed out; is it running, and is this its ROS_MASTER_URI?");
  // Bytes that trickle in do not extend the deadline: in the header, its fields, the body.
  for (const char* begin :
       {"HTTP", "HTTP/1.1 200 OK\r\na: ", "HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n",
        "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nFFF\r\n",
        "HTTP/1.1 200 OK\r\n\r\n"}) {
    EXPECT_EQ(outcome(
                  [&](Peer& peer) {
                    peer.take_post();
                    peer.give(begin);
                    const TimePoint until = in_seconds(kPatience);
                    while (std::chrono::steady_clock::now() < until && !peer.has_ended()) {
                      peer.give("x");
                      std::this_thread::sleep_for(std::chrono::milliseconds(1));
                    }
                  },
                  0.05),
              "timed out; is it running, and is this its ROS_MASTER_URI?");
  }
}

TEST(LookUp, SaysThatThereIsNoMaster) {
  const std::string uri = "http://127.0.0.1:" + std::to_string(test::dead_port());
  EXPECT_EQ(
      message_of<ConnectionError>(
          [&] { look_up_service(uri, "/walker_sim/step", Deadline(in_seconds(kPatience))); }),
      "ROS master " + uri + ": Connection refused; is it running, and is this its ROS_MASTER_URI?");
  const std::string unknown = message_of<ConnectionError>([&] {
    look_up_service("http://no-such-host.invalid:1", "/walker_sim/step",
                    Deadline(in_seconds(kPatience)));
  });
  EXPECT_EQ(unknown.rfind("ROS master http://no-such-host.invalid:1: ", 0), 0U) << unknown;
}

}  // namespace
}  // namespace walker

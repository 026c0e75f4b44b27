// The client's connections: look-ups, malformed answers, timeouts, signals.
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "base/limits.h"
#include "client/scripted_server.h"
#include "client/scripted_walker.h"
#include "error_message.h"
#include "walker_sim/client.h"

namespace walker::test {
namespace {

const std::string kHint =
    "; has the server died, or can its host not be reached under this name (the server's "
    "ROS_HOSTNAME or ROS_IP)?";

ScriptedServer::Script stepping(const std::vector<std::string>& answers) {
  return answering(kStep, answers);
}

/// Reads a step's request and does not answer it.
void take_step(Peer& peer) {
  open(peer, kStep);
  peer.take_frame();
}

/// Sends bytes one at a time until the client closes.
void drip(Peer& peer) {
  while (!peer.has_ended()) {
    peer.give("x");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// Returns the ConnectionError of a step on such a connection; expects the next step to succeed.
std::string broken_step(const ScriptedServer::Script& script, double timeout = 30) {
  ScriptedWalker walker({script, stepping({example_answer()})}, timeout);
  const std::string error = message_of<ConnectionError>([&] { walker.step(); });
  walker.step();
  EXPECT_EQ(walker.transition.step, 9U);
  const std::string whom = "service /walker_sim/step at " + walker.address();
  EXPECT_EQ(error.rfind(whom, 0), 0U) << error;
  return error.substr(whom.size());
}

TEST(Connection, ReportsEof) {
  EXPECT_EQ(broken_step(stepping({""})), ": the server has closed the connection" + kLost);
  const std::string good = example_answer();
  for (const std::size_t size : {std::size_t{1}, std::size_t{4}, std::size_t{5}, good.size() - 1}) {
    EXPECT_EQ(broken_step([&](Peer& peer) {
                take_step(peer);
                peer.give(good.substr(0, size));
              }),
              ": the server has closed the connection" + kLost);
  }
}

TEST(Connection, TimesOut) {
  constexpr double kTimeout = 2;  // [s] enough for every real answer on a busy machine
  const auto silent = [](Peer& peer) {
    take_step(peer);
    peer.sees_end();
  };
  // Bytes that trickle in do not extend the timeout.
  const auto dripping = [](Peer& peer) {
    take_step(peer);
    peer.give(answer(std::string(1 << 20, 'x')).substr(0, 5));
    drip(peer);
  };
  const auto dripping_header = [](Peer& peer) {
    take_header(peer);
    peer.give(Message().number(std::uint32_t{60000}).bytes());
    drip(peer);
  };
  EXPECT_EQ(broken_step(silent, kTimeout), ": timed out" + kLost);
  EXPECT_EQ(broken_step(dripping, kTimeout), ": timed out" + kLost);
  EXPECT_EQ(broken_step(dripping_header, kTimeout),
            ", its address in the ROS master: timed out" + kHint);
}

/// Master and server each answer within the timeout, but together they exceed it.
TEST(Connection, LooksUpAndCallsWithinOneTimeout) {
  const auto linger = [] { std::this_thread::sleep_for(std::chrono::milliseconds(600)); };
  ScriptedServer server({tell_specification, [&](Peer& peer) {
                           take_step(peer);
                           linger();
                           peer.give(example_answer());
                         }});
  ScriptedServer master({master_of(server.address()), [&](Peer& peer) {
                           linger();
                           master_of(server.address())(peer);
                         }});
  ClientOptions options = options_for(master);
  options.timeout = 1;
  Client client(options);
  Transition transition;
  const std::string error =
      message_of<ConnectionError>([&] { client.step(nullptr, 0, transition); });
  EXPECT_NE(error.find("timed out"), std::string::npos) << error;
}

TEST(Connection, RejectsMalformedAnswers) {
  const std::string body = to_bytes(example_transition());
  // An array length beyond the end of the answer causes no allocation.
  const std::string long_array = Message().number(std::uint8_t{1}).text("").bytes() +
                                 std::string(12, '\0') + framed("odom") + std::string(12, '\0') +
                                 "\xff\xff\xff\xff";
  const std::pair<std::string, std::string> cases[] = {
      {answer(body.substr(0, body.size() - 1)), "the answer ends within a field"},
      {answer(body + "x"), "the answer is longer than its type"},
      {answer(""), "the answer ends within a field"},
      {answer(long_array), "the answer ends within a field"},
      {example_answer() + "x", "it sent unrequested bytes"},
      {"HTTP/1.1 400 Bad request", "its answer begins with neither 0 nor 1; is it a ROS node?"},
      {"\1\xff\xff\xff\xff", "its answer has 4294967295 bytes; must have at most 1048616"},
  };
  for (const auto& [answer, reason] : cases) {
    EXPECT_EQ(broken_step(stepping({answer})), std::string(": ").append(reason).append(kLost));
  }
}

/// Peak resident set size of this process [bytes].
std::int64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr std::int64_t kKibi = 1024;
  return usage.ru_maxrss * kKibi;
}

TEST(Connection, AllocatesOnlyForReceivedBytes) {
  ServerSpecification large = example_specification();
  large.num_envs = kMaxEnvironments;
  large.observation_size = 500;
  large.observation_low.assign(500, -1);
  large.observation_high.assign(500, 1);
  constexpr std::uint32_t kAnnounced = 900000000;
  ScriptedWalker walker(
      {answering(kStepBatch, {Message().number('\1').number(kAnnounced).bytes()})}, 30, {}, large);
  const std::vector<double> actions(kMaxEnvironments);
  BatchTransition batch;
  const std::int64_t before = peak_memory();
  EXPECT_EQ(message_of<ConnectionError>(
                [&] { walker.client().step_batch(actions.data(), actions.size(), batch); }),
            "service /walker_sim/step_batch at " + walker.address() +
                ": the server has closed the connection" + kLost);
  EXPECT_LT(peak_memory() - before, kAnnounced / 4);
}

TEST(Connection, RejectsMalformedHeaders) {
  const std::string md5sum = kServiceTypes[kStep].md5sum;
  const std::string gone =
      ", its address in the ROS master: the server has closed the connection" + kHint;
  const std::pair<std::string, std::string> cases[] = {
      {header({{"error", "another MD5"}}), ": its error: another MD5"},
      {header({{"error", "no\n\x1b[2J\xFF"}}), ": its error: no\\n\\x1b[2J\\xff"},
      {header({{"md5sum", "0"}}), ": its walker_sim/Step has the MD5 0; here it is " + md5sum +
                                      ", so it is another version of walker_sim"},
      {framed("rubbish"), ": connection header: a field is longer than the header"},
      {std::string(4, '\xff'), ": it sent a header of 4294967295 bytes; is it a ROS node?"},
      {header({{"md5sum", md5sum}}) + "x", ": it sent unrequested bytes"},
      {"", gone},
      {std::string("\x10\0\0\0half", 8), gone},
  };
  for (const auto& row : cases) {
    EXPECT_EQ(broken_step([&](Peer& peer) {
                take_header(peer);
                peer.give(row.first);
              }),
              row.second);
  }
}

/// Before the specification is known, a fixed limit of 16 MiB applies.
TEST(Connection, RejectsALongSpecification) {
  const std::string announced = Message().number('\1').number(std::uint32_t{1} << 25).bytes();
  ScriptedServer server({answering(kGetSpec, {announced})});
  ScriptedServer master({master_of(server.address())});
  EXPECT_EQ(message_of<ConnectionError>([&] { Client client(options_for(master)); }),
            "service /walker_sim/get_spec at " + server.address() +
                ": its answer has 33554432 bytes; must have at most 16777216" + kLost);
}

TEST(Connection, SendsNoCallTwice) {
  std::atomic<int> requests{0};
  const auto swallow = [&](Peer& peer) {
    open(peer, kStep);
    if (!peer.take_frame().empty()) ++requests;
  };
  ScriptedWalker walker({swallow, swallow, swallow});
  for (int i = 1; i <= 3; ++i) {
    EXPECT_THROW(walker.step(), ConnectionError);
    EXPECT_EQ(requests, i);
  }
}

TEST(Connection, LooksTheServerUpAgainAfterAFailure) {
  ScriptedServer second({stepping({example_answer()})});
  ScriptedServer first({tell_specification, stepping({})});
  ScriptedServer master(
      {master_of(first.address()), master_of(first.address()), master_of(second.address())});
  Client client(options_for(master));
  Transition transition;
  EXPECT_THROW(client.step(nullptr, 0, transition), ConnectionError);
  client.step(nullptr, 0, transition);
  EXPECT_EQ(transition.step, 9U);
}

/// Makes SIGUSR1 interrupt this thread's system calls without any other effect.
class Signals {
 public:
  Signals() : thread_(pthread_self()) {
    struct sigaction interrupt {};
    interrupt.sa_handler = [](int) {};  // without SA_RESTART
    sigaction(SIGUSR1, &interrupt, &before_);
  }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;
  ~Signals() { sigaction(SIGUSR1, &before_, nullptr); }

  void raise() const { pthread_kill(thread_, SIGUSR1); }

  /// Raises repeatedly: the first signal may arrive before the client waits.
  void raise_until_end(Peer& peer) const {
    while (!peer.has_ended()) {
      raise();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

 private:
  pthread_t thread_;
  struct sigaction before_ {};
};

TEST(Connection, ContinuesAfterASignal) {
  const Signals signals;
  std::atomic<int> asked{0};
  const auto never = [&] {
    ++asked;
    return false;
  };
  for (const std::function<bool()>& is_interrupted : {std::function<bool()>(), {never}}) {
    ScriptedWalker walker({[&](Peer& peer) {
                            take_step(peer);
                            while (is_interrupted && asked == 0) signals.raise();
                            for (const char c : example_answer()) {
                              signals.raise();
                              peer.give(std::string(1, c));
                            }
                            peer.sees_end();
                          }},
                          30, is_interrupted);
    walker.step();
    EXPECT_EQ(walker.transition.step, 9U);
  }
  EXPECT_GT(asked, 0);
}

TEST(Connection, IsInterruptedBySignals) {
  const Signals signals;
  const std::thread::id caller = std::this_thread::get_id();
  bool is_meant = false;
  const auto is_interrupted = [&] {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    return is_meant;
  };
  const auto silent = [&](Peer& peer) {
    take_step(peer);
    signals.raise_until_end(peer);
  };
  ScriptedWalker walker({silent, stepping({example_answer()})}, 30, is_interrupted);
  is_meant = true;
  EXPECT_THROW(walker.step(), Interrupted);
  is_meant = false;
  walker.step();  // on a new connection
  EXPECT_EQ(walker.transition.step, 9U);
}

TEST(Connection, IsInterruptedWhileConnecting) {
  const Signals signals;
  const auto expect_interruption = [](const ScriptedServer::Script& master_script) {
    const ScriptedServer master({master_script});
    ClientOptions options = options_for(master);
    options.is_interrupted = [] { return true; };
    EXPECT_THROW(Client{options}, Interrupted);
  };
  expect_interruption([&](Peer& peer) {
    peer.take_post();
    signals.raise_until_end(peer);
  });
  const ScriptedServer server({[&](Peer& peer) {
    peer.take_frame();
    signals.raise_until_end(peer);
  }});
  expect_interruption(master_of(server.address()));
}

TEST(Connection, NamesAServerThatDied) {
  const std::string address = "127.0.0.1:" + std::to_string(dead_port());
  ScriptedServer master({master_of(address)});
  const ClientOptions options = options_for(master);
  EXPECT_EQ(message_of<ConnectionError>([&] { Client client(options); }),
            "service /walker_sim/get_spec at " + address +
                ", its address in the ROS master: Connection refused" + kHint);
}

}  // namespace
}  // namespace walker::test

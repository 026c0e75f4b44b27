// The client against scripted masters and servers, both correct and faulty.
#include "walker_sim/client.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "base/limits.h"
#include "bits.h"
#include "client/scripted_server.h"
#include "client/scripted_walker.h"
#include "error_message.h"

namespace walker {
namespace {

using test::kLost;
using test::Peer;
using test::ScriptedServer;
using test::ScriptedWalker;

void expect_equal(const Transition& told, const Transition& meant) {
  EXPECT_EQ(told.stamp, meant.stamp);
  EXPECT_EQ(told.environment, meant.environment);
  EXPECT_EQ(told.episode, meant.episode);
  EXPECT_EQ(told.step, meant.step);
  EXPECT_EQ(to_bits(told.action), to_bits(meant.action));
  EXPECT_EQ(to_bits(told.observation), to_bits(meant.observation));
  EXPECT_EQ(told.reward, meant.reward);
  EXPECT_EQ(told.episode_return, meant.episode_return);
  EXPECT_EQ(told.terminated, meant.terminated);
  EXPECT_EQ(told.truncated, meant.truncated);
  EXPECT_EQ(to_bits(told.info), to_bits(meant.info));
  EXPECT_EQ(told.error, meant.error);
}

ScriptedServer::Script answering(const std::vector<std::string>& answers) {
  return test::answering(kStep, answers);
}

std::string good_answer() { return test::answer(test::to_bytes(test::example_transition())); }

/// Returns the ConnectionError of a step on such a connection; expects the next step to succeed.
std::string broken_step(const ScriptedServer::Script& script, double timeout = 30) {
  ScriptedWalker walker({script, answering({good_answer()})}, timeout);
  const std::string error = message_of<ConnectionError>([&] { walker.step(); });
  walker.step();
  EXPECT_EQ(walker.transition.step, 9U);
  const std::string whom = "service /walker_sim/step at " + walker.address();
  EXPECT_EQ(error.rfind(whom, 0), 0U) << error;
  return error.substr(whom.size());
}

// ---------------------------------------------------------------- success

TEST(Client, TellsTheSpecification) {
  ScriptedServer server({[](Peer& peer) {
    test::tell_specification(peer);
    peer.take_frame();
    peer.give(test::answer(test::to_bytes(test::example_specification())));
  }});
  ScriptedServer master({test::master_of(server.address())});
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  EXPECT_EQ(test::to_bytes(Client(options).specification()),
            test::to_bytes(test::example_specification()));
}

TEST(Client, IntroducesItself) {
  tcpros::Fields fields;
  ScriptedWalker walker({[&](Peer& peer) {
    fields = test::take_header(peer);
    peer.give(test::header({{"md5sum", kServiceTypes[kStep].md5sum}}));
    peer.take_frame();
    peer.give(good_answer());
  }});
  walker.step();
  EXPECT_EQ(fields, (tcpros::Fields{{"callerid", "/walker_sim_client_" + std::to_string(getpid())},
                                    {"md5sum", kServiceTypes[kStep].md5sum},
                                    {"persistent", "1"},
                                    {"service", "/walker_sim/step"},
                                    {"type", "walker_sim/Step"}}));
}

TEST(Client, Steps) {
  std::string request;
  ScriptedWalker walker({[&](Peer& peer) {
    test::open(peer, kStep);
    request = peer.take_frame();
    peer.give(good_answer());
    peer.sees_end();
  }});
  const std::vector<double> action{0.5, -0.0, std::numeric_limits<double>::quiet_NaN()};
  walker.client().step(action.data(), action.size(), walker.transition);
  EXPECT_EQ(request, test::Message().array(action).bytes());
  expect_equal(walker.transition, test::example_transition());
}

TEST(Client, RepeatsAStep) {
  std::string request;
  const RepeatedStep meant{test::example_transition(), 2, -0.25};
  ScriptedWalker walker({[&](Peer& peer) {
    test::open(peer, kStepMany);
    request = peer.take_frame();
    peer.give(test::answer(test::to_bytes(meant)));
    peer.sees_end();
  }});
  const std::vector<double> action{0.5, -0.0};
  RepeatedStep repeated;
  walker.client().step_many(action.data(), action.size(), 4, repeated);
  EXPECT_EQ(request, test::Message().array(action).number(std::uint32_t{4}).bytes());
  expect_equal(repeated.transition, meant.transition);
  EXPECT_EQ(repeated.steps, meant.steps);
  EXPECT_EQ(repeated.total_reward, meant.total_reward);
}

TEST(Client, Resets) {
  std::vector<std::string> requests;
  ScriptedWalker walker({[&](Peer& peer) {
    test::open(peer, kReset);
    for (int i = 0; i < 2; ++i) {
      requests.push_back(peer.take_frame());
      peer.give(good_answer());
    }
    peer.sees_end();
  }});
  const std::uint64_t seed = std::numeric_limits<std::uint64_t>::max();
  walker.client().reset(seed, walker.transition);
  walker.client().reset(std::nullopt, walker.transition);
  EXPECT_EQ(requests[0], test::Message().number(std::uint8_t{1}).number(seed).bytes());
  EXPECT_EQ(requests[1], test::Message().number(std::uint8_t{0}).number(std::uint64_t{0}).bytes());
  expect_equal(walker.transition, test::example_transition());
}

TEST(Client, ResetsABatch) {
  std::string request;
  ScriptedWalker walker({[&](Peer& peer) {
    test::open(peer, kResetBatch);
    request = peer.take_frame();
    peer.give(
        test::answer(test::to_bytes(BatchReset{{1, 2, 3, 4, 5, 6}, {7, 8}, {1}, {"the engine"}})));
    peer.sees_end();
  }});
  BatchReset reset;
  walker.client().reset_batch({1, 0}, {std::uint64_t{5}, std::nullopt}, reset);
  EXPECT_EQ(request, test::Message()
                         .array<std::uint32_t>({1, 0})
                         .array<std::uint8_t>({1, 0})
                         .array<std::uint64_t>({5, 0})
                         .bytes());
  EXPECT_EQ(reset.observations, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(reset.info, (std::vector<double>{7, 8}));
  EXPECT_EQ(reset.failed_environments, (std::vector<std::uint32_t>{1}));
  EXPECT_EQ(reset.failures, (std::vector<std::string>{"the engine"}));
}

TEST(Client, StepsABatch) {
  std::string request;
  ScriptedWalker walker({[&](Peer& peer) {
    test::open(peer, kStepBatch);
    request = peer.take_frame();
    peer.give(test::answer(test::to_bytes(test::example_batch())));
    peer.sees_end();
  }});
  BatchTransition told;
  const std::vector<double> actions{0.5, -0.5};
  walker.client().step_batch(actions.data(), actions.size(), told);
  EXPECT_EQ(request, test::Message().array(actions).bytes());
  EXPECT_EQ(told.observations, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(told.rewards, (std::vector<double>{-1, -2}));
  EXPECT_EQ(told.terminated, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(told.truncated, (std::vector<std::uint8_t>{1, 0}));
  EXPECT_EQ(told.episodes, (std::vector<std::uint32_t>{5, 6}));
  EXPECT_EQ(told.steps, (std::vector<std::uint32_t>{7, 8}));
  EXPECT_EQ(told.info, (std::vector<double>{9, 10}));
  EXPECT_EQ(told.failed_environments, (std::vector<std::uint32_t>{1}));
  EXPECT_EQ(told.failed_at_reset, (std::vector<std::uint8_t>{0}));
  EXPECT_EQ(told.failures, (std::vector<std::string>{"the engine"}));
  EXPECT_EQ(told.final_environments, (std::vector<std::uint32_t>{1}));
  EXPECT_EQ(told.final_observations, (std::vector<double>{11, 12, 13}));
  EXPECT_EQ(told.final_info, (std::vector<double>{14}));
}

TEST(Client, TakesAnswersInPiecesAndLongOnes) {
  constexpr std::uint32_t kSize = 500000;
  ServerSpecification specification = test::example_specification();
  specification.observation_size = kSize;
  specification.observation_low.assign(kSize, -1);
  specification.observation_high.assign(kSize, 1);
  Transition meant = test::example_transition();
  meant.observation.assign(kSize, 0.5);
  Transition in_pieces = meant;
  in_pieces.observation.front() = -0.5;
  ScriptedWalker walker({[&](Peer& peer) {
                          const std::string first = test::answer(test::to_bytes(in_pieces));
                          test::open(peer, kStep);
                          peer.take_frame();
                          for (std::size_t i = 0; i < 200; ++i) peer.give(first.substr(i, 1));
                          peer.give(first.substr(200));
                          peer.take_frame();
                          peer.give(test::answer(test::to_bytes(meant)));
                          peer.sees_end();
                        }},
                        30, {}, specification);
  walker.step();
  expect_equal(walker.transition, in_pieces);
  walker.step();
  expect_equal(walker.transition, meant);
}

TEST(Client, SendsRequestsThatDoNotFitTheSocket) {
  const std::vector<double> actions(4000000, 0.5);
  std::size_t size = 0;
  ScriptedWalker walker({[&](Peer& peer) {
    test::open(peer, kStep);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // the buffer fills
    size = peer.take_frame().size();
    peer.give(good_answer());
    peer.sees_end();
  }});
  walker.client().step(actions.data(), actions.size(), walker.transition);
  EXPECT_EQ(size, 4 + actions.size() * sizeof(double));
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

TEST(Client, GoesOnAfterASignal) {
  const Signals signals;
  std::atomic<int> asked{0};
  const auto never = [&] {
    ++asked;
    return false;
  };
  for (const std::function<bool()>& is_interrupted : {std::function<bool()>(), {never}}) {
    ScriptedWalker walker({[&](Peer& peer) {
                            test::open(peer, kStep);
                            peer.take_frame();
                            while (is_interrupted && asked == 0) signals.raise();
                            for (const char c : good_answer()) {
                              signals.raise();
                              peer.give(std::string(1, c));
                            }
                            peer.sees_end();
                          }},
                          30, is_interrupted);
    walker.step();
    expect_equal(walker.transition, test::example_transition());
  }
  EXPECT_GT(asked, 0);
}

TEST(Client, IsInterruptedByASignalThatMeansIt) {
  const Signals signals;
  const std::thread::id caller = std::this_thread::get_id();
  bool is_meant = false;
  const auto is_interrupted = [&] {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    return is_meant;
  };
  const auto silent = [&](Peer& peer) {
    test::open(peer, kStep);
    peer.take_frame();
    signals.raise_until_end(peer);
  };
  ScriptedWalker walker({silent, answering({good_answer()})}, 30, is_interrupted);
  is_meant = true;
  EXPECT_THROW(walker.step(), Interrupted);
  is_meant = false;
  walker.step();  // on a new connection
  expect_equal(walker.transition, test::example_transition());
}

TEST(Client, IsInterruptedWhileItConnects) {
  const Signals signals;
  ClientOptions options;
  options.is_interrupted = [] { return true; };
  ScriptedServer master({[&](Peer& peer) {
    peer.take_post();
    signals.raise_until_end(peer);
  }});
  options.master_uri = "http://" + master.address();
  EXPECT_THROW(Client{options}, Interrupted);
  ScriptedServer server({[&](Peer& peer) {
    peer.take_frame();
    signals.raise_until_end(peer);
  }});
  ScriptedServer other_master({test::master_of(server.address())});
  options.master_uri = "http://" + other_master.address();
  EXPECT_THROW(Client{options}, Interrupted);
}

// ---------------------------------------------------------------- refusals

TEST(Client, PassesOnWhyTheServerRefuses) {
  const Transition before = test::example_transition();
  Transition other;
  other.step = 1;
  ScriptedWalker walker(
      {answering({good_answer(), test::answer(test::to_bytes(other, false, "action has ...")),
                  test::answer("not this request", 0), good_answer()})});
  walker.step();
  EXPECT_EQ(message_of<RequestRefused>([&] { walker.step(); }), "action has ...");
  EXPECT_EQ(message_of<RequestRefused>([&] { walker.step(); }), "not this request");
  expect_equal(walker.transition, before);
  walker.step();  // on the same connection
}

// ---------------------------------------------------------------- broken connections

TEST(Client, SaysThatTheServerHasGone) {
  EXPECT_EQ(broken_step(answering({""})), ": the server has closed the connection" + kLost);
  const std::string good = good_answer();
  for (const std::size_t size : {std::size_t{1}, std::size_t{4}, std::size_t{5}, good.size() - 1}) {
    EXPECT_EQ(broken_step([&](Peer& peer) {
                test::open(peer, kStep);
                peer.take_frame();
                peer.give(good.substr(0, size));
              }),
              ": the server has closed the connection" + kLost);
  }
}

TEST(Client, GivesUpAtTheTimeout) {
  constexpr double kTimeout = 2;  // [s] enough for every real answer on a busy machine
  const auto silent = [](Peer& peer) {
    test::open(peer, kStep);
    peer.take_frame();
    peer.sees_end();
  };
  // Bytes that trickle in do not extend the timeout.
  const auto dripping = [](Peer& peer) {
    test::open(peer, kStep);
    peer.take_frame();
    peer.give(test::answer(std::string(1 << 20, 'x')).substr(0, 5));
    while (!peer.has_ended()) {
      peer.give("x");
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  for (const ScriptedServer::Script& script :
       {ScriptedServer::Script(silent), ScriptedServer::Script(dripping)}) {
    EXPECT_EQ(broken_step(script, kTimeout), ": timed out" + kLost);
  }
  const auto dripping_header = [](Peer& peer) {
    test::take_header(peer);
    peer.give(test::Message().number(std::uint32_t{60000}).bytes());
    while (!peer.has_ended()) {
      peer.give("x");
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  EXPECT_EQ(broken_step(dripping_header, kTimeout),
            ", as the ROS master has it: timed out; has the server died, or can its host not be "
            "reached under this name (its ROS_HOSTNAME or ROS_IP)?");
}

/// Master and server each answer within the timeout, but together they exceed it.
TEST(Client, LooksUpAndCallsWithinOneTimeout) {
  const auto linger = [] { std::this_thread::sleep_for(std::chrono::milliseconds(600)); };
  ScriptedServer server({test::tell_specification, [&](Peer& peer) {
                           test::open(peer, kStep);
                           peer.take_frame();
                           linger();
                           peer.give(good_answer());
                         }});
  ScriptedServer master({test::master_of(server.address()), [&](Peer& peer) {
                           linger();
                           test::master_of(server.address())(peer);
                         }});
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  options.timeout = 1;
  Client client(options);
  Transition transition;
  const std::string error =
      message_of<ConnectionError>([&] { client.step(nullptr, 0, transition); });
  EXPECT_NE(error.find("timed out"), std::string::npos) << error;
}

TEST(Client, RefusesAnswersThatAreNone) {
  const std::string body = test::to_bytes(test::example_transition());
  const auto outcome = [](const std::string& answer) { return broken_step(answering({answer})); };
  EXPECT_EQ(outcome(test::answer(body.substr(0, body.size() - 1))),
            ": the answer ends within a field" + kLost);
  EXPECT_EQ(outcome(test::answer(body + "x")), ": the answer is longer than its type" + kLost);
  EXPECT_EQ(outcome(test::answer("")), ": the answer ends within a field" + kLost);
  EXPECT_EQ(outcome(good_answer() + "x"), ": it speaks unasked" + kLost);
  EXPECT_EQ(outcome("HTTP/1.1 400 Bad request"),
            ": it answers neither 0 nor 1; is it a ROS node?" + kLost);
  EXPECT_EQ(outcome("\1\xff\xff\xff\xff"),
            ": it announces an answer of 4294967295 bytes; at most 1048616 are taken" + kLost);
  // An array length beyond the end of the answer causes no allocation.
  const std::string many = "\xff\xff\xff\xff";
  const std::string begin = test::Message().number(std::uint8_t{1}).text("").bytes() +
                            std::string(12, '\0') + test::framed("odom") + std::string(12, '\0');
  EXPECT_EQ(outcome(test::answer(begin + many)), ": the answer ends within a field" + kLost);
}

/// Peak resident set size of this process [bytes].
std::int64_t largest_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr std::int64_t kKibi = 1024;
  return usage.ru_maxrss * kKibi;
}

TEST(Client, GivesMemoryToWhatComesOnly) {
  ServerSpecification large = test::example_specification();
  large.num_envs = kMaxEnvironments;
  large.observation_size = 500;
  large.observation_low.assign(500, -1);
  large.observation_high.assign(500, 1);
  constexpr std::uint32_t kAnnounced = 900000000;
  ScriptedWalker walker(
      {test::answering(kStepBatch, {test::Message().number('\1').number(kAnnounced).bytes()})}, 30,
      {}, large);
  const std::vector<double> actions(kMaxEnvironments);
  BatchTransition batch;
  const std::int64_t before = largest_memory();
  EXPECT_EQ(message_of<ConnectionError>(
                [&] { walker.client().step_batch(actions.data(), actions.size(), batch); }),
            "service /walker_sim/step_batch at " + walker.address() +
                ": the server has closed the connection" + kLost);
  EXPECT_LT(largest_memory() - before, kAnnounced / 4);
}

TEST(Client, SaysWhatIsWrongWithTheServersHeader) {
  const auto outcome = [](const std::string& header) {
    return broken_step([header](Peer& peer) {
      test::take_header(peer);
      peer.give(header);
    });
  };
  EXPECT_EQ(outcome(test::header({{"error", "another MD5"}})), ": it says: another MD5");
  EXPECT_EQ(outcome(test::header({{"md5sum", "0"}})),
            std::string(": its walker_sim/Step has the MD5 0; here it is ") +
                kServiceTypes[kStep].md5sum + ", so it is another version of walker_sim");
  EXPECT_EQ(outcome(test::framed("rubbish")),
            ": connection header: a field is longer than the header");
  EXPECT_EQ(outcome(std::string(4, '\xff')),
            ": it sent a header of 4294967295 bytes; is it a ROS node?");
  EXPECT_EQ(outcome(test::header({{"md5sum", kServiceTypes[kStep].md5sum}}) + "x"),
            ": it speaks unasked");
  const std::string gone =
      ", as the ROS master has it: the server has closed the connection; has "
      "the server died, or can its host not be reached under this name (its "
      "ROS_HOSTNAME or ROS_IP)?";
  EXPECT_EQ(outcome(""), gone);
  EXPECT_EQ(outcome(std::string("\x10\0\0\0half", 8)), gone);
}

TEST(Client, NeverSendsACallTwice) {
  std::atomic<int> requests{0};
  const auto swallow = [&](Peer& peer) {
    test::open(peer, kStep);
    if (!peer.take_frame().empty()) ++requests;
  };
  ScriptedWalker walker({swallow, swallow, swallow});
  for (int i = 1; i <= 3; ++i) {
    EXPECT_THROW(walker.step(), ConnectionError);
    EXPECT_EQ(requests, i);
  }
}

TEST(Client, LooksTheServerUpAnewOnceItBroke) {
  ScriptedServer second({answering({good_answer()})});
  ScriptedServer first({test::tell_specification, answering({})});
  ScriptedServer master({test::master_of(first.address()), test::master_of(first.address()),
                         test::master_of(second.address())});
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  Client client(options);
  Transition transition;
  EXPECT_THROW(client.step(nullptr, 0, transition), ConnectionError);
  client.step(nullptr, 0, transition);
  expect_equal(transition, test::example_transition());
}

// ---------------------------------------------------------------- options

std::string option_error(const ClientOptions& options) {
  return message_of<std::invalid_argument>([&] { Client client(options); });
}

TEST(ClientOptions, AreChecked) {
  for (const char* server : {"", "/", "walker_sim", "/walker_sim/"}) {
    ClientOptions options;
    options.server = server;
    EXPECT_EQ(option_error(options), "server = \"" + std::string(server) +
                                         "\"; must be a node's full name, e.g. /walker_sim");
  }
  for (const double timeout : {0.0, -1.0, 1e7, std::numeric_limits<double>::quiet_NaN()}) {
    ClientOptions options;
    options.timeout = timeout;
    EXPECT_EQ(option_error(options),
              "timeout = " + std::to_string(timeout) + " s; must be above 0 and at most 1000000");
  }
  ClientOptions options;
  options.master_uri = "localhost:11311";
  EXPECT_EQ(option_error(options), "master_uri = \"localhost:11311\"; must be http://HOST:PORT");
}

TEST(ClientOptions, AServersNameMayBeALetter) {
  ScriptedServer server({test::tell_specification});
  ScriptedServer master({test::master_of(server.address())});
  ClientOptions options;
  options.server = "/a";
  options.master_uri = "http://" + master.address();
  EXPECT_NO_THROW(Client{options});
}

TEST(ClientOptions, TheMasterComesFromTheEnvironment) {
  const char* const set = std::getenv("ROS_MASTER_URI");
  const std::string before = set != nullptr ? set : "";
  setenv("ROS_MASTER_URI", "nonsense", 1);
  EXPECT_EQ(option_error({}), "ROS_MASTER_URI = \"nonsense\"; must be http://HOST:PORT");
  ScriptedServer server({test::tell_specification});
  ScriptedServer master({test::master_of(server.address())});
  setenv("ROS_MASTER_URI", ("http://" + master.address()).c_str(), 1);
  EXPECT_NO_THROW(Client());
  if (set != nullptr) {
    setenv("ROS_MASTER_URI", before.c_str(), 1);
  } else {
    unsetenv("ROS_MASTER_URI");
  }
}

TEST(ClientOptions, AServerThatNobodyKnowsIsNamed) {
  ScriptedServer master({[](Peer& peer) {
    peer.take_post();
    peer.give(test::http_answer(test::xml_answer(-1, "no provider", "")));
  }});
  ClientOptions options;
  options.server = "/gone";
  options.master_uri = "http://" + master.address();
  EXPECT_EQ(message_of<ConnectionError>([&] { Client client(options); }),
            "ROS master " + options.master_uri +
                ": it does not know /gone/get_spec (no provider): is the server running, under "
                "this name, and in a version that has this service?");
}

TEST(ClientOptions, AServerThatDiedWithoutAWordIsNamed) {
  const std::string address = "127.0.0.1:" + std::to_string(test::dead_port());
  ScriptedServer master({test::master_of(address)});
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  EXPECT_EQ(message_of<ConnectionError>([&] { Client client(options); }),
            "service /walker_sim/get_spec at " + address +
                ", as the ROS master has it: Connection refused; has the server died, or can its "
                "host not be reached under this name (its ROS_HOSTNAME or ROS_IP)?");
}

}  // namespace
}  // namespace walker

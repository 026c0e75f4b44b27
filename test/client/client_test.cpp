// The client's calls, with a scripted master and server.
#include "walker_sim/client.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <limits>
#include <optional>
#include <thread>
#include <tuple>

#include "allocation_counter.h"
#include "base/posix.h"
#include "client/scripted_server.h"
#include "client/scripted_walker.h"
#include "error_message.h"

namespace walker::test {
namespace {

void expect_example(const Transition& transition) {
  EXPECT_EQ(to_bytes(transition), to_bytes(example_transition()));
}

TEST(Client, ReadsTheSpecification) {
  const std::string specification = to_bytes(example_specification());
  ScriptedServer server({answering(kGetSpec, {answer(specification), answer(specification)})});
  ScriptedServer master({master_of(server.address())});
  EXPECT_EQ(to_bytes(Client(options_for(master)).specification()), specification);
}

TEST(Client, SendsItsHeader) {
  tcpros::Fields fields;
  ScriptedWalker walker({[&](Peer& peer) {
    fields = take_header(peer);
    peer.give(header({{"md5sum", kServiceTypes[kStep].md5sum}}));
    peer.take_frame();
    peer.give(example_answer());
  }});
  walker.step();
  EXPECT_EQ(fields, (tcpros::Fields{{"callerid", "/walker_sim_client_" + std::to_string(getpid())},
                                    {"md5sum", kServiceTypes[kStep].md5sum},
                                    {"persistent", "1"},
                                    {"service", "/walker_sim/step"},
                                    {"type", "walker_sim/Step"}}));
}

/// Calls once. @return the request's payload
template <typename Call>
std::string request_of(ServiceIndex service, const std::string& body, const Call& call) {
  std::vector<std::string> requests;
  ScriptedWalker walker({answering(service, {answer(body)}, &requests)});
  call(walker.client());
  return requests.at(0);
}

/// A world as it is sent: the empty one as the preset that is Gymnasium's.
std::string sent(const World& world) {
  Message message;
  return append(world, message.text(world.empty() ? "gymnasium" : "")).bytes();
}

/// messages_test has the answers. An empty list resets all environments of the server.
TEST(Client, SendsRequests) {
  using Environments = std::vector<std::uint32_t>;
  const std::vector<double> action{0.5, -0.0, std::numeric_limits<double>::quiet_NaN()};
  const World world{{"gravity", {-2, -1}}, {"pit_gap", {0.5, 0.5}}};
  const std::uint64_t max = std::numeric_limits<std::uint64_t>::max();
  const std::vector<std::optional<std::uint64_t>> seeds{5, std::nullopt};
  Transition transition;
  RepeatedStep repeated;
  Reset reset;
  BatchTransition batch;
  BatchReset resets;
  const std::string begun = to_bytes(Reset{example_transition(), {}});
  const std::string done = Message().number(std::uint8_t{1}).text("").bytes();
  const std::string two_begun = to_bytes(BatchReset{{1, 2, 3, 4, 5, 6}, {7, 8}, {}, {}, {}});
  const std::string own_world(8, '\0');  // no preset, no parameters
  const auto lists = [&](const std::vector<World>& worlds) {
    Message message;
    message.array<std::uint32_t>({1, 0}).array<std::uint8_t>({1, 0}).array<std::uint64_t>({5, 0});
    std::string bytes = message.number(static_cast<std::uint32_t>(worlds.size())).bytes();
    for (const World& each : worlds) bytes += sent(each);
    return bytes;
  };
  const std::tuple<ServiceIndex, std::string, std::function<void(Client&)>, std::string> calls[] = {
      {kStep, to_bytes(example_transition()),
       [&](Client& client) { client.step(action.data(), action.size(), transition); },
       Message().array(action).bytes()},
      {kStepMany, to_bytes(RepeatedStep{example_transition(), 2, -0.25}),
       [&](Client& client) { client.step_many(action.data(), action.size(), 4, repeated); },
       Message().array(action).number(std::uint32_t{4}).bytes()},
      {kStepBatch, to_bytes(example_batch()),
       [&](Client& client) { client.step_batch(action.data(), action.size(), batch); },
       Message().array(action).bytes()},
      {kSetState, to_bytes(example_transition()),
       [&](Client& client) {
         client.set_state(2, {1.5, -0.0}, {0.25}, transition);
       },
       Message().number(std::uint32_t{2}).array<double>({1.5, -0.0}).array<double>({0.25}).bytes()},
      {kReset, begun, [&](Client& client) { client.reset(max, transition); },
       Message().number(std::uint8_t{1}).number(max).bytes() + own_world},
      {kReset, begun, [&](Client& client) { client.reset({}, transition); },
       std::string(9, '\0') + own_world},
      {kReset, begun, [&](Client& client) { client.reset({}, world, reset); },
       std::string(9, '\0') + sent(world)},
      {kReset, begun, [&](Client& client) { client.reset({}, World{}, reset); },
       std::string(9, '\0') + sent({})},
      {kResetBatch, two_begun,
       [&](Client& client) {
         client.reset_batch({1, 0}, seeds, resets);
       },
       lists({})},
      {kResetBatch, two_begun,
       [&](Client& client) {
         client.reset_batch({1, 0}, seeds, {world}, resets);
       },
       lists({world})},
      {kResetBatch, two_begun,
       [&](Client& client) {
         client.reset_batch({1, 0}, seeds, {{}, world}, resets);
       },
       lists({{}, world})},
      {kResetBatch, two_begun, [&](Client& client) { client.reset_batch({}, {}, resets); },
       std::string(16, '\0')},
      {kResetBatch, to_bytes(BatchReset{{1, 2, 3}, {7}, {}, {}, {}}),
       [&](Client& client) { client.reset_batch({1}, {}, resets); },
       Message().array(Environments{1}).bytes() + std::string(12, '\0')},
      {kSetWorld, done,
       [&](Client& client) {
         client.set_world({1, 0}, {world, {}});
       },
       Message().array(Environments{1, 0}).number(std::uint32_t{2}).bytes() + sent(world) +
           sent({})},
  };
  for (const auto& [service, body, call, request] : calls) {
    EXPECT_EQ(request_of(service, body, call), request) << kServiceTypes[service].name;
  }
}

TEST(Client, ThrowsTheReasonOfARefusedWorld) {
  const std::string refusal = Message().number(std::uint8_t{0}).text("no").bytes();
  const auto set_world = [](Client& client) { client.set_world({}, {World{}}); };
  EXPECT_EQ(message_of<RequestRefused>([&] { request_of(kSetWorld, refusal, set_world); }), "no");
}

TEST(Client, RendersColorsAndDepths) {
  Image image;
  image.depth = {1};
  const auto render = [&](const Picture& picture, std::uint32_t environment,
                          const std::string& encoding, const Parameters& camera) {
    return request_of(kRender, picture.bytes(),
                      [&](Client& client) { client.render(environment, encoding, camera, image); });
  };
  const Parameters camera{{"width", std::int64_t{2}}, {"camera_name", std::string("track")}};
  Message request;
  request.number(std::uint32_t{7})
      .text("rgb8")
      .texts({"camera_name", "width"})
      .texts({"track", "2"});
  EXPECT_EQ(render({}, 7, "rgb8", camera), request.bytes());
  EXPECT_EQ(image.width, 2U);
  EXPECT_EQ(image.height, 1U);
  EXPECT_EQ(image.rgb, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 255}));
  EXPECT_TRUE(image.depth.empty());
  const std::string depths = Message().number(0.5F).number(-3.0F).bytes();
  EXPECT_EQ(render({"32FC1", 1, 2, 4, depths}, 0, "32FC1", {}),
            Message().number(std::uint32_t{0}).text("32FC1").texts({}).texts({}).bytes());
  EXPECT_EQ(image.width, 1U);
  EXPECT_EQ(image.height, 2U);
  EXPECT_EQ(image.depth, (std::vector<float>{0.5F, -3.0F}));
  EXPECT_TRUE(image.rgb.empty());
}

TEST(Client, AcceptsLongAnswersInPieces) {
  constexpr std::uint32_t kSize = 500000;
  ServerSpecification specification = example_specification();
  specification.observation_size = kSize;
  specification.observation_low.assign(kSize, -1);
  specification.observation_high.assign(kSize, 1);
  Transition meant = example_transition();
  meant.observation.assign(kSize, 0.5);
  Transition in_pieces = meant;
  in_pieces.observation.front() = -0.5;
  ScriptedWalker walker({[&](Peer& peer) {
                          const std::string first = answer(to_bytes(in_pieces));
                          open(peer, kStep);
                          peer.take_frame();
                          for (std::size_t i = 0; i < 200; ++i) peer.give(first.substr(i, 1));
                          peer.give(first.substr(200));
                          peer.take_frame();
                          peer.give(answer(to_bytes(meant)));
                          peer.sees_end();
                        }},
                        30, {}, specification);
  walker.step();
  EXPECT_EQ(to_bytes(walker.transition), to_bytes(in_pieces));
  walker.step();
  EXPECT_EQ(to_bytes(walker.transition), to_bytes(meant));
}

TEST(Client, SendsRequestsThatDoNotFitTheSocket) {
  const std::vector<double> actions(4000000, 0.5);
  std::size_t size = 0;
  ScriptedWalker walker({[&](Peer& peer) {
    open(peer, kStep);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // the buffer fills
    size = peer.take_frame().size();
    peer.give(example_answer());
    peer.sees_end();
  }});
  walker.client().step(actions.data(), actions.size(), walker.transition);
  EXPECT_EQ(size, 4 + actions.size() * sizeof(double));
}

using ClientAllocation = AllocationTest;

TEST_F(ClientAllocation, StepsWithoutTheHeap) {
  ScriptedWalker walker({[](Peer& peer) {
    open(peer, kStep);
    const std::string answer = example_answer();
    // All requests have one size. This thread must not allocate: the counter covers it too.
    std::string request(4 + 4 + sizeof(double), '\0');
    while (peer.take(request)) peer.give(answer);
  }});
  walker.step();
  walker.step();
  {
    const Counting counting;
    for (int i = 0; i < 100; ++i) walker.step();
  }
  EXPECT_EQ(allocations, 0);
}

TEST(Client, ThrowsTheServersReason) {
  Transition other;
  other.step = 1;
  const auto refusal = [&](const std::string& reason) {
    return answer(to_bytes(other, false, reason));
  };
  const std::string no_reason = "the server gives no reason";
  const std::pair<std::string, std::string> cases[] = {
      {refusal("action has ..."), "action has ..."},
      {answer("not this request", 0), "not this request"},
      {refusal("no\xFE"), "no\\xfe"},
      {answer("\x80!", 0), "\\x80!"},
      {refusal(""), no_reason},
      {answer("", 0), no_reason},
  };
  std::vector<std::string> answers{example_answer()};
  for (const auto& row : cases) answers.push_back(row.first);
  answers.push_back(example_answer());
  ScriptedWalker walker({answering(kStep, answers)});
  walker.step();
  for (const auto& [answer, reason] : cases) {
    EXPECT_EQ(message_of<RequestRefused>([&] { walker.step(); }), reason);
    expect_example(walker.transition);
  }
  walker.step();  // on the same connection
}

TEST(Client, LeavesTheResultIfTheAnswerIsMalformed) {
  BatchTransition changed = example_batch();
  changed.rewards[0] = 5;
  changed.final_environments = {2};
  ScriptedWalker walker(
      {answering(kStepBatch, {answer(to_bytes(example_batch())), answer(to_bytes(changed))})});
  BatchTransition batch;
  const std::vector<double> actions{0.25, -0.25};
  const auto step = [&] { walker.client().step_batch(actions.data(), actions.size(), batch); };
  step();
  EXPECT_EQ(message_of<ConnectionError>(step),
            "service /walker_sim/step_batch at " + walker.address() +
                ": its answer's final_environments[0] is 2; must be below num_envs = 2" + kLost);
  EXPECT_EQ(to_bytes(batch), to_bytes(example_batch()));
}

/// After a restart with other parameters, a client that fetches the specification works again.
TEST(Client, ChecksAnswersByTheLastSpecification) {
  ServerSpecification other = example_specification();
  other.observation_size = 4;
  other.observation_low.push_back(-4);
  other.observation_high.push_back(4);
  Transition longer = example_transition();
  longer.observation.push_back(0.125);
  const auto steps = answering(kStep, {answer(to_bytes(longer))});
  ScriptedWalker walker({steps, telling(other), steps});
  EXPECT_THROW(walker.step(), ConnectionError);
  EXPECT_EQ(walker.client().specification().observation_size, 4U);
  walker.step();
  EXPECT_EQ(walker.transition.observation, longer.observation);
}

TEST(Client, StepsAServerThatDoesNotRender) {
  ScriptedServer server(
      {tell_specification, answering(kStep, {example_answer(), example_answer()})});
  const ScriptedServer::Script known = master_of(server.address());
  ScriptedServer master({known, known, unknowing_master("no provider")});
  Client client(options_for(master));
  Transition transition;
  client.step(nullptr, 0, transition);
  Image image;
  EXPECT_EQ(message_of<ConnectionError>([&] { client.render(0, "", {}, image); }),
            "ROS master http://" + master.address() +
                ": it does not know /walker_sim/render (no provider): is the server running, under "
                "this name, and in a version that has this service?");
  client.step(nullptr, 0, transition);  // on the same connection
}

bool holds_in_child(const std::function<bool()>& condition) {
  const pid_t child = fork();
  if (child == 0) _exit(condition() ? 0 : 1);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(Forks, AreCountedInTheChild) {
  const unsigned before = num_forks();
  EXPECT_TRUE(holds_in_child([&] { return num_forks() == before + 1; }));
  EXPECT_EQ(num_forks(), before);
}

TEST(Forks, RefuseTheChildsCallsOnly) {
  const std::string good = example_answer();
  ScriptedWalker walker({answering(kStep, {good, good})});
  walker.step();
  EXPECT_TRUE(holds_in_child([&] {
    return message_of<ConnectionError>([&] { walker.step(); }) == kForkedClientError &&
           message_of<ConnectionError>([&] { walker.client().specification(); }) ==
               kForkedClientError;
  }));
  walker.step();
  EXPECT_EQ(walker.transition.step, 9U);
}

}  // namespace
}  // namespace walker::test

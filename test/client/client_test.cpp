// The client's calls, with a scripted master and server.
#include "walker_sim/client.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <limits>
#include <thread>

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

TEST(Client, Steps) {
  const std::vector<double> action{0.5, -0.0, std::numeric_limits<double>::quiet_NaN()};
  Transition transition;
  EXPECT_EQ(
      request_of(kStep, to_bytes(example_transition()),
                 [&](Client& client) { client.step(action.data(), action.size(), transition); }),
      Message().array(action).bytes());
  expect_example(transition);
}

TEST(Client, RepeatsAStep) {
  const RepeatedStep meant{example_transition(), 2, -0.25};
  const std::vector<double> action{0.5, -0.0};
  RepeatedStep repeated;
  EXPECT_EQ(request_of(kStepMany, to_bytes(meant),
                       [&](Client& client) {
                         client.step_many(action.data(), action.size(), 4, repeated);
                       }),
            Message().array(action).number(std::uint32_t{4}).bytes());
  EXPECT_EQ(to_bytes(repeated), to_bytes(meant));
}

TEST(Client, Resets) {
  const std::uint64_t max = std::numeric_limits<std::uint64_t>::max();
  for (const std::optional<std::uint64_t> seed : {std::optional<std::uint64_t>(max), {}}) {
    Transition transition;
    const std::string own_world(8, '\0');  // no preset, no parameters
    EXPECT_EQ(request_of(kReset, to_bytes(Reset{example_transition(), {}}),
                         [&](Client& client) { client.reset(seed, transition); }),
              Message().number(std::uint8_t{seed.has_value()}).number(seed.value_or(0)).bytes() +
                  own_world);
    expect_example(transition);
  }
}

/// A world as it is sent: the empty one as the preset that is Gymnasium's.
std::string sent(const World& world) {
  Message message;
  return append(world, message.text(world.empty() ? "gymnasium" : "")).bytes();
}

TEST(Client, ResetsInAWorld) {
  const Reset meant{example_transition(), {{"gravity", -1.5}, {"pit_gap", 0.5}}};
  for (const World& world : {World{{"gravity", {-2, -1}}, {"pit_gap", {0.5, 0.5}}}, World{}}) {
    Reset reset;
    EXPECT_EQ(request_of(kReset, to_bytes(meant),
                         [&](Client& client) { client.reset(std::nullopt, world, reset); }),
              std::string(9, '\0') + sent(world));
    EXPECT_EQ(to_bytes(reset), to_bytes(meant));
  }
}

TEST(Client, SetsWorlds) {
  const World moon{{"gravity", {-1.62, -1.62}}};
  EXPECT_EQ(request_of(kSetWorld, Message().number(std::uint8_t{1}).text("").bytes(),
                       [&](Client& client) {
                         client.set_world({1, 0}, {moon, {}});
                       }),
            Message().array<std::uint32_t>({1, 0}).number(std::uint32_t{2}).bytes() + sent(moon) +
                sent({}));
  EXPECT_EQ(message_of<RequestRefused>([&] {
              request_of(kSetWorld, Message().number(std::uint8_t{0}).text("no").bytes(),
                         [&](Client& client) { client.set_world({}, {moon}); });
            }),
            "no");
}

TEST(Client, ResetsABatch) {
  const BatchReset meant{{1, 2, 3, 4, 5, 6}, {7, 8}, {1}, {"the engine"}, {{0, {{"gravity", -3}}}}};
  const World world{{"gravity", {-4, -2}}};
  for (const std::vector<World>& worlds : {std::vector<World>{}, {world}, {{}, world}}) {
    BatchReset reset;
    std::string expected = Message()
                               .array<std::uint32_t>({1, 0})
                               .array<std::uint8_t>({1, 0})
                               .array<std::uint64_t>({5, 0})
                               .number(static_cast<std::uint32_t>(worlds.size()))
                               .bytes();
    for (const World& each : worlds) expected += sent(each);
    EXPECT_EQ(
        request_of(kResetBatch, to_bytes(meant),
                   [&](Client& client) {
                     client.reset_batch({1, 0}, {std::uint64_t{5}, std::nullopt}, worlds, reset);
                   }),
        expected);
    EXPECT_EQ(to_bytes(reset), to_bytes(meant));
  }
}

/// An empty list resets all environments of the server.
TEST(Client, ResetsAllOrOne) {
  for (const std::vector<std::uint32_t>& environments : {std::vector<std::uint32_t>{}, {1}}) {
    const std::size_t rows = environments.empty() ? 2 : 1;
    const BatchReset meant{
        std::vector<double>(3 * rows, 0.5), std::vector<double>(rows, 2), {}, {}, {}};
    BatchReset reset;
    request_of(kResetBatch, to_bytes(meant),
               [&](Client& client) { client.reset_batch(environments, {}, reset); });
    EXPECT_EQ(to_bytes(reset), to_bytes(meant));
  }
}

TEST(Client, StepsABatch) {
  BatchTransition received;
  const std::vector<double> actions{0.5, -0.5};
  EXPECT_EQ(request_of(kStepBatch, to_bytes(example_batch()),
                       [&](Client& client) {
                         client.step_batch(actions.data(), actions.size(), received);
                       }),
            Message().array(actions).bytes());
  EXPECT_EQ(to_bytes(received), to_bytes(example_batch()));
}

TEST(Client, RendersAPicture) {
  Image image;
  image.depth = {1};
  EXPECT_EQ(request_of(kRender, Picture().bytes(),
                       [&](Client& client) {
                         client.render(
                             7, "rgb8",
                             {{"width", std::int64_t{2}}, {"camera_name", std::string("track")}},
                             image);
                       }),
            Message()
                .number(std::uint32_t{7})
                .text("rgb8")
                .texts({"camera_name", "width"})
                .texts({"track", "2"})
                .bytes());
  EXPECT_EQ(image.width, 2U);
  EXPECT_EQ(image.height, 1U);
  EXPECT_EQ(image.rgb, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 255}));
  EXPECT_TRUE(image.depth.empty());
}

TEST(Client, RendersDepth) {
  Picture picture;
  picture.encoding = "32FC1";
  picture.height = 2;
  picture.width = 1;
  picture.row_bytes = 4;
  picture.data = Message().number(0.5F).number(-3.0F).bytes();
  Image image;
  image.rgb = {1};
  EXPECT_EQ(request_of(kRender, picture.bytes(),
                       [&](Client& client) { client.render(0, "32FC1", {}, image); }),
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

// Answers whose lengths or indices contradict the server's specification, one field at a time.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/limits.h"
#include "client/messages.h"
#include "client/scripted_server.h"
#include "client/scripted_walker.h"
#include "error_message.h"
#include "walker_sim/client.h"

namespace walker {
namespace {

using test::kLost;
using test::Peer;
using test::ScriptedServer;
using test::ScriptedWalker;

constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();

template <typename Message>
struct Wrong {
  Message message;
  std::string words;
};

template <typename Message>
class Table {
 public:
  explicit Table(Message right) : right_(std::move(right)) {}

  template <typename Change>
  void add(const Change& change, const std::string& words) {
    Message message = right_;
    change(message);
    entries_.push_back({message, "its answer's " + words});
  }

  template <typename Field>
  void add_sizes(const std::string& name, Field Message::*field) {
    const std::size_t size = (right_.*field).size();
    for (const std::size_t other : std::set<std::size_t>{0, size - 1, size + 1}) {
      add([&](Message& message) { (message.*field).resize(other); },
          name + " has " + std::to_string(other) + " elements; must have " + std::to_string(size));
    }
  }

  const std::vector<Wrong<Message>>& entries() const { return entries_; }

 private:
  Message right_;
  std::vector<Wrong<Message>> entries_;
};

/// Calls three times: a valid and an invalid answer on one connection, a valid one on the next.
/// @return the ConnectionError's message, after the service and its address
template <typename Result>
std::string refusal(ServiceIndex service, const std::string& right, const std::string& wrong,
                    const std::function<void(Client&, Result&)>& call) {
  const std::string good = test::answer(right);
  ScriptedWalker walker(
      {test::answering(service, {good, test::answer(wrong)}), test::answering(service, {good})});
  Result result;
  call(walker.client(), result);
  const std::string error = message_of<ConnectionError>([&] { call(walker.client(), result); });
  EXPECT_EQ(test::to_bytes(result), right) << "as it was";
  call(walker.client(), result);
  EXPECT_EQ(test::to_bytes(result), right);
  const std::string whom = std::string("service /walker_sim/") + kServiceTypes[service].name +
                           " at " + walker.address() + ": ";
  EXPECT_EQ(error.rfind(whom, 0), 0U) << error;
  return error.substr(whom.size());
}

template <typename Result>
void expect_refused(ServiceIndex service, const Result& right, const Table<Result>& wrong,
                    const std::function<void(Client&, Result&)>& call) {
  for (const Wrong<Result>& entry : wrong.entries()) {
    EXPECT_EQ(refusal<Result>(service, test::to_bytes(right), test::to_bytes(entry.message), call),
              entry.words + kLost);
  }
}

void step(Client& client, Transition& transition) {
  const double action = 0.25;
  client.step(&action, 1, transition);
}

void step_batch(Client& client, BatchTransition& transition) {
  const double actions[] = {0.25, -0.25};
  client.step_batch(actions, 2, transition);
}

TEST(Answers, OfAStepAreMeasured) {
  Table<Transition> table(test::example_transition());
  table.add_sizes("observation", &Transition::observation);
  table.add_sizes("info", &Transition::info);
  table.add_sizes("action", &Transition::action);
  for (const std::uint32_t environment : {std::uint32_t{2}, kMax}) {
    table.add([&](Transition& transition) { transition.environment = environment; },
              "environment is " + std::to_string(environment) + "; must be below num_envs = 2");
  }
  table.add([](Transition& transition) { transition.step = 0; },
            "action has 1 elements; must have 0");
  expect_refused<Transition>(kStep, test::example_transition(), table, step);
}

TEST(Answers, OfARepeatedStepAreMeasured) {
  Table<RepeatedStep> table({test::example_transition(), 3, -0.5});
  table.add([](RepeatedStep& repeated) { repeated.transition.observation.clear(); },
            "observation has 0 elements; must have 3");
  table.add([](RepeatedStep& repeated) { repeated.transition.environment = 2; },
            "environment is 2; must be below num_envs = 2");
  for (const std::uint32_t steps : {std::uint32_t{0}, std::uint32_t{5}, kMax}) {
    table.add([&](RepeatedStep& repeated) { repeated.steps = steps; },
              "steps is " + std::to_string(steps) + "; must be in [1, 4]");
  }
  expect_refused<RepeatedStep>(kStepMany, {test::example_transition(), 3, -0.5}, table,
                               [](Client& client, RepeatedStep& repeated) {
                                 const double action = 0.25;
                                 client.step_many(&action, 1, 4, repeated);
                               });
}

TEST(Answers, OfAResetAreMeasured) {
  Transition right = test::example_transition();
  right.step = 0;
  right.action.clear();
  Table<Transition> table(right);
  table.add_sizes("observation", &Transition::observation);
  table.add_sizes("info", &Transition::info);
  expect_refused<Transition>(kReset, right, table, [](Client& client, Transition& transition) {
    client.reset(7, transition);
  });
}

TEST(Answers, OfABatchsStepAreMeasured) {
  Table<BatchTransition> table(test::example_batch());
  table.add_sizes("observations", &BatchTransition::observations);
  table.add_sizes("rewards", &BatchTransition::rewards);
  table.add_sizes("terminated", &BatchTransition::terminated);
  table.add_sizes("truncated", &BatchTransition::truncated);
  table.add_sizes("episodes", &BatchTransition::episodes);
  table.add_sizes("steps", &BatchTransition::steps);
  table.add_sizes("info", &BatchTransition::info);
  table.add_sizes("final_observations", &BatchTransition::final_observations);
  table.add_sizes("final_info", &BatchTransition::final_info);
  const auto ended = [&](const std::vector<std::uint32_t>& environments, const std::string& words) {
    table.add([&](BatchTransition& batch) { batch.final_environments = environments; }, words);
  };
  ended({}, "final_observations has 3 elements; must have 0");
  ended({0, 1}, "final_observations has 3 elements; must have 6");
  ended({2}, "final_environments[0] is 2; must be below num_envs = 2");
  ended({kMax}, "final_environments[0] is 4294967295; must be below num_envs = 2");
  ended({1, 1}, "final_environments[1] is 1; must be above the one before, 1");
  ended({1, 0}, "final_environments[1] is 0; must be above the one before, 1");
  ended({0, 1, 2}, "final_environments[2] is 2; must be below num_envs = 2");
  table.add([](BatchTransition& batch) { batch.failed_environments[0] = 2; },
            "failed_environments[0] is 2; must be below num_envs = 2");
  table.add([](BatchTransition& batch) { batch.failures.emplace_back(); },
            "failures has 2 elements; must have 1");
  table.add([](BatchTransition& batch) { batch.failed_at_reset[0] = 3; },
            "failed_at_reset[0] is 3; must be 0 or 1");
  table.add([](BatchTransition& batch) { batch.terminated[1] = 2; },
            "terminated[1] is 2; must be 0 or 1");
  table.add([](BatchTransition& batch) { batch.truncated[0] = 255; },
            "truncated[0] is 255; must be 0 or 1");
  expect_refused<BatchTransition>(kStepBatch, test::example_batch(), table, step_batch);
}

TEST(Answers, OfABatchsResetAreMeasured) {
  for (const std::vector<std::uint32_t>& environments :
       {std::vector<std::uint32_t>{}, {1}, {1, 0}}) {
    const std::size_t rows = environments.empty() ? 2 : environments.size();
    const BatchReset right{
        std::vector<double>(3 * rows, 0.5), std::vector<double>(rows, 2), {0}, {"the engine"}};
    Table<BatchReset> table(right);
    table.add_sizes("observations", &BatchReset::observations);
    table.add_sizes("info", &BatchReset::info);
    table.add([](BatchReset& reset) { reset.failed_environments[0] = 2; },
              "failed_environments[0] is 2; must be below num_envs = 2");
    table.add([](BatchReset& reset) { reset.failures.clear(); },
              "failures has 0 elements; must have 1");
    expect_refused<BatchReset>(kResetBatch, right, table, [&](Client& client, BatchReset& reset) {
      client.reset_batch(environments, {}, reset);
    });
  }
}

/// Returns the client's error for this answer of get_spec, after the service and its address.
std::string specification_refusal(const std::string& answer) {
  ScriptedServer server({test::answering(kGetSpec, {answer})});
  ScriptedServer master({test::master_of(server.address())});
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  const std::string error = message_of<ConnectionError>([&] { Client client(options); });
  const std::string whom = "service /walker_sim/get_spec at " + server.address() + ": ";
  EXPECT_EQ(error.rfind(whom, 0), 0U) << error;
  return error.substr(whom.size());
}

TEST(Answers, OfASpecificationAreMeasuredByThemselves) {
  Table<ServerSpecification> table(test::example_specification());
  for (const std::uint32_t num_envs : {std::uint32_t{0}, std::uint32_t{100001}, kMax}) {
    table.add([&](ServerSpecification& told) { told.num_envs = num_envs; },
              "num_envs is " + std::to_string(num_envs) + "; must be in [1, 100000]");
  }
  for (const std::uint32_t size : {std::uint32_t{0}, std::uint32_t{4}, kMax}) {
    table.add([&](ServerSpecification& told) { told.observation_size = size; },
              "observation_low has 3 elements; must have " + std::to_string(size));
    table.add([&](ServerSpecification& told) { told.action_size = size; },
              "action_low has 1 elements; must have " + std::to_string(size));
  }
  table.add_sizes("parameter_values", &ServerSpecification::parameter_values);
  table.add_sizes("observation_low", &ServerSpecification::observation_low);
  table.add_sizes("observation_high", &ServerSpecification::observation_high);
  table.add_sizes("action_low", &ServerSpecification::action_low);
  table.add_sizes("action_high", &ServerSpecification::action_high);
  table.add_sizes("joint_names", &ServerSpecification::joint_names);
  for (const Wrong<ServerSpecification>& wrong : table.entries()) {
    EXPECT_EQ(specification_refusal(test::answer(test::to_bytes(wrong.message))),
              wrong.words + kLost);
  }
}

/// Before the specification is known, a fixed limit of 16 MiB applies.
TEST(Answers, ALongSpecificationIsNotTaken) {
  EXPECT_EQ(specification_refusal(test::Message().number('\1').number(kMax).bytes()),
            "it announces an answer of 4294967295 bytes; at most 16777216 are taken" + kLost);
}

/// The specification determines the maximum length of an answer.
TEST(Answers, AreNoLongerThanTheyNeedToBe) {
  const ServerSpecification server = test::example_specification();
  constexpr std::size_t kMebibyte = 1 << 20;
  for (const ServiceIndex service : {kReset, kStep, kStepMany, kRestore, kResetBatch, kStepBatch}) {
    EXPECT_GE(max_answer_bytes(service, server), kMebibyte);
    EXPECT_LT(max_answer_bytes(service, server), kMebibyte + 4096);
  }
  EXPECT_EQ(max_answer_bytes(kGetSpec, server), kMaxSpecificationBytes);
  EXPECT_GE(max_answer_bytes(kSnapshot, server), 16000000 + kMaxSpecificationBytes);
  EXPECT_LT(max_answer_bytes(kSnapshot, server), 18000000 + kMaxSpecificationBytes);
  EXPECT_LT(max_answer_bytes(kRender, server), 70 * kMebibyte);
  ServerSpecification large = server;
  large.num_envs = kMaxEnvironments;
  large.observation_size = 500000;
  EXPECT_EQ(max_answer_bytes(kStepBatch, large), tcpros::kMaxMessageBytes);
}

/// An empty string takes 4 bytes in an answer and 32 in memory.
TEST(Answers, OfTooManyTextsAreNotTaken) {
  ServerSpecification told = test::example_specification();
  told.info_names.resize(kMaxTexts + 1);
  EXPECT_EQ(specification_refusal(test::answer(test::to_bytes(told))),
            "its answer's array has 4097 texts; must have at most 4096" + kLost);
}

TEST(Answers, TextsThatAreNoUtf8AreEscaped) {
  ServerSpecification told = test::example_specification();
  told.engine_path = "/\xFF";
  Transition failed = test::example_transition();
  failed.error = "it broke: \xC3(";
  ScriptedWalker walker(
      {test::answering(kStep, {test::answer(test::to_bytes(failed)),
                               test::answer(test::to_bytes(failed, false, "no\xFE")),
                               test::answer("\x80!", '\0')})},
      30, {}, told);
  walker.step();
  EXPECT_EQ(walker.transition.error, "it broke: \\xc3(");
  EXPECT_EQ(message_of<RequestRefused>([&] { walker.step(); }), "no\\xfe");
  EXPECT_EQ(message_of<RequestRefused>([&] { walker.step(); }), "\\x80!");
}

TEST(Answers, ARefusalWithoutAReasonHasWords) {
  const Transition failed = test::example_transition();
  ScriptedWalker walker({test::answering(kStep, {test::answer(test::to_bytes(failed, false, "")),
                                                 test::answer("", '\0')})},
                        30);
  const std::string words = "the server gives no reason";
  EXPECT_EQ(message_of<RequestRefused>([&] { walker.step(); }), words);
  EXPECT_EQ(message_of<RequestRefused>([&] { walker.step(); }), words);
}

TEST(Answers, OfAMasterOrAHeaderAreEscaped) {
  ScriptedServer server({[](Peer& peer) {
    test::take_header(peer);
    peer.give(test::header({{"error", "no\n\x1b[2J\xFF"}}));
  }});
  ScriptedServer master({test::master_of(server.address()), [](Peer& peer) {
                           peer.take_post();
                           peer.give(test::http_answer(test::xml_answer(-1, "un\xFFknown", "")));
                         }});
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  EXPECT_NE(message_of<ConnectionError>([&] {
              Client client(options);
            }).find("it says: no\\n\\x1b[2J\\xff"),
            std::string::npos);
  EXPECT_NE(message_of<ConnectionError>([&] { Client client(options); }).find("(un\\xffknown)"),
            std::string::npos);
}

/// After a restart with other parameters, a client that fetches the specification works again.
TEST(Answers, AreMeasuredByTheLastSpecification) {
  ServerSpecification other = test::example_specification();
  other.observation_size = 4;
  other.observation_low.push_back(-4);
  other.observation_high.push_back(4);
  Transition longer = test::example_transition();
  longer.observation.push_back(0.125);
  const auto steps = test::answering(kStep, {test::answer(test::to_bytes(longer))});
  ScriptedWalker walker({steps, test::telling(other), steps});
  EXPECT_THROW(walker.step(), ConnectionError);
  EXPECT_EQ(walker.client().specification().observation_size, 4U);
  walker.step();
  EXPECT_EQ(walker.transition.observation, longer.observation);
}

}  // namespace
}  // namespace walker

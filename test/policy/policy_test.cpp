// Policy files: reading, acting by the documented formula, and errors with file name and reason.
#include "walker_sim/policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "error_message.h"
#include "policy/policy_bytes.h"
#include "temporary_folder.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

Policy read(const std::string& bytes) { return {"toy", {bytes.begin(), bytes.end()}}; }

double act(const PolicyBytes& written, const std::array<double, 2>& observation) {
  Policy policy = read(written.bytes());
  double action = 0;
  policy.act(observation.data(), &action);
  return action;
}

std::string refusal(const std::string& bytes) {
  const std::string message = message_of<PolicyError>([&] { read(bytes); });
  const std::string head = "policy toy: ";
  EXPECT_EQ(message.rfind(head, 0), 0U) << message;
  return message.substr(std::min(head.size(), message.size()));
}

TEST(Policy, HasItsMetadata) {
  const Policy policy = read(small_policy().bytes());
  EXPECT_EQ(policy.id(), "Toy-v0");
  EXPECT_EQ(policy.notes(), (std::map<std::string, std::string>{{"steps", "12"}}));
  EXPECT_EQ(policy.observation_size(), 2U);
  EXPECT_EQ(policy.action_size(), 1U);
}

TEST(Policy, NormalisesAndAppliesItsLayers) {
  // The normalised observations are (2 - 1) / 2 and (-0.9 + 1) / 0.5.
  const double first = std::tanh(0.5 + 2 * 0.2 + 0.1);
  const double second = std::tanh(3 * 0.5 + 4 * 0.2 - 0.2);
  EXPECT_NEAR(act(small_policy(), {2, -0.9}), 0.5 * first - 0.25 * second + 0.05, 1e-6);
}

TEST(Policy, AppliesRelu) {
  PolicyBytes relu = small_policy();
  relu.metadata["activation"] = "relu";
  EXPECT_NEAR(act(relu, {2, -0.9}), 0.5 * 1.0 - 0.25 * 2.1 + 0.05, 1e-6);
  EXPECT_NEAR(act(relu, {-2, -1.9}), 0.05, 1e-6);
}

TEST(Policy, ClipsObservationsAtTenDeviations) {
  PolicyBytes linear = small_policy();
  linear.metadata["layers"] = "1";
  linear.tensors["layers.0.weight"] = {"F32", {1, 2}, {0.01, 0}};
  linear.tensors["layers.0.bias"] = {"F32", {1}, {0}};
  EXPECT_NEAR(act(linear, {1e9, 0}), 0.1, 1e-7);
  EXPECT_NEAR(act(linear, {-1e9, 0}), -0.1, 1e-7);
}

TEST(Policy, ClipsActionsAtTheirLimits) {
  PolicyBytes large = small_policy();
  large.tensors["layers.1.bias"].values = {5};
  EXPECT_EQ(act(large, {0, 0}), 1);
  large.tensors["layers.1.bias"].values = {-5};
  EXPECT_EQ(act(large, {0, 0}), -1);
}

TEST(Policy, TanhIsScaledToTheLimits) {
  PolicyBytes squashed = small_policy();
  squashed.metadata["output"] = "tanh";
  squashed.metadata["layers"] = "1";
  squashed.tensors["layers.0.weight"] = {"F32", {1, 2}, {0, 0}};
  squashed.tensors["layers.0.bias"] = {"F32", {1}, {0.5}};
  squashed.tensors["action.low"].values = {-2};
  squashed.tensors["action.high"].values = {4};
  EXPECT_NEAR(act(squashed, {0, 0}), 1 + 3 * std::tanh(0.5), 1e-6);
}

TEST(Policy, ActionsAreSinglePrecision) {
  const double action = act(small_policy(), {0.3, 0.7});
  EXPECT_EQ(action, double{static_cast<float>(action)});
}

/// Inputs of a policy with two observations of two values and two actions of one.
TEST(Policy, RemembersObservationsAndActions) {
  PolicyBytes written = small_policy();
  written.metadata["history.observations"] = written.metadata["history.actions"] = "2";
  written.metadata["layers"] = "1";
  for (const char* name : {"observation.mean", "observation.deviation"}) {
    written.tensors[name] = {"F64", {6}, std::vector<double>(6, name[12] == 'm' ? 0 : 1)};
  }
  written.tensors["layers.0.weight"] = {"F32", {1, 6}, {0.01, 0.02, 0.03, 0.04, 0.25, 0.5}};
  written.tensors["layers.0.bias"] = {"F32", {1}, {0}};
  Policy policy = read(written.bytes());
  EXPECT_EQ(policy.observation_size(), 2U);
  EXPECT_EQ(policy.input_size(), 6U);
  EXPECT_EQ(policy.history().observations, 2U);
  EXPECT_EQ(policy.history().actions, 2U);
  const std::array<double, 2> alone{1, 1};
  EXPECT_EQ(
      message_of<PolicyError>([&] { policy.act(alone.data(), nullptr); }),
      "policy toy: acts on its last 2 observations and 2 actions; must be given a PolicyInput");
  PolicyInput input(policy);
  Policy other = read(small_policy().bytes());
  double unused = 0;
  EXPECT_EQ(message_of<PolicyError>([&] { other.act(alone.data(), input, &unused); }),
            "policy toy: the PolicyInput has 6 values; must have 2");
  for (int episode = 0; episode < 2; ++episode) {
    std::array<double, 2> actions{};  // the latest ones
    std::array<double, 2> before{};
    for (double step = 1; step < 5; ++step) {
      const std::array<double, 2> observation{step, -step / 2};
      PolicyInput copy = input;
      const double* const given = copy.add_observation(observation.data());
      EXPECT_EQ(std::vector<double>(given, given + 6),
                (std::vector<double>{before[0], before[1], observation[0], observation[1],
                                     actions[0], actions[1]}));
      double action = 0;
      policy.act(observation.data(), input, &action);
      EXPECT_NEAR(action,
                  0.01 * before[0] + 0.02 * before[1] + 0.03 * observation[0] +
                      0.04 * observation[1] + 0.25 * actions[0] + 0.5 * actions[1],
                  1e-6);
      actions = {actions[1], action};
      before = observation;
    }
    input.reset();
  }
}

TEST(Policy, ReadsFiles) {
  const Folder folder;
  const std::string path = folder.write("toy.safetensors", small_policy().bytes());
  EXPECT_EQ(Policy(path).id(), "Toy-v0");
  EXPECT_EQ(message_of<PolicyError>([&] { Policy(folder.write("cut", "abc")); }),
            "policy " + folder.path("cut") + ": it has 3 bytes; must have at least 8");
  const std::string missing = folder.path("none.safetensors");
  EXPECT_EQ(message_of<PolicyError>([&] { Policy policy(missing); }),
            "policy " + missing + ": it cannot be read as a file");
  EXPECT_EQ(message_of<PolicyError>([&] { Policy policy(folder.path()); }),
            "policy " + folder.path() + ": it must be a regular file");
}

TEST(Policy, RejectsEveryTruncatedFile) {
  const std::string whole = small_policy().bytes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THROW(read(whole.substr(0, size)), PolicyError) << size << " of " << whole.size();
  }
  EXPECT_NO_THROW(read(whole));
}

TEST(Policy, RejectsOtherJson) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "ends early at byte 0"},
      {"[]", "has no { at byte 0"},
      {"{} x", "has more after its end at byte 3"},
      {R"({"__metadata__":{"a":"","a":""}})", "has the name a twice at byte 27"},
      {R"({"a":{"shape":[1,]}})", "has no integer from 0 to 2^64 - 1 at byte 17"},
      {R"({"a":{"shape":[-1]}})", "has no integer from 0 to 2^64 - 1 at byte 15"},
      {R"({"a":{"shape":[18446744073709551616]}})", "has no integer from 0 to 2^64 - 1 at byte 15"},
      {R"({"a":{"dtype":4}})", "has no \" at byte 14"},
      {R"({"\u0041":{}})", "has an escape that policies do not use at byte 3"},
      {"{\"a\n", "has a control character in a string at byte 3"},
  };
  for (const auto& [json, reason] : cases) {
    EXPECT_EQ(refusal(with_size(json)), std::string("its header ") + reason) << json;
  }
}

/// A 1 MB header could declare 17,000 tensors of 8 MiB that share the bytes of a small file.
TEST(Policy, RejectsOverlappingTensors) {
  std::string bytes = small_policy().bytes();
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof(size));
  const std::string again = R"(,"again":{"dtype":"F32","shape":[1],"data_offsets":[0,4]})";
  bytes.insert(sizeof(size) + size - 1, again);
  size += again.size();
  std::memcpy(bytes.data(), &size, sizeof(size));
  EXPECT_EQ(refusal(bytes), "again has 4 bytes; the other tensors leave 0 of the 76");
}

TEST(Policy, RejectsUnsuitableContent) {
  using P = PolicyBytes;
  const std::pair<std::function<void(P&)>, const char*> cases[] = {
      {[](P& p) { p.metadata["format"] = "other"; },
       "its format is other; must be walker_sim policy 1"},
      {[](P& p) { p.metadata.erase("format"); }, "its header has no format"},
      {[](P& p) { p.metadata.erase("id"); }, "its header has no id"},
      {[](P& p) { p.metadata["activation"] = "gelu"; }, "activation = gelu: must be tanh or relu"},
      {[](P& p) { p.metadata["output"] = "none"; }, "output = none: must be clip or tanh"},
      {[](P& p) { p.metadata["layers"] = "0"; }, "layers = 0: must be a number from 1 to 16"},
      {[](P& p) { p.metadata["layers"] = "3"; }, "it has no tensor layers.2.weight"},
      {[](P& p) { p.metadata["history.observations"] = "0"; },
       "history.observations = 0: must be a number from 1 to 1000"},
      {[](P& p) { p.metadata["history.actions"] = "-1"; },
       "history.actions = -1: must be a number from 0 to 1000"},
      {[](P& p) { p.metadata["history.observations"] = "3"; },
       "observation.mean has 2 values; must have those of 3 observations and 0 actions of 1"},
      {[](P& p) { p.metadata["history.actions"] = "2"; },
       "observation.mean has 2 values; must have those of 1 observations and 2 actions of 1"},
      {[](P& p) { p.tensors.erase("action.low"); }, "it has no tensor action.low"},
      {[](P& p) {
         p.tensors["observation.deviation"] = {"F64", {3}, {1, 1, 1}};
       },
       "observation.deviation has 3 values; must have 2"},
      {[](P& p) { p.tensors["observation.deviation"].values[0] = 0; },
       "observation.deviation[0] = 0; must be above 0"},
      {[](P& p) { p.tensors["action.high"].values[0] = -1; },
       "action.high[0] = -1; must be above action.low, -1"},
      {[](P& p) { p.tensors["layers.0.weight"].shape = {4}; },
       "layers.0.weight has 1 dimensions; must have 2"},
      {[](P& p) {
         p.tensors["layers.1.weight"] = {"F32", {1, 3}, {1, 1, 1}};
       },
       "layers.1.weight has 3 inputs; must have 2"},
      {[](P& p) {
         p.tensors["layers.0.weight"].shape = {2, 3};
       },
       "layers.0.weight has 16 bytes; its shape needs 24"},
      {[](P& p) { p.tensors["layers.1.bias"].dtype = "F16"; },
       "layers.1.bias is of type F16; must be F32 or F64"},
      {[](P& p) { p.tensors["layers.1.bias"].values[0] = std::nan(""); },
       "layers.1.bias has a value that is not finite"},
      {[](P& p) {
         p.tensors["action.low"] = p.tensors["action.high"] = {"F32", {2}, {-1, -1}};
         p.tensors["action.high"].values = {1, 1};
       },
       "its last layer has 1 outputs; must have 2, as action.low has"},
  };
  for (const auto& [change, reason] : cases) {
    PolicyBytes changed = small_policy();
    change(changed);
    EXPECT_EQ(refusal(changed.bytes()), reason);
  }
}

TEST(Policy, RejectsAnotherEnvironment) {
  const Folder folder;
  PolicyBytes small = small_policy();
  small.metadata["parameters"] = "size 2";
  const std::string path = folder.write("toy.safetensors", small.bytes());
  const Specification walker = make("Walker2d-v5")->specification();
  EXPECT_EQ(message_of<PolicyError>([&] { make_policy_agent(path, walker); }),
            "policy " + path +
                ", made for Toy-v0 with size 2: it takes 2 observations and gives 1 "
                "actions; Walker2d-v5 has 17 and 6");
  Specification toy;
  toy.id = "Toy-v1";
  toy.observation_low = toy.observation_high = {0, 0};
  toy.action_low = {-1};
  toy.action_high = {2};
  EXPECT_EQ(message_of<PolicyError>([&] { make_policy_agent(path, toy); }),
            "policy " + path +
                ", made for Toy-v0 with size 2: the upper limit of action 0 is 1; "
                "the environment's is 2");
  toy.action_high = {1};
  EXPECT_EQ(make_policy_agent(path, toy)->act({1, -1}).size(), 1U);
}

}  // namespace
}  // namespace walker

// Policy files: reading, acting by the documented formula, and errors with file name and reason.
#include "walker_sim/policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "error_message.h"
#include "policy/policy_bytes.h"
#include "temporary_folder.h"
#include "walker_sim/registry.h"

namespace walker::test {
namespace {

class PolicyTest : public testing::Test {
 protected:
  std::string write(const PolicyBytes& policy) const {
    return policy.write(folder_.path("toy.safetensors"));
  }

  double act(const PolicyBytes& written, const std::array<double, 2>& observation) const {
    Policy policy(write(written));
    double action = 0;
    policy.act(observation.data(), &action);
    return action;
  }

  std::string refusal(const std::function<void(PolicyBytes&)>& change) const {
    PolicyBytes changed = small_policy();
    change(changed);
    const std::string path = write(changed);
    const std::string message = message_of<PolicyError>([&path] { Policy policy(path); });
    const std::string head = "policy " + path + ": ";
    EXPECT_EQ(message.substr(0, head.size()), head);
    return message.substr(std::min(head.size(), message.size()));
  }

  Folder folder_;
};

TEST_F(PolicyTest, HasItsMetadata) {
  const Policy policy(write(small_policy()));
  EXPECT_EQ(policy.id(), "Toy-v0");
  EXPECT_EQ(policy.notes(), (std::map<std::string, std::string>{{"steps", "12"}}));
  EXPECT_EQ(policy.observation_size(), 2U);
  EXPECT_EQ(policy.action_size(), 1U);
}

TEST_F(PolicyTest, NormalisesAndAppliesItsLayers) {
  // The normalised observations are (2 - 1) / 2 and (-0.9 + 1) / 0.5.
  const double first = std::tanh(0.5 + 2 * 0.2 + 0.1);
  const double second = std::tanh(3 * 0.5 + 4 * 0.2 - 0.2);
  EXPECT_NEAR(act(small_policy(), {2, -0.9}), 0.5 * first - 0.25 * second + 0.05, 1e-6);
}

TEST_F(PolicyTest, AppliesRelu) {
  PolicyBytes relu = small_policy();
  relu.metadata["activation"] = "relu";
  EXPECT_NEAR(act(relu, {2, -0.9}), 0.5 * 1.0 - 0.25 * 2.1 + 0.05, 1e-6);
  EXPECT_NEAR(act(relu, {-2, -1.9}), 0.05, 1e-6);
}

TEST_F(PolicyTest, ClipsObservationsAtTenDeviations) {
  PolicyBytes linear = small_policy();
  linear.metadata["layers"] = "1";
  linear.tensors["layers.0.weight"] = {"F32", {1, 2}, {0.01, 0}};
  linear.tensors["layers.0.bias"] = {"F32", {1}, {0}};
  EXPECT_NEAR(act(linear, {1e9, 0}), 0.1, 1e-7);
  EXPECT_NEAR(act(linear, {-1e9, 0}), -0.1, 1e-7);
}

TEST_F(PolicyTest, ClipsActionsAtTheirLimits) {
  PolicyBytes large = small_policy();
  large.tensors["layers.1.bias"].values = {5};
  EXPECT_EQ(act(large, {0, 0}), 1);
  large.tensors["layers.1.bias"].values = {-5};
  EXPECT_EQ(act(large, {0, 0}), -1);
}

TEST_F(PolicyTest, TanhIsScaledToTheLimits) {
  PolicyBytes squashed = small_policy();
  squashed.metadata["output"] = "tanh";
  squashed.metadata["layers"] = "1";
  squashed.tensors["layers.0.weight"] = {"F32", {1, 2}, {0, 0}};
  squashed.tensors["layers.0.bias"] = {"F32", {1}, {0.5}};
  squashed.tensors["action.low"].values = {-2};
  squashed.tensors["action.high"].values = {4};
  EXPECT_NEAR(act(squashed, {0, 0}), 1 + 3 * std::tanh(0.5), 1e-6);
}

TEST_F(PolicyTest, ActionsAreSinglePrecision) {
  const double action = act(small_policy(), {0.3, 0.7});
  EXPECT_EQ(action, double{static_cast<float>(action)});
}

TEST_F(PolicyTest, RejectsUnreadableFiles) {
  const std::string missing = folder_.path("none.safetensors");
  EXPECT_EQ(message_of<PolicyError>([&] { Policy policy(missing); }),
            "policy " + missing + ": it cannot be read as a file");
  const std::string folder = folder_.path();
  EXPECT_NE(message_of<PolicyError>([&] { Policy policy(folder); }).find(folder),
            std::string::npos);
}

TEST_F(PolicyTest, ReadsTheContentOfAFile) {
  const std::string bytes = small_policy().bytes();
  Policy policy("toy", {bytes.begin(), bytes.end()});
  const std::array<double, 2> observation{2, -0.9};
  double action = 0;
  policy.act(observation.data(), &action);
  EXPECT_EQ(action, act(small_policy(), observation));
  EXPECT_EQ(message_of<PolicyError>([] {
              Policy("toy", {'a', 'b', 'c'});
            }),
            "policy toy: it has 3 bytes");
}

TEST_F(PolicyTest, RejectsEveryTruncatedFile) {
  const std::string whole = small_policy().bytes();
  const std::string path = folder_.path("cut.safetensors");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    EXPECT_THROW(Policy policy(path), PolicyError) << size << " of " << whole.size() << " bytes";
  }
  std::ofstream(path, std::ios::binary) << whole;
  EXPECT_NO_THROW(Policy policy(path));
}

TEST_F(PolicyTest, RejectsInvalidMetadata) {
  using P = PolicyBytes;
  EXPECT_EQ(refusal([](P& p) { p.metadata["format"] = "other"; }),
            "its format is other; must be walker_sim policy 1");
  EXPECT_EQ(refusal([](P& p) { p.metadata.erase("format"); }), "its header has no format");
  EXPECT_EQ(refusal([](P& p) { p.metadata.erase("id"); }), "its header has no id");
  EXPECT_EQ(refusal([](P& p) { p.metadata["activation"] = "gelu"; }),
            "activation = gelu: must be tanh or relu");
  EXPECT_EQ(refusal([](P& p) { p.metadata["output"] = "none"; }),
            "output = none: must be clip or tanh");
  EXPECT_EQ(refusal([](P& p) { p.metadata["layers"] = "0"; }),
            "layers = 0: must be a number from 1 to 16");
  EXPECT_EQ(refusal([](P& p) { p.metadata["layers"] = "3"; }), "it has no tensor layers.2.weight");
}

/// A policy whose header is `json`, without tensor values.
std::string policy_of(const std::string& json) {
  const std::uint64_t size = json.size();
  std::string bytes;
  append_bytes(&size, sizeof(size), bytes);
  return bytes + json;
}

TEST(PolicyHeader, RejectsOtherJson) {
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
    const std::string bytes = policy_of(json);
    EXPECT_EQ(message_of<PolicyError>([&] {
                Policy("toy", {bytes.begin(), bytes.end()});
              }),
              std::string("policy toy: its header ") + reason)
        << json;
  }
}

/// A 1 MB header could declare 17,000 tensors of 8 MiB that share the bytes of a small file.
TEST_F(PolicyTest, RejectsOverlappingTensors) {
  std::string bytes = small_policy().bytes();
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof(size));
  const std::string again = R"(,"again":{"dtype":"F32","shape":[1],"data_offsets":[0,4]})";
  bytes.insert(sizeof(size) + size - 1, again);
  size += again.size();
  std::memcpy(bytes.data(), &size, sizeof(size));
  EXPECT_EQ(message_of<PolicyError>([&] {
              Policy("toy", {bytes.begin(), bytes.end()});
            }),
            "policy toy: again has 4 bytes; of all 76 the other tensors leave 0");
}

TEST_F(PolicyTest, RejectsUnsuitableTensors) {
  using P = PolicyBytes;
  EXPECT_EQ(refusal([](P& p) { p.tensors.erase("action.low"); }), "it has no tensor action.low");
  EXPECT_EQ(refusal([](P& p) {
              p.tensors["observation.deviation"] = {"F64", {3}, {1, 1, 1}};
            }),
            "observation.deviation has 3 values; must have 2");
  EXPECT_EQ(refusal([](P& p) { p.tensors["observation.deviation"].values[0] = 0; }),
            "observation.deviation has a value that is not above 0");
  EXPECT_EQ(refusal([](P& p) { p.tensors["action.high"].values[0] = -1; }),
            "action.high is not above action.low");
  EXPECT_EQ(refusal([](P& p) { p.tensors["layers.0.weight"].shape = {4}; }),
            "layers.0.weight has 1 dimensions; must have 2");
  EXPECT_EQ(refusal([](P& p) {
              p.tensors["layers.1.weight"] = {"F32", {1, 3}, {1, 1, 1}};
            }),
            "layers.1.weight has 3 inputs; must have 2");
  EXPECT_EQ(refusal([](P& p) {
              p.tensors["layers.0.weight"].shape = {2, 3};
            }),
            "layers.0.weight has 16 bytes; its shape needs 24");
  EXPECT_EQ(refusal([](P& p) { p.tensors["layers.1.bias"].dtype = "F16"; }),
            "layers.1.bias is of type F16; must be F32 or F64");
  EXPECT_EQ(refusal([](P& p) {
              p.tensors["layers.1.bias"].values[0] = std::numeric_limits<double>::quiet_NaN();
            }),
            "layers.1.bias has a value that is not finite");
  EXPECT_EQ(refusal([](P& p) {
              p.tensors["action.low"] = p.tensors["action.high"] = {"F32", {2}, {-1, -1}};
              p.tensors["action.high"].values = {1, 1};
            }),
            "its last layer has 1 outputs; its action 2");
}

TEST_F(PolicyTest, RejectsAnotherEnvironment) {
  const std::string path = write(small_policy());
  const Specification walker = make("Walker2d-v5")->specification();
  EXPECT_EQ(message_of<PolicyError>([&] { make_policy_agent(path, walker); }),
            "policy " + path +
                ", made for Toy-v0: it takes 2 observations and gives 1 actions; "
                "Walker2d-v5 has 17 and 6");
  Specification toy;
  toy.id = "Toy-v1";
  toy.observation_low = toy.observation_high = {0, 0};
  toy.action_low = {-1};
  toy.action_high = {2};
  EXPECT_EQ(
      message_of<PolicyError>([&] { make_policy_agent(path, toy); }),
      "policy " + path + ", made for Toy-v0: the upper limit of action 0 is 1 there and 2 here");
  toy.action_high = {1};
  EXPECT_EQ(make_policy_agent(path, toy)->act({1, -1}).size(), 1U);
}

}  // namespace
}  // namespace walker::test

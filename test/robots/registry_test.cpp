#include "walker_sim/registry.h"

#include <gtest/gtest.h>

#include <regex>
#include <stdexcept>
#include <tuple>

#include "error_message.h"

namespace walker {
namespace {

const std::vector<std::string>& known_ids() {
  static const std::vector<std::string> kIds{"BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                             "Walker2d-v4",      "Walker2d-v5",
                                             "Hopper-v4",        "Hopper-v5"};
  return kIds;
}

std::string refusal(const std::string& id, const Parameters& parameters = {}) {
  return message_of<std::invalid_argument>([&] { make(id, parameters); });
}

ParameterValue parameter(const Environment& environment, const std::string& name) {
  for (const auto& [known, value] : environment.specification().parameters) {
    if (known == name) return value;
  }
  throw std::out_of_range(name);
}

TEST(Registry, KnowsAllIds) {
  ASSERT_EQ(registrations().size(), known_ids().size());
  for (std::size_t i = 0; i < known_ids().size(); ++i) {
    EXPECT_EQ(registrations()[i].id, known_ids()[i]);
    EXPECT_EQ(make(known_ids()[i])->specification().id, known_ids()[i]);
  }
}

TEST(Registry, RejectsUnknownIdsAndValues) {
  const std::string id = "BipedalWalker-v3";
  const std::string ids =
      " Known: BipedalWalker-v3 BipedalWalkerHardcore-v3 Walker2d-v4 Walker2d-v5 Hopper-v4 "
      "Hopper-v5";
  const std::string names = " Known: hardcore reuse_world max_episode_steps";
  const std::string limits = ": must be an integer in [0, 4294967295]";
  const std::vector<std::tuple<std::string, Parameters, std::string>> cases{
      {"BipedalWalker-v2",
       {},
       "environment BipedalWalker-v2: unknown; did you mean " + id + "?" + ids},
      {"Walker2D-v5", {}, "environment Walker2D-v5: unknown; did you mean Walker2d-v5?" + ids},
      {"CartPole-v1", {}, "environment CartPole-v1: unknown." + ids},
      {"", {}, "environment : unknown." + ids},
      {id, {{"hardcore", std::int64_t{1}}}, "parameter hardcore = 1: must be true or false"},
      {id,
       {{"hardcor", true}},
       "parameter hardcor = true: unknown; did you mean hardcore?" + names},
      {id, {{"max_episode_steps", std::int64_t{-1}}}, "parameter max_episode_steps = -1" + limits},
      {id,
       {{"max_episode_steps", std::int64_t{4294967296}}},
       "parameter max_episode_steps = 4294967296" + limits},
      {id,
       {{"max_episode_steps", true}},
       "parameter max_episode_steps = true: must be an integer"}};
  for (const auto& [unknown, parameters, message] : cases) {
    EXPECT_EQ(refusal(unknown, parameters), message);
  }
}

TEST(Registry, RejectsEveryParameterOfAnotherType) {
  for (const std::string& id : known_ids()) {
    for (const ParameterDescription& description : parameter_descriptions(id)) {
      const std::vector<ParameterValue> values{std::string("abc"), std::vector<double>{1.0}, 0.5};
      for (const ParameterValue& value : values) {
        if (value.index() == description.default_value.index()) continue;
        EXPECT_EQ(
            refusal(id, {{description.name, value}})
                .find("parameter " + description.name + " = " + to_string(value) + ": must be"),
            0U);
      }
      EXPECT_FALSE(description.description.empty()) << description.name;
    }
  }
}

TEST(Registry, LimitIsACountOfSteps) {
  for (const std::uint32_t limit : {0U, 10U, 4294967295U}) {
    const auto environment =
        make("BipedalWalker-v3", {{"max_episode_steps", static_cast<double>(limit)}});
    EXPECT_EQ(environment->specification().max_episode_steps, limit);
  }
}

TEST(Registry, DefaultLimitBelongsToTheId) {
  EXPECT_EQ(make("BipedalWalker-v3")->specification().max_episode_steps, 1600U);
  EXPECT_EQ(make("BipedalWalkerHardcore-v3")->specification().max_episode_steps, 2000U);
  const auto hardcore = make("BipedalWalker-v3", {{"hardcore", true}});
  EXPECT_EQ(hardcore->specification().max_episode_steps, 1600U);
  EXPECT_EQ(parameter(*hardcore, "hardcore"), ParameterValue(true));
}

TEST(Registry, SpecificationHasAllParameters) {
  const auto environment = make("BipedalWalkerHardcore-v3", {{"reuse_world", true}});
  EXPECT_EQ(environment->specification().parameters.size(), 3U);
  EXPECT_EQ(parameter(*environment, "hardcore"), ParameterValue(true));
  EXPECT_EQ(parameter(*environment, "reuse_world"), ParameterValue(true));
  EXPECT_EQ(parameter(*environment, "max_episode_steps"), ParameterValue(std::int64_t{2000}));
  Parameters again;
  for (const auto& [name, value] : environment->specification().parameters) again[name] = value;
  EXPECT_NO_THROW(make("BipedalWalkerHardcore-v3", again));
}

TEST(Registry, VersionHasThreeNumbers) {
  EXPECT_TRUE(std::regex_match(version(), std::regex("[0-9]+\\.[0-9]+\\.[0-9]+"))) << version();
}

}  // namespace
}  // namespace walker

#include "episode/episode_record.h"

#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>
#include <string>

#include "base/engine_release.h"
#include "base/random.h"
#include "error_message.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

std::string refusal(const EpisodeRecord& record, const Specification& specification) {
  return message_of<std::invalid_argument>([&] { check_repeatable(record, specification); });
}

std::string refusal_of(const std::string& name, const std::string& recorded,
                       const std::string& own) {
  std::ostringstream words;
  words << "parameter " << name << " = " << recorded << " in the record; here it is " << own;
  return words.str();
}

class EpisodeRecordTest : public testing::Test {
 protected:
  EpisodeRecordTest() : record_(describe_origin(specification_)) {
    record_.seed = 5;
    record_.generator_state = Generator(5).state();
    record_.num_steps = 1;
    record_.actions = {1, 2, 3, 4, 5, 6};
  }

  std::string refusal() const { return walker::refusal(record_, specification_); }

  Specification specification_ = make("Walker2d-v5")->specification();
  EpisodeRecord record_;
};

TEST_F(EpisodeRecordTest, OfTheSameEnvironmentIsRepeatable) {
  EXPECT_NO_THROW(check_repeatable(record_, specification_));
  record_.seed.reset();  // the generator continues
  record_.generator_state = Generator(6).state();
  record_.num_steps = 0;
  record_.actions.clear();
  EXPECT_NO_THROW(check_repeatable(record_, specification_));
}

TEST_F(EpisodeRecordTest, TheFieldThatDiffersIsNamedWithBothValues) {
  record_.id = "Walker2d-v4";
  EXPECT_EQ(refusal(), "id = Walker2d-v4 in the record; here it is Walker2d-v5");
  record_ = describe_origin(specification_);
  record_.engine = "another engine";
  EXPECT_EQ(refusal(), "engine = another engine in the record; here it is MuJoCo");
  record_ = describe_origin(specification_);
  record_.engine_version = "9";
  EXPECT_EQ(refusal(), "engine_version = 9 in the record; here it is " +
                           engine_release(specification_.engine_version));
}

TEST_F(EpisodeRecordTest, WhatMadeTheStepsDoesNotCount) {
  record_.engine_version = engine_release(specification_.engine_version) + ", stepped by hand";
  EXPECT_NO_THROW(check_repeatable(record_, specification_));
}

TEST_F(EpisodeRecordTest, AnotherLibmIsRefusedByName) {
  const std::string release = engine_release(specification_.engine_version);
  record_.engine_version = release + ", libm: another, stepped by hand";
  EXPECT_EQ(refusal(),
            "libm = another in the record; here it is " + libm_of(specification_.engine_version));
  record_.engine_version = release;  // written by a release that did not record libm
  EXPECT_NO_THROW(check_repeatable(record_, specification_));
}

TEST_F(EpisodeRecordTest, WhatIsSaidOfALongTextIsShort) {
  record_.id.assign(10000000, 'a');
  EXPECT_LT(refusal().size(), 300U);
}

TEST_F(EpisodeRecordTest, EveryParameterCounts) {
  ASSERT_GT(record_.parameters.size(), 5U);
  for (std::size_t i = 0; i < record_.parameters.size(); ++i) {
    EpisodeRecord other = record_;
    other.parameters[i].second += '1';
    const auto& [name, value] = record_.parameters[i];
    EXPECT_EQ(walker::refusal(other, specification_), refusal_of(name, value + "1", value));
    other.parameters.erase(other.parameters.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_EQ(walker::refusal(other, specification_), refusal_of(name, "(absent)", value));
  }
  EpisodeRecord twice = record_;
  twice.parameters.push_back(twice.parameters.front());
  EXPECT_EQ(walker::refusal(twice, specification_),
            "parameter xml_file stands twice in the record");
  record_.parameters.emplace_back("wind", "3");
  EXPECT_EQ(refusal(), "parameter wind = 3 in the record; here it is (absent)");
}

TEST_F(EpisodeRecordTest, ASeedMustGiveTheGeneratorsState) {
  record_.seed = 6;
  EXPECT_EQ(refusal(), "generator_state is not that of seed = 6");
}

TEST_F(EpisodeRecordTest, ActionsAreWhole) {
  record_.actions.pop_back();
  EXPECT_EQ(refusal(), "actions has 5 values; must have 6, 1 steps of 6");
  record_.actions.clear();
  record_.num_steps = 4294967295;
  EXPECT_EQ(refusal(), "actions has 0 values; must have 25769803770, 4294967295 steps of 6");
}

TEST_F(EpisodeRecordTest, ChecksumsAreOfEachTransition) {
  record_.checksums = {1, 2};
  EXPECT_EQ(refusal(), "nothing thrown");
  record_.checksums = {1};
  EXPECT_EQ(refusal(), "checksums has 1 values; must have none or 2");
}

}  // namespace
}  // namespace walker

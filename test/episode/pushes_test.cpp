// Pushes by hand: when they act, what a record has of them, and how wrong ones are refused.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bits.h"
#include "episode/walker.h"
#include "error_message.h"
#include "test_name.h"

namespace walker {
namespace {

constexpr auto kWhenever = std::chrono::steady_clock::time_point::max();

using Row = std::vector<std::uint64_t>;

Row row_of(const Walker& walker) {
  std::vector<double> row = walker.state().observation;
  row.push_back(walker.state().reward);
  row.insert(row.end(), walker.state().info.begin(), walker.state().info.end());
  return to_bits(row);
}

bool operator==(const LinkWrench& a, const LinkWrench& b) {
  return a.link == b.link && a.force_x == b.force_x && a.force_z == b.force_z &&
         a.torque_y == b.torque_y;
}

class PushesTest : public testing::TestWithParam<const char*> {
 protected:
  static std::unique_ptr<Walker> make_recorded() {
    auto walker = make_walker(GetParam());
    walker->configure({std::nullopt, true});
    return walker;
  }

  static std::unique_ptr<Walker> begun(const World& world = {}) {
    auto walker = make_recorded();
    walker->set_world(world);
    walker->reset(3);
    return walker;
  }

  LinkWrench draw(const Walker& walker) {
    const std::size_t links = walker.specification().links.size();
    return {static_cast<std::uint32_t>(random_() % links), 40 * unit_(random_), 40 * unit_(random_),
            3 * unit_(random_)};
  }

  std::vector<double> draw_action(const Walker& walker) {
    std::vector<double> action(walker.specification().action_size());
    for (double& value : action) value = unit_(random_);
    return action;
  }

  void step_both() {
    for (Walker* each : {walker_.get(), other_.get()}) each->step(action_);
  }

  std::mt19937_64 random_{1};
  std::uniform_real_distribution<double> unit_{-1, 1};
  const std::unique_ptr<Walker> walker_ = begun();
  const std::unique_ptr<Walker> other_ = begun();
  const std::vector<double> action_ =
      std::vector<double>(walker_->specification().action_size(), 0.1);
};

TEST_P(PushesTest, ARecordRepeatsThem) {
  for (const World& world :
       {World{}, load_world("pushed"),
        World{
            {"ground_roughness", {2, 2}}, {"action_delay", {0.1, 0.1}}, {"dropout", {0.1, 0.1}}}}) {
    const auto original = begun(world);
    std::vector<Row> rows;
    std::vector<std::uint32_t> pushed;
    for (int i = 0; i < 60 && !original->state().has_ended(); ++i) {
      if (i % 3 == 1) {
        original->push(draw(*original));
        pushed.push_back(i + 1);
      }
      original->step(draw_action(*original));
      rows.push_back(row_of(*original));
    }
    const EpisodeRecord record = original->record();
    ASSERT_EQ(record.pushes.size(), pushed.size());
    for (std::size_t i = 0; i < pushed.size(); ++i) EXPECT_EQ(record.pushes[i].step, pushed[i]);
    const auto repeated = make_recorded();
    repeated->begin(record);
    for (const Row& row : rows) {  // a step at a time, as a server does
      repeated->repeat(record, {});
      ASSERT_EQ(row_of(*repeated), row) << to_string(world);
    }
    EXPECT_EQ(repeated->record().checksums, record.checksums);
    EXPECT_EQ(repeated->record().pushes.size(), record.pushes.size());
    EpisodeRecord other = record;
    other.pushes.pop_back();
    repeated->begin(other);
    EXPECT_NE(message_of<std::invalid_argument>([&] { repeated->repeat(other, kWhenever); }), "");
  }
}

TEST_P(PushesTest, ActInOneStep) {
  step_both();
  walker_->push({0, 20, 10, 0});
  step_both();
  EXPECT_NE(row_of(*walker_), row_of(*other_));
  const auto repeated = make_recorded();
  repeated->begin(walker_->record());
  EXPECT_TRUE(repeated->repeat(walker_->record(), kWhenever));
  for (int i = 0; i < 20; ++i) {  // without another push
    for (Walker* each : {walker_.get(), repeated.get()}) each->step(action_);
    ASSERT_EQ(row_of(*walker_), row_of(*repeated));
  }
  EXPECT_EQ(walker_->record().pushes.size(), 1U);
}

TEST_P(PushesTest, OnSeveralLinksAddUpAndALaterOneReplaces) {
  const LinkWrench trunk{0, 20, 10, 0};
  const LinkWrench shin{2, -5, 7, 1};
  for (const LinkWrench& wrench : {shin, LinkWrench{0, 99, 99, 99}, trunk}) walker_->push(wrench);
  for (const LinkWrench& wrench : {trunk, shin}) other_->push(wrench);
  step_both();
  const std::vector<RecordedPush> pushes = walker_->record().pushes;
  ASSERT_EQ(pushes.size(), 2U);
  EXPECT_EQ(pushes[0].step, 1U);
  EXPECT_TRUE(pushes[0].wrench == trunk);
  EXPECT_TRUE(pushes[1].wrench == shin);
  EXPECT_EQ(row_of(*walker_), row_of(*other_));
}

/// A world's force is a push of each step. That on the trunk acts where a world's pushes do.
TEST_P(PushesTest, AWorldsForcesAreThoseOfEachStepAndAddUpWithPushes) {
  const std::vector<Link>& links = walker_->specification().links;
  const std::uint32_t last = static_cast<std::uint32_t>(links.size()) - 1;
  const auto walker = begun(
      {{links[last].name + "_force_x", {3, 3}}, {links[last].name + "_force_z", {-2.5, -2.5}}});
  walker_->reset(3);
  for (int i = 0; i < 10; ++i) {
    LinkWrench push{last, 3, -2.5, 0};
    if (i == 5) {
      walker->push({last, 0, 0, 0.25});  // sums of forces would have other roundings
      push.torque_y = 0.25;
    }
    walker_->push(push);
    walker_->step(action_);
    walker->step(action_);
    EXPECT_EQ(row_of(*walker), row_of(*walker_)) << i;
  }
}

TEST_P(PushesTest, AForceThatChangesIsTheOneOfItsStep) {
  const std::vector<Link>& links = walker_->specification().links;
  const std::uint32_t last = static_cast<std::uint32_t>(links.size()) - 1;
  const std::string name = links[last].name + "_force_x";
  const double interval = 3 * walker_->specification().dt;
  const auto walker = begun({{"change_interval", {interval, interval}}, {name, {-5, 5}}});
  std::set<double> forces;
  for (int i = 0; i < 10; ++i) {
    walker->step(action_);
    forces.insert(walker->world_values().at(name));
    walker_->push({last, walker->world_values().at(name), 0, 0});
    walker_->step(action_);
    EXPECT_EQ(row_of(*walker), row_of(*walker_)) << i;
  }
  EXPECT_EQ(forces.size(), 4U);
}

TEST_P(PushesTest, ZerosCancel) {
  for (const LinkWrench& wrench :
       {LinkWrench{0, 20, 10, 0}, LinkWrench{1, 20, 10, 0}, LinkWrench{0, 0, 0, 0}}) {
    walker_->push(wrench);
  }
  other_->push({1, 20, 10, 0});
  other_->push({0, 0, 0, 0});  // nothing to cancel
  step_both();
  EXPECT_EQ(row_of(*walker_), row_of(*other_));
  EXPECT_EQ(walker_->record().pushes.size(), 1U);
  EXPECT_EQ(other_->record().pushes.size(), 1U);
}

TEST_P(PushesTest, ARecordMayHaveZeros) {
  step_both();
  walker_->push({0, 20, 10, 0});
  step_both();
  EpisodeRecord record = walker_->record();
  record.pushes.insert(record.pushes.begin(), {1, {0, 0, 0, 0}});
  other_->begin(record);
  ASSERT_TRUE(other_->repeat(record, kWhenever));
  EXPECT_EQ(row_of(*other_), row_of(*walker_));
  EXPECT_EQ(other_->record().pushes.size(), 2U);
}

TEST_P(PushesTest, AResetDropsThem) {
  walker_->push({0, 20, 10, 0});
  for (Walker* each : {walker_.get(), other_.get()}) each->reset(5);
  step_both();
  EXPECT_EQ(row_of(*walker_), row_of(*other_));
  EXPECT_TRUE(walker_->record().pushes.empty());
}

TEST_P(PushesTest, ALoadedStateDropsThem) {
  std::vector<std::byte> state;
  other_->save_state(state);
  walker_->push({0, 20, 10, 0});
  walker_->load_state(state.data(), state.size());
  step_both();
  EXPECT_EQ(row_of(*walker_), row_of(*other_));
}

TEST_P(PushesTest, GroupsHaveTheBitsOfSingleSteps) {
  constexpr std::size_t kSize = 11;
  std::vector<std::unique_ptr<Walker>> single;
  std::vector<std::unique_ptr<Walker>> grouped;
  for (std::size_t i = 0; i < kSize; ++i) {
    single.push_back(begun());
    grouped.push_back(begun());
  }
  for (int time = 0; time < 40; ++time) {
    std::vector<std::vector<double>> actions;
    std::vector<Walker::GroupStep> steps;
    for (std::size_t i = 0; i < kSize; ++i) {
      actions.push_back(draw_action(*single[i]));
      if ((i + time) % 4 == 0 && !single[i]->state().has_ended()) {
        const LinkWrench wrench = draw(*single[i]);
        single[i]->push(wrench);
        grouped[i]->push(wrench);
      }
    }
    for (std::size_t i = 0; i < kSize; ++i) {
      if (single[i]->state().has_ended()) continue;
      single[i]->step(actions[i]);
      steps.push_back({grouped[i].get(), actions[i].data()});
    }
    Walker::step_group(steps.data(), steps.size());
    for (std::size_t i = 0; i < kSize; ++i) ASSERT_EQ(row_of(*grouped[i]), row_of(*single[i])) << i;
  }
}

TEST_P(PushesTest, WrongOnesAreRefused) {
  const auto refusal = [&](const LinkWrench& wrench) {
    return message_of<std::invalid_argument>([&] { walker_->push(wrench); });
  };
  const std::string links = std::to_string(walker_->specification().links.size());
  EXPECT_EQ(refusal({99, 0, 0, 0}), "link = 99; must be below " + links);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal({0, nan, 0, 0}), "force_x = nan N; must be in [-2000000, 2000000]");
  EXPECT_EQ(refusal({0, 0, -3e6, 0}), "force_z = -3000000 N; must be in [-2000000, 2000000]");
  EXPECT_EQ(refusal({0, 0, 0, HUGE_VAL}), "torque_y = inf N m; must be in [-2000000, 2000000]");
  EXPECT_EQ(message_of<ResetNeeded>([] { make_recorded()->push({}); }),
            "push: there is no episode yet; reset first");
  step_both();
  EXPECT_EQ(row_of(*walker_), row_of(*other_));
}

/// The strongest pushes may end the episode, but harm nothing else.
TEST_P(PushesTest, TheStrongestAreSurvived) {
  for (int i = 0; i < 40; ++i) {
    if (walker_->state().has_ended()) walker_->reset(i);
    const double sign = i % 2 == 0 ? 1 : -1;
    for (std::uint32_t link = 0; link < walker_->specification().links.size(); ++link) {
      walker_->push({link, sign * kMaxTurnedPush, kMaxTurnedPush, -sign * kMaxTurnedPush});
    }
    walker_->step(draw_action(*walker_));
  }
  walker_->reset(3);
  for (int i = 0; i < 20; ++i) {
    step_both();
    ASSERT_EQ(row_of(*walker_), row_of(*other_));
  }
}

TEST_P(PushesTest, ARecordsPushesAreChecked) {
  for (int i = 0; i < 4; ++i) {
    walker_->push({0, 1, 2, 3});
    walker_->push({1, 1, 2, 3});
    walker_->step(action_);
  }
  const EpisodeRecord good = walker_->record();
  ASSERT_EQ(good.pushes.size(), 8U);
  const std::vector<std::pair<std::function<void(EpisodeRecord&)>, std::string>> cases{
      {[](auto& r) { r.pushes[0].step = 0; }, "pushes[0].step = 0; must be in [1, 4]"},
      {[](auto& r) { r.pushes[7].step = 5; }, "pushes[7].step = 5; must be in [1, 4]"},
      {[](auto& r) { r.pushes[1].wrench.link = 77; }, "pushes[1].link = 77; must be below "},
      {[](auto& r) { r.pushes[1].wrench.force_x = HUGE_VAL; },
       "pushes[1].force_x = inf N; must be"},
      {[](auto& r) { r.pushes[1].wrench.link = 0; }, "pushes[1] is not after the push before it"},
      {[](auto& r) { std::swap(r.pushes[3], r.pushes[4]); }, "pushes[4] is not after the push"}};
  for (const auto& [change, words] : cases) {
    EpisodeRecord bad = good;
    change(bad);
    const std::string message = message_of<std::invalid_argument>([&] { walker_->begin(bad); });
    EXPECT_EQ(message.rfind(words, 0), 0U) << message;
  }
}

INSTANTIATE_TEST_SUITE_P(Ids, PushesTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v5", "Hopper-v5"),
                         kNameOfId);

}  // namespace
}  // namespace walker

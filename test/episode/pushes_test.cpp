// Pushes by hand: when they act, what a record has of them, and how wrong ones are refused.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bits.h"
#include "episode/episode.h"
#include "error_message.h"
#include "test_name.h"

namespace walker {
namespace {

constexpr auto kWhenever = std::chrono::steady_clock::time_point::max();

using Row = std::vector<std::uint64_t>;

Row row_of(const Episode& episode) {
  std::vector<double> row = episode.state().observation;
  row.push_back(episode.state().reward);
  row.insert(row.end(), episode.state().info.begin(), episode.state().info.end());
  return to_bits(row);
}

bool operator==(const LinkWrench& a, const LinkWrench& b) {
  return a.link == b.link && a.force_x == b.force_x && a.force_z == b.force_z &&
         a.torque_y == b.torque_y;
}

class PushesTest : public testing::TestWithParam<const char*> {
 protected:
  static std::unique_ptr<Episode> make_walker() {
    auto walker = make_episode(GetParam());
    walker->configure({std::nullopt, true});
    return walker;
  }

  static std::unique_ptr<Episode> begun(const World& world = {}) {
    auto walker = make_walker();
    walker->set_world(world);
    walker->reset(3);
    return walker;
  }

  LinkWrench draw(const Episode& episode) {
    const std::size_t links = episode.specification().links.size();
    return {static_cast<std::uint32_t>(random_() % links), 40 * unit_(random_), 40 * unit_(random_),
            3 * unit_(random_)};
  }

  std::vector<double> draw_action(const Episode& episode) {
    std::vector<double> action(episode.specification().action_size());
    for (double& value : action) value = unit_(random_);
    return action;
  }

  std::mt19937_64 random_{1};
  std::uniform_real_distribution<double> unit_{-1, 1};
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
    const auto repeated = make_walker();
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
  const auto walker = begun();
  const auto other = begun();
  const std::vector<double> action(walker->specification().action_size(), 0.1);
  for (Episode* each : {walker.get(), other.get()}) each->step(action);
  walker->push({0, 20, 10, 0});
  for (Episode* each : {walker.get(), other.get()}) each->step(action);
  EXPECT_NE(row_of(*walker), row_of(*other));
  const auto repeated = make_walker();
  repeated->begin(walker->record());
  EXPECT_TRUE(repeated->repeat(walker->record(), kWhenever));
  for (int i = 0; i < 20; ++i) {  // without another push
    for (Episode* each : {walker.get(), repeated.get()}) each->step(action);
    ASSERT_EQ(row_of(*walker), row_of(*repeated));
  }
  EXPECT_EQ(walker->record().pushes.size(), 1U);
}

TEST_P(PushesTest, OnSeveralLinksAddUpAndALaterOneReplaces) {
  const auto walker = begun();
  const LinkWrench trunk{0, 20, 10, 0};
  const LinkWrench shin{2, -5, 7, 1};
  for (const LinkWrench& wrench : {shin, LinkWrench{0, 99, 99, 99}, trunk}) walker->push(wrench);
  const std::vector<double> action(walker->specification().action_size(), 0.1);
  walker->step(action);
  const std::vector<RecordedPush> pushes = walker->record().pushes;
  ASSERT_EQ(pushes.size(), 2U);
  EXPECT_EQ(pushes[0].step, 1U);
  EXPECT_TRUE(pushes[0].wrench == trunk);
  EXPECT_TRUE(pushes[1].wrench == shin);
  const auto other = begun();
  for (const LinkWrench& wrench : {trunk, shin}) other->push(wrench);
  other->step(action);
  EXPECT_EQ(row_of(*walker), row_of(*other));
}

TEST_P(PushesTest, ZerosCancel) {
  const auto walker = begun();
  const auto other = begun();
  const std::vector<double> action(walker->specification().action_size(), 0.1);
  for (const LinkWrench& wrench :
       {LinkWrench{0, 20, 10, 0}, LinkWrench{1, 20, 10, 0}, LinkWrench{0, 0, 0, 0}}) {
    walker->push(wrench);
  }
  other->push({1, 20, 10, 0});
  other->push({0, 0, 0, 0});  // nothing to cancel
  for (Episode* each : {walker.get(), other.get()}) each->step(action);
  EXPECT_EQ(row_of(*walker), row_of(*other));
  EXPECT_EQ(walker->record().pushes.size(), 1U);
  EXPECT_EQ(other->record().pushes.size(), 1U);
}

TEST_P(PushesTest, ARecordMayHaveZeros) {
  const auto original = begun();
  const std::vector<double> action(original->specification().action_size(), 0.1);
  original->step(action);
  original->push({0, 20, 10, 0});
  original->step(action);
  EpisodeRecord record = original->record();
  record.pushes.insert(record.pushes.begin(), {1, {0, 0, 0, 0}});
  const auto repeated = make_walker();
  repeated->begin(record);
  ASSERT_TRUE(repeated->repeat(record, kWhenever));
  EXPECT_EQ(row_of(*repeated), row_of(*original));
  EXPECT_EQ(repeated->record().pushes.size(), 2U);
}

TEST_P(PushesTest, AResetDropsThem) {
  const auto walker = begun();
  const auto other = begun();
  walker->push({0, 20, 10, 0});
  for (Episode* each : {walker.get(), other.get()}) {
    each->reset(5);
    each->step(std::vector<double>(each->specification().action_size(), 0.1));
  }
  EXPECT_EQ(row_of(*walker), row_of(*other));
  EXPECT_TRUE(walker->record().pushes.empty());
}

TEST_P(PushesTest, ALoadedStateDropsThem) {
  const auto walker = begun();
  std::vector<std::byte> state;
  walker->save_state(state);
  const std::vector<double> action(walker->specification().action_size(), 0.1);
  walker->step(action);
  const Row row = row_of(*walker);
  walker->push({0, 20, 10, 0});
  walker->load_state(state.data(), state.size());
  walker->step(action);
  EXPECT_EQ(row_of(*walker), row);
}

TEST_P(PushesTest, GroupsHaveTheBitsOfSingleSteps) {
  constexpr std::size_t kSize = 11;
  std::vector<std::unique_ptr<Episode>> single;
  std::vector<std::unique_ptr<Episode>> grouped;
  for (std::size_t i = 0; i < kSize; ++i) {
    single.push_back(begun());
    grouped.push_back(begun());
  }
  for (int time = 0; time < 40; ++time) {
    std::vector<std::vector<double>> actions;
    std::vector<Episode::GroupStep> steps;
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
    Episode::step_group(steps.data(), steps.size());
    for (std::size_t i = 0; i < kSize; ++i) ASSERT_EQ(row_of(*grouped[i]), row_of(*single[i])) << i;
  }
}

TEST_P(PushesTest, WrongOnesAreRefused) {
  const auto walker = begun();
  const auto refusal = [&](const LinkWrench& wrench) {
    return message_of<std::invalid_argument>([&] { walker->push(wrench); });
  };
  const std::string links = std::to_string(walker->specification().links.size());
  EXPECT_EQ(refusal({99, 0, 0, 0}), "link = 99; must be below " + links);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal({0, nan, 0, 0}), "force_x = nan N; must be finite, and at most 2000000");
  EXPECT_EQ(refusal({0, 0, -3e6, 0}), "force_z = -3000000 N; must be finite, and at most 2000000");
  EXPECT_EQ(refusal({0, 0, 0, HUGE_VAL}),
            "torque_y = inf N m; must be finite, and at most 2000000");
  const std::vector<double> action(walker->specification().action_size());
  const auto other = begun();
  for (Episode* each : {walker.get(), other.get()}) each->step(action);
  EXPECT_EQ(row_of(*walker), row_of(*other));
}

/// The strongest pushes may end the episode, but harm nothing else.
TEST_P(PushesTest, TheStrongestAreSurvived) {
  const auto walker = begun();
  const auto fresh = begun();
  for (int i = 0; i < 40; ++i) {
    if (walker->state().has_ended()) walker->reset(i);
    const double sign = i % 2 == 0 ? 1 : -1;
    for (std::uint32_t link = 0; link < walker->specification().links.size(); ++link) {
      walker->push({link, sign * kMaxTurnedPush, kMaxTurnedPush, -sign * kMaxTurnedPush});
    }
    walker->step(draw_action(*walker));
  }
  walker->reset(3);
  const std::vector<double> action(walker->specification().action_size(), 0.2);
  for (int i = 0; i < 20; ++i) {
    for (Episode* each : {walker.get(), fresh.get()}) each->step(action);
    ASSERT_EQ(row_of(*walker), row_of(*fresh));
  }
}

TEST_P(PushesTest, NeedAnEpisode) {
  const auto walker = make_walker();
  EXPECT_EQ(message_of<ResetNeeded>([&] { walker->push({}); }),
            "push: there is no episode yet; reset first");
}

TEST_P(PushesTest, ARecordsPushesAreChecked) {
  const auto walker = begun();
  for (int i = 0; i < 4; ++i) {
    walker->push({0, 1, 2, 3});
    walker->push({1, 1, 2, 3});
    walker->step(std::vector<double>(walker->specification().action_size()));
  }
  const EpisodeRecord good = walker->record();
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
    const std::string message = message_of<std::invalid_argument>([&] { walker->begin(bad); });
    EXPECT_EQ(message.rfind(words, 0), 0U) << message;
  }
}

INSTANTIATE_TEST_SUITE_P(Ids, PushesTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v5", "Hopper-v5"),
                         kNameOfId);

}  // namespace
}  // namespace walker

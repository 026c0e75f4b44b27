#include "server/topics/topic_pace.h"

#include <chrono>

#include <gtest/gtest.h>

namespace walker {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// @return how many of the states that follow each other for so long are shown
int count_shown(TopicPace& pace, TopicPace::Clock::time_point& now, microseconds step, int steps) {
  int shown = 0;
  for (int i = 0; i < steps; ++i) {
    now += step;
    if (pace.take(now)) ++shown;
  }
  return shown;
}

TEST(TopicPace, BoundsStatesThatFollowEachOtherFaster) {
  TopicPace pace(500);
  TopicPace::Clock::time_point now = TopicPace::Clock::now();
  EXPECT_EQ(count_shown(pace, now, microseconds(1), 500), 500) << "a second's worth";
  EXPECT_NEAR(count_shown(pace, now, microseconds(50), 200000), 5000, 2) << "in ten seconds";
  EXPECT_EQ(count_shown(pace, now, milliseconds(2), 500), 500) << "slower ones are all shown";
  now += seconds(10);
  EXPECT_EQ(count_shown(pace, now, microseconds(1), 1000), 500) << "no more are saved up";
  EXPECT_FALSE(pace.take(now));
  now += pace.period();
  EXPECT_TRUE(pace.take(now));
}

TEST(TopicPace, ShowsAllWithoutALimit) {
  TopicPace pace(0);
  TopicPace::Clock::time_point now;
  EXPECT_EQ(count_shown(pace, now, microseconds(0), 10000), 10000);
}

TEST(TopicPace, ShowsAStateInMoreThanASecond) {
  TopicPace pace(0.5);
  TopicPace::Clock::time_point now = TopicPace::Clock::now();
  EXPECT_TRUE(pace.take(now));
  EXPECT_NEAR(count_shown(pace, now, milliseconds(100), 200), 10, 1);
  EXPECT_LE(pace.period(), seconds(1));
}

}  // namespace
}  // namespace walker

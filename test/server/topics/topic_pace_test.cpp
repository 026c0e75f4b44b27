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
  TopicPace pace(100);
  TopicPace::Clock::time_point now = TopicPace::Clock::now();
  EXPECT_NEAR(count_shown(pace, now, microseconds(1), 1000), 500, 1) << "after a pause";
  EXPECT_NEAR(count_shown(pace, now, microseconds(50), 200000), 1000, 2) << "in ten seconds";
  EXPECT_EQ(count_shown(pace, now, milliseconds(10), 500), 500) << "slower ones are all shown";
  now += seconds(3);
  EXPECT_NEAR(count_shown(pace, now, microseconds(1), 1000), 300, 1) << "saved up in three seconds";
  now += seconds(10);
  EXPECT_NEAR(count_shown(pace, now, microseconds(1), 1000), 500, 1) << "no more are saved up";
}

TEST(TopicPace, SavesUpASecondAtAHighRate) {
  TopicPace pace(2000);
  TopicPace::Clock::time_point now = TopicPace::Clock::now();
  EXPECT_NEAR(count_shown(pace, now, microseconds(1), 5000), 2010, 2);
}

TEST(TopicPace, ShowsAllWithoutALimit) {
  TopicPace pace(0);
  TopicPace::Clock::time_point now;
  EXPECT_EQ(count_shown(pace, now, microseconds(0), 10000), 10000);
}

}  // namespace
}  // namespace walker

// set_coordinates against the MuJoCo calls of Gymnasium's set_state, bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "episode/walker.h"
#include "error_message.h"
#include "kernel_variable.h"
#include "restorable.h"
#include "robots/mujoco/plain_walker.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

struct Case {
  const char* id;
  const char* model;
  const char* kernel;  ///< argument of KernelVariable
};

class CoordinatesTest : public testing::TestWithParam<Case> {
 protected:
  Stepper make_ours() const {
    return make_by(GetParam().kernel, GetParam().id,
                   {{"exclude_current_positions_from_observation", false},
                    {"terminate_when_unhealthy", false}});
  }
};

TEST_P(CoordinatesTest, AreSetAsByGymnasium) {
  Stepper ours = make_ours();
  PlainWalker theirs(GetParam().model);
  const std::size_t size = ours.observation.size() / 2;
  ours.reset(3);
  theirs.set_state(ours.observation);
  const std::vector<double> action(size - 3, 0.7);
  std::vector<double> position(size);
  std::vector<double> velocity(size);
  std::vector<double> state;
  for (int time = 0; time < 10; ++time) {
    for (int step = 0; step < 20; ++step) {
      ours.step(action);
      theirs.step(action);
      ASSERT_EQ(ours.observation, theirs.observation()) << "time " << time << ", step " << step;
    }
    for (std::size_t i = 0; i < size; ++i) {
      position[i] = i == 1 ? 1.2 : 0.03 * static_cast<double>((time + i) % 5) - 0.05;
      velocity[i] = 0.4 * static_cast<double>((time + time + i) % 7) - 1;
    }
    ours.environment->set_coordinates(position, velocity, ours.result);
    state = position;
    state.insert(state.end(), velocity.begin(), velocity.end());
    theirs.set_state(state);
    ASSERT_EQ(ours.observation, theirs.observation());
  }
}

TEST_P(CoordinatesTest, RejectedOnesChangeNothing) {
  Stepper ours = make_ours();
  Stepper untouched = make_ours();
  const std::size_t size = ours.observation.size() / 2;
  const std::vector<double> zeros(size);
  const auto refused = [&](const std::vector<double>& position,
                           const std::vector<double>& velocity) {
    return message_of<std::invalid_argument>(
        [&] { ours.environment->set_coordinates(position, velocity, ours.result); });
  };
  EXPECT_EQ(message_of<ResetNeeded>(
                [&] { ours.environment->set_coordinates(zeros, zeros, ours.result); }),
            "set_state: there is no episode yet; reset first");
  ours.reset(1);
  untouched.reset(1);
  const std::string all = std::to_string(size);
  EXPECT_EQ(refused({}, zeros), "qpos has 0 values; must have " + all + ", one per coordinate");
  EXPECT_EQ(refused(zeros, {1, 2}), "qvel has 2 values; must have " + all + ", one per coordinate");
  std::vector<double> wrong = zeros;
  wrong[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused(wrong, zeros), "qpos[2] = nan; must be finite");
  wrong[2] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refused(zeros, wrong), "qvel[2] = inf; must be finite");
  const std::vector<double> action(size - 3, 0.5);
  ours.step(action);
  untouched.step(action);
  EXPECT_EQ(ours.row(), untouched.row());
}

INSTANTIATE_TEST_SUITE_P(Robots, CoordinatesTest,
                         testing::Values(Case{"Walker2d-v5", "walker2d_v5.xml", nullptr},
                                         Case{"Walker2d-v5", "walker2d_v5.xml", "off"},
                                         Case{"Walker2d-v4", "walker2d_v4.xml", nullptr},
                                         Case{"Hopper-v5", "hopper_v5.xml", nullptr},
                                         Case{"Hopper-v4", "hopper_v4.xml", nullptr}));

std::unique_ptr<Walker> make_recorded() {
  std::unique_ptr<Walker> walker = make_walker("Hopper-v5");
  walker->configure({std::nullopt, true});
  return walker;
}

TEST(Coordinates, ContinueAnEndedEpisode) {
  const std::unique_ptr<Walker> walker = make_recorded();
  walker->reset(1);
  EXPECT_EQ(walker->is_healthy(), true);
  const std::vector<double> standing{0, 1.25, 0, 0, 0, 0};
  const std::vector<double> lying{0, 0.1, 0, 0, 0, 0};
  const std::vector<double> still(6);
  walker->set_coordinates(lying, still);
  EXPECT_EQ(walker->is_healthy(), false);
  EXPECT_FALSE(walker->state().has_ended());
  const std::vector<double> action(3);
  walker->step(action);
  EXPECT_TRUE(walker->state().terminated);
  EXPECT_THROW(walker->step(action), ResetNeeded);
  walker->set_coordinates(standing, still);
  EXPECT_EQ(walker->is_healthy(), true);
  walker->step(action);
  EXPECT_FALSE(walker->state().has_ended());
  EXPECT_EQ(walker->state().step, 2U);
  walker->set_coordinates(standing, lying);
  const EpisodeRecord record = walker->record();
  EXPECT_EQ(record.coordinates.size(), 3U);
  const std::unique_ptr<Walker> repeated = make_recorded();
  repeated->begin(record);
  while (!repeated->repeat(record, {})) {
  }
  expect_same_state(repeated->state(), walker->state());
  EXPECT_EQ(repeated->record().checksums, record.checksums);
}

TEST(Coordinates, AreSetAsOftenAsARecordCanHave) {
  const std::unique_ptr<Walker> walker = make_recorded();
  walker->reset(1);
  const std::vector<double> standing{0, 1.25, 0, 0, 0, 0};
  const std::vector<double> still(6);
  for (std::size_t i = 0; i < kMaxRecordedCoordinates; ++i) {
    walker->set_coordinates(standing, still);
  }
  EXPECT_EQ(message_of<std::logic_error>([&] { walker->set_coordinates(standing, still); }),
            "set_state: the episode has been set 10000 times, as often as its record can have");
  EpisodeRecord record = walker->record();
  record.coordinates.push_back(record.coordinates.back());
  EXPECT_EQ(message_of<std::invalid_argument>([&] { walker->begin(record); }),
            "the record has 10001 coordinates; must have at most 10000");
}

}  // namespace
}  // namespace walker::mujoco

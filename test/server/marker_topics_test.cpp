// Marker topics without subscribers cost nothing, and a new subscriber gets the present markers.
#include "server/markers/markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <ros/callback_queue.h>

#include "episode/fake_robot.h"
#include "server/inbox.h"

namespace walker::test {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

/// A walker of one link on ground and floor that counts calls of `sense` and `scene`.
class CountingRobot : public BareRobot {
 public:
  CountingRobot() {
    specification_.id = "Fake-v0";
    specification_.links.resize(1);
    sensors_.link_poses.resize(1);
    scene_.ground.push_back({{{0, 0}, {1, 0}, {1, -1}, {0, -1}}, {0, 1, 0, 1}});
    scene_.floor = Floor{0, 0.5, {{{1, 1, 1, 1}, {0, 0, 0, 1}}}};
  }

  void reset(Generator& /*generator*/, double* /*info*/) override {
    if (is_broken) throw std::runtime_error("NaN");
  }
  void step(RobotStep& /*step*/) override {}
  void sense(Sensors& sensors) override {
    ++sensed;
    sensors = sensors_;
  }
  void scene(Scene& scene) const override {
    ++scenes;
    scene = scene_;
  }

  double& x() { return sensors_.link_poses[0].position[0]; }

  bool is_broken = false;
  int sensed = 0;
  mutable int scenes = 0;

 private:
  Sensors sensors_;
  Scene scene_;
};

const Marker* find(const MarkerArray& array, const std::string& name) {
  const auto found = std::find_if(array.markers.begin(), array.markers.end(),
                                  [&](const Marker& marker) { return marker.ns == name; });
  return found == array.markers.end() ? nullptr : &*found;
}

class MarkerTopicsTest : public testing::Test {
 protected:
  using Viewer = std::unique_ptr<Inbox<MarkerArray>>;

  MarkerTopicsTest() : MarkerTopicsTest(std::make_unique<CountingRobot>()) {}

  explicit MarkerTopicsTest(std::unique_ptr<CountingRobot> robot)
      : robot_(*robot), walker_(std::move(robot)) {
    node_.setCallbackQueue(&callbacks_);
    topics_ = std::make_unique<MarkerTopics>(node_, walker_, "odom");
  }

  /// Subscribes and waits for the first message.
  Viewer subscribe(const std::string& topic) {
    auto viewer = std::make_unique<Inbox<MarkerArray>>(viewers_, topic);
    wait_until([&] { return viewer->has_any(); });
    return viewer;
  }

  /// Serves new subscribers until the condition holds, like a server between steps.
  template <typename Condition>
  void wait_until(const Condition& condition) {
    ASSERT_TRUE(test::wait_until([&] {
      callbacks_.callAvailable(ros::WallDuration(0.01));
      return condition();
    }));
  }

  void begin_episode() {
    stamp_ += ros::Duration(1);
    walker_.reset(1);
    topics_->begin_episode(stamp_);
    topics_->publish_state(stamp_);
  }

  void step() {
    stamp_ += ros::Duration(1);
    walker_.step({});
    topics_->publish_state(stamp_);
  }

  static std::vector<MarkerArray> wait_count(Inbox<MarkerArray>& viewer, std::size_t count) {
    test::wait_until([&] { return viewer.messages().size() >= count; });
    return viewer.messages();
  }

  ros::NodeHandle viewers_;
  ros::CallbackQueue callbacks_;
  ros::NodeHandle node_;
  CountingRobot& robot_;
  Walker walker_;
  ros::Time stamp_{100};
  std::unique_ptr<MarkerTopics> topics_;
};

TEST_F(MarkerTopicsTest, DoesNothingWithoutSubscribers) {
  for (int episode = 0; episode < 3; ++episode) {
    begin_episode();
    for (int i = 0; i < 20; ++i) step();
  }
  EXPECT_EQ(robot_.sensed, 0);
  EXPECT_EQ(robot_.scenes, 0);
}

TEST_F(MarkerTopicsTest, BuildsTheSceneOncePerEpisodeAndForNewSubscribers) {
  begin_episode();
  const Viewer viewer = subscribe("scene_markers");
  EXPECT_EQ(robot_.scenes, 1);
  const MarkerArray scene = viewer->messages().front();
  EXPECT_EQ(scene.markers.front().action, Marker::DELETEALL);
  ASSERT_NE(find(scene, "ground"), nullptr);
  EXPECT_NE(find(scene, "floor"), nullptr);
  EXPECT_EQ(find(scene, "ground")->header.frame_id, "odom");
  EXPECT_EQ(find(scene, "ground")->header.stamp, stamp_);
  for (int i = 0; i < 20; ++i) step();
  EXPECT_EQ(robot_.scenes, 1);
  begin_episode();
  EXPECT_EQ(robot_.scenes, 2);
  EXPECT_EQ(wait_count(*viewer, 2).size(), 2U) << "not one scene per episode";
}

TEST_F(MarkerTopicsTest, SendsTheFloorAgainWhenTheWalkerLeavesIt) {
  begin_episode();
  const Viewer viewer = subscribe("scene_markers");
  constexpr int kSteps = 90;
  for (int i = 0; i < kSteps; ++i) {
    robot_.x() += 0.05;
    step();
  }
  // The floor moves in steps of four tiles, 2 m. A walk of 4.5 m moves it at x = 1 m and 3 m.
  const std::vector<MarkerArray> sent = wait_count(*viewer, 3);
  ASSERT_EQ(sent.size(), 3U);
  for (std::size_t i = 1; i < sent.size(); ++i) {
    ASSERT_EQ(sent[i].markers.size(), 1U);
    EXPECT_EQ(sent[i].markers[0].ns, "floor");
  }
  EXPECT_EQ(robot_.scenes, 1);
}

TEST_F(MarkerTopicsTest, SendsTheStateToNewSubscribers) {
  begin_episode();
  step();
  const Viewer viewer = subscribe("state_markers");
  const MarkerArray state = viewer->messages().front();
  ASSERT_NE(find(state, "episode"), nullptr);
  EXPECT_EQ(find(state, "episode")->header.stamp, stamp_);
}

TEST_F(MarkerTopicsTest, SendsNothingBeforeTheFirstEpisodeOrAfterAFailure) {
  Inbox<MarkerArray> scenes(viewers_, "scene_markers");
  Inbox<MarkerArray> states(viewers_, "state_markers");
  for (int i = 0; i < 20; ++i) callbacks_.callAvailable(ros::WallDuration(0.01));
  robot_.is_broken = true;
  walker_.reset(1);
  Inbox<MarkerArray> others(viewers_, "state_markers");
  for (int i = 0; i < 20; ++i) callbacks_.callAvailable(ros::WallDuration(0.01));
  EXPECT_EQ(robot_.sensed + robot_.scenes, 0);
  EXPECT_FALSE(scenes.has_any() || states.has_any() || others.has_any());
}

TEST_F(MarkerTopicsTest, SendsThePathWhenItGrowsAndClearsItAtResets) {
  begin_episode();
  const Viewer viewer = subscribe("state_markers");
  const std::size_t before = viewer->messages().size();
  for (std::size_t i = 1; i <= 10; ++i) {
    robot_.x() += 0.6 * Path::kSpacing;
    step();
    wait_count(*viewer, before + i);  // the publisher's queue is short
  }
  robot_.x() = 0;
  begin_episode();
  const std::vector<MarkerArray> sent = wait_count(*viewer, before + 11);
  ASSERT_EQ(sent.size(), before + 11);
  std::vector<std::size_t> lengths;
  for (std::size_t i = before; i < sent.size(); ++i) {
    const Marker* path = find(sent[i], "path");
    if (path != nullptr && path->action == Marker::ADD) lengths.push_back(path->points.size());
  }
  EXPECT_EQ(lengths, (std::vector<std::size_t>{2, 3, 4, 5})) << "it grows at every second step";
  EXPECT_EQ(find(sent.back(), "path")->action, Marker::DELETE) << "path of the previous episode";
}

TEST_F(MarkerTopicsTest, ClearsThePathWithoutSubscribers) {
  begin_episode();
  Viewer viewer = subscribe("state_markers");
  for (int i = 0; i < 10; ++i) {
    robot_.x() += Path::kSpacing + 1e-9;
    step();
  }
  viewer.reset();
  int sensed = -1;
  wait_until([&] {  // the publisher detects the disconnection asynchronously
    sensed = robot_.sensed;
    step();
    return robot_.sensed == sensed;
  });
  robot_.x() += 100;
  viewer = subscribe("state_markers");
  EXPECT_EQ(find(viewer->messages().front(), "path")->action, Marker::DELETE);
}

}  // namespace
}  // namespace walker::test

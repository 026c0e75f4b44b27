// A server steps and serves while pictures are rendered. Its renderer blocks until the test opens a
// gate, so the test does not depend on timing. camera_test.py has names, sizes and encodings.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include "server/gate.h"
#include "server/inbox.h"
#include "server/server.h"
#include "walker_sim/client.h"
#include "walker_sim/registry.h"

namespace walker::test {
namespace {

constexpr std::uint32_t kWidth = 4;
constexpr std::uint32_t kHeight = 2;
constexpr std::size_t kPixels = 8;
const std::vector<double> kAction{1, 1, -1, 1};  // the walker stands with its legs apart

Gate the_gate;                       // passed by each `render`
std::atomic<bool> is_broken{false};  // whether each `render` throws
Mailbox rendered;                    // steps of the pictures, in order

/// The value of all pixels is the step since the reset.
class FakeRenderer : public Renderer {
 public:
  const Camera& camera() const override { return camera_; }

  void render(const StateCapture& captured, const Channels& /*channels*/, Image& image) override {
    the_gate.pass();
    if (is_broken) throw std::runtime_error("no OpenGL: install it");
    rendered.add(std::to_string(captured.step));
    image.width = kWidth;
    image.height = kHeight;
    image.rgb.assign(3 * kPixels, static_cast<std::uint8_t>(captured.step));
  }

 private:
  Camera camera_{kWidth, kHeight, 10, 1, 2};
};

std::ptrdiff_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return std::distance(begin(all), end(all));
}

/// All tests share one in-process server: ROS cannot restart after a shutdown.
class Pictures : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const ServerOptions options = read_server_options();
    server_ = new walker::Server(
        options, [options] { return make(options.id, options.environment); },
        [](const Parameters& /*camera*/) { return std::make_unique<FakeRenderer>(); });
    loop_ = new std::thread([] { server_->run(); });
  }

  static void TearDownTestSuite() {
    ros::shutdown();
    loop_->join();
    delete server_;
    delete loop_;
  }

  Pictures() {
    the_gate.open();
    client_.reset(0, transition_);
  }

  static ClientOptions options(double timeout = 30) {
    ClientOptions options;
    options.server = ros::this_node::getName();
    options.timeout = timeout;
    return options;
  }

  /// Requests a picture from another client in a new thread.
  static std::future<Image> request_picture(double timeout = 30) {
    return std::async(std::launch::async, [timeout] {
      Client client(options(timeout));
      Image image;
      client.render(0, "", {}, image);
      return image;
    });
  }

  /// The same; returns when the renderer is blocked at the closed gate.
  static std::future<Image> request_blocked_picture() {
    the_gate.close();
    const std::uint64_t arrivals = the_gate.arrivals();
    auto picture = request_picture();
    the_gate.wait_for_arrivals(arrivals + 1);
    return picture;
  }

  void step(int count) {
    for (int i = 0; i < count; ++i) {
      const std::uint32_t before = transition_.step;
      client_.step(kAction.data(), kAction.size(), transition_);
      ASSERT_EQ(transition_.step, before + 1);
    }
  }

  /// Steps until the server renders for the topic; the picture is blocked at the gate.
  void step_until_it_is_watched() {
    the_gate.close();
    const std::uint64_t arrivals = the_gate.arrivals();
    for (int i = 0; i < 1000 && the_gate.arrivals() == arrivals; ++i) {
      step(1);
      ros::WallDuration(0.005).sleep();  // a publisher registers its subscribers asynchronously
    }
    the_gate.wait_for_arrivals(arrivals + 1);
  }

  static walker::Server* server_;
  static std::thread* loop_;

  ros::NodeHandle node_;
  Client client_{options()};
  Transition transition_;
};

walker::Server* Pictures::server_ = nullptr;
std::thread* Pictures::loop_ = nullptr;

TEST_F(Pictures, TopicsNeitherBlockNorLoseSteps) {
  Inbox<sensor_msgs::Image> images(node_, "camera/image_raw");
  Inbox<sensor_msgs::CameraInfo> infos(node_, "camera/camera_info");
  Inbox<walker_sim::Transition> transitions(node_, "transition");
  step_until_it_is_watched();
  const std::uint32_t first = transition_.step;
  step(100);  // while the renderer is blocked
  EXPECT_FALSE(client_.specification().id.empty());
  EXPECT_FALSE(images.has_any());
  the_gate.open();
  const auto image = images.at(ros::Time().fromNSec(transition_.stamp));
  ASSERT_TRUE(image) << "no picture of the newest state";
  EXPECT_EQ(image->data,
            std::vector<std::uint8_t>(3 * kPixels, static_cast<std::uint8_t>(first + 100)));
  EXPECT_EQ(images.messages().size(), 2U) << "the picture in progress and the newest";
  const auto info = infos.at(image->header.stamp);
  ASSERT_TRUE(info);
  EXPECT_EQ(infos.messages().size(), 2U);
  const std::array<double, 9> k{10, 0, 1.5, 0, 10, 0.5, 0, 0, 1};
  const std::array<double, 12> p{10, 0, 1.5, 0, 0, 10, 0.5, 0, 0, 0, 1, 0};
  EXPECT_TRUE(std::equal(k.begin(), k.end(), info->K.begin()));
  EXPECT_TRUE(std::equal(p.begin(), p.end(), info->P.begin()));
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_TRUE(transitions.find([&](const auto& other) { return other.step == first + i + 1; }));
  }
}

TEST_F(Pictures, TransformsAreOfTheStateOfTheOdometry) {
  Inbox<nav_msgs::Odometry> odometries(node_, "odom");
  Inbox<tf2_msgs::TFMessage> transforms(node_, "/tf");
  wait_until([&] {
    step(1);
    return odometries.has_any() && transforms.has_any();
  });
  step(10);
  const ros::Time stamp = ros::Time().fromNSec(transition_.stamp);
  const auto odometry = odometries.at(stamp);
  const auto transform = transforms.at(stamp);
  ASSERT_TRUE(odometry && transform);
  EXPECT_EQ(transform->transforms[0].transform.translation.x, odometry->pose.pose.position.x);
}

TEST_F(Pictures, RequestsShowTheStateAtTheirArrival) {
  step(3);
  auto picture = request_blocked_picture();
  step(10);
  the_gate.open();
  EXPECT_EQ(picture.get().rgb, std::vector<std::uint8_t>(3 * kPixels, 3));
}

TEST_F(Pictures, DropsRequestsOfDisconnectedClients) {
  step(5);
  auto patient = request_blocked_picture();
  step(1);
  const auto descriptors = open_descriptors();
  auto impatient = request_picture(0.2);  // queued behind the first
  EXPECT_THROW(impatient.get(), ConnectionError);
  // Wait until the in-process server has closed its descriptors too.
  wait_until([&] {
    step(1);
    return open_descriptors() <= descriptors;
  });
  const std::uint32_t last = transition_.step;
  const std::vector<std::string> before = rendered.texts();
  the_gate.open();
  EXPECT_EQ(patient.get().rgb.front(), 5);
  Image image;
  client_.render(0, "", {}, image);
  const std::vector<std::string> after = rendered.texts();
  EXPECT_EQ(std::vector<std::string>(after.begin() + static_cast<std::ptrdiff_t>(before.size()),
                                     after.end()),
            (std::vector<std::string>{"5", std::to_string(last)}));
}

TEST_F(Pictures, RenderFailuresDoNotStopSteps) {
  Inbox<sensor_msgs::Image> images(node_, "camera/image_raw");
  is_broken = true;
  step_until_it_is_watched();
  the_gate.open();
  step(100);
  is_broken = false;
  step(100);
  EXPECT_TRUE(images.at(ros::Time().fromNSec(transition_.stamp)));
}

}  // namespace
}  // namespace walker::test

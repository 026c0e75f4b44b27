// Pictures that the client requests, valid and invalid.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client/scripted_server.h"
#include "client/scripted_walker.h"
#include "error_message.h"
#include "walker_sim/client.h"

namespace walker {
namespace {

using test::kLost;
using test::Peer;
using test::ScriptedServer;
using test::ScriptedWalker;

/// Response of ~render: the success fields, then a sensor_msgs/Image.
struct Picture {
  std::string encoding = "rgb8";
  std::uint32_t width = 2;
  std::uint32_t height = 1;
  std::uint32_t row_bytes = 6;
  std::string data = "\1\2\3\4\5\xff";
  std::uint8_t is_bigendian = 0;

  std::string answer() const {
    test::Message message;
    message.number(std::uint8_t{1}).text("");
    message.number(std::uint32_t{0}).number(std::uint32_t{3}).number(std::uint32_t{20});
    message.text("camera").number(height).number(width).text(encoding).number(is_bigendian);
    return test::answer(message.number(row_bytes).text(data).bytes());
  }
};

ScriptedServer::Script drawing(const std::string& answer, std::string* request = nullptr) {
  return [answer, request](Peer& peer) {
    test::open(peer, kRender);
    const std::string taken = peer.take_frame();
    if (request != nullptr) *request = taken;
    peer.give(answer);
    peer.sees_end();
  };
}

TEST(Render, AsksAndTakesThePicture) {
  std::string request;
  ScriptedWalker walker({drawing(Picture().answer(), &request)});
  Image image;
  image.depth = {1};
  walker.client().render(
      7, "rgb8", {{"width", std::int64_t{2}}, {"camera_name", std::string("track")}}, image);
  EXPECT_EQ(request, test::Message()
                         .number(std::uint32_t{7})
                         .text("rgb8")
                         .texts({"camera_name", "width"})
                         .texts({"track", "2"})
                         .bytes());
  EXPECT_EQ(image.width, 2U);
  EXPECT_EQ(image.height, 1U);
  EXPECT_EQ(image.rgb, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 255}));
  EXPECT_TRUE(image.depth.empty());
}

TEST(Render, TakesDepth) {
  Picture picture;
  picture.encoding = "32FC1";
  picture.height = 2;
  picture.width = 1;
  picture.row_bytes = 4;
  picture.data = test::Message().number(0.5F).number(-3.0F).bytes();
  std::string request;
  ScriptedWalker walker({drawing(picture.answer(), &request)});
  Image image;
  image.rgb = {1};
  walker.client().render(0, "32FC1", {}, image);
  EXPECT_EQ(request,
            test::Message().number(std::uint32_t{0}).text("32FC1").texts({}).texts({}).bytes());
  EXPECT_EQ(image.width, 1U);
  EXPECT_EQ(image.height, 2U);
  EXPECT_EQ(image.depth, (std::vector<float>{0.5F, -3.0F}));
  EXPECT_TRUE(image.rgb.empty());
}

TEST(Render, RefusesPicturesThatAreNone) {
  const auto outcome = [](const Picture& picture, const std::string& encoding = "rgb8",
                          const Parameters& camera = {}) {
    ScriptedWalker walker({drawing(picture.answer())});
    Image image;
    const std::string error =
        message_of<ConnectionError>([&] { walker.client().render(0, encoding, camera, image); });
    EXPECT_EQ(image.width, 0U);
    const std::string whom = "service /walker_sim/render at " + walker.address() + ": ";
    EXPECT_EQ(error.rfind(whom, 0), 0U) << error;
    return error.substr(whom.size());
  };
  EXPECT_EQ(outcome({}, "32FC1"), "the picture's encoding is rgb8 instead of 32FC1" + kLost);
  Picture picture;
  picture.is_bigendian = 1;
  EXPECT_EQ(outcome(picture), "the picture's encoding is rgb8, big-endian instead of rgb8" + kLost);
  picture = Picture();
  picture.encoding = "bgr8";
  EXPECT_EQ(outcome(picture, ""), "the picture's encoding is bgr8 instead of rgb8" + kLost);
  picture = Picture();
  picture.width = 3;
  EXPECT_EQ(outcome(picture), "the picture's rows have 6 bytes instead of 9" + kLost);
  picture = Picture();
  picture.height = 2;
  EXPECT_EQ(outcome(picture), "6 bytes of data came instead of 12" + kLost);
  picture = Picture();
  for (const std::string& data : {std::string(), picture.data.substr(1), picture.data + "\7"}) {
    Picture other = picture;
    other.data = data;
    EXPECT_EQ(outcome(other),
              std::to_string(data.size()) + " bytes of data came instead of 6" + kLost);
  }
  // The requested number of pixels with other dimensions.
  const Parameters upright{{"width", std::int64_t{1}}, {"height", std::int64_t{2}}};
  EXPECT_EQ(outcome(picture, "rgb8", upright), "the picture's width is 2 instead of 1" + kLost);
  EXPECT_EQ(outcome(picture, "rgb8", {{"height", std::int64_t{2}}}),
            "the picture's height is 1 instead of 2" + kLost);
  // width * height * 3 overflows a signed 64-bit integer.
  picture = Picture();
  picture.width = std::uint32_t{1} << 31;
  picture.height = std::uint32_t{1} << 31;
  picture.row_bytes = 0;
  EXPECT_EQ(outcome(picture), "the picture's rows have 0 bytes instead of 6442450944" + kLost);
}

TEST(Render, PassesOnWhyThereIsNone) {
  const std::string refusal = test::Message().number(std::uint8_t{0}).text("no episode").bytes();
  ScriptedWalker walker({drawing(test::answer(refusal))});
  Image image;
  EXPECT_EQ(message_of<RequestRefused>([&] { walker.client().render(0, "", {}, image); }),
            "no episode");
}

TEST(Render, AServerWithoutPicturesStillSteps) {
  const auto knows_nothing = [](Peer& peer) {
    peer.take_post();
    peer.give(test::http_answer(test::xml_answer(-1, "no provider", "")));
  };
  const auto steps = [](Peer& peer) {
    test::open(peer, kStep);
    for (int i = 0; i < 2; ++i) {
      peer.take_frame();
      peer.give(test::answer(test::to_bytes(test::example_transition())));
    }
  };
  ScriptedServer server({test::tell_specification, steps});
  const ScriptedServer::Script known = test::master_of(server.address());
  ScriptedServer master({known, known, knows_nothing});
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  Client client(options);
  Transition transition;
  client.step(nullptr, 0, transition);
  Image image;
  EXPECT_EQ(message_of<ConnectionError>([&] { client.render(0, "", {}, image); }),
            "ROS master " + options.master_uri +
                ": it does not know /walker_sim/render (no provider): is the server running, under "
                "this name, and in a version that has this service?");
  client.step(nullptr, 0, transition);  // on the same connection
}

}  // namespace
}  // namespace walker

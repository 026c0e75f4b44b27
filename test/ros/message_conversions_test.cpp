// Worlds between messages and the core's types.
#include "ros/message_conversions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "error_message.h"

namespace walker {
namespace {

walker_sim::WorldParameter parameter(const std::string& name, double low, double high) {
  walker_sim::WorldParameter message;
  message.name = name;
  message.low = low;
  message.high = high;
  return message;
}

TEST(WorldMessages, EmptyOneLeavesTheWorld) {
  EXPECT_EQ(to_world(walker_sim::World()), std::nullopt);
}

TEST(WorldMessages, ParametersReplaceThoseOfThePreset) {
  walker_sim::World message;
  message.preset = "moon";
  EXPECT_EQ(to_world(message), (World{{"gravity", {-1.62, -1.62}}}));
  message.parameters = {parameter("dropout", 0.1, 0.2)};
  EXPECT_EQ(to_world(message), (World{{"dropout", {0.1, 0.2}}, {"gravity", {-1.62, -1.62}}}));
  message.parameters = {parameter("gravity", -3, -2)};
  EXPECT_EQ(to_world(message), (World{{"gravity", {-3, -2}}}));
  message.preset.clear();
  EXPECT_EQ(to_world(message), (World{{"gravity", {-3, -2}}}));
}

TEST(WorldMessages, PresetIsNoFile) {
  walker_sim::World message;
  for (const char* text : {"/etc/hostname", "{gravity: -5}", "moom"}) {
    message.preset = text;
    const std::string error = message_of<std::invalid_argument>([&] { to_world(message); });
    EXPECT_EQ(error.rfind(std::string("world preset ") + text + ": unknown", 0), 0U) << error;
    EXPECT_NE(error.find("Known: dcd_high_stairs dcd_med"), std::string::npos) << error;
  }
}

TEST(WorldMessages, DrawnValuesAreNumbers) {
  EXPECT_EQ(to_values({parameter("gravity", -3, -3)}), (WorldValues{{"gravity", -3}}));
  for (const double high : {-2.0, std::nan("")}) {
    const std::string error =
        message_of<std::invalid_argument>([&] { to_values({parameter("gravity", -3, high)}); });
    EXPECT_NE(error.find("must be a number, low == high"), std::string::npos) << error;
  }
}

TEST(WorldMessages, RoundTrip) {
  for (const World& world : {World{}, World{{"gravity", {-3, -2}}, {"dropout", {0.5, 0.5}}}}) {
    walker_sim::World message;
    to_message(world, message);
    EXPECT_EQ(to_world(message), world);
  }
  const WorldValues values{{"gravity", -3}, {"dropout", 0.1}};
  std::vector<walker_sim::WorldParameter> message;
  to_message(values, message);
  EXPECT_EQ(to_values(message), values);
}

}  // namespace
}  // namespace walker

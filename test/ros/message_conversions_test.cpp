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

TEST(WorldMessages, RoundTrip) {
  for (const World& world :
       {World{},
        World{{"gravity", {-3, -2}}, {"dropout", {0.5, 0.5}}, {"foot_mass", {1, 4, true}}}}) {
    walker_sim::World message;
    to_message(world, message);
    EXPECT_EQ(to_world(message), world);
  }
}

}  // namespace
}  // namespace walker

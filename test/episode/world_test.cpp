#include "walker_sim/world.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/random.h"
#include "error_message.h"
#include "temporary_folder.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

const std::string kId = "BipedalWalker-v3";

std::string refusal(const std::string& id, const World& world) {
  return message_of<std::invalid_argument>([&] { check_world(id, world); });
}

TEST(World, ParsesLinesAndBraces) {
  const World expected{{"gravity", {-5, -5}}, {"push_interval", {1, 2.5}}};
  EXPECT_EQ(parse_world("# comment\ngravity: -5 # more\n\npush_interval: [1, 2.5]\n", "x"),
            expected);
  EXPECT_EQ(parse_world("{gravity: -5, push_interval: [1, 2.5]}", "x"), expected);
  EXPECT_EQ(load_world("{ gravity: -5.0, push_interval: [1,2.5] }"), expected);
  EXPECT_EQ(parse_world(to_string(expected), "x"), expected);
  EXPECT_EQ(to_string(expected), "{gravity: -5.0, push_interval: [1.0, 2.5]}");
  EXPECT_EQ(parse_world("# c\n{\"gravity\": -5, # d\n 'push_interval': [1, 2.5]} # e", "x"),
            expected);
  EXPECT_EQ(parse_world("{}", "x"), World{});
}

/// test/python/worlds_test.py compares with PyYAML.
TEST(World, ParsesYamlsOrdinaryForms) {
  const World expected{{"gravity", {-5, -4}}, {"pit_gap", {1, 1}}};
  for (const char* text : {
           "gravity:\n- -5\n- -4\npit_gap: 1\n",
           "gravity: # m/s^2\n  - -5.0  # low\n  -   -4\n\npit_gap:\n  1\n",
           "pit_gap: 1\ngravity: [-5,\n  -4,\n]\n",
           "\xEF\xBB\xBF%YAML 1.1\n# mine\n---  # here\r\ngravity: [-5, -4]\r\npit_gap: "
           "1\r\n...\r\n",
           "--- {gravity: [-5, -4],\n pit_gap: 1,}\n",
           "{\n \"gravity\": [\n  -5,\n  -4\n ],\n \"pit_gap\": 1\n}\n",
           "gravity: !!python/tuple\n- -5\n- -4\npit_gap: 1\n",
       }) {
    EXPECT_EQ(parse_world(text, "x"), expected) << text;
  }
  for (const char* text :
       {"a: &id001 !!python/tuple\n- 1\n- 2\nb: *id001\n", "  a: &x [1, 2]\n  b: *x\n"}) {
    EXPECT_EQ(parse_world(text, "x"), (World{{"a", {1, 2}}, {"b", {1, 2}}})) << text;
  }
}

TEST(World, ParsesLogarithmicRanges) {
  const World expected{{"friction_scale", {0.5, 2, true}}, {"gravity", {-5, -4}}};
  for (const char* text : {
           "{friction_scale: {log: [0.5, 2]}, gravity: [-5, -4]}",
           "friction_scale: {log: [0.5, 2]}\ngravity: [-5, -4]\n",
           "friction_scale:\n  log: [0.5, 2]\ngravity: [-5, -4]\n",
           "friction_scale:\n  log:\n  - 0.5\n  - 2\ngravity: [-5, -4]\n",
           "{\"friction_scale\": {\"log\": [0.5, 2]}, \"gravity\": [-5, -4]}",
       }) {
    EXPECT_EQ(parse_world(text, "x"), expected) << text;
  }
  EXPECT_EQ(to_string(expected), "{friction_scale: {log: [0.5, 2.0]}, gravity: [-5.0, -4.0]}");
  EXPECT_EQ(parse_world(to_string(expected), "x"), expected);
  EXPECT_EQ(parse_world("a: {log: [2, 2]}", "x"), (World{{"a", {2, 2}}}));
  EXPECT_EQ(parse_world("a: &id001\n  log: !!python/tuple\n  - 1\n  - 2\nb: *id001\n", "x"),
            (World{{"a", {1, 2, true}}, {"b", {1, 2, true}}}));
  for (const char* text :
       {"a: {log: 2}", "a:\nlog: [1, 2]", "a: {ln: [1, 2]}", "a: {log: [1, 2], b: 3}",
        "a: {log: {log: [1, 2]}}", "a: log: [1, 2]", "a: {log: [1, 2]"}) {
    EXPECT_THROW(parse_world(text, "x"), std::invalid_argument) << text;
  }
}

TEST(World, NamesWhatItCannotParse) {
  const auto message = [](const std::string& text) {
    return message_of<std::invalid_argument>([&] { parse_world(text, "w.yaml"); });
  };
  const std::string allowed =
      ": must be NAME: NUMBER, NAME: [LOW, HIGH] or NAME: {log: [LOW, HIGH]}";
  for (const std::string line :
       {"gravity", "gravity: low", "gravity: [1]", "gravity: [1, 2, 3]", "gravity: [1, x]", ": 1",
        "gravity:", "gravity: 1 2", "gravity: 1#2", "gravity: - 1", "gravity: *a", "gravity: [1, 2",
        "- 1", "gravity: \"1\"", "gravity: !!float 1"}) {
    EXPECT_EQ(message(line), "world w.yaml: " + line + allowed);
  }
  EXPECT_EQ(message("a:\n- 1\n- 2\n- 3"), "world w.yaml: a:\\n- 1\\n- 2\\n- 3" + allowed);
  EXPECT_EQ(message("world:\n  a: 1"), "world w.yaml: world:\\na: 1" + allowed);
  EXPECT_EQ(message("a: 1\na: 2"), "world w.yaml: a is given twice");
  for (const std::string text : {"a: 1\n---\nb: 2", "a: 1\n...\nb: 2", "---\n---"}) {
    EXPECT_EQ(message(text), "world w.yaml: must be one YAML document");
  }
  EXPECT_EQ(
      message_of<std::invalid_argument>([] { load_world("mon"); }).substr(0, 87),
      "world mon, neither a preset nor a readable YAML file: unknown; did you mean moon? Known");
}

TEST(World, ReadsWholeFiles) {
  const Folder folder;
  EXPECT_EQ(load_world(folder.write("empty.yaml", "")), World{});
  const std::string path =
      folder.write("long.yaml", std::string(65530, '#') + "\ngravity: -5.25\n");
  EXPECT_EQ(message_of<std::invalid_argument>([&] { load_world(path); }),
            "world " + path + ": has more than 65536 bytes");
}

/// Opening a FIFO would block until it has a writer.
TEST(World, ReadsRegularFilesOnly) {
  const Folder folder;
  const std::string pipe = folder.path("world.pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), S_IRUSR | S_IWUSR), 0);
  for (const std::string& path : {pipe, folder.path(), std::string("/dev/zero")}) {
    EXPECT_EQ(message_of<std::invalid_argument>([&] { load_world(path); }),
              "world " + path + ": must be a preset or a regular YAML file");
  }
}

TEST(World, HasPresetsThatSomeEnvironmentApplies) {
  const std::vector<std::string> presets = world_presets();
  EXPECT_GE(presets.size(), 12U);
  for (const std::string& preset : presets) {
    const World world = load_world(preset);
    EXPECT_EQ(world.empty(), preset == "gymnasium") << preset;
    const bool is_of_walker2d = preset.find("walker2d") == 0;
    for (const char* id : {is_of_walker2d ? "Walker2d-v5" : "BipedalWalker-v3",
                           is_of_walker2d ? "Hopper-v4" : "BipedalWalkerHardcore-v3"}) {
      EXPECT_EQ(refusal(id, world), "nothing thrown") << preset << " in " << id;
    }
  }
  for (const std::string preset : {"slippery", "moon", "pushed", "laggy", "noisy"}) {
    for (const std::string id : {"Walker2d-v4", "Walker2d-v5", "Hopper-v5"}) {
      EXPECT_EQ(refusal(id, load_world(preset)), "nothing thrown") << preset << " in " << id;
    }
  }
}

TEST(World, RefusesByName) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(kId, {{"gravitty", {1, 1}}}).substr(0, 67),
            "world parameter gravitty = 1.0: unknown; did you mean gravity? Know");
  EXPECT_EQ(refusal("Walker2d-v5", {{"hip_speed", {0.5, 1}}}),
            "world parameter hip_speed = [0.5, 1.0]: cannot be applied by Walker2d-v5; "
            "BipedalWalker-v3 has it");
  EXPECT_EQ(refusal(kId, {{"dropout", {0.5, 0.25}}}),
            "world parameter dropout = [0.5, 0.25]: must be a number, or a range [low, high] with "
            "low <= high");
  EXPECT_EQ(refusal(kId, {{"dropout", {0.5, 1.5}}}),
            "world parameter dropout = [0.5, 1.5]: must be in [0.0, 1.0]");
  EXPECT_EQ(refusal(kId, {{"action_delay", {kNan, kNan}}}),
            "world parameter action_delay = .nan: must be finite, in [0.0, 1.0] s");
  EXPECT_EQ(
      refusal(kId, {{"stair_steps", {1.5, 1.5}}}),
      "world parameter stair_steps = 1.5: must be a whole number, or a range of whole numbers");
  EXPECT_EQ(refusal(kId, {{"push_impulse", {1, 1}}}),
            "world parameter push_impulse = 1.0: has no effect without push_interval");
  EXPECT_EQ(refusal(kId, {{"change_interval", {1, 1}}, {"gravity", {-5, -5}}}),
            "world parameter change_interval = 1.0: has no effect without a range of physics, such "
            "as gravity: [-12, -8]");
  EXPECT_EQ(refusal(kId, {{"friction_scale", {0, 2, true}}}),
            "world parameter friction_scale = {log: [0.0, 2.0]}: with log must not contain 0");
  EXPECT_EQ(
      refusal(kId, {{"stair_steps", {1, 4, true}}}),
      "world parameter stair_steps = {log: [1.0, 4.0]}: must be drawn uniformly, without log");
}

TEST(World, HasLimitsAroundItsDefaults) {
  for (const Registration& registration : registrations()) {
    for (const WorldParameter& parameter : world_parameters(registration.id)) {
      SCOPED_TRACE(registration.id + " " + parameter.name);
      EXPECT_LT(parameter.minimum, parameter.maximum);
      EXPECT_FALSE(parameter.description.empty());
      if (std::isnan(parameter.default_value)) continue;
      EXPECT_LE(parameter.minimum, parameter.default_value);
      EXPECT_LE(parameter.default_value, parameter.maximum);
    }
  }
}

TEST(World, DrawsNormalNumbers) {
  constexpr std::size_t kDraws = 100001;
  std::vector<double> values(kDraws);
  Generator(1).normals(values.data(), kDraws);
  double sum = 0;
  double sum_of_squares = 0;
  double sum_of_cubes = 0;
  std::size_t beyond_two = 0;
  for (const double value : values) {
    sum += value;
    sum_of_squares += value * value;
    sum_of_cubes += value * value * value;
    if (std::abs(value) > 2) ++beyond_two;
  }
  const double root = std::sqrt(static_cast<double>(kDraws));
  EXPECT_NEAR(sum / kDraws, 0, 5 / root);
  EXPECT_NEAR(sum_of_squares / kDraws, 1, 5 * std::sqrt(2.0) / root);
  EXPECT_NEAR(sum_of_cubes / kDraws, 0, 5 * std::sqrt(15.0) / root);
  const double share = std::erfc(std::sqrt(2.0));
  EXPECT_NEAR(static_cast<double>(beyond_two) / kDraws, share, 5 * std::sqrt(share) / root);
}

}  // namespace
}  // namespace walker

// The lidar against geometry on the floor, against mj_ray on everything else, and as it is
// observed.
#include "robots/mujoco/lidar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "as_numbers.h"
#include "base/random.h"
#include "robots/mujoco/level_ground.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/planar_model.h"
#include "robots/mujoco/player.h"
#include "robots/mujoco/world_robot.h"
#include "stepper.h"
#include "test_name.h"

namespace walker::mujoco {
namespace {

using Numbers = std::vector<double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRange = 160.0 / 68 * 1.01;
const Parameters kWithLidar{{"include_lidar_in_observation", true},
                            {"terminate_when_unhealthy", false}};

/// Ranges over level ground, which the origin is this high above.
LidarRanges ranges_above(double height, double maximum) {
  LidarRanges ranges{};
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double range = height / std::cos(0.15 * static_cast<double>(i));
    ranges[i] = range <= maximum ? range : kInfinity;
  }
  return ranges;
}

Numbers observed_fractions(const WorldRobot& robot) {
  const Numbers all = robot.observation();
  return Numbers(all.end() - kLidarRays, all.end());
}

Numbers pose(const WorldRobot& robot, double x, double z, double pitch) {
  Numbers position(kBaseJoints + robot.action_size(), -0.4);
  position[kBaseX] = x;
  position[kBaseZ] = z;
  position[kBasePitch] = pitch;
  return position;
}

class LidarTest : public testing::TestWithParam<const char*> {};

/// Also beyond the part of the floor that is drawn, 20 m or 40 m from the start.
TEST_P(LidarTest, MeasuresTheFloor) {
  WorldRobot robot(GetParam(), kWithLidar);
  robot.reset(0);
  for (const double height : {0.3, 1.25, 2.0, 2.3, 2.6, 30.0}) {
    for (const double pitch : {0.0, 0.7, -2.0, 9.0}) {
      for (const double x : {0.0, -3.0, 100.0}) {
        robot.place(pose(robot, x, height, pitch));
        Sensors sensors;
        robot.robot->sense(sensors);
        EXPECT_EQ(sensors.maximum_range, kRange);
        ASSERT_EQ(sensors.ranges.size(), kLidarRays);
        const LidarRanges expected = ranges_above(height, kRange);
        const Numbers fractions = observed_fractions(robot);
        for (std::size_t i = 0; i < kLidarRays; ++i) {
          if (std::isinf(expected[i])) {
            ASSERT_EQ(sensors.ranges[i], kInfinity) << height << " m, ray " << i;
            ASSERT_EQ(fractions[i], 1);
          } else {
            ASSERT_NEAR(sensors.ranges[i], expected[i], 1e-12) << height << " m, ray " << i;
            ASSERT_EQ(fractions[i], sensors.ranges[i] / kRange);
          }
        }
      }
    }
  }
}

/// Distance along a ray in the plane to a segment; infinity: no hit.
double distance_to(const GroundPiece& piece, const Vector3& origin, double angle) {
  const Point ray{std::sin(angle), -std::cos(angle)};
  const Point way = piece.to - piece.from;
  const Point to_piece = piece.from - Point{origin[0], origin[2]};
  const double area = ray.x * way.y - ray.y * way.x;
  const double distance = (to_piece.x * way.y - to_piece.y * way.x) / area;
  const double share = (to_piece.x * ray.y - to_piece.y * ray.x) / area;
  return area != 0 && 0 <= share && share <= 1 && distance >= 0 ? distance : kInfinity;
}

TEST_P(LidarTest, MeasuresLevels) {
  constexpr double kFar = 20;
  const WorldValues values{{"ground_roughness", 3}, {"pit_gap", 0.4},      {"stump_height", 0.2},
                           {"stair_height", 0.15},  {"stair_width", 0.25}, {"stump_float", 0.3},
                           {"lidar_range", kFar}};
  WorldRobot robot(GetParam(), kWithLidar, values);
  int num_hits = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    robot.reset(seed);
    Generator generator(seed);
    const LevelGround ground(generator, *level_of(values), {0, 0});
    for (double x = -3; x < 60; x += 0.37) {
      for (const double clearance : {0.2, 1.25, 2.0}) {
        const Vector3 origin{x, 0, ground.below(x).top + clearance};
        robot.place(pose(robot, x, origin[2], 0.3));
        Sensors sensors;
        robot.robot->sense(sensors);
        const Numbers fractions = observed_fractions(robot);
        for (std::size_t i = 0; i < kLidarRays; ++i) {
          double expected = kInfinity;
          for (const GroundPiece& piece : ground.line().pieces()) {
            const double angle = 0.15 * static_cast<double>(i);
            expected = std::min(expected, distance_to(piece, origin, angle));
          }
          if (std::abs(expected - kFar) < 1e-6) continue;
          if (expected > kFar) {
            ASSERT_EQ(sensors.ranges[i], kInfinity)
                << "seed " << seed << " at " << x << " ray " << i;
            continue;
          }
          ++num_hits;
          ASSERT_NEAR(sensors.ranges[i], expected, 1e-9)
              << "seed " << seed << " at " << x << " ray " << i;
          ASSERT_EQ(fractions[i], sensors.ranges[i] / kFar);
        }
      }
    }
  }
  EXPECT_GT(num_hits, 10000);
}

TEST_P(LidarTest, HasTheWorldsRange) {
  WorldRobot robot(GetParam(), kWithLidar, {{"lidar_range", 5}});
  robot.reset(0);
  robot.place(pose(robot, 0, 4, 0));
  Sensors sensors;
  robot.robot->sense(sensors);
  EXPECT_EQ(sensors.maximum_range, 5);
  EXPECT_EQ(sensors.ranges[0], 4);
  EXPECT_EQ(observed_fractions(robot)[0], 0.8);
  EXPECT_EQ(robot.robot->specification().range_finder.maximum_range, kRange);
  robot.robot->set_world({});
  robot.reset(0);
  robot.robot->sense(sensors);
  EXPECT_EQ(sensors.maximum_range, kRange);
}

/// The fractions change nothing else: neither the walker's motion nor the other sensors' errors.
TEST_P(LidarTest, IsAppendedToTheObservation) {
  const World world =
      as_numbers({{"push_interval", 0.08}, {"joint_position_noise", 0.05}, {"range_noise", 0.1}});
  Stepper plain(GetParam());
  Stepper walker(GetParam(), {{"include_lidar_in_observation", true}});
  const Specification& specification = walker.environment->specification();
  const std::size_t size = plain.observation.size();
  ASSERT_EQ(walker.observation.size(), size + kLidarRays);
  for (std::size_t i = size; i < walker.observation.size(); ++i) {
    EXPECT_EQ(specification.observation_low[i], 0);
    EXPECT_EQ(specification.observation_high[i], 1);
  }
  for (Stepper* each : {&plain, &walker}) {
    each->environment->set_world(world);
    each->reset(1);
  }
  Actions actions("random", 1, static_cast<int>(specification.action_size()));
  Numbers action;
  int steps = 0;
  for (; !plain.has_ended(); ++steps) {
    actions.draw(plain.observation, action);
    for (Stepper* each : {&plain, &walker}) each->step(action);
    ASSERT_TRUE(
        std::equal(plain.observation.begin(), plain.observation.end(), walker.observation.begin()));
    const auto [least, most] =
        std::minmax_element(walker.observation.begin() + size, walker.observation.end());
    ASSERT_GE(*least, 0);
    ASSERT_LE(*most, 1);
  }
  EXPECT_GT(steps, 10);
}

INSTANTIATE_TEST_SUITE_P(Ids, LidarTest, testing::Values("Walker2d-v4", "Walker2d-v5", "Hopper-v5"),
                         kNameOfId);

/// Geoms of all shapes in the world and in bodies that are fixed to it; two are fully transparent.
const char* const kObstacles = R"(
    <geom type="box" size="0.4 1 0.1" pos="0.9 0 0.1"/>
    <geom type="box" size="0.3 1 0.5" pos="1.5 0.1 0.3" euler="10 20 30"/>
    <geom type="sphere" size="0.2" pos="0.35 0 0.3"/>
    <geom type="capsule" size="0.1 0.3" pos="0.6 0.05 0.5" euler="70 0 20"/>
    <geom type="cylinder" size="0.1 0.3" pos="-3 0 0.1"/>
    <geom type="ellipsoid" size="0.1 0.2 0.15" pos="-2 0 0.1"/>
    <geom type="box" size="0.5 1 0.1" pos="0 0 0.9" rgba="1 1 1 0"/>
    <geom type="box" size="0.5 1 0.1" pos="0 0 0.8" material="glass"/>
    <body name="wall" pos="3 0 0" euler="0 5 0">
      <geom type="box" size="0.1 1 2"/>
      <body name="shelf" pos="-0.6 0 0.6" euler="0 0 15">
        <geom type="box" size="0.5 1 0.05" material="MatPlane"/>
      </body>
    </body>
)";
const char* const kSurfaces = R"(
    <geom type="mesh" mesh="ramp" pos="-1.5 0 0"/>
    <geom type="hfield" hfield="plateau" pos="-6 0 0.2"/>
)";
const char* const kAssets = R"(
    <material name="glass" rgba="1 1 1 0"/>
    <mesh name="ramp" vertex="-1 -1 0  1 -1 0  1 1 0  -1 1 0  1 -1 0.6  1 1 0.6"/>
    <hfield name="plateau" nrow="3" ncol="5" size="3 3 0.5 0.1"/>
)";

/// Writes Walker2d with these geoms. The walker's own ones are in group 5, the others in group 0.
std::string write_world(const Folder& folder, const std::string& geoms) {
  std::string text = replaced(builtin_text("walker2d_v5.xml"), "<geom type=\"capsule\"",
                              "<geom group=\"5\" type=\"capsule\"");
  text = replaced(text, "<geom name=\"floor\"", "<geom group=\"0\" name=\"floor\"");
  text = replaced(text, "<asset>", std::string("<asset>") + kAssets);
  return folder.write(
      "world.xml",
      replaced(text, "<worldbody>", "<worldbody>" + replaced(geoms, "<geom", "<geom group=\"0\"")));
}

/// Against mj_ray, which here sees group 0 only.
TEST(LidarInAWorld, MeasuresWhatTheEngineDoes) {
  const Folder folder;
  for (const std::string& geoms : {std::string(kObstacles), std::string(kObstacles) + kSurfaces}) {
    const std::string file = write_world(folder, geoms);
    Parameters parameters = kWithLidar;
    parameters["xml_file"] = file;
    const ModelPointer model = load_model(file);
    EXPECT_EQ(needs_data(*model), geoms != kObstacles);
    const DataPointer data = make_data(*model);
    const int torso = mj_name2id(model.get(), mjOBJ_BODY, "torso");
    const int floor = mj_name2id(model.get(), mjOBJ_GEOM, "floor");
    for (const double maximum : {kRange, 7.0}) {
      WorldRobot robot("Walker2d-v5", parameters, {{"lidar_range", maximum}});
      robot.reset(0);
      Sensors sensors;
      std::array<int, kLidarRays> num_hits{};  // of other geoms than the floor
      for (double x = -8; x < 4; x += 0.037) {
        const Numbers position = pose(robot, x, 1.3 + 0.5 * std::sin(9 * x), x);
        robot.place(position);
        robot.robot->sense(sensors);
        std::copy(position.begin(), position.end(), data->qpos);
        mj_kinematics(model.get(), data.get());
        const Numbers fractions = observed_fractions(robot);
        for (std::size_t i = 0; i < kLidarRays; ++i) {
          const double angle = 0.15 * static_cast<double>(i);
          const Vector3 ray{std::sin(angle), 0, -std::cos(angle)};
          constexpr std::array<mjtByte, mjNGROUP> kGroups{1, 1, 1, 1, 1, 0};
          int geom = -1;
          const double distance = mj_ray(model.get(), data.get(), at(data->xpos, torso, 3),
                                         ray.data(), kGroups.data(), 1, -1, &geom);
          const bool is_hit = 0 <= distance && distance <= maximum;
          ASSERT_EQ(std::isfinite(sensors.ranges[i]), is_hit) << "x = " << x << ", ray " << i;
          if (is_hit) {
            ASSERT_NEAR(sensors.ranges[i], distance, 1e-10) << "x = " << x << ", ray " << i;
          }
          ASSERT_EQ(fractions[i], is_hit ? sensors.ranges[i] / maximum : 1);
          num_hits[i] += is_hit && geom != floor ? 1 : 0;
        }
      }
      for (const int number : num_hits) EXPECT_GT(number, 20);
    }
  }
}

}  // namespace
}  // namespace walker::mujoco

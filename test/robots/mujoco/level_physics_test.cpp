// Contacts with a level's boxes against geometry, and a level's steps against the flat floor's.
#include "robots/mujoco/level_physics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bits.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/planar_model.h"
#include "robots/mujoco/random_level.h"

namespace walker::mujoco {
namespace {

constexpr double kPi = 3.141592653589793;

using State = std::vector<double>;

struct Level {
  explicit Level(const ModelPointer& model) : physics(model) {}

  void set(const WorldValues& values, std::uint64_t seed) {
    Generator generator(seed);
    ground = std::make_shared<BoxGround>(generator, *level_of(values));
    physics.set_ground(ground);
  }

  LevelPhysics physics;
  std::shared_ptr<const BoxGround> ground;
};

/// Returns the distance of a point of the x,z plane from a box; 0 if it is inside.
double distance(const GroundBox& box, double x, double z) {
  const auto [along, up] = box.direction;
  const double right = x - box.center[0];
  const double above = z - box.center[1];
  const double u = std::max(std::abs(along * right + up * above) - box.half_size[0], 0.0);
  const double v = std::max(std::abs(-up * right + along * above) - box.half_size[1], 0.0);
  return std::sqrt(u * u + v * v);
}

/// Returns the distance of a capsule's axis from a box.
double distance_of_capsule(const mjModel& model, const mjData& data, int geom,
                           const GroundBox& box) {
  constexpr int kPoints = 400;
  const mjtNum* const position = at(data.geom_xpos, geom, 3);
  const mjtNum* const rotation = at(data.geom_xmat, geom, 9);
  const double half_length = at(model.geom_size, geom, 3)[1];
  double nearest = 1e9;
  for (int i = -kPoints; i <= kPoints; ++i) {
    const double along = half_length * i / kPoints;
    nearest = std::min(nearest, distance(box, position[0] + along * rotation[2],
                                         position[2] + along * rotation[8]));
  }
  return nearest;
}

bool is_below_a_box(const BoxGround& ground, double x, double z) {
  return std::any_of(ground.boxes().begin(), ground.boxes().end(), [&](const GroundBox& box) {
    return box.left < x && x < box.right && z < box.center[1];
  });
}

class LevelPhysicsTest : public testing::TestWithParam<const char*> {
 protected:
  ModelPointer model = load_planar_model({GetParam(), num_hinges(), "walker2d_v5.xml"});
  State position = State(model->nq);
  State velocity = State(model->nv);

  static int num_hinges() { return std::string(GetParam()).find("walker") == 0 ? 6 : 3; }

  /// Draws any pose near the ground at x.
  void draw_pose(Generator& random, const BoxGround& ground, double x) {
    for (double& value : position) value = random.uniform(-kPi, kPi);
    position[kBaseX] = x;
    position[kBaseZ] = ground.below(x).ground + random.uniform(-0.4, 1.6);
  }
};

/// Whatever the pose, exactly those capsules touch a box whose axes are nearer than their radius;
/// of boxes that adjoin, at least the nearest one, if the capsule is not in the earth.
TEST_P(LevelPhysicsTest, CapsulesTouchTheBoxesThatTheyReach) {
  constexpr double kRounding = 1e-4;  // of the points on the axes [m]
  Generator random(1);
  Level level(model);
  int touching = 0;
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    level.set(random_level(random), seed);
    for (int i = 0; i < 30; ++i) {
      draw_pose(random, *level.ground, random.uniform(-5, 105));
      level.physics.reset(position.data(), velocity.data());
      const mjData& data = level.physics.data();
      const mjModel& m = level.physics.model();
      ASSERT_LT(data.ncon, m.nconmax);
      std::set<std::pair<int, std::array<double, 2>>> contacts;
      for (const mjContact* contact = data.contact; contact != data.contact + data.ncon;
           ++contact) {
        const int box = std::max(contact->geom1, contact->geom2);
        if (box < model->ngeom) continue;
        const int geom = std::min(contact->geom1, contact->geom2);
        contacts.insert({geom, {data.geom_xpos[3 * box], data.geom_xpos[3 * box + 2]}});
      }
      for (const FloorContact& floor : floor_contacts(*model)) {
        const double radius = at(m.geom_size, floor.geom, 3)[0];
        const double margin = m.pair_margin[0];
        double nearest = 1e9;
        double nearest_with_contact = 1e9;
        for (const GroundBox& box : level.ground->boxes()) {
          if (box.left > position[kBaseX] + 2 || box.right < position[kBaseX] - 2) continue;
          const double gap = distance_of_capsule(m, data, floor.geom, box) - radius - margin;
          nearest = std::min(nearest, gap);
          const bool has_contact = contacts.count({floor.geom, box.center}) != 0;
          if (has_contact) nearest_with_contact = std::min(nearest_with_contact, gap);
          if (std::abs(gap) < kRounding) continue;
          if (gap < -radius - margin + 0.01) continue;  // MuJoCo may miss an axis inside the box
          const bool adjoins = box.max_tilt != std::array<double, 2>{1, 1};
          ASSERT_TRUE(has_contact == (gap < 0) || (adjoins && !has_contact))
              << "seed " << seed << ", pose " << i << ", geom " << floor.geom << ", gap " << gap;
          touching += has_contact ? 1 : 0;
        }
        const mjtNum* const center = at(data.geom_xpos, floor.geom, 3);
        if (is_below_a_box(*level.ground, center[0], center[2])) continue;
        if (nearest > -kRounding || nearest < -radius - margin + 0.01) continue;
        ASSERT_LE(nearest_with_contact, nearest + kRounding)
            << "seed " << seed << ", pose " << i << ", geom " << floor.geom;
      }
    }
  }
  EXPECT_GT(touching, 900);
}

/// On slopes that are all but level the same limbs touch the ground as deeply as on the floor, and
/// every contact pushes upwards.
TEST_P(LevelPhysicsTest, SeamsBetweenBoxesAreNotFelt) {
  constexpr double kDeep = 0.03;  // less than a limb's radius [m]
  Level level(model);
  level.set({{"ground_roughness", 1e-7}}, 1);
  LibraryPhysics flat(model);
  Generator random(4);
  int touching = 0;
  for (int pose = 0; pose < 10000; ++pose) {
    for (int i = 0; i < model->nq; ++i) {
      position[i] = model->qpos0[i] + random.uniform(-0.3, 0.3);
    }
    position[kBaseX] = random.uniform(3, 90);
    std::map<int, double> depths[2];  // by geom
    double largest_tilt = 0;
    for (LibraryPhysics* physics : {&flat, static_cast<LibraryPhysics*>(&level.physics)}) {
      physics->reset(position.data(), velocity.data());
      const mjData& data = physics->data();
      for (int i = 0; i < data.ncon; ++i) {
        const mjContact& contact = data.contact[i];
        const bool is_flat = physics == &flat;
        const int geom = is_flat ? contact.geom2 : contact.geom1;
        if (!is_flat && contact.geom2 < model->ngeom) continue;
        double& depth = depths[is_flat ? 0 : 1][geom];
        depth = std::max(depth, contact.includemargin - contact.dist);
        largest_tilt = std::max(largest_tilt, 1 - std::abs(contact.frame[2]));
      }
    }
    const bool is_inside =
        std::any_of(depths[0].begin(), depths[0].end(),
                    [&](const auto& geom_depth) { return geom_depth.second > kDeep; });
    if (is_inside) continue;
    ASSERT_LT(largest_tilt, 1e-5) << "pose " << pose;
    ASSERT_EQ(depths[1].size(), depths[0].size()) << "pose " << pose;
    for (const auto& [geom, depth] : depths[0]) {
      ASSERT_NEAR(depths[1][geom], depth, 1e-5) << "pose " << pose << ", geom " << geom;
      ++touching;
    }
  }
  EXPECT_GT(touching, 400);
}

/// A foot that has come to rest on a tread or a stump is at its height.
TEST_P(LevelPhysicsTest, AFootRestsOnAStep) {
  Level level(model);
  LibraryPhysics flat(model);
  const State control(model->nu);
  const auto lowest_contact = [&](const LibraryPhysics& physics) {
    double lowest = 1e9;
    physics.measure([&](const mjData& data) {
      for (int i = 0; i < data.ncon; ++i) {
        lowest = std::min(lowest, data.contact[i].pos[2] - data.contact[i].dist / 2);
        EXPECT_NEAR(std::abs(data.contact[i].frame[2]), 1, 1e-9) << "upright";
      }
    });
    return lowest;
  };
  for (const double height : {0.05, 0.2, 0.5}) {
    level.set({{"stump_height", height}, {"stump_width", 3}, {"obstacle_spacing", 20}}, 1);
    std::copy_n(model->qpos0, model->nq, position.begin());
    position[kBaseZ] -= 0.045;  // the feet are 4 cm above the floor in this pose
    flat.reset(position.data(), velocity.data());
    position[kBaseX] += 3.5;  // the middle of the first stump
    position[kBaseZ] += height;
    level.physics.reset(position.data(), velocity.data());
    for (int step = 0; step < 10; ++step) {
      level.physics.step(control.data(), {}, 4);
      flat.step(control.data(), {}, 4);
    }
    EXPECT_NEAR(level.physics.position()[kBaseZ] - height, flat.position()[kBaseZ], 1e-3);
    EXPECT_NEAR(lowest_contact(level.physics), height, 1e-9);
  }
}

/// Steps from a state have the same bits in a world that was somewhere else before.
TEST_P(LevelPhysicsTest, ResultsDoNotDependOnThePath) {
  Generator random(3);
  Level one(model);
  Level other(model);
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const WorldValues values = random_level(random);
    one.set(values, seed);
    other.set(values, seed);
    draw_pose(random, *one.ground, random.uniform(0, 90));
    other.physics.reset(position.data(), velocity.data());
    position[kBaseX] = random.uniform(0, 90);
    position[kBaseZ] = one.ground->below(position[kBaseX]).ground + 1.2;
    one.physics.reset(position.data(), velocity.data());
    State control(model->nu);
    try {
      for (int step = 0; step < 20; ++step) {
        for (double& value : control) value = random.uniform(-1, 1);
        one.physics.step(control.data(), {30, 0}, 4);
      }
    } catch (const std::runtime_error&) {
      continue;  // an extreme pose
    }
    State state(one.physics.state_size());
    one.physics.save(state.data());
    other.physics.load(state.data());
    for (int step = 0; step < 30; ++step) {
      for (double& value : control) value = random.uniform(-1, 1);
      for (Level* each : {&one, &other}) each->physics.step(control.data(), {30, 0}, 4);
      State again(state.size());
      one.physics.save(state.data());
      other.physics.save(again.data());
      ASSERT_EQ(to_bits(again), to_bits(state)) << "seed " << seed << ", step " << step;
      if (step % 3 == 0) one.physics.measure([](const mjData&) {});
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BuiltIn, LevelPhysicsTest,
                         testing::Values("walker2d_v4.xml", "walker2d_v5.xml", "hopper_v5.xml"),
                         [](const auto& each) {
                           const std::string file = each.param;
                           return file.substr(0, file.find('.'));
                         });

std::string text_of(const mjContact& contact) {
  std::string text = std::to_string(contact.dim);
  const auto add = [&text](const mjtNum* values, int size) {
    for (int i = 0; i < size; ++i) text += " " + std::to_string(values[i]);
  };
  add(contact.friction, 5);
  add(contact.solref, mjNREF);
  add(contact.solimp, mjNIMP);
  add(&contact.includemargin, 1);
  return text;
}

/// Friction and softness are the floor's, whether the model names pairs or the engine finds them.
TEST(LevelModelTest, ContactsHaveTheFloorsParameters) {
  const Folder folder;
  const std::string stock = stock_text("walker2d_v5.xml");
  const std::string floor = "<geom name=\"floor\"";
  const std::string texts[] = {
      builtin_text("walker2d_v5.xml"),
      builtin_text("walker2d_v4.xml"),
      replaced(builtin_text("walker2d_v5.xml"), " collision=\"predefined\"", ""),
      stock,
      replaced(stock, "integrator=\"RK4\"", "integrator=\"RK4\" collision=\"dynamic\""),
      replaced(stock, floor, floor + " priority=\"1\" condim=\"6\" margin=\"0.002\""),
      replaced(stock, floor, floor + " priority=\"-1\" solref=\"0.03 0.7\""),
      replaced(stock, floor, floor + " solmix=\"3\" solref=\"0.03 0.7\" solimp=\"0.7 0.8 0.01\""),
      replaced(stock, floor, floor + " solmix=\"0\" solref=\"-900 -30\" gap=\"0.0001\""),
  };
  for (std::size_t i = 0; i < std::size(texts); ++i) {
    SCOPED_TRACE(i);
    const std::string file = folder.write("model" + std::to_string(i) + ".xml", texts[i]);
    const ModelPointer model = load_planar_model({file, 6, "walker2d_v5.xml"});
    ASSERT_EQ(level_refusal(*model), "");
    EXPECT_EQ(floor_contacts(*model).size(), 7U);
    Level level(model);
    level.set({{"pit_gap", 1}}, 1);
    LibraryPhysics flat(model);
    State position(model->nq);
    for (const double height : {1.2, 0.035}) {
      position[kBaseZ] = height;
      position[kBasePitch] = height < 0.5 ? kPi / 2 : 0;
      const auto contacts_of = [&](LibraryPhysics& physics) {
        physics.reset(position.data(), State(model->nv).data());
        const mjData& data = physics.data();
        std::set<std::string> contacts;
        for (int k = 0; k < data.ncon; ++k) {
          const mjContact& contact = data.contact[k];
          const auto is_limb = [&](int geom) {
            return geom < model->ngeom && model->geom_bodyid[geom] != 0;
          };
          const int limb = is_limb(contact.geom1) ? contact.geom1 : contact.geom2;
          contacts.insert(std::to_string(limb) + ": " + text_of(contact));
        }
        return contacts;
      };
      const std::set<std::string> expected = contacts_of(flat);
      EXPECT_GE(expected.size(), height < 0.5 ? 6U : 2U);
      EXPECT_EQ(contacts_of(level.physics), expected) << height;
    }
  }
}

TEST(LevelModelTest, AModelWithoutAFloorIsRefused) {
  const Folder folder;
  const std::string text = stock_text("walker2d_v5.xml");
  const auto refusal = [&](const std::string& name, const std::string& changed) {
    return level_refusal(*load_model(folder.write(name + ".xml", changed)));
  };
  EXPECT_EQ(refusal("tilted",
                    replaced(text, "<geom name=\"floor\"", "<geom name=\"floor\" euler=\"0 3 0\"")),
            "the model has no floor, a level plane of the world's body");
  EXPECT_EQ(refusal("box", replaced(text, "type=\"plane\" size=\"40 40 40\"",
                                    "type=\"box\" size=\"40 40 0.1\" pos=\"0 0 -0.1\"")),
            "the model has no floor, a level plane of the world's body");
  EXPECT_EQ(refusal("untouched", replaced(text, "conaffinity=\"1\"", "conaffinity=\"0\"")),
            "no limb of the model touches its floor");
}

}  // namespace
}  // namespace walker::mujoco

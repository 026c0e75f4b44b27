// Contacts with lines of ground against MuJoCo's plane and against geometry, and what they do.
#include "robots/mujoco/ground_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "bits.h"
#include "robots/mujoco/floor.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/on_line.h"
#include "robots/mujoco/planar_model.h"
#include "robots/mujoco/random_level.h"

namespace walker::mujoco {
namespace {

constexpr double kPi = 3.141592653589793;

class GroundContactTest : public testing::TestWithParam<const char*> {
 protected:
  ModelPointer model = load_planar_model({GetParam(), num_hinges(), "walker2d_v5.xml"});
  State position = State(model->nq);
  State velocity = State(model->nv);

  static int num_hinges() { return std::string(GetParam()).find("walker") == 0 ? 6 : 3; }

  void draw_pose(Generator& random) {
    for (double& value : position) value = random.uniform(-kPi, kPi);
    position[kBaseZ] = random.uniform(-0.4, 1.6);
  }

  void stand_at(double x, double ground) {
    std::copy_n(model->qpos0, model->nq, position.begin());
    position[kBaseX] = x;
    position[kBaseZ] += ground;
  }
};

/// In any pose, also below the floor, and in steps from it.
TEST_P(GroundContactTest, ALevelLineIsTheFloorToTheBit) {
  LibraryPhysics flat(model);
  const auto level = on_line(model, line_of({{-3, 0}, {0, 0}, {7.5, 0}}));
  Generator random(1);
  int touching = 0;
  for (int pose = 0; pose < 1500; ++pose) {
    draw_pose(random);
    if (pose % 5 == 0) position[kBasePitch] = kPi / 2 * static_cast<double>(random.integers(0, 4));
    if (pose % 9 == 0) std::fill(position.begin() + kBasePitch + 1, position.end(), 0.0);
    for (double& value : velocity) value = random.uniform(-5, 5);
    State control(model->nu);
    for (LibraryPhysics* each : {&flat, level.get()}) each->reset(position.data(), velocity.data());
    for (int step = 0; step < 4; ++step) {
      const std::vector<mjContact> expected = contacts_of(flat);
      const std::vector<mjContact> contacts = contacts_of(*level);
      ASSERT_EQ(contacts.size(), expected.size());
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        ASSERT_EQ(to_bits(numbers_of(contacts[i])), to_bits(numbers_of(expected[i])));
      }
      touching += static_cast<int>(contacts.size());
      State saved(flat.state_size());
      State saved_on_line(flat.state_size());
      flat.save(saved.data());
      level->save(saved_on_line.data());
      ASSERT_EQ(to_bits(saved_on_line), to_bits(saved)) << "pose " << pose << ", step " << step;
      for (double& value : control) value = random.uniform(-1, 1);
      for (LibraryPhysics* each : {&flat, level.get()}) each->step(control.data(), {}, 1);
    }
  }
  EXPECT_GT(touching, 5000);
}

double distance_to(const GroundPiece& piece, const Point& point) {
  const Point way = point - piece.from;
  const Point whole = piece.to - piece.from;
  const double share = std::clamp(dot(way, whole) / dot(whole, whole), 0.0, 1.0);
  const Point off = way - Point{whole.x * share, whole.y * share};
  return std::sqrt(dot(off, off));
}

/// Returns the distance between a capsule and the ground; NaN if its axis is in the ground.
double gap_of(const mjModel& model, const mjData& data, int geom, const GroundLine& line) {
  constexpr int kPoints = 200;
  const mjtNum* const centre = at(data.geom_xpos, geom, 3);
  const mjtNum* const rotation = at(data.geom_xmat, geom, 9);
  const mjtNum* const size = at(model.geom_size, geom, 3);
  double nearest = 1e9;
  for (int i = -kPoints; i <= kPoints; ++i) {
    const double along = size[1] * i / kPoints;
    const Point point{centre[0] + along * rotation[2], centre[2] + along * rotation[8]};
    if (line.between(point.x, point.x).has_inside(point)) return std::nan("");
    for (const GroundPiece& piece : line.pieces()) {
      nearest = std::min(nearest, distance_to(piece, point));
    }
  }
  return nearest - size[0];
}

/// Whatever the pose, a capsule has a contact exactly if its axis is nearer to the line than its
/// radius or in the ground, and the deepest contact outside is as deep as the capsule is.
TEST_P(GroundContactTest, CapsulesTouchWhatTheyReach) {
  constexpr double kRounding = 2e-4;  // of the points on the axes [m]
  Generator random(1);
  int touching = 0;
  const std::vector<int> limbs = geoms_on_floor(*model);
  for (int world = 0; world < 120; ++world) {
    const WorldValues values = random_level(random);
    const auto ground = std::make_shared<LevelGround>(random, *level_of(values), Point{0, 0});
    const GroundLine& line = ground->line();
    const auto physics = on_line(model, Line(ground, &line));
    for (int pose = 0; pose < 25; ++pose) {
      draw_pose(random);
      position[kBaseX] = random.uniform(-5, 105);
      position[kBaseZ] += ground->below(position[kBaseX]).ground;
      physics->reset(position.data(), velocity.data());
      const mjData& data = physics->data();
      const mjModel& m = physics->model();
      ASSERT_LT(data.ncon, m.nconmax);
      for (const int geom : limbs) {
        const double gap = gap_of(m, data, geom, line);
        double deepest = 1e9;
        for (const mjContact* each = data.contact; each != data.contact + data.ncon; ++each) {
          if (each->geom1 == 0 && each->geom2 == geom) deepest = std::min(deepest, each->dist);
        }
        const bool has_contact = deepest < 1e9;
        SCOPED_TRACE("world " + std::to_string(world) + ", pose " + std::to_string(pose) +
                     ", geom " + std::to_string(geom) + ", gap " + std::to_string(gap));
        touching += has_contact ? 1 : 0;
        if (std::isnan(gap)) continue;  // the way out is not that of the nearest point of the axis
        if (std::abs(gap - m.pair_margin[0]) < kRounding) continue;
        ASSERT_EQ(has_contact, gap < m.pair_margin[0]);
        if (has_contact) {
          ASSERT_NEAR(deepest, gap, kRounding);
        }
      }
    }
  }
  EXPECT_GT(touching, 900);
}

TEST_P(GroundContactTest, ACapsuleOverARidgeTouchesIt) {
  const Line ridge = line_of({{-1, -0.5}, {0, 0}, {1, -0.5}});
  const int limb = geoms_on_floor(*model).back();
  const mjtNum* const size = at(model->geom_size, limb, 3);
  for (const double shift : {-0.6, 0.0, 0.6}) {
    const double height = size[0] - 1e-3;
    const double middle = shift * size[1];
    const GroundLimb foot{
        {middle + size[1], middle - size[1]}, {height, height}, height, size[0], size[0] + size[1]};
    std::array<LimbContact, kMaxLimbContacts> contacts;
    ASSERT_EQ(find_contacts(*ridge, foot, 0, contacts.data()), 1);
    EXPECT_NEAR(contacts[0].distance, -1e-3, 1e-12);
    EXPECT_NEAR(contacts[0].normal_x, 0, 1e-12);
    EXPECT_NEAR(contacts[0].x, 0, 1e-12);
    EXPECT_NEAR(contacts[0].share, (1 + shift) / 2, 1e-12);
  }
}

/// A foot that has come to rest on a step is at its height, as deep in it as in the floor, and has
/// not gained energy on the way.
TEST_P(GroundContactTest, AFootRestsOnAStep) {
  const State control(model->nu);
  for (const double height : {0.02, 0.2, 0.5}) {
    const auto level =
        on_line(model, line_of({{1, 0}, {2, 0}, {2, height}, {5, height}, {5, 0}, {6, 0}}));
    LibraryPhysics flat(model);
    stand_at(0, 0);
    position[kBaseZ] -= 0.045;  // the feet are 4 cm above the floor in this pose
    flat.reset(position.data(), velocity.data());
    position[kBaseX] += 3.5;
    position[kBaseZ] += height;
    level->reset(position.data(), velocity.data());
    for (int step = 0; step < 10; ++step) {
      level->step(control.data(), {}, 4);
      flat.step(control.data(), {}, 4);
    }
    EXPECT_NEAR(level->position()[kBaseZ] - height, flat.position()[kBaseZ], 1e-9);
    for (const mjContact& contact : contacts_of(*level)) {
      EXPECT_NEAR(contact.pos[2] - contact.dist / 2, height, 1e-9);
      EXPECT_EQ(contact.frame[2], 1);
    }
  }
}

/// Its centre of mass is as high as gravity's work allows: contacts do not push it up.
TEST_P(GroundContactTest, NothingGainsEnergy) {
  Generator random(5);
  for (int fall = 0; fall < 60; ++fall) {
    const auto ground =
        std::make_shared<LevelGround>(random, *level_of(random_level(random)), Point{0, 0});
    const auto physics = on_line(model, Line(ground, &ground->line()));
    stand_at(random.uniform(0, 95), 0);
    position[kBaseZ] += ground->below(position[kBaseX]).top + 0.3;
    position[kBasePitch] += random.uniform(-0.5, 0.5);
    physics->reset(position.data(), velocity.data());
    const auto energy_of = [&] {
      mjModel m = physics->model();
      m.opt.enableflags |= mjENBL_ENERGY;
      const DataPointer data = make_data(m);
      std::copy_n(physics->position(), m.nq, data->qpos);
      std::copy_n(physics->velocity(), m.nv, data->qvel);
      mj_forward(&m, data.get());
      return data->energy[0] + data->energy[1];
    };
    const double before = energy_of();
    const State control(model->nu);
    for (int step = 0; step < 100; ++step) {
      physics->step(control.data(), {}, 4);
      ASSERT_LT(energy_of(), before + 0.05 * std::abs(before)) << "fall " << fall;
    }
  }
}

TEST_P(GroundContactTest, AWalkerPushedAgainstAStumpStops) {
  constexpr double kWall = 0.5;
  const auto physics =
      on_line(model, line_of({{0, 0}, {kWall, 0}, {kWall, 2}, {3, 2}, {3, 0}, {4, 0}}));
  stand_at(0, 0);
  position[kBaseZ] -= 0.045;
  physics->reset(position.data(), velocity.data());
  const State control(model->nu);
  int touching = 0;
  const std::vector<int> limbs = geoms_on_floor(*model);
  for (int step = 0; step < 500; ++step) {
    physics->step(control.data(), {{100, 0}, nullptr}, 4);
    for (const mjContact& contact : contacts_of(*physics)) touching += contact.frame[0] < -0.99;
    physics->measure([&](const mjData& data) {
      for (const int geom : limbs) {
        ASSERT_LT(at(data.geom_xpos, geom, 3)[0], kWall) << "step " << step << ", geom " << geom;
      }
    });
  }
  EXPECT_GT(touching, 300);
  EXPECT_LT(std::abs(physics->velocity()[kBaseX]), 0.05);
}

/// No limb is below ground into which the walker falls at 60 m/s.
TEST_P(GroundContactTest, FastLimbsDoNotPassTheGround) {
  Generator random(3);
  const auto ground =
      std::make_shared<LevelGround>(random, *level_of({{"ground_roughness", 3}}), Point{0, 0});
  const auto physics = on_line(model, Line(ground, &ground->line()));
  for (int fall = 0; fall < 40; ++fall) {
    stand_at(random.uniform(3, 90), 0);
    position[kBaseZ] += ground->below(position[kBaseX]).ground + 1;
    velocity.assign(velocity.size(), 0);
    velocity[kBaseX] = random.uniform(-60, 60);
    velocity[kBaseZ] = -60;
    physics->reset(position.data(), velocity.data());
    const State control(model->nu);
    for (int step = 0; step < 150; ++step) physics->step(control.data(), {}, 4);
    physics->measure([&](const mjData& data) {
      for (int body = 1; body < model->nbody; ++body) {
        const mjtNum* const at_body = at(data.xipos, body, 3);
        ASSERT_GT(at_body[2], ground->below(at_body[0]).ground - 0.02) << "fall " << fall;
      }
    });
  }
}

INSTANTIATE_TEST_SUITE_P(BuiltIn, GroundContactTest,
                         testing::Values("walker2d_v4.xml", "walker2d_v5.xml", "hopper_v4.xml",
                                         "hopper_v5.xml"),
                         [](const auto& each) {
                           const std::string file = each.param;
                           return file.substr(0, file.find('.'));
                         });

/// A sphere of 1 kg, or two as a capsule, on slides, on the floor.
std::string sliding_model(const std::string& shape, double friction) {
  return "<mujoco><option timestep='0.002'/><worldbody><geom name='floor' type='plane' size='1 1 "
         "1' "
         "friction='" +
         std::to_string(friction) +
         " 0 0'/><body pos='0 0 0'><joint type='slide' axis='1 0 0'/><joint type='slide' "
         "axis='0 0 1'/><geom name='limb' mass='1' friction='0 0 0' " +
         shape + "/></body></worldbody></mujoco>";
}

/// It stays with more friction than the tangent of the slope's angle, and slides with less.
TEST(SlopeTest, AtRestNeedsTheFrictionOfTheAngle) {
  const Folder folder;
  int number = 0;
  for (const double slope : {0.1, -0.3, 0.6}) {
    const Line line = line_of({{-50, -50 * slope}, {50, 50 * slope}});
    for (const double excess : {0.9, 1.1}) {
      const double friction = std::abs(slope) * excess;
      for (const char* shape :
           {"type='sphere' size='0.1'", "type='capsule' size='0.1 0.2' euler='0 90 0'"}) {
        const std::string file = folder.write("slope" + std::to_string(number++) + ".xml",
                                              sliding_model(shape, friction));
        const ModelPointer model = load_model(file);
        const auto physics = on_line(model, line);
        const State position{0, 0.12 * std::sqrt(1 + slope * slope) + 0.2 * std::abs(slope)};
        physics->reset(position.data(), State(2).data());
        const State control;
        physics->step(control.data(), {}, 1500);
        const double x = physics->position()[0];
        const double speed = physics->velocity()[0];
        if (excess > 1) {
          EXPECT_LT(std::abs(speed), 0.02) << file << " " << shape << " on " << slope;
        } else {
          // a = g (sin - mu cos) along the slope
          const double angle = std::atan(std::abs(slope));
          const double a = 9.81 * (std::sin(angle) - friction * std::cos(angle));
          EXPECT_NEAR(std::abs(speed), a * 3 * std::cos(angle), 0.1 * a * 3 + 0.03) << shape;
          EXPECT_LT(x * slope, 0) << "downhill";
        }
      }
    }
  }
}

/// At rest the contacts carry the weight, whatever the ground.
TEST(RestTest, ContactForcesSumToTheWeight) {
  const Folder folder;
  const std::vector<std::vector<Point>> grounds{
      {{-5, 0}, {5, 0}},
      {{-5, -0.5}, {5, 0.5}},
      {{-5, 1}, {0, 0}, {5, 1}},                                       // a valley
      {{-5, -1}, {0, 0}, {5, -1}},                                     // a ridge
      {{-5, 0}, {0, 0}, {0, -0.8}, {5, -0.8}},                         // the edge of a step
      {{-5, 0}, {-0.1, 0}, {-0.1, -2}, {0.1, -2}, {0.1, 0}, {5, 0}}};  // across a pit
  for (std::size_t i = 0; i < grounds.size(); ++i) {
    const std::string file =
        folder.write("rest" + std::to_string(i) + ".xml",
                     sliding_model("type='capsule' size='0.1 0.2' euler='0 90 0'", 2));
    const ModelPointer model = load_model(file);
    const auto physics = on_line(model, line_of(grounds[i]));
    const State position{0, 0.35};
    physics->reset(position.data(), State(2).data());
    const State control;
    physics->step(control.data(), {}, 2000);
    double up = 0;
    double forward = 0;
    const mjData& data = physics->data();
    for (int contact = 0; contact < data.ncon; ++contact) {
      std::array<mjtNum, 6> force{};
      mj_contactForce(&physics->model(), &data, contact, force.data());
      std::array<mjtNum, 3> in_world{};
      mju_mulMatTVec(in_world.data(), data.contact[contact].frame, force.data(), 3, 3);
      forward += in_world[0];
      up += in_world[2];
    }
    EXPECT_NEAR(up, 9.81, 0.05) << "ground " << i;
    EXPECT_NEAR(forward, 0, 0.05) << "ground " << i;
  }
}

}  // namespace
}  // namespace walker::mujoco

// Disturbances of a world's physics.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>

#include "robots/bipedal_walker/physics.h"
#include "robots/bipedal_walker/random_world.h"
#include "robots/bipedal_walker/twin.h"

namespace walker::bipedal_walker {
namespace {

constexpr double kDt = 1 / kStepsPerSecond;
constexpr std::array<double, kJointCount> kNoAction{};

struct Momentum {
  double forward = 0;  ///< [N s]
  double up = 0;       ///< [N s]
  double mass = 0;     ///< [kg]
  double height = 0;   ///< of the centre of mass, times the mass [kg m]
};

Momentum momentum_of(Physics& physics) {
  Momentum sum;
  for (const b2Body* body : physics.parts().bodies) {
    const double mass = body->GetMass();
    const b2Vec2& v = body->GetLinearVelocity();
    sum.forward += mass * double{v.x};
    sum.up += mass * double{v.y};
    sum.mass += mass;
    sum.height += mass * double{body->GetWorldCenter().y};
  }
  return sum;
}

/// A walker in the air, or at the start, where its legs soon touch the ground.
struct Flight {
  explicit Flight(const Dynamics& dynamics = {}, double push = 0, float height = 10) {
    Generator generator(1);
    physics.build(draw_ground(generator, false), push, dynamics);
    for (b2Body* body : physics.parts().bodies) {
      body->SetTransform(body->GetPosition() + b2Vec2(0, height), body->GetAngle());
    }
  }

  void step(const std::array<double, kJointCount>& action = kNoAction) {
    physics.drive(action.data());
    physics.step();
  }

  Physics physics;
};

Dynamics with(double Dynamics::*member, double value) {
  Dynamics dynamics;
  dynamics.*member = value;
  return dynamics;
}

Dynamics with_gravity(double gravity) { return with(&Dynamics::gravity, gravity); }

/// Box2D adds g dt to the velocity in each step, and then moves by it.
TEST(DynamicsTest, FreeFall) {
  for (const double gravity : {-1.62, -3.7, -9.81, -10.0, -25.0}) {
    Flight flight(with_gravity(gravity));
    double fallen = 0;
    const Momentum before = momentum_of(flight.physics);
    for (int i = 1; i <= 5; ++i) {
      flight.step();
      EXPECT_NEAR(momentum_of(flight.physics).up / before.mass, gravity * kDt * i, 2e-6) << gravity;
      EXPECT_NEAR(momentum_of(flight.physics).forward / before.mass, 0, 2e-6);
      fallen += gravity * kDt * kDt * i;
    }
    EXPECT_NEAR((momentum_of(flight.physics).height - before.height) / before.mass, fallen, 2e-5)
        << gravity;
  }
}

TEST(DynamicsTest, PushChangesTheMomentumByItsImpulse) {
  for (const double mass_scale : {0.5, 1.0, 3.0}) {
    Dynamics dynamics = with_gravity(-2);
    dynamics.mass_scale = mass_scale;
    Flight flight(dynamics);
    const double mass = momentum_of(flight.physics).mass;
    flight.step();
    const Momentum before = momentum_of(flight.physics);
    flight.physics.push({1.5, 0.7});
    flight.step();
    const Momentum after = momentum_of(flight.physics);
    EXPECT_NEAR(after.forward - before.forward, 1.5, 1e-5);
    EXPECT_NEAR(after.up - before.up, 0.7 - 2 * kDt * mass, 1e-5);
    flight.step();
    EXPECT_NEAR(momentum_of(flight.physics).forward, after.forward, 1e-5) << "for one step";
  }
}

TEST(DynamicsTest, PushesOfAStepAreSummed) {
  Flight flight(with_gravity(0), 5);
  flight.physics.push({1, 0});
  flight.physics.push({0.25, 0.5});
  flight.step();
  EXPECT_NEAR(momentum_of(flight.physics).forward, 5 * kDt + 1.25, 1e-5);
  EXPECT_NEAR(momentum_of(flight.physics).up, 0.5, 1e-5);
}

/// Angular momentum about the world's origin, with the sign of Box2D's rotations [N m s].
double angular_momentum_of(Physics& physics) {
  double sum = 0;
  for (const b2Body* body : physics.parts().bodies) {
    const b2Vec2& v = body->GetLinearVelocity();
    const double about_center = double{body->GetInertia()} -
                                double{body->GetMass()} * body->GetLocalCenter().LengthSquared();
    sum += about_center * body->GetAngularVelocity() +
           double{body->GetMass()} * b2Cross(body->GetWorldCenter(), v);
  }
  return sum;
}

/// On each link, a wrench at the origin of the frame that `Sensors::link_poses` has.
TEST(DynamicsTest, AWrenchChangesMomentumAndAngularMomentum) {
  for (std::uint32_t link = 0; link < kBodies; ++link) {
    Flight flight(with_gravity(0));
    flight.step();
    b2Vec2 origin = flight.physics.hull().GetPosition();
    if (link > 0) origin = flight.physics.joint(link - 1).GetAnchorB();
    const Momentum before = momentum_of(flight.physics);
    const double angular_before = angular_momentum_of(flight.physics);
    flight.physics.apply({link, 30, -20, 4});
    flight.step();
    EXPECT_NEAR(momentum_of(flight.physics).forward - before.forward, 30 * kDt, 1e-5);
    EXPECT_NEAR(momentum_of(flight.physics).up - before.up, -20 * kDt, 1e-5);
    const double moment = double{b2Cross(origin, b2Vec2(30, -20))} - 4;
    EXPECT_NEAR(angular_momentum_of(flight.physics) - angular_before, moment * kDt, 0.05) << link;
    const double after = angular_momentum_of(flight.physics);
    flight.step();
    EXPECT_NEAR(momentum_of(flight.physics).forward - before.forward, 30 * kDt, 1e-5);
    EXPECT_NEAR(angular_momentum_of(flight.physics), after, 0.05) << "for one step";
  }
}

/// A reset ends with a step, in which the hull is pushed.
TEST(DynamicsTest, InitialPushIsDrawn) {
  const auto speed_after = [](WorldValues values, std::uint64_t seed) {
    values["gravity"] = 0;
    return Player(values, seed).sensors.linear_velocity[0];
  };
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const double plain = speed_after({}, seed);
    EXPECT_EQ(speed_after({{"initial_push", 0.1}}, seed), plain);
    EXPECT_NEAR(speed_after({{"initial_push", 0}}, seed), 0, 1e-5);
    EXPECT_NEAR(speed_after({{"initial_push", 1}}, seed), 10 * plain, 0.01 * std::abs(10 * plain));
  }
}

TEST(DynamicsTest, MassScaleIsAFactorOfMassesAndInertias) {
  Physics plain;
  Physics heavy;
  Generator generator(1);
  const Ground ground = draw_ground(generator, false);
  plain.build(ground, 0);
  heavy.build(ground, 0, with(&Dynamics::mass_scale, 2.5));
  for (std::size_t i = 0; i < kBodies; ++i) {
    const b2Body& one = *plain.parts().bodies[i];
    const b2Body& other = *heavy.parts().bodies[i];
    EXPECT_FLOAT_EQ(other.GetMass(), 2.5F * one.GetMass());
    EXPECT_FLOAT_EQ(other.GetInertia(), 2.5F * one.GetInertia());
    EXPECT_EQ(other.GetLocalCenter().x, one.GetLocalCenter().x);
    EXPECT_EQ(other.GetLocalCenter().y, one.GetLocalCenter().y);
    EXPECT_EQ(other.GetWorldCenter().x, one.GetWorldCenter().x);
    EXPECT_EQ(other.GetWorldCenter().y, one.GetWorldCenter().y);
  }
}

/// Changed dynamics are those that a new world would have, also in contacts that exist.
TEST(DynamicsTest, ChangeWithinAnEpisode) {
  Dynamics other = with_gravity(-5);
  other.friction_scale = 0.3;
  other.floor_friction = 1.5;
  other.mass_scale = 1.7;
  other.masses[2] = 0.5;
  Flight changed({}, 0, 0);
  Flight built(other, 0, 0);
  const auto find_contact = [](Flight& flight) -> const b2Contact& {
    const b2Contact* contact = nullptr;
    while (contact == nullptr) {
      flight.step();
      contact = flight.physics.world().GetContactList();
    }
    return *contact;
  };
  const b2Contact& contact = find_contact(changed);
  changed.physics.change(other);
  EXPECT_EQ(contact.GetFriction(), find_contact(built).GetFriction());
  EXPECT_EQ(changed.physics.world().GetGravity().y, -5);
  for (std::size_t i = 0; i < kBodies; ++i) {
    const b2Body& body = *changed.physics.parts().bodies[i];
    const b2Body& expected = *built.physics.parts().bodies[i];
    EXPECT_EQ(body.GetMass(), expected.GetMass());
    EXPECT_EQ(body.GetInertia(), expected.GetInertia());
    EXPECT_EQ(body.GetLocalCenter().x, expected.GetLocalCenter().x);
    EXPECT_EQ(body.GetLocalCenter().y, expected.GetLocalCenter().y);
    EXPECT_EQ(body.GetFixtureList()->GetFriction(), expected.GetFixtureList()->GetFriction());
  }
  const b2Vec2 center = changed.physics.hull().GetWorldCenter();
  changed.physics.change(other);
  EXPECT_EQ(changed.physics.hull().GetWorldCenter().x, center.x) << "nothing has changed";
  EXPECT_EQ(changed.physics.hull().GetWorldCenter().y, center.y);
}

TEST(DynamicsTest, AMassIsThatOfItsLinkWhoseInertiaStays) {
  Generator generator(1);
  const Ground ground = draw_ground(generator, false);
  const auto build = [&](Physics& physics, const Dynamics& dynamics) {
    physics.build(ground, 0, dynamics);
    std::vector<const b2Body*> bodies{&physics.hull()};
    for (std::size_t i = 0; i < kJointCount; ++i) bodies.push_back(&child_of(physics.joint(i)));
    return bodies;
  };
  const auto inertia = [](const b2Body& body) {  // about the centre of mass
    return body.GetInertia() - body.GetMass() * body.GetLocalCenter().LengthSquared();
  };
  Physics plain_physics;
  const auto plain = build(plain_physics, with(&Dynamics::mass_scale, 2));
  for (std::size_t link = 0; link < kBodies; ++link) {
    Dynamics dynamics = with(&Dynamics::mass_scale, 2);
    dynamics.masses[link] = 2.75;
    Physics physics;
    const auto bodies = build(physics, dynamics);
    for (std::size_t i = 0; i < kBodies; ++i) {
      EXPECT_EQ(bodies[i]->GetMass(), i == link ? 2.75F : plain[i]->GetMass()) << kLinks[i];
      EXPECT_FLOAT_EQ(inertia(*bodies[i]), inertia(*plain[i])) << kLinks[i];
      EXPECT_EQ(bodies[i]->GetWorldCenter().x, plain[i]->GetWorldCenter().x);
      EXPECT_EQ(bodies[i]->GetWorldCenter().y, plain[i]->GetWorldCenter().y);
    }
  }
}

TEST(DynamicsTest, EveryContactHasTheFrictionOfFloorAndLink) {
  for (const double scale : {0.0, 0.3, 1.0, 2.0}) {
    Dynamics dynamics = with(&Dynamics::friction_scale, scale);
    dynamics.floor_friction = scale + 1;
    Flight flight(dynamics, 0, 0);
    int contacts = 0;
    for (int i = 0; i < 60; ++i) {
      flight.step();
      for (const b2Contact* contact = flight.physics.world().GetContactList(); contact != nullptr;
           contact = contact->GetNext()) {
        const auto* const other = const_cast<b2Contact*>(contact)->GetFixtureB()->GetBody();
        const double own = other == &flight.physics.hull() ? 0.1 : 0.2;
        EXPECT_NEAR(contact->GetFriction(), scale * std::sqrt((scale + 1) * own), 1e-6);
        ++contacts;
      }
    }
    EXPECT_GT(contacts, 10);
  }
}

TEST(DynamicsTest, MotorsHaveTheirStrengthAndSpeed) {
  Dynamics dynamics;
  dynamics.motor_strength = 0.25;
  dynamics.hip_speed = 3;
  dynamics.knee_speed = 9;
  Flight flight(dynamics);
  const std::array<double, kJointCount> action{0.5, -1, -0.25, 2};
  flight.physics.drive(action.data());
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const b2RevoluteJoint& joint = flight.physics.joint(i);
    EXPECT_FLOAT_EQ(joint.GetMaxMotorTorque(),
                    static_cast<float>(20 * std::min(std::abs(action[i]), 1.0)));
    const double speed = i % 2 == 0 ? 3 : 9;
    EXPECT_FLOAT_EQ(joint.GetMotorSpeed(), static_cast<float>(action[i] < 0 ? -speed : speed));
  }
}

/// The damping's impulse is -c (joint speed before the step) dt.
TEST(DynamicsTest, DampingIsProportionalToTheJointsSpeeds) {
  Dynamics dynamics = with_gravity(0);
  dynamics.joint_damping = 0.3;
  Flight flight(dynamics);
  for (int i = 0; i < 3; ++i) flight.step({1, -1, -1, -1});
  flight.physics.drive(kNoAction.data());
  std::array<double, kJointCount> speeds{};
  for (std::size_t i = 0; i < kJointCount; ++i) {
    speeds[i] = double{flight.physics.joint(i).GetJointSpeed()};
  }
  EXPECT_GT(std::abs(speeds[0]), 1);
  const auto torques = torques_on(flight.physics);
  EXPECT_NEAR(torques[0], 0.3 * (speeds[0] + speeds[2]), 1e-5) << "hull";
  EXPECT_NEAR(torques[1], -0.3 * speeds[0] + 0.3 * speeds[1], 1e-5) << "upper leg 1";
  EXPECT_NEAR(torques[2], -0.3 * speeds[1], 1e-5) << "lower leg 1";
  EXPECT_NEAR(torques[3], -0.3 * speeds[2] + 0.3 * speeds[3], 1e-5) << "upper leg 2";
  EXPECT_NEAR(torques[4], -0.3 * speeds[3], 1e-5) << "lower leg 2";
  EXPECT_NEAR(std::accumulate(torques.begin(), torques.end(), 0.0), 0, 1e-5);
}

TEST(DynamicsTest, LidarRangeIsTheRaysLength) {
  Player plain({{"gravity", 0}, {"initial_push", 0}}, 3);
  for (const double range : {0.5, 2.0, 20.0}) {
    Player player({{"gravity", 0}, {"initial_push", 0}, {"lidar_range", range}}, 3);
    EXPECT_EQ(player.sensors.maximum_range, range);
    int hits = 0;
    for (std::size_t i = 0; i < kLidarRays; ++i) {
      const double distance = player.sensors.ranges[i];
      const double fraction = player.observation[kFirstRay + i];
      if (std::isinf(distance)) {
        EXPECT_EQ(fraction, 1);
        EXPECT_GT(plain.sensors.ranges[i], range * 0.999);
        continue;
      }
      ++hits;
      EXPECT_NEAR(fraction * range, distance, 1e-6);
      if (std::isfinite(plain.sensors.ranges[i])) {
        EXPECT_NEAR(distance, plain.sensors.ranges[i], 1e-4);
      }
    }
    EXPECT_EQ(hits != 0, range > 2 * kLegHeight) << range;  // the hull's height at the start
  }
  EXPECT_EQ(plain.sensors.maximum_range, kLidarRange);
}

TEST(DynamicsTest, GravityIsSensed) {
  Player player({{"gravity", -1.62}}, 3);
  EXPECT_NEAR(player.sensors.gravity[2], -1.62, 1e-6);
}

}  // namespace
}  // namespace walker::bipedal_walker

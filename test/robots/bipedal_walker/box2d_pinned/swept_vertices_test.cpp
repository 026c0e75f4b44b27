// If SweptVertices proves that shapes stay apart, b2TimeOfImpact finds no impact.
// Compiled with -fno-access-control, because b2Body's sweep is private.
#include "robots/bipedal_walker/box2d_pinned/swept_vertices.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace walker::bipedal_walker {
namespace {

class SweptVerticesTest : public testing::Test {
 protected:
  SweptVerticesTest() {
    b2BodyDef definition;
    definition.type = b2_dynamicBody;
    body_ = world_.CreateBody(&definition);
    b2PolygonShape limb;
    limb.SetAsBox(0.1F, 0.5F);
    body_->CreateFixture(&limb, 1);
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  float between(double low, double high) { return static_cast<float>(uniform(low, high)); }
  /// Random magnitude over five decades up to `most`, random sign.
  float any_size(double most) {
    return static_cast<float>(most * std::pow(10.0, uniform(-5, 0)) *
                              (uniform(-1, 1) < 0 ? -1 : 1));
  }

  void set_sweep(const b2Vec2& from, float from_angle, const b2Vec2& to, float to_angle) {
    b2Sweep& sweep = body_->m_sweep;
    sweep.c0 = from;
    sweep.a0 = from_angle;
    sweep.c = to;
    sweep.a = to_angle;
    body_->SynchronizeTransform();
  }

  bool is_proven_apart(const b2Shape& ground) {
    SweptVertices swept;
    swept.follow(*body_);
    return swept.stay_apart_from(ground);
  }

  b2TOIOutput::State impact_with(const b2Shape& ground) const {
    b2TOIInput input;
    input.proxyA.Set(&ground, 0);
    input.proxyB.Set(body_->GetFixtureList()->GetShape(), 0);
    input.sweepA = {{0, 0}, {0, 0}, {0, 0}, 0, 0, 0};
    input.sweepB = body_->m_sweep;
    input.tMax = 1;
    b2TOIOutput output;
    b2TimeOfImpact(&output, &input);
    return output.state;
  }

  struct Count {
    int apart = 0, proven = 0, touching = 0;
  };

  /// Compares random ground with a random sweep of the limb near it, `times` times.
  /// @param position bound of the ground's coordinates [m]
  /// @param turns bound of the limb's angle before the sweep [rad]
  Count compare(int times, double position, double turns) {
    Count count;
    for (int i = 0; i < times; ++i) {
      const b2Vec2 origin(between(-position, position), between(-position, position));
      b2EdgeShape edge;
      edge.Set(origin, origin + b2Vec2(between(0.1, 0.5), between(-0.3, 0.3)));
      b2PolygonShape box;
      box.SetAsBox(between(0.1, 0.5), between(0.1, 0.5), origin, 0);
      const b2Shape& ground = i % 2 == 0 ? static_cast<const b2Shape&>(edge) : box;
      // Mostly close to touching: the limb is 0.2 m by 1 m.
      const b2Vec2 from = origin + b2Vec2(between(-1, 1.4), between(-1.2, 1.2));
      const float angle = between(-turns, turns);
      set_sweep(from, angle, from + b2Vec2(any_size(0.5), any_size(0.5)), angle + any_size(2));
      const b2TOIOutput::State state = impact_with(ground);
      count.touching += state == b2TOIOutput::e_touching ? 1 : 0;
      count.apart += state == b2TOIOutput::e_separated ? 1 : 0;
      if (!is_proven_apart(ground)) continue;
      ++count.proven;
      EXPECT_EQ(state, b2TOIOutput::e_separated)
          << "terrain at " << origin.x << " " << origin.y << ", limb from " << from.x << " "
          << from.y << " to " << body_->m_sweep.c.x << " " << body_->m_sweep.c.y << ", angle "
          << angle << " to " << body_->m_sweep.a;
    }
    return count;
  }

  std::mt19937_64 random_{3};
  b2World world_{b2Vec2(0, 0)};
  b2Body* body_;
};

TEST_F(SweptVerticesTest, WhatIsProvenApartHasNoImpact) {
  for (const double position : {1.0, 90.0, 490.0}) {
    const Count count = compare(1000000, position, 3);
    EXPECT_GT(count.touching, 20000) << position;
    EXPECT_GT(count.proven, 2 * count.apart / 3) << position << " of " << count.apart;
  }
  compare(200000, 90, 95);  // many turns
}

/// The limb lands almost flat on the ground and ends within 15 mm of it, a range that includes
/// Box2D's touching distance.
TEST_F(SweptVerticesTest, HoldsAtTheTouchingDistance) {
  b2EdgeShape ground;
  int proven = 0;
  int touching = 0;
  for (int i = 0; i < 200000; ++i) {
    const float height = between(3, 5);
    const float left = between(0, 88);
    ground.Set(b2Vec2(left, height), b2Vec2(left + 2, height));
    const float end = height + 0.5F + between(0, 0.015);
    set_sweep(b2Vec2(left + 1, end + between(0, 0.2)), 0, b2Vec2(left + 1, end), any_size(0.01));
    const b2TOIOutput::State state = impact_with(ground);
    touching += state == b2TOIOutput::e_touching ? 1 : 0;
    if (!is_proven_apart(ground)) continue;
    ++proven;
    ASSERT_EQ(state, b2TOIOutput::e_separated) << end - height;
  }
  EXPECT_GT(proven, 50000);
  EXPECT_GT(touching, 20000);
}

/// A corner of the limb swings through its lowest point, 9 mm below its height at both ends.
TEST_F(SweptVerticesTest, IncludesTheBulgeOfATurn) {
  b2EdgeShape ground;
  const float lean = std::atan2(0.1F, 0.5F);
  const float lowest = -std::hypot(0.1F, 0.5F);
  ground.Set(b2Vec2(-5, lowest - 0.002F), b2Vec2(5, lowest - 0.002F));
  set_sweep(b2Vec2(0, 0), lean - 0.19F, b2Vec2(0, 0), lean + 0.19F);
  EXPECT_FALSE(is_proven_apart(ground));
  set_sweep(b2Vec2(0, 0), lean - 0.19F, b2Vec2(0, 0), lean - 0.19F);
  EXPECT_TRUE(is_proven_apart(ground)) << "else the turn is not what decides";
}

TEST_F(SweptVerticesTest, ProvesNothingFarAwayOrNonFinite) {
  b2EdgeShape ground;
  ground.Set(b2Vec2(-5, -100), b2Vec2(5, -100));
  set_sweep(b2Vec2(0, 0), 0, b2Vec2(0, 0), 0);
  EXPECT_TRUE(is_proven_apart(ground));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  for (const float strange : {501.0F, -501.0F, inf, -inf, nan}) {
    for (std::size_t i = 0; i < 4; ++i) {
      std::array<float, 4> numbers{};
      numbers[i] = strange;
      set_sweep(b2Vec2(numbers[0], 0), numbers[1], b2Vec2(0, numbers[2]), numbers[3]);
      EXPECT_FALSE(is_proven_apart(ground)) << strange << " at " << i;
    }
  }
}

TEST_F(SweptVerticesTest, FollowsTheBody) {
  b2EdgeShape ground;
  ground.Set(b2Vec2(-5, -1), b2Vec2(5, -1));
  SweptVertices swept;
  for (const float height : {0.0F, -0.6F, 0.0F, 600.0F, 0.0F}) {
    set_sweep(b2Vec2(0, 0), 0, b2Vec2(0, height), 0);
    swept.follow(*body_);
    EXPECT_EQ(swept.stay_apart_from(ground), height == 0) << height;
  }
}

}  // namespace
}  // namespace walker::bipedal_walker

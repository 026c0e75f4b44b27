#include "robots/bipedal_walker/physics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

namespace walker::bipedal_walker {
namespace {

/// Rounds to the engine's single precision, as the Python binding does.
b2Vec2 to_vector(const Point& point) {
  return {static_cast<float>(point.x), static_cast<float>(point.y)};
}

template <std::size_t N>
b2PolygonShape polygon_of(const std::array<Point, N>& corners) {
  std::array<b2Vec2, N> vertices;
  std::transform(corners.begin(), corners.end(), vertices.begin(), to_vector);
  b2PolygonShape shape;
  shape.Set(vertices.data(), static_cast<int>(N));
  return shape;
}

b2BodyDef dynamic_body(const Point& position, double angle) {
  b2BodyDef definition;
  definition.type = b2_dynamicBody;
  definition.position = to_vector(position);
  definition.angle = static_cast<float>(angle);
  return definition;
}

/// Fills Box2D's process-wide tables, which the first b2World and the first contact initialise.
void fill_tables() {
  const auto world = std::make_unique<b2World>(b2Vec2(0, 0));  // 100 KiB: too large for a stack
  b2CircleShape circle;
  circle.m_radius = 1;
  const b2BodyDef body = dynamic_body({0, 0}, 0);
  world->CreateBody(&body)->CreateFixture(&circle, 1);
  world->CreateBody(&body)->CreateFixture(&circle, 1);
  world->Step(1, 1, 1);
}

/// Returns the gravity until `build`. Every `Physics` calls this before it makes its world, so the
/// first call fills Box2D's tables before any other thread can read them.
b2Vec2 first_gravity() {
  static const b2Vec2 kVector = [] {
    fill_tables();
    return b2Vec2(0, kGravity);
  }();
  return kVector;
}

constexpr std::uint16_t kGroundCategory = 0x0001;  // collision bits of ground
constexpr std::uint16_t kWalkerCategory = 0x0020;  // collision bits of hull and legs
constexpr std::uint16_t kAllCategories = 0xFFFF;
constexpr double kHullDensity = 5.0;
constexpr double kHullFriction = 0.1;
constexpr double kLimbDensity = 1.0;
constexpr double kLimbFriction = 0.2;  // Box2D's default, which Gymnasium leaves in place
constexpr double kLegSpread = 0.05;    // initial angles: -kLegSpread, +kLegSpread [rad]

// Joint ranges [rad]
constexpr double kHipLower = -0.8;
constexpr double kHipUpper = 1.1;
constexpr double kKneeLower = -1.6;
constexpr double kKneeUpper = -0.1;

/// Makes a level's box. b2PolygonShape::Set subtracts areas that reach to the world's origin, so
/// the area of a small box at a distance would round to zero or less.
/// @param corners lower left, lower right, upper right, upper left
b2PolygonShape box_of(const std::array<Point, 4>& corners) {
  constexpr std::array<std::size_t, 4> kOrder{1, 2, 3, 0};  // that of Set
  const std::array<b2Vec2, 4> normals{b2Vec2(1, 0), b2Vec2(0, 1), b2Vec2(-1, 0), b2Vec2(0, -1)};
  b2PolygonShape shape;
  shape.m_count = 4;
  for (std::size_t i = 0; i < kOrder.size(); ++i) {
    shape.m_vertices[i] = to_vector(corners[kOrder[i]]);
    shape.m_normals[i] = normals[i];
  }
  shape.m_centroid =
      to_vector({(corners[0].x + corners[1].x) / 2, (corners[0].y + corners[2].y) / 2});
  return shape;
}

b2RevoluteJoint* create_joint(b2Body* parent, b2Body* child, double anchor_y, double speed,
                              double lower, double upper) {
  b2RevoluteJointDef definition;
  definition.bodyA = parent;
  definition.bodyB = child;
  definition.localAnchorA = to_vector({0, anchor_y});
  definition.localAnchorB = to_vector({0, kLegHeight / 2});
  // The Python binding sets the reference angle from the bodies' angles at creation.
  definition.referenceAngle = child->GetAngle() - parent->GetAngle();
  definition.enableMotor = true;
  definition.enableLimit = true;
  definition.maxMotorTorque = static_cast<float>(kMotorTorque);
  definition.motorSpeed = static_cast<float>(speed);
  definition.lowerAngle = static_cast<float>(lower);
  definition.upperAngle = static_cast<float>(upper);
  return static_cast<b2RevoluteJoint*>(parent->GetWorld()->CreateJoint(&definition));
}

}  // namespace

Physics::Physics() : world_(first_gravity()) {}

void Physics::build(const Ground& ground, double push, const Dynamics& dynamics) {
  dynamics_ = dynamics;
  world_.SetContactListener(&contacts_);
  world_.SetGravity(to_vector({0, dynamics_.gravity}));
  build_ground(ground);
  constexpr std::array<Point, 5> kHull{{{-30 / kScale, +9 / kScale},
                                        {+6 / kScale, +9 / kScale},
                                        {+34 / kScale, +1 / kScale},
                                        {+34 / kScale, -8 / kScale},
                                        {-30 / kScale, -8 / kScale}}};
  hull_ = create_part(0, dynamic_body({kStartX, kStartY}, 0), polygon_of(kHull), kHullDensity,
                      kHullFriction);
  hull_->ApplyForceToCenter(to_vector({push, 0}), true);
  build_leg(0);
  build_leg(1);
  contacts_.watch(hull_, limbs_[kKnee1], limbs_[kKnee2]);
}

void Physics::destroy() {
  world_.SetContactListener(nullptr);
  std::for_each(ground_.rbegin(), ground_.rend(), [this](b2Body* b) { world_.DestroyBody(b); });
  ground_.clear();
  world_.DestroyBody(hull_);  // also destroys the hip joints
  hull_ = nullptr;
  for (b2Body*& limb : limbs_) {
    world_.DestroyBody(limb);
    limb = nullptr;
  }
  joints_ = {};
}

void Physics::change(const Dynamics& dynamics) {
  const Dynamics before = std::exchange(dynamics_, dynamics);
  world_.SetGravity(to_vector({0, dynamics_.gravity}));
  change_friction();
  if (dynamics_.mass_scale == before.mass_scale && dynamics_.masses == before.masses) return;
  for (std::size_t link = 0; link < kBodies; ++link) {
    b2Body& body = link == 0 ? *hull_ : *limbs_[link - 1];
    body.ResetMassData();
    set_mass(link, body);
  }
}

/// A contact's friction is the geometric mean of its fixtures', so all are scaled.
void Physics::change_friction() {
  const auto set = [this](b2Body& body, double friction) {
    const double scaled = friction * dynamics_.friction_scale;
    body.GetFixtureList()->SetFriction(static_cast<float>(scaled));
  };
  for (b2Body* body : ground_) set(*body, dynamics_.floor_friction);
  set(*hull_, kHullFriction);
  for (b2Body* limb : limbs_) set(*limb, kLimbFriction);
  for (b2Contact* each = world_.GetContactList(); each != nullptr; each = each->GetNext()) {
    each->ResetFriction();
  }
}

/// Creates ground if the body is static, else a part of the walker.
b2Body* Physics::create_body(const b2BodyDef& body, const b2Shape& shape, double density,
                             double friction) {
  const bool is_ground = body.type == b2_staticBody;
  b2FixtureDef fixture;
  fixture.shape = &shape;
  fixture.density = static_cast<float>(density);
  fixture.friction = static_cast<float>(friction * dynamics_.friction_scale);
  fixture.filter.categoryBits = is_ground ? kGroundCategory : kWalkerCategory;
  fixture.filter.maskBits = is_ground ? kAllCategories : kGroundCategory;
  b2Body* created = world_.CreateBody(&body);
  created->CreateFixture(&fixture);
  return created;
}

/// @param link of `kLinks`
b2Body* Physics::create_part(std::size_t link, const b2BodyDef& body, const b2Shape& shape,
                             double density, double friction) {
  b2Body* created = create_body(body, shape, density, friction);
  set_mass(link, *created);
  return created;
}

/// @param body has the mass of its density
void Physics::set_mass(std::size_t link, b2Body& body) const {
  const double mass_given = dynamics_.masses[link];
  if (dynamics_.mass_scale == 1 && mass_given == 0) return;
  // A scaled density would round the centre of mass, which the kernel's worlds share.
  b2MassData mass;
  body.GetMassData(&mass);
  mass.mass *= static_cast<float>(dynamics_.mass_scale);
  mass.I *= static_cast<float>(dynamics_.mass_scale);
  if (mass_given != 0) {
    const float more = static_cast<float>(mass_given) - mass.mass;
    mass.I += more * mass.center.LengthSquared();  // about the body's origin
    mass.mass = static_cast<float>(mass_given);
  }
  body.SetMassData(&mass);
}

void Physics::build_ground(const Ground& ground) {
  const std::size_t pieces = ground.obstacles.size() + ground.points.size() - 1;
  ground_.reserve(pieces);
  reserve_tree_nodes(static_cast<int>(pieces + 1 + kJointCount));  // plus hull and limbs
  const auto add = [this](const b2Shape& shape) {
    const b2BodyDef body;  // static, at the origin
    ground_.push_back(create_body(body, shape, 0, dynamics_.floor_friction));
    clear_move_buffer();
  };
  for (const auto& obstacle : ground.obstacles) {
    add(ground.obstacles_are_gymnasiums ? polygon_of(obstacle) : box_of(obstacle));
  }
  for (std::size_t i = 0; i + 1 < ground.points.size(); ++i) {
    b2EdgeShape shape;
    shape.Set(to_vector(ground.points[i]), to_vector(ground.points[i + 1]));
    add(shape);
  }
}

void Physics::build_leg(std::size_t leg) {
  const double side = leg == 0 ? -1 : +1;
  const auto create_limb = [&](std::size_t link, double center_height, double half_width) {
    b2PolygonShape shape;
    shape.SetAsBox(static_cast<float>(half_width), static_cast<float>(kLegHeight / 2));
    return create_part(link, dynamic_body({kStartX, center_height}, side * kLegSpread), shape,
                       kLimbDensity, kLimbFriction);
  };
  b2Body*& upper = limbs_[2 * leg];
  b2Body*& lower = limbs_[2 * leg + 1];
  upper = create_limb(2 * leg + 1, kStartY - kLegHeight / 2 - kLegDown, kLegWidth / 2);
  joints_[2 * leg] = create_joint(hull_, upper, kLegDown, side, kHipLower, kHipUpper);
  lower = create_limb(2 * leg + 2, kStartY - kLegHeight * 3 / 2 - kLegDown,
                      kLowerLegTaper * kLegWidth / 2);
  joints_[2 * leg + 1] = create_joint(upper, lower, -kLegHeight / 2, 1, kKneeLower, kKneeUpper);
}

void Physics::drive(const double* action) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const bool is_hip = i == kHip1 || i == kHip2;
    const double full_speed = is_hip ? dynamics_.hip_speed : dynamics_.knee_speed;
    const auto direction = static_cast<double>((action[i] > 0) - (action[i] < 0));
    joints_[i]->SetMotorSpeed(static_cast<float>(full_speed * direction));
    const double torque =
        dynamics_.motor_strength * kMotorTorque * std::min(std::abs(action[i]), 1.0);
    joints_[i]->SetMaxMotorTorque(static_cast<float>(torque));
  }
  // A damping torque acts against each joint's speed before the step.
  if (dynamics_.joint_damping == 0) return;
  for (b2RevoluteJoint* joint : joints_) {
    const auto damping = static_cast<float>(dynamics_.joint_damping);
    const float torque = damping * joint->GetJointSpeed();
    joint->GetBodyA()->ApplyTorque(torque, true);
    joint->GetBodyB()->ApplyTorque(-torque, true);
  }
}

void Physics::push(const std::array<double, 2>& impulse) {
  const auto [forward, up] = impulse;
  hull_->ApplyForceToCenter(to_vector({forward * kStepsPerSecond, up * kStepsPerSecond}), true);
}

void Physics::apply(const LinkWrench& wrench) {
  const bool is_hull = wrench.link == 0;
  b2Body& body = is_hull ? *hull_ : *limbs_[wrench.link - 1];
  const b2Vec2 origin = is_hull ? b2Vec2(0, 0) : joints_[wrench.link - 1]->GetLocalAnchorB();
  // In the body's frame, since positions in the world are inaccurate far from its origin.
  const b2Vec2 arm = body.GetWorldVector(origin - body.GetLocalCenter());
  const b2Vec2 force = to_vector({wrench.force_x, wrench.force_z});
  body.ApplyForceToCenter(force, true);
  // Box2D's rotations are about -y.
  body.ApplyTorque(b2Cross(arm, force) - static_cast<float>(wrench.torque_y), true);
}

WalkerParts Physics::parts() {
  return {&world_,
          {limbs_[kKnee2], limbs_[kHip2], hull_, limbs_[kHip1], limbs_[kKnee1]},
          {joints_[kKnee2], joints_[kHip2], joints_[kHip1], joints_[kKnee1]}};
}

}  // namespace walker::bipedal_walker

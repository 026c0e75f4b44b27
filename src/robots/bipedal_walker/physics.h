// The walker as Box2D bodies, on its ground.
#pragma once

#include <array>
#include <exception>
#include <functional>
#include <vector>

#include <Box2D/Box2D.h>

#include "base/state_bytes.h"
#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/kernel/kernel.h"
#include "robots/robot.h"
#include "simd/choose_kernel.h"

namespace walker::bipedal_walker {

/// Indices of joints, and of the limbs that they carry, in action order.
enum JointIndex : std::size_t { kHip1, kKnee1, kHip2, kKnee2, kJointCount };

/// Bodies and joints in the order in which Box2D solves them: the chain from the second lower leg
/// over the hull to the first lower leg.
struct WalkerParts {
  b2World* world;
  std::array<b2Body*, kBodies> bodies;
  std::array<b2RevoluteJoint*, kJoints> joints;
};

/// Links in the order of a specification: the trunk, then those of the joints.
constexpr std::array<const char*, kBodies> kLinks{"hull", "upper_leg_1", "lower_leg_1",
                                                  "upper_leg_2", "lower_leg_2"};

/// Physics of a world, Gymnasium's by default.
struct Dynamics {
  double gravity = kGravity;                 ///< upwards [m/s^2]
  double floor_friction = kTerrainFriction;  ///< of the ground
  double friction_scale = 1;
  double motor_strength = 1;             ///< factor of the torque limits
  double mass_scale = 1;                 ///< factor of masses and inertias
  std::array<double, kBodies> masses{};  ///< of `kLinks` [kg]; 0: by area and mass_scale
  double joint_damping = 0;              ///< [N m s]
  double hip_speed = kHipSpeed;          ///< [rad/s]
  double knee_speed = kKneeSpeed;        ///< [rad/s]
};

/// Upper bound of a saved world's numbers, in Box2D's units. A step moves a body by 2 m at most,
/// less than single precision resolves at this distance. Fourth powers of the bound are finite.
constexpr float kMaxSaved = 1e8F;

/// A b2World with one walker in it. Builds, destroys, drives and steps in Gymnasium's order, which
/// affects the engine's bits. box2d_pinned/ defines what needs Box2D's private members.
///
/// Model: five rigid bodies in the x,y plane, y up. The hull (5 kg/m^2) carries two legs, each an
/// upper and a lower box (1 kg/m^2), on revolute joints with limits and velocity motors. Ground is
/// static edges and boxes. The walker's bodies touch only ground. There is no restitution.
///
///   angle of a joint    q = angle of child - angle of parent - the same difference at the start
///   limits              hip -0.8 .. 1.1 rad, knee -1.6 .. -0.1 rad
///   motor (`drive`)     speed  = full speed * sign(action), by default hip 4, knee 6 rad/s
///                       torque <= motor_strength * 80 N m * min(|action|, 1)
///   joint_damping c     torque = -c dq/dt on the child, the opposite on the parent; dq/dt is that
///                       before the step
///   push J              force  = J / dt on the hull's centre of mass
///   friction            sqrt(mu_1 mu_2): hull 0.1, legs 0.2, ground floor_friction, by default
///                       2.5, each * friction_scale
///   mass                of hull and legs by their areas, * mass_scale, or given; then the inertia
///                       about the centre of mass stays
///
/// A step (b2World::Step, dt = 1/50 s, 180 velocity and 60 position iterations) finds contacts,
/// applies forces to velocities, solves joints and contacts by sequential impulses, integrates
/// positions by the new velocities and corrects them. If a body then would have passed through
/// ground, its motion is redone from the time of impact. The kernel has the equations:
/// kernel/island.h, and kernel/solve.h for impacts.
///
/// Inputs: motor speeds and torque limits, forces and torques. State: positions and velocities of
/// the bodies, and what Box2D carries over: accumulated impulses, contacts, the broad phase's tree.
///
/// Source: Gymnasium 1.4.0, envs/box2d/bipedal_walker.py, BipedalWalker.reset, step, _destroy and
/// ContactDetector; Box2D (box2d-py 2.3.8), Dynamics/b2World.cpp, b2World::Step.
class Physics {
 public:
  Physics();
  Physics(const Physics&) = delete;
  Physics& operator=(const Physics&) = delete;
  ~Physics() = default;

  /// Creates ground, hull and legs at the start. The b2World must be empty.
  /// @param push horizontal force on the hull during the first step [N]
  void build(const Ground& ground, double push, const Dynamics& dynamics = {});

  /// Sets other dynamics, also those of contacts that exist. Equal dynamics change no bit.
  void change(const Dynamics& dynamics);

  /// Destroys all bodies, in Gymnasium's order. The world keeps its own state.
  void destroy();

  /// Sets the velocity motors: speed by the sign of the action, torque limit by its magnitude.
  /// Applies the joints' damping to the next step.
  /// @param action kJointCount values; magnitudes are clamped to 1
  void drive(const double* action);

  /// Applies an impulse to the hull's centre of mass, as a constant force over the next step.
  /// @param impulse forward, up [N s]
  void push(const std::array<double, 2>& impulse);

  /// Applies a wrench over the next step.
  void apply(const LinkWrench& wrench);

  /// Advances the world by 1 / kStepsPerSecond.
  void step();

  /// Writes the state that a step leaves. There are then no pending broad-phase pairs, forces or
  /// island flags.
  void save(StateWriter& writer) const;

  /// Reads a state and validates every index.
  /// @param ground the ground of the destination
  /// @return a function that restores the state in a b2World built with this ground
  /// @throws std::invalid_argument naming the invalid value
  static std::function<void(Physics&)> read_state(StateReader& reader, const Ground& ground);

  WalkerParts parts();

  bool hull_has_touched() const { return contacts_.hull_has_touched; }
  /// Returns the ground contact flag of leg 0 or 1, which follows the contacts of its lower part.
  bool leg_touches(std::size_t leg) const { return contacts_.leg_touches[leg]; }

  const b2World& world() const { return world_; }
  const b2Body& hull() const { return *hull_; }
  const b2RevoluteJoint& joint(std::size_t index) const { return *joints_[index]; }
  /// @param index into Ground::obstacles
  const b2Fixture& obstacle(std::size_t index) const { return *ground_[index]->GetFixtureList(); }

 private:
  /// Tracks contacts as Gymnasium's ContactDetector does: the end of any contact of a leg clears
  /// its flag, even if another contact persists.
  class Contacts : public b2ContactListener {
   public:
    void watch(const b2Body* hull, const b2Body* lower_leg_1, const b2Body* lower_leg_2) {
      hull_ = hull;
      lower_legs_ = {lower_leg_1, lower_leg_2};
      hull_has_touched = false;
      leg_touches = {};
    }

    void BeginContact(b2Contact* contact) override {
      if (has(*contact, hull_)) hull_has_touched = true;
      set_legs(*contact, true);
    }

    void EndContact(b2Contact* contact) override { set_legs(*contact, false); }

    bool hull_has_touched = false;
    std::array<bool, 2> leg_touches{};

   private:
    static bool has(b2Contact& contact, const b2Body* body) {
      return contact.GetFixtureA()->GetBody() == body || contact.GetFixtureB()->GetBody() == body;
    }

    void set_legs(b2Contact& contact, bool touch) {
      for (std::size_t leg = 0; leg < lower_legs_.size(); ++leg) {
        if (has(contact, lower_legs_[leg])) leg_touches[leg] = touch;
      }
    }

    const b2Body* hull_ = nullptr;
    std::array<const b2Body*, 2> lower_legs_{};
  };

  b2Body* create_body(const b2BodyDef& body, const b2Shape& shape, double density, double friction);
  b2Body* create_part(std::size_t link, const b2BodyDef& body, const b2Shape& shape, double density,
                      double friction);
  void set_mass(std::size_t link, b2Body& body) const;
  void change_friction();
  void build_ground(const Ground& ground);
  void build_leg(std::size_t leg);
  void reserve_tree_nodes(int fixtures);
  void clear_move_buffer();

  b2World world_;
  Dynamics dynamics_;
  Contacts contacts_;
  std::vector<b2Body*> ground_;  // obstacles, then the line
  b2Body* hull_ = nullptr;
  std::array<b2Body*, kJointCount> limbs_{};
  std::array<b2RevoluteJoint*, kJointCount> joints_{};
};

/// One call of `Physics::step` within a group.
struct PhysicsCall {
  Physics* physics;
  std::exception_ptr* failure;  ///< receives what `step` would have thrown
};

/// Advances distinct instances by one step. Each gets the same bits as by `Physics::step`.
/// @param count at most kMaxGroupSize
void step_together(const Kernel& kernel, PhysicsCall* calls, std::size_t count) noexcept;

/// Whether rotations have the C library's bits, and some hundred steps have Box2D's.
bool has_box2ds_bits(const Kernel& kernel);

using KernelChoice = simd::KernelChoice<Kernel>;

/// Returns the first of `kernels` that the user allows and that passes `has_box2ds_bits`, if any.
/// Each kernel is tested once per process.
/// @throws std::invalid_argument if WALKER_SIM_KERNEL has an unknown value
KernelChoice choose_kernel();

}  // namespace walker::bipedal_walker

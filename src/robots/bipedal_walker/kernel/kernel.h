// What Box2D's solvers do to a walker, as code of its own: the engine's bits for many worlds at
// once.
//
// No Box2D here: a world's numbers are copied into an Island or an Impact, solved together with
// those of other worlds, and copied back.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace walker::bipedal_walker {

constexpr int kBodies = 5;        ///< one lower leg, its upper leg, the hull, the other legs' parts
constexpr int kJoints = 4;        ///< joint i is between bodies i and i + 1
constexpr int kMaxContacts = 32;  ///< of one island
constexpr int kMaxContactsOfBody = 12;

/// What is the same in all worlds [m, rad, kg, s].
struct Model {
  struct Body {
    float inverse_mass;
    float inverse_inertia;
    float center_x, center_y;  ///< b2Sweep::localCenter
  };
  struct Joint {
    float arm_a_x, arm_a_y;  ///< from the centre of its body A to the anchor, in A's frame
    float arm_b_x, arm_b_y;
    float reference_angle;
    float lower_angle, upper_angle;
  };
  std::array<Body, kBodies> bodies;
  std::array<Joint, kJoints> joints;
  float gravity_x, gravity_y;
  float dt;
  float dt_ratio;  ///< of this step's length to the last one's, as b2TimeStep has it
  int velocity_iterations;
  int position_iterations;
};

/// b2Sweep's and b2Body's state: centre of mass, angle and velocities. Number is a float, or a
/// vector with the numbers of several worlds.
template <typename Number>
struct BodyState {
  Number x, y, angle;
  Number velocity_x, velocity_y, angular_velocity;
};

template <typename Number>
struct Force {
  Number x, y, torque;
};

/// b2Rot.
template <typename Number>
struct Rotation {
  Number sine, cosine;
};

/// b2RevoluteJoint's inputs and state. Truth is 0 or -1.
template <typename Number, typename Truth>
struct JointState {
  Number motor_speed, motor_torque;
  Number impulse_x, impulse_y, limit_impulse, motor_impulse;
  Truth at_lower, at_upper;
};

/// b2Manifold between one body of the walker and one of the terrain, which is static, at the
/// origin.
template <typename Number, typename Truth>
struct ContactManifold {
  Truth exists;           ///< this contact: lanes may have fewer than others
  Truth walker_is_a;      ///< the contact's body A, not B
  Truth walker_has_face;  ///< the reference face is the walker's: normal and plane are in its frame
  Truth has_two_points;
  Number normal_x, normal_y, plane_x, plane_y;
  Number point_x[2], point_y[2];  ///< in the frame of the other body than the face's
  Number friction;
};

/// Of the points of a manifold, accumulated in the last step, to start from.
template <typename Number>
struct ContactImpulses {
  Number normal[2], tangent[2];
};

template <typename Number, typename Truth>
struct Contact {
  ContactManifold<Number, Truth> manifold;
  ContactImpulses<Number> impulses;
};

/// b2Island with a walker and its contacts, before and after b2Island::Solve.
struct Island {
  std::array<BodyState<float>, kBodies> bodies;
  std::array<Force<float>, kBodies> forces;
  std::array<JointState<float, int>, kJoints> joints;
  std::array<int, kBodies> num_contacts;  ///< of each body, at most kMaxContactsOfBody
  std::array<Contact<float, int>, kMaxContacts> contacts;  ///< body by body

  std::array<Rotation<float>, kBodies> rotations_before;  ///< only written
  std::array<Rotation<float>, kBodies> rotations;         ///< only written
  int position_is_solved;                                 ///< only written

  unsigned pattern;  ///< alike in worlds that have much in common
};

/// b2Island of a time of impact, before and after b2Island::SolveTOI.
struct Impact {
  int body;  ///< of the walker
  float dt;  ///< of what is left of the step [s]
  BodyState<float> state;
  int num_contacts;  ///< 1 .. kMaxContactsOfBody
  std::array<ContactManifold<float, int>, kMaxContactsOfBody> contacts;

  float safe_x, safe_y, safe_angle;  ///< only written: where the rest of the step starts
  unsigned pattern;
};

/// One compilation of the kernel.
struct Kernel {
  const char* instruction_set;
  int lanes;  ///< worlds that are solved together

  /// @param count at most kMaxGroupSize
  void (*solve)(Island* const* islands, std::size_t count, const Model& model);
  void (*solve_impacts)(Impact* const* impacts, std::size_t count, const Model& model);

  /// b2Rot::Set, with the C library's bits. Any number of angles [rad].
  void (*rotate)(const float* angles, std::size_t count, Rotation<float>* rotations);
};

/// Those that this processor can run, the one with the most lanes first.
std::vector<const Kernel*> kernels();

}  // namespace walker::bipedal_walker

// Interface of the kernel, which reimplements Box2D's solvers for many walkers, bit for bit.
//
// The kernel does not depend on Box2D: an instance's numbers are copied into an Island or a
// ToiIsland, solved together with those of other instances, and copied back.
//
// A step of a walker has these parts (box2d_pinned/world_step.cpp, world_toi.h):
//
//   contacts  manifolds between the walker's polygons and the ground             Box2D
//   Island    velocities, positions and impulses after dt                         Kernel::solve
//   sweep     the first time of impact of a body with the ground, if any         Box2D
//   ToiIsland the body's velocity and position after the rest of dt               Kernel::solve_toi
//
// The last two repeat until no body has an impact.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace walker::bipedal_walker {

constexpr int kBodies = 5;        ///< lower leg, upper leg, hull, other upper leg, other lower leg
constexpr int kJoints = 4;        ///< joint i is between bodies i and i + 1
constexpr int kMaxContacts = 32;  ///< per island
constexpr int kMaxContactsOfBody = 12;

/// Constants that all instances share [m, rad, kg, s].
struct Model {
  struct Body {
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
  float gravity_x;
  float dt;
  float dt_ratio;  ///< b2TimeStep::dtRatio: length of this step over that of the last
  int velocity_iterations;
  int position_iterations;
};

/// Centre of mass, angle and velocities. Number is a float, or a vector over several instances.
template <typename Number>
struct BodyState {
  Number x, y, angle;
  Number velocity_x, velocity_y, angular_velocity;
};

template <typename Number>
struct InverseMass {
  Number mass, inertia;
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

/// Inputs and state of b2RevoluteJoint. Truth is an int, 0 or -1, or a mask over several instances.
template <typename Number, typename Truth>
struct JointState {
  Number motor_speed, motor_torque;
  Number impulse_x, impulse_y, limit_impulse, motor_impulse;
  Truth at_lower, at_upper;
};

/// b2Manifold between a body of the walker and a static body of the ground at the origin.
template <typename Number, typename Truth>
struct ContactManifold {
  Truth exists;           ///< 0 in lanes that have fewer contacts than others
  Truth walker_is_a;      ///< whether the walker is body A of the contact
  Truth walker_has_face;  ///< reference face is the walker's; normal and plane are in its frame
  Truth has_two_points;
  Number normal_x, normal_y, plane_x, plane_y;
  Number point_x[2], point_y[2];  ///< in the frame of the body without the face
  Number friction;
};

/// Accumulated impulses of a manifold's points; on input, those of the last step (warm start).
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
  std::array<InverseMass<float>, kBodies> inverse_masses;
  float gravity_y;
  std::array<JointState<float, int>, kJoints> joints;
  std::array<int, kBodies> num_contacts;                   ///< per body, at most kMaxContactsOfBody
  std::array<Contact<float, int>, kMaxContacts> contacts;  ///< sorted by body

  std::array<Rotation<float>, kBodies> rotations_before;  ///< output
  std::array<Rotation<float>, kBodies> rotations;         ///< output
  int position_is_solved;                                 ///< output

  unsigned pattern;  ///< sort key that groups instances with similar constraints
};

/// b2Island at a time of impact, before and after b2Island::SolveTOI.
struct ToiIsland {
  int body;  ///< index into Model::bodies
  float dt;  ///< rest of the step [s]
  BodyState<float> state;
  InverseMass<float> inverse_mass;
  int num_contacts;  ///< 1 .. kMaxContactsOfBody
  std::array<ContactManifold<float, int>, kMaxContactsOfBody> contacts;

  float safe_x, safe_y, safe_angle;  ///< output: position from which the rest of the step starts
  unsigned pattern;
};

/// A compilation of the kernel for an instruction set.
struct Kernel {
  const char* instruction_set;
  int lanes;  ///< instances per vector

  /// @param count at most kMaxGroupSize
  void (*solve)(Island* const* islands, std::size_t count, const Model& model);
  void (*solve_toi)(ToiIsland* const* islands, std::size_t count, const Model& model);

  /// b2Rot::Set for `count` angles [rad], with the C library's bits.
  void (*rotate)(const float* angles, std::size_t count, Rotation<float>* rotations);
};

/// Compilations, each in a file of its own. Only those for the target architecture exist.
extern const Kernel kernel_sse2, kernel_avx2, kernel_avx512, kernel_neon;

/// Returns the kernels that this processor can run, the one with the most lanes first.
std::vector<const Kernel*> kernels();

}  // namespace walker::bipedal_walker

// Box2D's file with custom loops over the velocity constraints, which take nearly all of the time.
// The loops give the same bits.
//
// The macro adds a call to the conditions of both of Box2D's loops. The names that it uses cannot
// change, because the package's hash is pinned. Compiled with -fno-access-control.
#include <Box2D/Box2D.h>
#include <Box2D/Dynamics/Contacts/b2ContactSolver.h>
#include <Box2D/Dynamics/b2Island.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace {

/// Contacts of one island that are solved together.
struct Contacts {
  b2ContactVelocityConstraint* first;
  int32 count;
};

void solve(b2ContactSolver& solver, const Contacts& contacts) {
  solver.m_velocityConstraints = contacts.first;
  solver.m_count = contacts.count;
  solver.SolveVelocityConstraints();
}

/// The walker's joints from one lower leg to the other, in the order of each of its islands.
enum JointOrder { kFirstKnee, kFirstHip, kSecondHip, kSecondKnee, kJointCount };

bool touches(const b2ContactVelocityConstraint& contact, const b2Joint& joint) {
  const auto has = [&contact](const b2Body* body) {
    return contact.indexA == body->m_islandIndex || contact.indexB == body->m_islandIndex;
  };
  return has(joint.m_bodyA) || has(joint.m_bodyB);
}

/// Whether the island's joints are the walker's: each shares a body with the next one.
bool is_chain(const b2Island& island) {
  if (island.m_jointCount != kJointCount) return false;
  const auto& joints = island.m_joints;
  return joints[kFirstKnee]->m_bodyA == joints[kFirstHip]->m_bodyB &&
         joints[kFirstHip]->m_bodyA == joints[kSecondHip]->m_bodyA &&
         joints[kSecondHip]->m_bodyB == joints[kSecondKnee]->m_bodyA;
}

/// Runs all velocity iterations of the walker's joints and contacts, in an order that lets the
/// processor overlap two constraints. Constraints without a common body are independent, so their
/// order does not matter, and the first leg may be one iteration ahead of hull and second leg.
/// @return false, having done nothing, if the island is not a walker's
bool solve_velocities(const b2SolverData& data, b2ContactSolver& solver, const b2Island& island) {
  if (!is_chain(island)) return false;
  const auto solve_joint = [&](JointOrder joint) {
    island.m_joints[joint]->SolveVelocityConstraints(data);
  };
  const Contacts all{solver.m_velocityConstraints, solver.m_count};
  const auto of_first_leg = [&](const b2ContactVelocityConstraint& contact) {
    return touches(contact, *island.m_joints[kFirstKnee]);
  };
  b2ContactVelocityConstraint* const end = all.first + all.count;
  b2ContactVelocityConstraint* const middle = std::find_if_not(all.first, end, of_first_leg);
  if (std::any_of(middle, end, of_first_leg)) return false;
  const Contacts first_leg{all.first, static_cast<int32>(middle - all.first)};
  const Contacts the_rest{middle, static_cast<int32>(end - middle)};

  const auto solve_first_leg = [&] { solve(solver, first_leg); };
  solve_joint(kFirstKnee);
  solve_joint(kFirstHip);
  solve_first_leg();
  for (int32 i = 1; i < data.step.velocityIterations; ++i) {
    solve_joint(kSecondHip);
    solve_joint(kFirstKnee);  // of the next iteration
    solve_joint(kSecondKnee);
    solve(solver, the_rest);
    solve_joint(kFirstHip);  // of the next iteration
    solve_first_leg();       // of the next iteration
  }
  solve_joint(kSecondHip);
  solve_joint(kSecondKnee);
  solve(solver, the_rest);
  solver.m_velocityConstraints = all.first;
  solver.m_count = all.count;
  return true;
}

/// The state that an iteration over contacts can change.
class ContactState {
 public:
  void read(const b2ContactSolver& solver, int32 bodies) {
    std::memcpy(velocities_.data(), solver.m_velocities, velocity_bytes(bodies));
    for (int32 i = 0; i < solver.m_count; ++i) {
      const b2ContactVelocityConstraint& contact = solver.m_velocityConstraints[i];
      std::memcpy(points_[i].data(), contact.points, point_bytes(contact));
    }
  }

  /// Compares bits: 0 and -0 differ.
  bool is_that_of(const b2ContactSolver& solver, int32 bodies) const {
    if (std::memcmp(velocities_.data(), solver.m_velocities, velocity_bytes(bodies)) != 0) {
      return false;
    }
    for (int32 i = 0; i < solver.m_count; ++i) {
      const b2ContactVelocityConstraint& contact = solver.m_velocityConstraints[i];
      if (std::memcmp(points_[i].data(), contact.points, point_bytes(contact)) != 0) return false;
    }
    return true;
  }

 private:
  static std::size_t velocity_bytes(int32 bodies) {
    return static_cast<std::size_t>(bodies) * sizeof(b2Velocity);
  }
  static std::size_t point_bytes(const b2ContactVelocityConstraint& contact) {
    return static_cast<std::size_t>(contact.pointCount) * sizeof(b2VelocityConstraintPoint);
  }

  // Capacities of the island of b2World::SolveTOI.
  std::array<b2Velocity, std::size_t{2} * b2_maxTOIContacts> velocities_;
  std::array<std::array<b2VelocityConstraintPoint, b2_maxManifoldPoints>, b2_maxTOIContacts>
      points_;
};

/// Replaces the local variable of b2Island::Solve, which b2Island::SolveTOI does not have.
struct NoJoints {
} solverData;

/// Runs the velocity iterations at a time of impact, until one changes nothing: no later one would.
bool solve_velocities(NoJoints /*none*/, b2ContactSolver& solver, const b2Island& island) {
  ContactState before;
  for (int32 i = 0; i < solver.m_step.velocityIterations; ++i) {
    before.read(solver, island.m_bodyCount);
    solver.SolveVelocityConstraints();
    if (before.is_that_of(solver, island.m_bodyCount)) break;
  }
  return true;
}

}  // namespace

#define velocityIterations velocityIterations && !solve_velocities(solverData, contactSolver, *this)
#include <Box2D/Dynamics/b2Island.cpp>  // NOLINT(bugprone-suspicious-include)

// b2Island's loops over the velocity constraints, which take nearly all of a step's time. They give
// Box2D's bits. cmake/engines.cmake inserts the call into copies of Box2D's loops.
//
// Compiled with -fno-access-control.
#include <Box2D/Box2D.h>
#include <Box2D/Dynamics/Contacts/b2ContactSolver.h>
#include <Box2D/Dynamics/b2Island.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace {

/// The walker's joints from one lower leg to the other, in the order of each of its islands.
enum JointOrder { kFirstKnee, kFirstHip, kSecondHip, kSecondKnee, kJointCount };

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
/// @return false, having done nothing, if the contacts of the first leg are not the first ones
bool solve_chain(const b2Island& island, b2ContactSolver& solver) {
  const b2Joint& knee = *island.m_joints[kFirstKnee];
  const auto touches_first_leg = [&knee](const b2ContactVelocityConstraint& contact) {
    const auto has = [&contact](const b2Body* body) {
      return contact.indexA == body->m_islandIndex || contact.indexB == body->m_islandIndex;
    };
    return has(knee.m_bodyA) || has(knee.m_bodyB);
  };
  b2ContactVelocityConstraint* const begin = solver.m_velocityConstraints;
  b2ContactVelocityConstraint* const end = begin + solver.m_count;
  if (!std::is_partitioned(begin, end, touches_first_leg)) return false;
  b2ContactVelocityConstraint* const middle = std::partition_point(begin, end, touches_first_leg);

  const b2SolverData data{solver.m_step, solver.m_positions, solver.m_velocities};
  const auto solve_joint = [&](JointOrder joint) {
    island.m_joints[joint]->SolveVelocityConstraints(data);
  };
  const auto solve_contacts = [&solver](b2ContactVelocityConstraint* first,
                                        const b2ContactVelocityConstraint* last) {
    solver.m_velocityConstraints = first;
    solver.m_count = static_cast<int32>(last - first);
    solver.SolveVelocityConstraints();
  };
  solve_joint(kFirstKnee);
  solve_joint(kFirstHip);
  solve_contacts(begin, middle);
  for (int32 i = 1; i < data.step.velocityIterations; ++i) {
    solve_joint(kSecondHip);
    solve_joint(kFirstKnee);  // of the next iteration
    solve_joint(kSecondKnee);
    solve_contacts(middle, end);
    solve_joint(kFirstHip);         // of the next iteration
    solve_contacts(begin, middle);  // of the next iteration
  }
  solve_joint(kSecondHip);
  solve_joint(kSecondKnee);
  solve_contacts(middle, end);
  solver.m_velocityConstraints = begin;
  solver.m_count = static_cast<int32>(end - begin);
  return true;
}

/// Runs the velocity iterations of contacts until one changes no bit: no later one would.
void solve_until_unchanged(const b2Island& island, b2ContactSolver& solver) {
  // Capacities of the island of b2World::SolveTOI.
  std::array<b2Velocity, std::size_t{2} * b2_maxTOIContacts> velocities;
  std::array<b2ContactVelocityConstraint, b2_maxTOIContacts> contacts;
  const std::size_t velocity_bytes =
      sizeof velocities[0] * static_cast<unsigned>(island.m_bodyCount);
  const std::size_t contact_bytes = sizeof contacts[0] * static_cast<unsigned>(solver.m_count);
  const auto is_unchanged = [&] {
    return std::memcmp(velocities.data(), solver.m_velocities, velocity_bytes) == 0 &&
           std::memcmp(contacts.data(), solver.m_velocityConstraints, contact_bytes) == 0;
  };
  for (int32 i = 0; i < solver.m_step.velocityIterations; ++i) {
    std::memcpy(velocities.data(), solver.m_velocities, velocity_bytes);
    std::memcpy(contacts.data(), solver.m_velocityConstraints, contact_bytes);
    solver.SolveVelocityConstraints();
    if (is_unchanged()) break;
  }
}

}  // namespace

/// @return whether all velocity iterations are done
bool walker_sim_solve_velocities(const b2Island& island, b2ContactSolver& solver) {
  if (is_chain(island)) return solve_chain(island, solver);
  if (island.m_jointCount != 0 || solver.m_count > b2_maxTOIContacts) return false;
  solve_until_unchanged(island, solver);
  return true;
}

// Contacts of limbs with the line of a ground, for MuJoCo's library and for the kernels.
#pragma once

namespace walker::mujoco {

class GroundLine;

/// A capsule in the plane of motion, or a sphere, whose ends are equal. [m]
struct GroundLimb {
  double end_x[2], end_z[2];  ///< ends of the axis, in the order in which MuJoCo tests them
  double centre_z;
  double radius;
  double bound;  ///< radius of a sphere about the centre that the limb is in
};

struct LimbContact {
  double distance;  ///< between the surfaces, negative inside [m]
  double share;     ///< of the way from the first end to the second, where the axis touches
  double x, z;      ///< point halfway between the surfaces [m]
  double normal_x, normal_z;  ///< out of the ground
};

constexpr int kMaxLimbContacts = 8;

/// Returns an upper bound of the line's heights within 2 m of x [m]. No limb is farther from its
/// robot's centre of mass.
double top_around(const GroundLine& line, double x);

/// Finds the contacts of a limb with the surface. With r = radius, and a contact's normal n and
/// distance d between the limb's surface and the ground's:
///
///   ends    of the axis, outside: each nearest point of the line, that is of each piece or corner
///           from which the distance grows in all directions. n points from there to the end.
///           In the ground: the nearest point of the surface; n points out.
///   corners under the side of a capsule: n is perpendicular to the axis. It may lean by 0.1 beyond
///           the normals of the corner's pieces, so that a limb that lies on one of them has two
///           contacts with it, as with a plane.
///   point   p - (d / 2 + r) n, p: point of the axis
///
/// All contacts with d <= margin are found: those of the first end, of the second, of the corners,
/// each from left to right, up to kMaxLimbContacts. A level line gives the numbers of
/// mjc_PlaneSphere and mjc_PlaneCapsule (engine_collision_primitive.c of MuJoCo 2.2.2), to the bit,
/// and their bounding test.
/// @return the number of contacts
int find_contacts(const GroundLine& line, const GroundLimb& limb, double margin,
                  LimbContact* contacts);

}  // namespace walker::mujoco

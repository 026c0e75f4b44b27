// Contacts at edges inside the surface of a level, which is made of boxes that adjoin.
#pragma once

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Makes MuJoCo drop the contacts of spheres and capsules with a level's boxes that the boxes'
/// common surface does not have: at an edge at which another box continues the surface, a contact
/// whose normal is beyond the normals of both boxes. Without this, a foot that slides over a seam
/// between boxes is pushed back by the next box's edge.
///
/// With a box's axes x and z (out of the surface), a contact's normal n out of the box, and the
/// sines of `set_max_tilt`, a contact is dropped if n.z > 0 and
///
///   n.x < -left  or  n.x > right    (tolerance 1e-3)
///
/// If the axis of the sphere or capsule is inside the box, the contact stays, with n = z.
///
/// The functions in MuJoCo's table of collision functions are replaced. They do nothing else than
/// the former ones with boxes that are not a level's.
///
/// @pre no other thread uses MuJoCo, or the functions are installed
void install_internal_edges();

/// Sets the sines of the largest angles between the normal of a level's box and those of its
/// contacts. A level's boxes are geoms of the world's body that `body_geomnum` does not count.
/// @param left, right `GroundBox::max_tilt`
void set_max_tilt(mjModel& model, int box, double left, double right);

}  // namespace walker::mujoco

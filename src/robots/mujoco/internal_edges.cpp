#include "robots/mujoco/internal_edges.h"

#include <algorithm>

namespace walker::mujoco {
namespace {

/// Tolerance of the sines. Boxes meet within 10 um.
constexpr mjtNum kTolerance = 1e-3;

mjfCollision collide_sphere = nullptr;
mjfCollision collide_capsule = nullptr;

bool is_of_level(const mjModel& model, int geom) {
  return model.geom_bodyid[geom] == 0 && geom >= model.body_geomadr[0] + model.body_geomnum[0];
}

/// Returns the component of a contact's normal, out of the box, along one of the box's axes.
mjtNum along_axis(const mjContact& contact, const mjtNum* rotation, int axis) {
  const mjtNum* const into_box = contact.frame;
  return -(into_box[0] * rotation[axis] + into_box[1] * rotation[3 + axis] +
           into_box[2] * rotation[6 + axis]);
}

/// Keeps the contacts that the surface has. @return their number
int keep_contacts(const mjModel& model, const mjData& data, mjContact* contacts, int count,
                  int geom, int box) {
  const mjtNum* const max_tilt = at(model.geom_solref, box, mjNREF);
  const mjtNum* const rotation = at(data.geom_xmat, box, 9);
  const mjtNum radius = at(model.geom_size, geom, 3)[0];
  mjContact* end = contacts;
  for (mjContact* contact = contacts; contact != contacts + count; ++contact) {
    const mjtNum tilt = along_axis(*contact, rotation, 0);
    const bool is_beyond = tilt < -max_tilt[0] - kTolerance || tilt > max_tilt[1] + kTolerance;
    if (is_beyond && along_axis(*contact, rotation, 2) > -kTolerance) {
      if (contact->dist > -radius + mjMINVAL) continue;
      // The axis is inside the box and nearest to the next box: the surface pushes it out.
      for (int i = 0; i < 3; ++i) contact->frame[i] = -rotation[3 * i + 2];
    }
    if (end != contact) *end = *contact;
    ++end;
  }
  return static_cast<int>(end - contacts);
}

template <mjfCollision* collide>
int collide_with_box(const mjModel* model, const mjData* data, mjContact* contacts, int geom,
                     int box, mjtNum margin) {
  const int count = (*collide)(model, data, contacts, geom, box, margin);
  if (count == 0 || !is_of_level(*model, box)) return count;
  return keep_contacts(*model, *data, contacts, count, geom, box);
}

template <mjfCollision* collide>
void install(mjtGeom type) {
  if (*collide != nullptr) return;
  mjfCollision& installed = mjCOLLISIONFUNC[type][mjGEOM_BOX];
  *collide = installed;
  installed = collide_with_box<collide>;
}

}  // namespace

void install_internal_edges() {
  install<&collide_sphere>(mjGEOM_SPHERE);
  install<&collide_capsule>(mjGEOM_CAPSULE);
}

/// The engine does not read `geom_solref` of a geom that only predefined pairs let touch.
void set_max_tilt(mjModel& model, int box, double left, double right) {
  mjtNum* const max_tilt = at(model.geom_solref, box, mjNREF);
  max_tilt[0] = left;
  max_tilt[1] = right;
}

}  // namespace walker::mujoco

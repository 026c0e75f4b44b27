#include "robots/mujoco/floor.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "robots/mujoco/ground_contact.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {
namespace {

thread_local const GroundLine* line_in_use = nullptr;

/// The functions of MuJoCo's table that `collide` replaces, by the type of the geom on the plane.
std::array<mjfCollision, mjNGEOMTYPES> plane_functions{};

/// On level ground the frame is made from the capsule's axis, as by mjc_PlaneCapsule.
int collide(const mjModel* model, const mjData* data, mjContact* contacts, int floor, int geom,
            mjtNum margin) {
  const int type = model->geom_type[geom];
  if (line_in_use == nullptr || floor != floor_of(*model)) {
    return plane_functions[static_cast<std::size_t>(type)](model, data, contacts, floor, geom,
                                                           margin);
  }
  const bool is_capsule = type == mjGEOM_CAPSULE;
  const mjtNum* const centre = at(data->geom_xpos, geom, 3);
  const mjtNum* const rotation = at(data->geom_xmat, geom, 9);
  const mjtNum* const size = at(model->geom_size, geom, 3);
  const Vector3 axis{rotation[2], rotation[5], rotation[8]};
  Vector3 half{};
  if (is_capsule) mju_scl3(half.data(), axis.data(), size[1]);
  std::array<LimbContact, kMaxLimbContacts> found;
  const int count = find_contacts(*line_in_use,
                                  {{centre[0] + half[0], centre[0] - half[0]},
                                   {centre[2] + half[2], centre[2] - half[2]},
                                   centre[2],
                                   size[0],
                                   model->geom_rbound[geom]},
                                  margin, found.data());
  for (int i = 0; i < count; ++i) {
    const LimbContact& each = found[static_cast<std::size_t>(i)];
    mjContact& contact = contacts[i];
    contact.dist = each.distance;
    mju_copy3(contact.pos,
              Vector3{each.x, centre[1] + half[1] * (1 - 2 * each.share), each.z}.data());
    mju_copy3(contact.frame, Vector3{each.normal_x, 0, each.normal_z}.data());
    mju_zero3(contact.frame + 3);
    if (!is_capsule) continue;
    const Vector3 tangent{each.normal_z, 0, -each.normal_x};
    mju_copy3(contact.frame + 3, (each.normal_x == 0 ? axis : tangent).data());
  }
  return count;
}

}  // namespace

int floor_of(const mjModel& model) {
  constexpr double kTolerance = 1e-9;  // of 1 - cos(tilt)
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_type[geom] != mjGEOM_PLANE || model.geom_bodyid[geom] != 0) continue;
    const mjtNum* const quaternion = at(model.geom_quat, geom, 4);
    if (2 * mju_dot(quaternion + 1, quaternion + 1, 2) < kTolerance) return geom;
  }
  return -1;
}

/// Lets the engine find the contacts of the robot far below the floor.
std::vector<int> geoms_on_floor(const mjModel& model) {
  constexpr double kDepth = 1e3;  // [m]
  mjModel enlarged = model;
  enlarged.nconmax += 8 * model.ngeom;
  const int floor = floor_of(model);
  const DataPointer data = make_data(enlarged);
  data->qpos[kBaseZ] -= kDepth;
  mj_kinematics(&enlarged, data.get());
  mj_collision(&enlarged, data.get());
  std::set<int> geoms;
  std::for_each(data->contact, data->contact + data->ncon, [&](const mjContact& contact) {
    const bool moves = carrier_of(model, model.geom_bodyid[contact.geom2]) != 0;
    if (contact.geom1 == floor && moves) geoms.insert(contact.geom2);
  });
  return {geoms.begin(), geoms.end()};
}

std::string level_refusal(const mjModel& model) {
  if (floor_of(model) < 0) return "the model has no floor, a level plane of the world's body";
  const std::vector<int> geoms = geoms_on_floor(model);
  if (geoms.empty()) return "no limb of the model touches its floor";
  for (const int geom : geoms) {
    const int type = model.geom_type[geom];
    if (type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE) continue;
    return "the geom " + element_name(model, mjOBJ_GEOM, geom) +
           " touches the floor and has another shape than a sphere or a capsule, which alone stand "
           "on a level";
  }
  return "";
}

void install_ground_contacts() {
  // Each copy of this library in a process installs its own once, over that of the copy before it.
  for (const std::size_t type : {mjGEOM_SPHERE, mjGEOM_CAPSULE}) {
    if (plane_functions[type] != nullptr) continue;
    mjfCollision& installed = mjCOLLISIONFUNC[mjGEOM_PLANE][type];
    plane_functions[type] = installed;
    installed = collide;
  }
}

GroundInUse::GroundInUse(const GroundLine* line) : before_(std::exchange(line_in_use, line)) {}

GroundInUse::~GroundInUse() { line_in_use = before_; }

}  // namespace walker::mujoco

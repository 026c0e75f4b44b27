#include "robots/mujoco/floor.h"

#include <algorithm>
#include <array>

#include "robots/mujoco/ground_contact.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {
namespace {

thread_local const GroundLine* line_in_use = nullptr;
thread_local int floor_in_use = -1;

/// The functions of MuJoCo's table that `collide` replaces.
mjfCollision plane_sphere = nullptr;
mjfCollision plane_capsule = nullptr;

/// On level ground the frame is made from the capsule's axis, as by mjc_PlaneCapsule.
int collide(const mjModel* model, const mjData* data, mjContact* contacts, int floor, int geom,
            mjtNum margin) {
  const bool is_capsule = model->geom_type[geom] == mjGEOM_CAPSULE;
  if (line_in_use == nullptr || floor != floor_in_use) {
    return (is_capsule ? plane_capsule : plane_sphere)(model, data, contacts, floor, geom, margin);
  }
  const mjtNum* const centre = at(data->geom_xpos, geom, 3);
  const mjtNum* const rotation = at(data->geom_xmat, geom, 9);
  const mjtNum* const size = at(model->geom_size, geom, 3);
  const double half_length = is_capsule ? size[1] : 0;
  const Vector3 half{rotation[2] * half_length, rotation[5] * half_length,
                     rotation[8] * half_length};
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
    if (is_capsule && each.normal_x == 0) {
      mju_copy3(contact.frame + 3, Vector3{rotation[2], rotation[5], rotation[8]}.data());
    } else if (is_capsule) {
      mju_copy3(contact.frame + 3, Vector3{each.normal_z, 0, -each.normal_x}.data());
    }
  }
  return count;
}

/// Whether the engine looks for contacts between these geoms, of which one is the floor.
bool are_found(const mjModel& m, int floor, int geom) {
  const auto [first, second] = std::minmax(m.geom_bodyid[floor], m.geom_bodyid[geom]);
  const int signature = ((first + 1) << 16) + second + 1;
  const bool are_excluded = std::find(m.exclude_signature, m.exclude_signature + m.nexclude,
                                      signature) != m.exclude_signature + m.nexclude;
  const bool match = (m.geom_contype[floor] & m.geom_conaffinity[geom]) != 0 ||
                     (m.geom_contype[geom] & m.geom_conaffinity[floor]) != 0;
  return m.opt.collision != mjCOL_PAIR && match && !are_excluded;
}

bool are_a_pair(const mjModel& m, int floor, int geom) {
  if (m.opt.collision == mjCOL_DYNAMIC) return false;
  for (int pair = 0; pair < m.npair; ++pair) {
    const auto [first, second] = std::minmax(m.pair_geom1[pair], m.pair_geom2[pair]);
    if (first == std::min(floor, geom) && second == std::max(floor, geom)) return true;
  }
  return false;
}

bool is_upright(const mjtNum* quaternion) {
  constexpr double kAligned = 1 - 1e-9;
  std::array<mjtNum, 9> rotation{};
  mju_quat2Mat(rotation.data(), quaternion);
  return rotation[8] > kAligned;
}

std::string name_of(const mjModel& model, int geom) {
  const char* const name = mj_id2name(&model, mjOBJ_GEOM, geom);
  return name != nullptr ? name : "number " + std::to_string(geom);
}

}  // namespace

int floor_of(const mjModel& model) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_type[geom] == mjGEOM_PLANE && model.geom_bodyid[geom] == 0 &&
        is_upright(at(model.geom_quat, geom, 4))) {
      return geom;
    }
  }
  return -1;
}

std::vector<int> geoms_on_floor(const mjModel& model) {
  const int floor = floor_of(model);
  std::vector<int> geoms;
  for (int geom = 0; geom < model.ngeom && floor >= 0; ++geom) {
    if (carrier_of(model, model.geom_bodyid[geom]) == 0) continue;
    if (are_a_pair(model, floor, geom) || are_found(model, floor, geom)) geoms.push_back(geom);
  }
  return geoms;
}

std::string level_refusal(const mjModel& model) {
  if (floor_of(model) < 0) return "the model has no floor, a level plane of the world's body";
  const std::vector<int> geoms = geoms_on_floor(model);
  if (geoms.empty()) return "no limb of the model touches its floor";
  for (const int geom : geoms) {
    const int type = model.geom_type[geom];
    if (type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE) continue;
    return "the geom " + name_of(model, geom) +
           " touches the floor and has another shape than a sphere or a capsule, which alone stand "
           "on a level";
  }
  return "";
}

void install_ground_contacts() {
  if (plane_sphere != nullptr) return;
  const auto install = [](mjtGeom type, mjfCollision& original) {
    mjfCollision& installed = mjCOLLISIONFUNC[mjGEOM_PLANE][type];
    original = installed;
    installed = collide;
  };
  install(mjGEOM_SPHERE, plane_sphere);
  install(mjGEOM_CAPSULE, plane_capsule);
}

GroundInUse::GroundInUse(const GroundLine* line, int floor)
    : line_before_(line_in_use), floor_before_(floor_in_use) {
  line_in_use = line;
  floor_in_use = floor;
}

GroundInUse::~GroundInUse() {
  line_in_use = line_before_;
  floor_in_use = floor_before_;
}

}  // namespace walker::mujoco

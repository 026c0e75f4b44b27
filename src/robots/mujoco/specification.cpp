// Specification of a planar robot, read from the compiled model.
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "base/engine_release.h"
#include "base/random.h"
#include "base/state_bytes.h"
#include "robots/mujoco/lidar.h"
#include "robots/mujoco/planar_robot.h"

namespace walker::mujoco {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Pose to_pose(const Frame& frame) {
  return mujoco::to_pose(frame.position.data(), frame.quaternion.data());
}

std::vector<int> bodies_of(const mjModel& model, int carrier) {
  std::vector<int> bodies;
  for (int body = 0; body < model.nbody; ++body) {
    if (carrier_of(model, body) == carrier) bodies.push_back(body);
  }
  return bodies;
}

/// Returns the frame of a body's centre of mass and principal axes.
Frame inertial_frame(const mjModel& model, int carrier, int body) {
  return compose(frame_in(model, carrier, body), frame_at(model.body_ipos, model.body_iquat, body));
}

void read_mass(const mjModel& model, int carrier, Link& link) {
  const std::vector<int> bodies = bodies_of(model, carrier);
  for (const int body : bodies) {
    const Frame frame = inertial_frame(model, carrier, body);
    link.mass += model.body_mass[body];
    for (std::size_t k = 0; k < 3; ++k) {
      link.center_of_mass[k] += model.body_mass[body] * frame.position[k];
    }
  }
  if (link.mass > 0) {
    for (double& coordinate : link.center_of_mass) coordinate /= link.mass;
  }
  // Rotates the inertias to the link's axes and moves them to the common centre of mass (Steiner).
  std::array<std::array<double, 3>, 3> tensor{};
  for (const int body : bodies) {
    const Frame frame = inertial_frame(model, carrier, body);
    std::array<mjtNum, 9> rotation{};
    mju_quat2Mat(rotation.data(), frame.quaternion.data());
    const mjtNum* const principal = at(model.body_inertia, body, 3);
    Vector3 arm{};
    for (std::size_t k = 0; k < 3; ++k) arm[k] = frame.position[k] - link.center_of_mass[k];
    const double square = arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2];
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) {
          tensor[i][j] += rotation[3 * i + k] * principal[k] * rotation[3 * j + k];
        }
        tensor[i][j] += model.body_mass[body] * ((i == j ? square : 0) - arm[i] * arm[j]);
      }
    }
  }
  // Products of inertia that quarter-turn rotations leave behind are rounding errors.
  constexpr double kRounding = 1e-14;
  const double trace = tensor[0][0] + tensor[1][1] + tensor[2][2];
  const auto product = [&](std::size_t i, std::size_t j) {
    return std::abs(tensor[i][j]) > kRounding * trace ? tensor[i][j] : 0.0;
  };
  link.inertia = {tensor[0][0],  tensor[1][1],  tensor[2][2],
                  product(0, 1), product(0, 2), product(1, 2)};
}

std::optional<Solid> read_solid(const mjModel& model, int carrier, int geom) {
  static const std::map<int, Solid::Kind> kKinds{{mjGEOM_SPHERE, Solid::Kind::sphere},
                                                 {mjGEOM_CAPSULE, Solid::Kind::capsule},
                                                 {mjGEOM_CYLINDER, Solid::Kind::cylinder},
                                                 {mjGEOM_BOX, Solid::Kind::box}};
  const auto kind = kKinds.find(model.geom_type[geom]);
  if (kind == kKinds.end()) return std::nullopt;
  const mjtNum* const size = at(model.geom_size, geom, 3);
  Solid solid;
  solid.kind = kind->second;
  solid.size = {size[0], size[1], size[2]};
  solid.pose = to_pose(geom_frame_in(model, carrier, geom));
  return solid;
}

/// Maximum torque by the control's range and, if limited, the force's range before the gear [N m].
double maximum_effort(const mjModel& model, int actuator) {
  const auto largest = [actuator](const mjtNum* ranges) {
    const mjtNum* const range = at(ranges, actuator, 2);
    return std::max(std::abs(range[0]), std::abs(range[1]));
  };
  const double effort =
      std::abs(effort_per_control(model, actuator)) * largest(model.actuator_ctrlrange);
  if (model.actuator_forcelimited[actuator] == 0) return effort;
  const double gear = at(model.actuator_gear, actuator, 6)[0];
  return std::min(effort, std::abs(gear) * largest(model.actuator_forcerange));
}

std::string body_name(const mjModel& model, int body) {
  const char* const name = mj_id2name(&model, mjOBJ_BODY, body);
  return name != nullptr ? name : "body_" + std::to_string(body);
}

/// Returns mass, shapes and colour of a body and everything fixed to it, in the body's frame. The
/// shapes exclude planes, ellipsoids and meshes.
Link read_link(const mjModel& model, int body) {
  Link link;
  link.name = body_name(model, body);
  read_mass(model, body, link);
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (carrier_of(model, model.geom_bodyid[geom]) != body) continue;
    if (const std::optional<Solid> solid = read_solid(model, body, geom)) {
      if (link.solids.empty()) {
        std::copy_n(at(model.geom_rgba, geom, 4), 4, link.color.begin());
      }
      link.solids.push_back(*solid);
    }
  }
  return link;
}

/// Returns the hinge that an element of the action drives, with its motor.
Joint read_joint(const mjModel& model, const Layout& layout, int action_index) {
  const int index = layout.joints[action_index];
  const int child = layout.limbs[action_index];
  const int parent = carrier_of(model, model.body_parentid[child]);
  const Frame frame = compose(frame_in(model, parent, model.body_parentid[child]),
                              frame_at(model.body_pos, model.body_quat, child));

  Joint joint;
  const char* const name = mj_id2name(&model, mjOBJ_JOINT, index);
  joint.name = name != nullptr ? name : "joint_" + std::to_string(index);
  joint.parent = body_name(model, parent);
  joint.child = body_name(model, child);
  Vector3 arm{};  // from the child's origin to the hinge, in the parent's axes
  mju_rotVecQuat(arm.data(), at(model.jnt_pos, index, 3), frame.quaternion.data());
  mju_rotVecQuat(joint.axis.data(), at(model.jnt_axis, index, 3), frame.quaternion.data());
  Frame in_joint{{}, frame.quaternion};
  for (std::size_t k = 0; k < 3; ++k) {
    joint.origin[k] = frame.position[k] + arm[k];
    in_joint.position[k] = -arm[k];
  }
  // The model's frames apply at the joint's reference angle; turn back to angle 0.
  Frame back;
  mju_axisAngle2Quat(back.quaternion.data(), joint.axis.data(),
                     -model.qpos0[model.jnt_qposadr[index]]);
  joint.child_frame = to_pose(compose(back, in_joint));

  const bool is_limited = model.jnt_limited[index] != 0;
  joint.lower = is_limited ? at(model.jnt_range, index, 2)[0] : -kInfinity;
  joint.upper = is_limited ? at(model.jnt_range, index, 2)[1] : kInfinity;
  joint.maximum_effort = maximum_effort(model, action_index);
  joint.maximum_velocity = kInfinity;
  return joint;
}

void set_spaces(const PlanarOptions& options, const mjModel& model, Specification& specification) {
  const int excluded = options.exclude_current_positions_from_observation ? 1 : 0;
  const auto size = static_cast<std::size_t>(model.nq + model.nv - excluded);
  specification.observation_low.assign(size, -kInfinity);
  specification.observation_high.assign(size, kInfinity);
  if (options.include_lidar_in_observation) {
    specification.observation_low.resize(size + kLidarRays, 0);
    specification.observation_high.resize(size + kLidarRays, 1);
  }
  specification.observation_dtype = "float64";
  for (int i = 0; i < model.nu; ++i) {
    // Gymnasium's action space is float32.
    const mjtNum* const range = at(model.actuator_ctrlrange, i, 2);
    specification.action_low.push_back(double{static_cast<float>(range[0])});
    specification.action_high.push_back(double{static_cast<float>(range[1])});
    specification.effort_per_action.push_back(effort_per_control(model, i));
  }
}

/// Returns a hash of sin, cos and pow of 20,000 arguments each. Some results of each function
/// differ between the variants.
std::uint64_t hash_of_results() {
  constexpr int kArguments = 20000;
  std::uint64_t hash = 0;
  Generator generator(0);
  for (int i = 0; i < kArguments; ++i) {
    const double angle = generator.uniform(-4, 4);
    const double base = generator.uniform(0, 1);
    const double exponent = generator.uniform(0, 4);
    const std::array<double, 3> results{std::sin(angle), std::cos(angle), std::pow(base, exponent)};
    hash = hash * 31 + checksum(reinterpret_cast<const std::byte*>(results.data()), sizeof results);
  }
  return hash;
}

/// Returns the name of the variant of the C library's sin, cos and pow. glibc has one for
/// processors with FMA ("fma") and one for those without ("no fma"), whose results differ in the
/// last bits. Any other library is named by a hash of its results.
std::string name_libm_variant() {
  constexpr std::uint64_t kFma = 0x6de57019e6faba9c;
  constexpr std::uint64_t kNoFma = 0x0a4eadacd8eab543;
  const std::uint64_t hash = hash_of_results();
  if (hash == kFma) return "fma";
  if (hash == kNoFma) return "no fma";
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(hash));
  return digits.data();
}

void set_engine(Specification& specification) {
  static const std::string kLibmVariant = name_libm_variant();
  specification.engine = "MuJoCo";
  specification.engine_version = std::string(mj_versionString()) + " (pinned, mujoco 2.2.2)" +
                                 kLibm + kLibmVariant + kLevels + "lines";
  Dl_info where{};
  if (dladdr(reinterpret_cast<const void*>(&mj_step), &where) != 0 && where.dli_fname != nullptr) {
    specification.engine_path = where.dli_fname;
  }
}

}  // namespace

Specification make_specification(const PlanarOptions& options, const Layout& layout,
                                 const mjModel& model) {
  Specification specification = options.specification;
  specification.dt = model.opt.timestep * options.frame_skip;
  specification.gravity = to_vector3(model.opt.gravity);
  set_spaces(options, model, specification);
  set_engine(specification);
  specification.joints_are_exact = true;
  specification.num_coordinates = static_cast<std::size_t>(model.nq);
  specification.links.push_back(read_link(model, layout.trunk));
  for (int i = 0; i < model.nu; ++i) {
    specification.links.push_back(read_link(model, layout.limbs[i]));
    specification.joints.push_back(read_joint(model, layout, i));
  }
  for (const int foot : layout.feet) specification.contact_links.push_back(body_name(model, foot));
  // Ray 0 points straight down: -Y of the lidar frame, whose Y is up.
  specification.range_finder = {kLidarRays,
                                -M_PI / 2,
                                kLidarIncrement,
                                options.lidar_range,
                                options.include_lidar_in_observation,
                                true};
  return specification;
}

}  // namespace walker::mujoco

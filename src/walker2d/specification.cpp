#include "walker2d/specification.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "walker2d/links.h"

namespace walker::walker2d {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void set_parameters(const Options& options, Specification& specification) {
  const auto list = [](const std::array<double, 2>& range) {
    return std::vector<double>(range.begin(), range.end());
  };
  auto& parameters = specification.parameters;
  if (options.is_v5) {
    parameters.emplace_back("xml_file", options.xml_file);
    parameters.emplace_back("frame_skip", std::int64_t{options.frame_skip});
  }
  parameters.emplace_back("forward_reward_weight", options.reward.forward_reward_weight);
  parameters.emplace_back("ctrl_cost_weight", options.reward.ctrl_cost_weight);
  parameters.emplace_back("healthy_reward", options.reward.healthy_reward);
  parameters.emplace_back("terminate_when_unhealthy", options.reward.terminate_when_unhealthy);
  parameters.emplace_back("healthy_z_range", list(options.healthy_z_range));
  parameters.emplace_back("healthy_angle_range", list(options.healthy_angle_range));
  parameters.emplace_back("reset_noise_scale", options.reset_noise_scale);
  parameters.emplace_back("exclude_current_positions_from_observation",
                          options.exclude_current_positions_from_observation);
  parameters.emplace_back("max_episode_steps", std::int64_t{options.max_episode_steps});
}

void set_spaces(const Options& options, const mjModel& model, Specification& specification) {
  const std::size_t excluded = options.exclude_current_positions_from_observation ? 1 : 0;
  const std::size_t size = 2 * std::size_t{kDegreesOfFreedom} - excluded;
  specification.observation_low.assign(size, -kInfinity);
  specification.observation_high.assign(size, kInfinity);
  specification.observation_dtype = "float64";
  for (int i = 0; i < kJointCount; ++i) {
    // Gymnasium's action space is float32.
    const mjtNum* const range = at(model.actuator_ctrlrange, i, 2);
    specification.action_low.push_back(double{static_cast<float>(range[0])});
    specification.action_high.push_back(double{static_cast<float>(range[1])});
    specification.effort_per_action.push_back(effort_per_control(model, i));
  }
  if (options.is_v5) {
    specification.info_names = {"x_position",  "z_distance_from_origin",
                                "x_velocity",  "reward_forward",
                                "reward_ctrl", "reward_survive"};
  } else {
    specification.info_names = {"x_position", "x_velocity"};
  }
}

void set_engine(Specification& specification) {
  specification.engine = "MuJoCo";
  specification.engine_version = std::string(mj_versionString()) + WALKER_SIM_MUJOCO_ORIGIN;
  Dl_info where{};
  if (dladdr(reinterpret_cast<const void*>(&mj_step), &where) != 0 && where.dli_fname != nullptr) {
    specification.engine_path = where.dli_fname;
  }
}

}  // namespace

Specification make_specification(const Options& options, const Layout& layout,
                                 const mjModel& model) {
  Specification specification;
  specification.id = options.id;
  set_parameters(options, specification);
  specification.dt = model.opt.timestep * options.frame_skip;
  specification.max_episode_steps = options.max_episode_steps;
  specification.reward_threshold = std::numeric_limits<double>::quiet_NaN();
  set_spaces(options, model, specification);
  set_engine(specification);
  specification.joints_are_exact = true;
  specification.links.push_back(read_link(model, layout.trunk));
  for (int i = 0; i < kJointCount; ++i) {
    specification.links.push_back(read_link(model, layout.limbs[i]));
    specification.joints.push_back(read_joint(model, layout, i));
  }
  for (const int foot : layout.feet) specification.contact_links.push_back(body_name(model, foot));
  return specification;
}

void describe_scene(const mjModel& model, const mjData& data, Scene& scene) {
  constexpr double kTile = 0.5;  // [m]
  constexpr std::array<Color, 2> kColors{{{0.85, 0.89, 0.87, 1}, {0.55, 0.65, 0.66, 1}}};
  scene = {};
  const int* const plane = std::find(model.geom_type, model.geom_type + model.ngeom, mjGEOM_PLANE);
  if (plane == model.geom_type + model.ngeom) return;
  const double top = at(data.geom_xpos, static_cast<int>(plane - model.geom_type), 3)[2];
  scene.floor = Floor{top, kTile, kColors};
}

Vector3 to_vector3(const mjtNum* vector) { return {vector[0], vector[1], vector[2]}; }

Pose pose_of_body(const mjData& data, int body) {
  return to_pose(at(data.xpos, body, 3), at(data.xquat, body, 4));
}

bool touches_ground(const mjModel& model, const mjData& data, int body) {
  const auto carrier = [&model](int geom) { return carrier_of(model, model.geom_bodyid[geom]); };
  return std::any_of(data.contact, data.contact + data.ncon, [&](const mjContact& contact) {
    const int first = carrier(contact.geom1);
    const int second = carrier(contact.geom2);
    return contact.exclude == 0 &&
           ((first == body && second == 0) || (first == 0 && second == body));
  });
}

}  // namespace walker::walker2d

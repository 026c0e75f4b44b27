#include "robots/mujoco/specification.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <limits>

#include "base/engine_release.h"
#include "robots/mujoco/links.h"
#include "robots/mujoco/processor.h"
#include "robots/mujoco/sense.h"

namespace walker::mujoco {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void set_spaces(const PlanarOptions& options, const mjModel& model, Specification& specification) {
  const int excluded = options.exclude_current_positions_from_observation ? 1 : 0;
  const auto size = static_cast<std::size_t>(model.nq + model.nv - excluded);
  specification.observation_low.assign(size, -kInfinity);
  specification.observation_high.assign(size, kInfinity);
  specification.observation_dtype = "float64";
  for (int i = 0; i < model.nu; ++i) {
    // Gymnasium's action space is float32.
    const mjtNum* const range = at(model.actuator_ctrlrange, i, 2);
    specification.action_low.push_back(double{static_cast<float>(range[0])});
    specification.action_high.push_back(double{static_cast<float>(range[1])});
    specification.effort_per_action.push_back(effort_per_control(model, i));
  }
}

void set_engine(Specification& specification) {
  specification.engine = "MuJoCo";
  specification.engine_version =
      std::string(mj_versionString()) + " (pinned, mujoco 2.2.2)" + kLibm + libm_variant();
  Dl_info where{};
  if (dladdr(reinterpret_cast<const void*>(&mj_step), &where) != 0 && where.dli_fname != nullptr) {
    specification.engine_path = where.dli_fname;
  }
}

}  // namespace

Specification make_specification(const PlanarOptions& options, const Layout& layout,
                                 const mjModel& model) {
  Specification specification;
  specification.id = options.id;
  specification.parameters = options.parameters;
  specification.info_names = options.info_names;
  specification.dt = model.opt.timestep * options.frame_skip;
  specification.gravity = to_vector3(model.opt.gravity);
  specification.max_episode_steps = options.max_episode_steps;
  specification.reward_threshold = options.reward_threshold;
  set_spaces(options, model, specification);
  set_engine(specification);
  specification.joints_are_exact = true;
  specification.links.push_back(read_link(model, layout.trunk));
  for (int i = 0; i < model.nu; ++i) {
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

}  // namespace walker::mujoco

#include "robots/mujoco/world_physics.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/link_parameters.h"
#include "robots/mujoco/floor.h"
#include "robots/mujoco/level_ground.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {
namespace {

/// A model that shares with another one the arrays that it does not replace.
struct AlteredModel {
  explicit AlteredModel(ModelPointer other) : base(std::move(other)), model(*base) {}

  /// Replaces an array of `model` with the given numbers.
  template <typename Number>
  void replace(Number*& array, const Number* numbers, int size) {
    const auto copy = std::make_shared<std::vector<Number>>(numbers, numbers + size);
    array = copy->data();
    arrays.push_back(copy);
  }

  void scale(mjtNum*& array, int size, double factor) {
    replace(array, array, size);
    std::for_each(array, array + size, [factor](mjtNum& number) { number *= factor; });
  }

  ModelPointer base;
  mjModel model;
  std::vector<std::shared_ptr<void>> arrays;  // replacements
};

/// Sets the floor's friction. A pair of the model that has MuJoCo's friction, the larger one of
/// both geoms, gets it again; one with a friction of its own keeps it.
void set_floor_friction(AlteredModel& altered, double friction) {
  mjModel& model = altered.model;
  altered.replace(model.geom_friction, model.geom_friction, 3 * model.ngeom);
  altered.replace(model.pair_friction, model.pair_friction, 5 * model.npair);
  const int floor = floor_of(model);
  mjtNum& of_floor = at(model.geom_friction, floor, 3)[0];
  for (int pair = 0; pair < model.npair; ++pair) {
    const int first = model.pair_geom1[pair];
    const int second = model.pair_geom2[pair];
    if (first != floor && second != floor) continue;
    const mjtNum of_limb = at(model.geom_friction, first == floor ? second : first, 3)[0];
    mjtNum* const of_pair = at(model.pair_friction, pair, 5);
    if (of_pair[0] != std::max(of_floor, of_limb)) continue;
    std::fill_n(of_pair, 2, std::max(friction, of_limb));
  }
  of_floor = friction;
}

/// Raises the floor, and gives mjData room for contacts with corners.
void prepare_for_level(AlteredModel& altered) {
  constexpr double kHigh = 1e6;  // [m]
  constexpr int kMoreContacts = 32;
  constexpr int kStackPerRow = 200;  // [mjtNum]
  mjModel& model = altered.model;
  const int floor = floor_of(model);
  altered.replace(model.geom_pos, model.geom_pos, 3 * model.ngeom);
  at(model.geom_pos, floor, 3)[2] += kHigh;
  altered.replace(model.geom_sameframe, model.geom_sameframe, model.ngeom);
  model.geom_sameframe[floor] = 0;
  int dim = *std::max_element(model.geom_condim, model.geom_condim + model.ngeom);
  for (int pair = 0; pair < model.npair; ++pair) dim = std::max(dim, model.pair_dim[pair]);
  const int more_rows = kMoreContacts * std::max(2 * (dim - 1), 1);
  model.nconmax += kMoreContacts;
  model.njmax += more_rows;
  model.nstack += kStackPerRow * more_rows;
}

}  // namespace

/// A copy of the base model in which mj_setConst runs: it writes more than what depends on the
/// masses, temporarily even the cameras' modes.
class MassComputation {
 public:
  explicit MassComputation(const mjModel& base)
      : model_(mj_copyModel(nullptr, &base), mj_deleteModel) {
    if (!model_) throw std::runtime_error("MuJoCo could not allocate a model");
    data_ = make_data(*model_);
    mj_setConst(model_.get(), data_.get());
    // An MJCF file may set the statistic, which then does not follow the masses.
    has_fixed_mean_inertia_ = model_->stat.meaninertia != base.stat.meaninertia;
  }

  /// Computes what depends on the masses and inertias of an altered model.
  void run(AlteredModel& altered) {
    mjModel& to = altered.model;
    std::copy_n(to.body_mass, to.nbody, model_->body_mass);
    std::copy_n(to.body_inertia, 3 * to.nbody, model_->body_inertia);
    mj_setConst(model_.get(), data_.get());
    altered.replace(to.body_subtreemass, model_->body_subtreemass, to.nbody);
    altered.replace(to.body_invweight0, model_->body_invweight0, 2 * to.nbody);
    altered.replace(to.dof_invweight0, model_->dof_invweight0, to.nv);
    altered.replace(to.dof_M0, model_->dof_M0, to.nv);
    altered.replace(to.tendon_invweight0, model_->tendon_invweight0, to.ntendon);
    if (!has_fixed_mean_inertia_) to.stat.meaninertia = model_->stat.meaninertia;
  }

 private:
  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  DataPointer data_;
  bool has_fixed_mean_inertia_ = false;
};

std::vector<WorldParameter> physics_parameters(const DampingLimits& damping,
                                               const std::vector<std::string>& bodies,
                                               double push_impulse) {
  constexpr double kOwn = std::numeric_limits<double>::quiet_NaN();
  std::vector<WorldParameter> parameters{
      {"gravity", "m/s^2", "Acceleration of free fall, upwards.", -9.81, -50, 0},
      {"friction_scale", "", "Factor of the friction of every contact.", 1, 0, 10},
      {"motor_strength", "", "Factor of the motors' torques.", 1, 0, 10},
      {"mass_scale", "", "Factor of the masses and inertias of the limbs, not of the rotors.", 1,
       0.1, 10},
      {"joint_damping", "N m s", "Torque against each joint's rotation, per rad/s.",
       damping.default_value, 0, damping.maximum},
      {kFloorFriction, "",
       "Friction of the floor, before friction_scale. A contact has the larger one of the floor's "
       "and the limb's.",
       kOwn, 0, 10},
  };
  for (const std::string& body : bodies) parameters.push_back(mass_parameter(body, 0.1, 20));
  add_force_parameters(bodies, push_impulse, parameters);
  for (WorldParameter& parameter : parameters) parameter.can_change = true;
  return parameters;
}

bool operator==(const WorldPhysics& a, const WorldPhysics& b) {
  return a.gravity == b.gravity && a.joint_damping == b.joint_damping &&
         a.friction_scale == b.friction_scale && a.motor_strength == b.motor_strength &&
         a.mass_scale == b.mass_scale && a.has_level == b.has_level &&
         a.floor_friction == b.floor_friction && a.masses == b.masses;
}

WorldPhysics physics_of(const WorldValues& values) {
  const auto optional = [&values](const char* name) {
    const auto found = values.find(name);
    return found == values.end() ? std::nullopt : std::optional<double>(found->second);
  };
  WorldPhysics physics;
  if (values.empty()) return physics;
  physics.gravity = optional("gravity");
  physics.joint_damping = optional("joint_damping");
  physics.floor_friction = optional(kFloorFriction);
  const std::string end = mass_name("");
  for (const auto& [name, value] : values) {
    const std::size_t size = name.size() - std::min(name.size(), end.size());
    if (name.compare(size, end.size(), end) == 0) physics.masses[name.substr(0, size)] = value;
  }
  physics.friction_scale = value_or(values, "friction_scale", physics.friction_scale);
  physics.motor_strength = value_or(values, "motor_strength", physics.motor_strength);
  physics.mass_scale = value_or(values, "mass_scale", physics.mass_scale);
  physics.has_level = level_of(values).has_value();
  return physics;
}

WorldModels::WorldModels(ModelPointer base)
    : base_(std::move(base)),
      mass_computations_(shared_by_users_of<ModelPool<MassComputation>>(base_)),
      last_model_(base_) {}

ModelPointer WorldModels::model_of(const WorldPhysics& physics) {
  if (physics == last_physics_) return last_model_;
  const auto altered = std::make_shared<AlteredModel>(base_);
  mjModel& model = altered->model;
  bool is_altered = false;
  if (physics.gravity.value_or(model.opt.gravity[2]) != model.opt.gravity[2]) {
    model.opt.gravity[2] = *physics.gravity;
    is_altered = true;
  }
  if (physics.floor_friction) {
    set_floor_friction(*altered, *physics.floor_friction);
    is_altered = true;
  }
  if (physics.friction_scale != 1) {
    altered->scale(model.geom_friction, 3 * model.ngeom, physics.friction_scale);
    altered->scale(model.pair_friction, 5 * model.npair, physics.friction_scale);
    is_altered = true;
  }
  if (physics.motor_strength != 1) {
    altered->scale(model.actuator_gear, 6 * model.nu, physics.motor_strength);
    is_altered = true;
  }
  if (physics.joint_damping) {
    altered->replace(model.dof_damping, base_->dof_damping, model.nv);
    std::fill(model.dof_damping + kBaseJoints, model.dof_damping + model.nv,
              *physics.joint_damping);
    is_altered |= !std::equal(model.dof_damping, model.dof_damping + model.nv, base_->dof_damping);
  }
  if (physics.mass_scale != 1) {
    altered->scale(model.body_mass, model.nbody, physics.mass_scale);
    altered->scale(model.body_inertia, 3 * model.nbody, physics.mass_scale);
    ModelPool<MassComputation>::Loan(*mass_computations_)->run(*altered);
    is_altered = true;
  }
  if (!physics.masses.empty()) {
    altered->replace(model.body_mass, model.body_mass, model.nbody);
    for (const auto& [body, mass] : physics.masses) {
      model.body_mass[mj_name2id(&model, mjOBJ_BODY, body.c_str())] = mass;
    }
    is_altered = true;
  }
  if (physics.has_level) {
    prepare_for_level(*altered);
    is_altered = true;
  }
  last_model_ = is_altered ? ModelPointer(altered, &model) : base_;
  last_physics_ = physics;
  return last_model_;
}

}  // namespace walker::mujoco

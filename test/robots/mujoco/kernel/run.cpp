#include "robots/mujoco/kernel/run.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <utility>

#include "robots/hopper/registration.h"
#include "robots/mujoco/planar_model.h"
#include "robots/mujoco/random_level.h"
#include "robots/mujoco/world_physics.h"
#include "robots/walker2d/registration.h"
#include "walker_sim/agent.h"
#include "walker_sim/registry.h"

namespace walker::mujoco::kernel {
namespace {

constexpr std::size_t kInstances = 61;  // prime, so that the last vector is never full
constexpr int kFrames = 4;

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

struct Mode {
  std::function<void(const mjModel&, Random&, mjData&)> begin;
  std::function<void(const mjModel&, Random&, std::size_t instance, mjData&)> drive;
  std::function<bool(const TestedRobot&, Random&, double height, double pitch)> ends;
};

void begin_near_standing(const mjModel& model, Random& random, mjData& data) {
  for (int i = 0; i < model.nv; ++i) {
    data.qpos[i] += uniform(random, -0.005, 0.005);
    data.qvel[i] = uniform(random, -0.005, 0.005);
  }
}

void begin_fast(const mjModel& model, Random& random, mjData& data) {
  begin_near_standing(model, random, data);
  for (int i = 0; i < model.nv; ++i) {
    if (i > 2) data.qpos[i] += uniform(random, -0.5, 0.5);
    data.qvel[i] = uniform(random, -10, 10);
  }
}

/// Denormal offsets and velocities; some velocities are -0, which a user may set as well.
void begin_tiny(const mjModel& model, Random& random, mjData& data) {
  for (int i = 0; i < model.nv; ++i) {
    data.qpos[i] += random() % 3 == 0 ? 0 : uniform(random, -1e-308, 1e-308);
    data.qvel[i] = random() % 3 == 0 ? -0.0 : uniform(random, -1e-308, 1e-308);
  }
}

void begin_anywhere(const mjModel& model, Random& random, double largest_power, mjData& data) {
  const double speed = std::pow(10.0, uniform(random, -3.5, largest_power));
  for (int i = 0; i < model.nv; ++i) {
    data.qpos[i] = i == 1 ? uniform(random, -1.25, 1.25) : uniform(random, -2, 2);
    data.qvel[i] = speed * uniform(random, -1, 1);
  }
}

void drive_randomly(const mjModel& model, Random& random, std::size_t /*instance*/, mjData& data) {
  std::generate_n(data.ctrl, model.nu, [&] { return uniform(random, -1, 1); });
}

void drive_hard(const mjModel& model, Random& random, std::size_t /*instance*/, mjData& data) {
  std::generate_n(data.ctrl, model.nu, [&] {
    const double sign = random() % 2 == 0 ? 1.5 : -1.5;
    return random() % 3 == 0 ? sign * uniform(random, -1, 1) : sign;
  });
}

void drive_symmetrically(const mjModel& model, Random& random, std::size_t instance, mjData& data) {
  for (int motor = 0; motor < 3; ++motor) {
    const double control = instance % 2 == 0 ? static_cast<double>(random() % 3) - 1 : 0;
    for (int leg = 0; leg < model.nu; leg += 3) data.ctrl[leg + motor] = control;
  }
}

/// Adds some noise, because otherwise all instances would walk alike.
void drive_by_gait(const mjModel& model, Random& random, std::size_t /*instance*/, mjData& data) {
  static std::map<int, std::unique_ptr<Agent>> gaits;  // by number of motors
  std::unique_ptr<Agent>& gait = gaits[model.nu];
  if (!gait) {
    const auto environment = make(model.nu == 3 ? "Hopper-v5" : "Walker2d-v5");
    gait = make_agent("heuristic", environment->specification(), 0);
  }
  std::vector<double> observation(data.qpos + 1, data.qpos + model.nq);
  std::transform(data.qvel, data.qvel + model.nv, std::back_inserter(observation),
                 [](double speed) { return std::clamp(speed, -10.0, 10.0); });
  const std::vector<double>& action = gait->act(observation);
  std::transform(action.begin(), action.end(), data.ctrl, [&](double control) {
    return static_cast<float>(control + uniform(random, -0.05, 0.05));
  });
}

bool ends_by_fall(const TestedRobot& robot, Random& random, double height, double pitch) {
  const bool stands = height > robot.lowest && height < 2 && std::abs(pitch) < robot.largest_pitch;
  return !stands || random() % 1000 == 0;
}

bool ends_rarely(const TestedRobot& /*robot*/, Random& random, double /*height*/,
                 double /*pitch*/) {
  return random() % 400 == 0;
}

bool ends_at_once(const TestedRobot& /*robot*/, Random& /*random*/, double /*height*/,
                  double /*pitch*/) {
  return true;
}

const std::map<std::string, Mode>& all_modes() {
  const auto begin_wildly = [](const mjModel& model, Random& random, mjData& data) {
    begin_anywhere(model, random, 3.5, data);
  };
  const auto begin_extremely = [](const mjModel& model, Random& random, mjData& data) {
    begin_anywhere(model, random, 10.5, data);
  };
  static const std::map<std::string, Mode> kModes{
      {"random", {begin_near_standing, drive_randomly, ends_by_fall}},
      {"violent", {begin_fast, drive_hard, ends_by_fall}},
      {"endless", {begin_fast, drive_hard, ends_rarely}},
      {"rest", {[](const mjModel&, Random&, mjData&) {}, drive_symmetrically, ends_rarely}},
      {"tiny", {begin_tiny, drive_symmetrically, ends_rarely}},
      {"wild", {begin_wildly, drive_hard, ends_at_once}},
      {"extreme", {begin_extremely, drive_hard, ends_at_once}},
      {"gait", {begin_near_standing, drive_by_gait, ends_by_fall}},
  };
  return kModes;
}

/// Draws an instance with some of the parameters; half of their values are limits.
WorldValues draw_world(const TestedRobot& robot, Random& random) {
  WorldValues values;
  std::vector<WorldParameter> parameters = find_registration(robot.name + "-v5").world_parameters;
  parameters.erase(parameters.begin(),
                   parameters.begin() + static_cast<std::ptrdiff_t>(level_parameters().size()));
  for (const WorldParameter& parameter : parameters) {
    if (random() % 3 == 0) continue;
    const auto [low, high] = std::pair(parameter.minimum, parameter.maximum);
    if (random() % 2 == 0) {
      values[parameter.name] = uniform(random, low, high);
    } else {
      values[parameter.name] = random() % 2 == 0 ? low : high;
    }
  }
  return values;
}

bool has_warned(const mjData& data) {
  return std::any_of(std::begin(data.warning), std::end(data.warning),
                     [](const mjWarningStat& warning) { return warning.number > 0; });
}

struct Side {
  explicit Side(Contestant who) : contestant(std::move(who)) {
    for (Instance& instance : instances) pointers.push_back(&instance);
  }

  Contestant contestant;
  std::vector<Instance> instances = std::vector<Instance>(kInstances);
  std::vector<Instance*> pointers;
  Tally tally;
};

class Run {
 public:
  Run(const std::vector<Contestant>& all, const std::string& xml_file, const Mode& mode,
      Instances instances)
      : robot_(robot_of(xml_file)),
        models_(load_model(xml_file)),
        model_of_(kInstances, models_.base()),
        values_of_(kInstances, values_of(*models_.base())),
        grounds_(kInstances),
        mode_(mode),
        worlds_(instances) {
    for (const Contestant& contestant : all) {
      sides_.push_back(std::make_unique<Side>(contestant));
    }
    const ModelPointer roomy = models_.model_of(physics_of({{"ground_roughness", 1}}));
    for (std::size_t i = 0; i < kInstances; ++i) {
      data_.push_back(make_data(*roomy));
      begin(i);
    }
  }

  Report run(long steps) {
    while (report_.steps < steps) {
      for (std::size_t i = 0; i < kInstances; ++i) drive(i);
      for (const auto& side : sides_) {
        side->contestant.step(side->pointers.data(), kInstances, kFrames);
      }
      for (std::size_t i = 0; i < kInstances; ++i) step(i);
      report_.steps += kInstances;
    }
    for (const auto& side : sides_) report_.tallies.push_back(side->tally);
    return report_;
  }

 private:
  void begin(std::size_t i) {
    mjData& data = *data_[i];
    WorldValues values;
    if (worlds_ == Instances::altered) values = draw_world(robot_, random_);
    grounds_[i] = nullptr;
    if (worlds_ == Instances::in_levels && random_() % 8 != 0) {
      Generator generator(random_());
      values = random_level(generator);
      grounds_[i] = std::make_unique<LevelGround>(generator, *level_of(values), Point{0, 0});
    }
    model_of_[i] = models_.model_of(physics_of(values));
    values_of_[i] = kernel::values_of(*model_of_[i]);
    mj_resetData(model_of_[i].get(), &data);
    mode_.begin(*model_of_[i], random_, data);
    if (grounds_[i]) {
      data.qpos[0] += uniform(random_, -3, 100);
      data.qpos[1] += grounds_[i]->below(data.qpos[0]).top;
    }
    for (const auto& side : sides_) {
      read_state(*model_of_[i], data, side->instances[i]);
      side->instances[i].values = &values_of_[i];
      side->instances[i].line = line_of(i);
      side->contestant.kernel->start(side->instances[i]);
    }
    const GroundInUse ground(line_of(i));
    mj_forward(model_of_[i].get(), &data);
    compare("start", i);
  }

  const GroundLine* line_of(std::size_t i) const {
    return grounds_[i] ? &grounds_[i]->line() : nullptr;
  }

  void drive(std::size_t i) {
    mjData& data = *data_[i];
    mode_.drive(*model_of_[i], random_, i, data);
    const bool has_push = worlds_ == Instances::altered && random_() % 4 == 0;
    for (int k = 0; k < 2; ++k) data.qfrc_applied[k] = has_push ? uniform(random_, -2e4, 2e4) : 0;
    for (const auto& side : sides_) {
      Instance& instance = side->instances[i];
      std::copy_n(data.qfrc_applied, 2, instance.push.begin());
      for (int motor = 0; motor < model_of_[i]->nu; ++motor) {
        const double gear = at(model_of_[i]->actuator_gear, motor, 6)[0];
        instance.torque[motor] = gear * std::clamp(data.ctrl[motor], -1.0, 1.0);
      }
    }
  }

  void step(std::size_t i) {
    mjData& data = *data_[i];
    const mjModel* const model = model_of_[i].get();
    const GroundInUse ground(line_of(i));
    bool limbs_touch = false;
    for (int frame = 0; frame < kFrames; ++frame) {
      mj_step(model, &data);
      report_.most_contacts = std::max(report_.most_contacts, data.ncon);
      limbs_touch |= std::any_of(data.contact, data.contact + data.ncon,
                                 [](const mjContact& contact) { return contact.geom1 != 0; });
    }
    report_.steps_with_limb_contacts += limbs_touch ? 1 : 0;
    // LibraryPhysics also checks after the last step.
    mj_checkPos(model, &data);
    mj_checkVel(model, &data);
    compare("step", i);
    report_.warnings += has_warned(data) ? 1 : 0;
    const double ground_z = grounds_[i] ? grounds_[i]->below(data.qpos[0]).ground : 0;
    const bool ends = mode_.ends(robot_, random_, data.qpos[1] - ground_z, data.qpos[2]);
    if (has_warned(data) || ends) begin(i);
  }

  void compare(const char* what, std::size_t i) {
    const mjData& data = *data_[i];
    for (const auto& side : sides_) {
      Instance& instance = side->instances[i];
      Tally& tally = side->tally;
      if (instance.is_flagged) {
        ++tally.flagged;
      } else if (has_warned(data)) {
        ++tally.missed;
      } else if (!has_state(*model_of_[i], instance, data)) {
        if (tally.different++ == 0) tally.first_different = describe(what, instance, data);
      } else {
        continue;
      }
      read_state(*model_of_[i], data, instance);
    }
  }

  std::string describe(const char* what, const Instance& instance, const mjData& data) const {
    std::ostringstream text;
    text << what << " after " << report_.steps << ", " << data.ncon << " contacts, " << data.nefc
         << " rows:" << std::hexfloat;
    for (int k = 0; k < models_.base()->nv; ++k) {
      text << "\n  " << instance.position[k] << " " << data.qpos[k] << "  " << instance.velocity[k]
           << " " << data.qvel[k] << "  " << instance.warm_start[k] << " "
           << data.qacc_warmstart[k];
    }
    return text.str();
  }

  const TestedRobot& robot_;
  WorldModels models_;
  std::vector<ModelPointer> model_of_;                 // per instance
  std::vector<ModelValues<double>> values_of_;         // per instance
  std::vector<std::unique_ptr<LevelGround>> grounds_;  // per instance; null: the floor is flat
  const Mode& mode_;
  Instances worlds_;
  Random random_{11};
  std::vector<std::unique_ptr<Side>> sides_;
  std::vector<DataPointer> data_;
  Report report_;
};

}  // namespace

const std::vector<TestedRobot>& robots() {
  static const std::vector<TestedRobot> kRobots{{"Hopper", hopper::kernels(), 0.7, 0.2, true},
                                                {"Walker2d", walker2d::kernels(), 0.8, 1, false}};
  return kRobots;
}

const TestedRobot& robot_of(const std::string& xml_file) {
  return robots().at(xml_file.rfind("hopper", 0) == 0 ? 0 : 1);
}

std::vector<Contestant> contestants(const TestedRobot& robot) {
  std::vector<Contestant> all;
  for (const Kernel* kernel : robot.kernels.usable) {
    const std::string name = kernel->instruction_set;
    all.push_back({name, kernel, kernel->step});
    all.push_back({name + ", one instance at a time", kernel, kernel->step_singly});
  }
  return all;
}

const std::vector<std::string>& modes() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const auto& [name, mode] : all_modes()) names.push_back(name);
    return names;
  }();
  return kNames;
}

Report run(const std::vector<Contestant>& contestants, const std::string& xml_file,
           const std::string& mode, Instances instances, long steps) {
  return Run(contestants, xml_file, all_modes().at(mode), instances).run(steps);
}

}  // namespace walker::mujoco::kernel

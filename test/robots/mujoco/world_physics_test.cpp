// Models of worlds: which numbers they have, and that these are the compiler's.
#include "robots/mujoco/world_physics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "bits.h"
#include "robots/mujoco/floor.h"
#include "robots/mujoco/level_ground.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/planar_model.h"
#include "walker_sim/registry.h"

namespace walker::mujoco {
namespace {

const char* const kBuiltin[] = {"walker2d_v4.xml", "walker2d_v5.xml", "hopper_v4.xml",
                                "hopper_v5.xml"};

ModelPointer model_of(const std::string& xml_file, const WorldValues& world) {
  return WorldModels(load_model(xml_file)).model_of(physics_of(world));
}

using Numbers = std::vector<double>;

Numbers scaled(const mjtNum* numbers, std::size_t size, double factor) {
  Numbers result(numbers, numbers + size);
  for (double& number : result) number *= factor;
  return result;
}

/// Everything that mj_step reads and a world may change.
std::vector<std::pair<std::string, Numbers>> values_in(const mjModel& m) {
  const auto all = [](const mjtNum* numbers, int size) { return scaled(numbers, size, 1); };
  return {{"gravity", all(m.opt.gravity, 3)},
          {"meaninertia", {m.stat.meaninertia}},
          {"qpos0", all(m.qpos0, m.nq)},
          {"body_mass", all(m.body_mass, m.nbody)},
          {"body_inertia", all(m.body_inertia, 3 * m.nbody)},
          {"body_subtreemass", all(m.body_subtreemass, m.nbody)},
          {"body_invweight0", all(m.body_invweight0, 2 * m.nbody)},
          {"dof_invweight0", all(m.dof_invweight0, m.nv)},
          {"dof_M0", all(m.dof_M0, m.nv)},
          {"dof_damping", all(m.dof_damping, m.nv)},
          {"dof_armature", all(m.dof_armature, m.nv)},
          {"tendon_invweight0", all(m.tendon_invweight0, m.ntendon)},
          {"geom_friction", all(m.geom_friction, 3 * m.ngeom)},
          {"pair_friction", all(m.pair_friction, 5 * m.npair)},
          {"actuator_gear", all(m.actuator_gear, 6 * m.nu)}};
}

void expect_same_values(const mjModel& actual, const mjModel& expected) {
  const auto expected_values = values_in(expected);
  std::size_t i = 0;
  for (const auto& [name, numbers] : values_in(actual)) {
    EXPECT_EQ(to_bits(numbers), to_bits(expected_values[i++].second)) << name;
  }
}

TEST(WorldPhysicsTest, ParametersAreListed) {
  for (const std::string id : {"Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5"}) {
    const Registration& registration = find_registration(id);
    const ModelPointer model =
        load_model((id[0] == 'W' ? "walker2d_" : "hopper_") + id.substr(id.size() - 2) + ".xml");
    double mass = 0;
    for (int body = 0; body < model->nbody; ++body) mass += model->body_mass[body];
    EXPECT_NEAR(registration.push_impulse / mass, 0.5, 0.02) << id << ": " << mass << " kg";
    std::vector<std::string> names;
    WorldValues defaults;
    for (const WorldParameter& parameter : registration.world_parameters) {
      names.push_back(parameter.name);
      if (names.size() <= level_parameters().size()) continue;  // ground_test.cpp has the level's
      defaults[parameter.name] = parameter.default_value;
      EXPECT_FALSE(parameter.is_whole);
      if (std::isnan(parameter.default_value)) {
        defaults.erase(parameter.name);
        continue;
      }
      EXPECT_LE(parameter.minimum, parameter.default_value);
      EXPECT_LE(parameter.default_value, parameter.maximum);
    }
    constexpr int kFirstBody = 16;
    std::vector<std::string> expected{
        "ground_roughness", "pit_gap",          "stump_width",   "stump_height",
        "stump_float",      "stair_width",      "stair_height",  "stair_steps",
        "stair_steps_vary", "obstacle_spacing", "gravity",       "friction_scale",
        "motor_strength",   "mass_scale",       "joint_damping", "floor_friction",
        "torso_mass",       "thigh_mass",       "leg_mass",      "foot_mass"};
    if (id[0] == 'W') {
      expected.insert(expected.end(), {"thigh_left_mass", "leg_left_mass", "foot_left_mass"});
    }
    const std::vector<std::string> bodies(expected.begin() + kFirstBody, expected.end());
    for (const std::string& name : bodies) {
      const std::string body = name.substr(0, name.rfind('_'));
      for (const char* force : {"_force_x", "_force_z"}) expected.push_back(body + force);
    }
    expected.insert(expected.end(), {"lidar_range", "range_noise"});
    EXPECT_EQ(names, expected);
    EXPECT_EQ(WorldModels(model).model_of(physics_of(defaults)), model)
        << id << ": the defaults are the model's own";
  }
}

TEST(WorldPhysicsTest, WorldsWithoutPhysicsShareTheModel) {
  const ModelPointer model = load_model("walker2d_v5.xml");
  WorldModels models(model);
  EXPECT_EQ(models.model_of({}), model);
  EXPECT_EQ(models.model_of(physics_of({{"push_interval", 1}, {"joint_position_noise", 1}})),
            model);
  const WorldPhysics moon = physics_of({{"gravity", -1.62}});
  const ModelPointer on_moon = models.model_of(moon);
  EXPECT_NE(on_moon, model);
  EXPECT_EQ(models.model_of(moon), on_moon) << "the last one is kept";
  EXPECT_EQ(models.model_of({}), model);
  EXPECT_EQ(model->opt.gravity[2], -9.81);
}

/// mj_setConst gives the compiler's numbers, so that a mass_scale of 1 could use it as well.
TEST(WorldPhysicsTest, SetConstChangesNoBit) {
  for (const char* file : kBuiltin) {
    const ModelPointer model = load_model(file);
    const std::unique_ptr<mjModel, void (*)(mjModel*)> copy(mj_copyModel(nullptr, model.get()),
                                                            mj_deleteModel);
    const DataPointer data = make_data(*model);
    mj_setConst(copy.get(), data.get());
    expect_same_values(*copy, *model);
    EXPECT_EQ(fingerprint(*copy), fingerprint(*model)) << file;
  }
}

/// Each parameter changes what it names, and with the masses what depends on them.
TEST(WorldPhysicsTest, EachParameterChangesItsFields) {
  const Folder folder;
  for (const std::string& file : {std::string("walker2d_v5.xml"), std::string("hopper_v4.xml"),
                                  folder.write("other.xml", other_walker_text())}) {
    const ModelPointer model = load_model(file);
    const auto changed = [&](const WorldValues& world) {
      const ModelPointer altered = model_of(file, world);
      const auto before = values_in(*model);
      std::vector<std::string> names;
      std::size_t i = 0;
      for (const auto& [name, numbers] : values_in(*altered)) {
        if (to_bits(numbers) != to_bits(before[i++].second)) names.push_back(name);
      }
      return names;
    };
    using Names = std::vector<std::string>;
    EXPECT_EQ(changed({{"gravity", -5}}), Names{"gravity"});
    EXPECT_EQ(changed({{"joint_damping", 3}}), Names{"dof_damping"});
    EXPECT_EQ(changed({{"motor_strength", 2}}), Names{"actuator_gear"});
    EXPECT_EQ(changed({{"friction_scale", 2}}), model->npair > 0
                                                    ? (Names{"geom_friction", "pair_friction"})
                                                    : Names{"geom_friction"});
    EXPECT_EQ(changed({{"mass_scale", 2}}),
              (Names{"meaninertia", "body_mass", "body_inertia", "body_subtreemass",
                     "body_invweight0", "dof_invweight0", "dof_M0"}));
    const ModelPointer altered = model_of(file, {{"gravity", -5},
                                                 {"joint_damping", 3},
                                                 {"motor_strength", 2.1},
                                                 {"friction_scale", 0.7},
                                                 {"mass_scale", 1.3}});
    EXPECT_EQ(altered->opt.gravity[2], -5);
    for (int dof = 0; dof < model->nv; ++dof) {
      EXPECT_EQ(altered->dof_damping[dof], dof < kBaseJoints ? model->dof_damping[dof] : 3);
    }
    const std::map<std::string, double> factors{{"actuator_gear", 2.1},
                                                {"geom_friction", 0.7},
                                                {"pair_friction", 0.7},
                                                {"body_mass", 1.3},
                                                {"body_inertia", 1.3}};
    const auto values = values_in(*model);
    std::size_t i = 0;
    for (const auto& [name, numbers] : values_in(*altered)) {
      const Numbers& before = values[i++].second;
      if (factors.count(name) == 0) continue;
      EXPECT_EQ(numbers, scaled(before.data(), before.size(), factors.at(name))) << name;
    }
  }
}

/// MuJoCo's contacts have the larger one of two frictions; the models' pairs spell it out.
TEST(WorldPhysicsTest, FloorFrictionIsThatOfTheFloorsContacts) {
  for (const char* file : kBuiltin) {
    for (const double friction : {0.1, 0.8, 1.5, 3.0}) {
      const ModelPointer model = model_of(file, {{"floor_friction", friction}});
      const int floor = floor_of(*model);
      int count = 0;
      for (int pair = 0; pair < model->npair; ++pair) {
        const int limb = model->pair_geom2[pair];
        if (model->pair_geom1[pair] != floor) continue;
        ++count;
        const double expected = std::max(friction, at(model->geom_friction, limb, 3)[0]);
        EXPECT_EQ(at(model->pair_friction, pair, 5)[0], expected);
        EXPECT_EQ(at(model->pair_friction, pair, 5)[1], expected);
      }
      EXPECT_EQ(count, model->nbody - 1) << "each limb";
      EXPECT_EQ(at(model->geom_friction, floor, 3)[0], friction);
    }
  }
}

/// Alone, and whatever mass_scale is.
TEST(WorldPhysicsTest, AMassIsThatOfItsBodyAlone) {
  const ModelPointer model = load_model("walker2d_v5.xml");
  for (const double scale : {1.0, 2.0}) {
    const WorldValues scaled{{"mass_scale", scale}};
    const ModelPointer expected = model_of("walker2d_v5.xml", scaled);
    const auto values = values_in(*expected);
    WorldValues world = scaled;
    world["thigh_left_mass"] = 5;
    const ModelPointer altered = model_of("walker2d_v5.xml", world);
    const int body = mj_name2id(altered.get(), mjOBJ_BODY, "thigh_left");
    std::size_t i = 0;
    for (const auto& [name, numbers] : values_in(*altered)) {
      Numbers before = values[i++].second;
      if (name == "body_mass") before.at(static_cast<std::size_t>(body)) = 5;
      EXPECT_EQ(to_bits(numbers), to_bits(before)) << name;
    }
  }
}

/// The model of a world against MJCF with the same numbers. The factors are powers of two, with
/// which the compiler's numbers are exact multiples.
TEST(WorldPhysicsTest, HasTheCompilersNumbers) {
  const Folder folder;
  constexpr const char* kWalker = "walker2d_v5.xml";
  constexpr const char* kHopper = "hopper_v5.xml";
  const std::string walker = builtin_text(kWalker);
  const std::string hopper = builtin_text(kHopper);
  const struct {
    const char* model;
    WorldValues world;
    std::string text;
  } cases[] = {
      {kHopper, {{"gravity", -3.7}}, replaced(hopper, "<option", "<option gravity='0 0 -3.7'")},
      {kHopper, {{"joint_damping", 0.75}}, replaced(hopper, "damping=\"1\"", "damping='0.75'")},
      {kHopper, {{"motor_strength", 1.5}}, replaced(hopper, "gear=\"200\"", "gear='300'")},
      {kHopper, {{"mass_scale", 2}}, replaced(hopper, "<geom type", "<geom density='2000' type")},
      {kWalker, {{"gravity", -3.7}}, replaced(walker, "<option", "<option gravity='0 0 -3.7'")},
      {kWalker, {{"joint_damping", 0.75}}, replaced(walker, "damping=\"0.1\"", "damping='0.75'")},
      {kWalker, {{"motor_strength", 1.5}}, replaced(walker, "gear=\"100\"", "gear='150'")},
      {kWalker, {{"mass_scale", 4}}, replaced(walker, "density=\"1000\"", "density='4000'")},
      {kWalker, {{"mass_scale", 0.25}}, replaced(walker, "density=\"1000\"", "density='250'")},
      {kWalker,
       {{"friction_scale", 0.5}},
       replaced(
           replaced(replaced(replaced(replaced(walker, "\"0.9 0.1 0.1\"", "\"0.45 0.05 0.05\""),
                                      "\"0.7 0.1 0.1\"", "\"0.35 0.05 0.05\""),
                             "\"1.9 0.1 0.1\"", "\"0.95 0.05 0.05\""),
                    "\"0.9 0.9 0.1 0.1 0.1\"", "\"0.45 0.45 0.05 0.05 0.05\""),
           "\"1.9 1.9 0.1 0.1 0.1\"", "\"0.95 0.95 0.05 0.05 0.05\"")},
  };
  for (const auto& [model, world, altered_text] : cases) {
    SCOPED_TRACE(model + (" " + world.begin()->first));
    const std::string file = folder.write(world.begin()->first + model, altered_text);
    expect_same_values(*model_of(model, world), *load_model(file));
  }
}

/// An MJCF file may fix the mean inertia, by which the solver scales its tolerance.
TEST(WorldPhysicsTest, KeepsAFixedMeanInertia) {
  const Folder folder;
  const std::string text = replaced(builtin_text("hopper_v5.xml"), "<worldbody>",
                                    "<statistic meaninertia=\"7\"/>\n<worldbody>");
  const std::string file = folder.write("fixed.xml", text);
  EXPECT_EQ(model_of(file, {{"mass_scale", 2}})->stat.meaninertia, 7);
  const std::string heavy = folder.write(
      "heavy.xml",
      replaced(text, "<geom type=\"capsule\"", "<geom density=\"2000\" type=\"capsule\""));
  expect_same_values(*model_of(file, {{"mass_scale", 2}}), *load_model(heavy));
}

}  // namespace
}  // namespace walker::mujoco

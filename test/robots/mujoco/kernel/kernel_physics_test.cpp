// A walker stepped by the kernel against one stepped by the library, in all observable values.
#include "robots/mujoco/kernel/kernel_physics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "error_message.h"
#include "kernel_variable.h"
#include "robots/mujoco/kernel/run.h"
#include "robots/mujoco/level_ground.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/world_physics.h"
#include "saved_states.h"

namespace walker::mujoco::kernel {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using State = std::vector<double>;

std::string stepper_of(const Stepper& walker) {
  const std::string& version = walker.environment->specification().engine_version;
  return version.substr(version.find(", stepped by "));
}

State senses(Environment& environment) {
  State all = look_at(environment);
  Scene scene;
  environment.scene(scene);
  for (const ScenePolygon& piece : scene.ground) all.push_back(piece.points[1][1]);
  return all;
}

void expect_same(Stepper& one, Stepper& other) {
  ASSERT_EQ(to_bits(one.row()), to_bits(other.row()));
  ASSERT_STREQ(one.result.end_reason, other.result.end_reason);
  ASSERT_STREQ(one.result.error, other.result.error);
}

/// Compares an environment stepped by the kernel with one stepped by the library.
template <typename Act>
void compare(const char* id, const Parameters& parameters, int episodes, int steps, const Act& act,
             const walker::World& world = {}) {
  Stepper one = make_by(nullptr, id, parameters);
  Stepper other = make_by("off", id, parameters);
  one.environment->set_world(world);
  other.environment->set_world(world);
  for (int episode = 0; episode < episodes; ++episode) {
    SCOPED_TRACE("episode " + std::to_string(episode));
    const std::optional<std::uint64_t> seed =
        episode % 2 == 0 ? std::optional<std::uint64_t>(episode) : std::nullopt;
    one.reset(seed);
    other.reset(seed);
    ASSERT_NO_FATAL_FAILURE(expect_same(one, other));
    for (int i = 0; i < steps && !one.has_ended(); ++i) {
      SCOPED_TRACE("step " + std::to_string(i));
      if (i % 7 == 0) {
        ASSERT_EQ(to_bits(senses(*one.environment)), to_bits(senses(*other.environment)));
      }
      const State action = act(one);
      one.step(action);
      other.step(action);
      ASSERT_NO_FATAL_FAILURE(expect_same(one, other));
    }
  }
}

class EnvironmentTest : public testing::TestWithParam<const char*> {
 protected:
  std::mt19937_64 random_{5};
  std::size_t num_motors_ = make(GetParam())->specification().action_low.size();

  State any_action(double largest) {
    std::uniform_real_distribution<double> unit(-largest, largest);
    State action(num_motors_);
    for (double& value : action) value = double{static_cast<float>(unit(random_))};
    return action;
  }
};

TEST_P(EnvironmentTest, SpecificationNamesTheStepper) {
  EXPECT_EQ(stepper_of(make_by("sse2", GetParam())), ", stepped by the kernel for sse2");
  EXPECT_EQ(stepper_of(make_by("off", GetParam())),
            ", stepped by the library: WALKER_SIM_KERNEL is off");
}

TEST_P(EnvironmentTest, EpisodesInAWorldAreTheSame) {
  walker::World world{{"push_interval", {0.1, 0.3}}, {"joint_velocity_noise", {0.1, 0.1}}};
  for (const WorldParameter& parameter : find_registration(GetParam()).world_parameters) {
    world[parameter.name] = {parameter.minimum, parameter.maximum};
  }
  walker::World flat = world;
  for (const WorldParameter& parameter : level_parameters()) flat.erase(parameter.name);
  for (const walker::World& each : {flat, world}) {
    compare(
        GetParam(), {}, 60, 1000, [&](const Stepper&) { return any_action(1); }, each);
  }
}

TEST_P(EnvironmentTest, ActionsBeyondTheirRangeAreTheSame) {
  int step = 0;
  compare(GetParam(), {{"terminate_when_unhealthy", false}}, 2, 400,
          [&](const Stepper&) { return any_action(++step % 50 == 0 ? 1e30 : 3); });
}

/// Some starts are so extreme that MuJoCo fails; both must then report the same error.
TEST_P(EnvironmentTest, WildStartsAreTheSame) {
  for (const double noise : {0.0, 0.3, 3.0, 1e4, 1e6}) {
    compare(GetParam(), {{"terminate_when_unhealthy", false}, {"reset_noise_scale", noise}}, 20, 5,
            [&](const Stepper&) { return any_action(1); });
  }
}

INSTANTIATE_TEST_SUITE_P(Walkers, EnvironmentTest,
                         testing::Values("Hopper-v4", "Hopper-v5", "Walker2d-v4", "Walker2d-v5"));

TEST(KernelEnvironmentTest, OtherFrameSkipsAreTheSame) {
  for (const auto& [id, num_motors] : {std::pair("Hopper-v5", 3U), {"Walker2d-v5", 6U}}) {
    for (const std::int64_t frames : {1, 3, 17}) {
      compare(id, {{"frame_skip", frames}}, 4, 60,
              [num = num_motors](const Stepper&) { return State(num, 0.5); });
    }
  }
}

class KernelPhysicsTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    const KernelVariable variable(nullptr);
    kernel_ = make_physics(robot_of(GetParam()).kernels, model_);
    library_ = std::make_unique<LibraryPhysics>(model_);
    ASSERT_EQ(kernel_->stepper().rfind("the kernel for ", 0), 0U) << kernel_->stepper();
  }

  void reset(const State& position, const State& velocity) {
    kernel_->reset(position.data(), velocity.data());
    library_->reset(position.data(), velocity.data());
    expect_same_state();
  }

  /// @return message of the exception that both threw, or "nothing thrown"
  std::string step(const State& control, const ExternalForces& forces = {}) {
    const auto words = [&](Physics& physics) {
      return message_of<std::runtime_error>([&] { physics.step(control.data(), forces, 4); });
    };
    const std::string message = words(*kernel_);
    EXPECT_EQ(message, words(*library_));
    expect_same_state();
    return message;
  }

  void expect_same_state() const {
    for (int i = 0; i < size_; ++i) {
      ASSERT_EQ(to_bits(kernel_->position()[i]), to_bits(library_->position()[i])) << i;
      ASSERT_EQ(to_bits(kernel_->velocity()[i]), to_bits(library_->velocity()[i])) << i;
    }
  }

  ModelPointer model_ = load_model(GetParam() + "_v5.xml");
  int size_ = model_->nv;
  int num_motors_ = model_->nu;
  State standing_{model_->qpos0, model_->qpos0 + size_};
  std::unique_ptr<Physics> kernel_;
  std::unique_ptr<Physics> library_;
};

TEST_P(KernelPhysicsTest, KeepsNegativeZeros) {
  State position = standing_;
  for (const std::size_t i : {0U, 2U, 4U}) position[i] = -0.0;
  reset(position, State(size_, -0.0));
  for (int i = 0; i < 100; ++i) step(State(num_motors_, i % 2 == 0 ? 0.0 : -0.0));
}

/// A control beyond 1e10 leaves a step to the library.
TEST_P(KernelPhysicsTest, PushesInStepsOfTheLibrary) {
  reset(standing_, State(size_, 0.1));
  for (int i = 0; i < 20; ++i) {
    step(State(num_motors_, i % 2 == 0 ? 1e11 : 0.1), {{i % 3 == 0 ? 300.0 : 0.0, i % 5 * 100.0}});
  }
}

/// A wrench leaves a step to the library. Nothing of it is left in the next one.
TEST_P(KernelPhysicsTest, WrenchesInSomeSteps) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  reset(standing_, State(size_, 0.1));
  for (int i = 0; i < 60; ++i) {
    std::vector<BodyWrench> wrenches;
    for (int body = 1 + i % 2; body < model_->nbody; body += 2) {
      wrenches.push_back({body, {90 * unit(random), 0, 90 * unit(random)}, {0, unit(random), 0}});
    }
    ExternalForces forces{{i % 4 == 0 ? 100.0 : 0.0, 0}};
    if (i % 3 == 0) forces.wrenches = &wrenches;
    step(State(num_motors_, 0.1), forces);
  }
}

/// The library makes the steps of a symmetric walker, whose velocities are zero.
TEST_P(KernelPhysicsTest, PushesAWalkerAtRest) {
  using Force = std::array<double, 2>;
  for (const Force& force : {Force{500, 0}, {0, 500}, {-1e9, 1e12}}) {
    reset(standing_, State(size_, 0));
    std::string message = "nothing thrown";
    for (int i = 0; i < 20 && message == "nothing thrown"; ++i) {
      message = step(State(num_motors_, 0), i == 5 ? ExternalForces{force} : ExternalForces{});
    }
    EXPECT_EQ(message == "nothing thrown", force[1] < 1e3) << message;
  }
}

/// Also from one world to another in the middle of an episode, as when a state is loaded.
TEST_P(KernelPhysicsTest, StepsEveryWorldsModelAsTheLibrary) {
  WorldModels models(model_);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::mt19937_64 random(1);
  for (const WorldValues& world : std::vector<WorldValues>{{{"gravity", 0}},
                                                           {{"friction_scale", 0}},
                                                           {{"mass_scale", 0.1}},
                                                           {{"torso_mass", 6}, {"leg_mass", 0.1}},
                                                           {{"floor_friction", 4}},
                                                           {},
                                                           {{"motor_strength", 2}},
                                                           {{"joint_damping", 3}}}) {
    const ModelPointer model = models.model_of(physics_of(world));
    kernel_->set_model(model);
    library_->set_model(model);
    EXPECT_EQ(&kernel_->model(), model.get());
    reset(standing_, State(size_, 0.1));
    for (int i = 0; i < 200; ++i) {
      State control(num_motors_);
      for (double& value : control) value = unit(random);
      step(control, {i % 10 == 0 ? 1000 * unit(random) : 0, 0});
    }
  }
}

/// MuJoCo clips large and infinite controls and warns of NaN. The next episode is unaffected.
TEST_P(KernelPhysicsTest, RejectsTheControlsThatTheLibraryRejects) {
  for (const double bad : {kInfinity, -kInfinity, 1e11, kNan}) {
    reset(standing_, State(size_, 0.1));
    EXPECT_EQ(step(State(num_motors_, 0.1)), "nothing thrown");
    State control(num_motors_, 0.1);
    control.back() = bad;
    const bool is_refused = step(control).find("CTRL") != std::string::npos;
    EXPECT_EQ(is_refused, std::isnan(bad)) << bad;
  }
  reset(standing_, State(size_, 0.1));
  EXPECT_EQ(step(State(num_motors_, 1e9)), "nothing thrown");
}

TEST_P(KernelPhysicsTest, RejectsTheStatesThatTheLibraryRejects) {
  for (const double bad : {kNan, kInfinity, 2e10, 1e150}) {
    for (int i = 0; i < size_; ++i) {
      State position = standing_;
      position[i] = bad;
      reset(position, State(size_, 0.1));
      step(State(num_motors_, 0.1));
      State velocity(size_, 0.1);
      velocity[i] = bad;
      reset(standing_, velocity);
      step(State(num_motors_, 0.1));
    }
  }
  reset(standing_, State(size_, 0.1));
  EXPECT_EQ(step(State(num_motors_, 0.1)), "nothing thrown");
}

/// The kernel variable or the model file may change while environments are made.
TEST_P(KernelPhysicsTest, StepsOtherKindsOfWorldsApart) {
  const Kernels& kernels = robot_of(GetParam()).kernels;
  const ModelPointer& model = model_;
  const ModelPointer other_model = load_model(GetParam() + "_v4.xml");
  WorldModels worlds(model);
  const auto make_by_each = [&] {
    std::vector<std::unique_ptr<Physics>> all;
    for (const char* kernel : {"sse2", "off", kernels.usable.front()->instruction_set}) {
      const KernelVariable variable(kernel);
      for (const double mass_scale : {1.0, 1.0, 0.5, 2.0, 3.0}) {
        all.push_back(make_physics(kernels, model));
        all.back()->set_model(worlds.model_of(physics_of({{"mass_scale", mass_scale}})));
      }
      all.push_back(make_physics(kernels, other_model));
    }
    return all;
  };
  const auto together = make_by_each();
  const auto apart = make_by_each();
  const State velocity(size_, 0.3);
  for (const auto* all : {&together, &apart}) {
    for (const auto& physics : *all) physics->reset(model->qpos0, velocity.data());
  }
  const State control(num_motors_, 0.7);
  std::vector<PhysicsCall> calls(together.size());
  for (int step = 0; step < 100; ++step) {
    const std::vector<BodyWrench> wrenches{{2, {50, 0, 20}, {0, 3, 0}}};
    const auto forces_of = [step, &wrenches](std::size_t i) {
      ExternalForces forces{{(i + step) % 3 == 0 ? 200.0 : 0.0, 0}};
      if ((i + step) % 7 == 0) forces.wrenches = &wrenches;
      return forces;
    };
    for (std::size_t i = 0; i < calls.size(); ++i) {
      calls[i] = {together[i].get(), control.data(), forces_of(i), {}};
    }
    together[step % calls.size()]->step_together(calls.data(), calls.size(), 4);
    for (std::size_t i = 0; i < calls.size(); ++i) {
      ASSERT_FALSE(calls[i].failure);
      apart[i]->step(control.data(), forces_of(i), 4);
      for (int k = 0; k < size_; ++k) {
        ASSERT_EQ(to_bits(together[i]->position()[k]), to_bits(apart[i]->position()[k]));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, KernelPhysicsTest, testing::Values("hopper", "walker2d"));

}  // namespace
}  // namespace walker::mujoco::kernel

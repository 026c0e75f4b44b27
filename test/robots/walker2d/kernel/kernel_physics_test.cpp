// A walker stepped by the kernel against one stepped by the library, in all observable values.
#include "robots/walker2d/kernel/kernel_physics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "error_message.h"
#include "kernel_variable.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/world_physics.h"
#include "robots/walker2d/kernel/kernel.h"
#include "saved_states.h"
#include "walker_sim/agent.h"

namespace walker::walker2d {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kSize = 9;
constexpr int kMotors = 6;

using State = std::vector<double>;

std::string stepper_of(const Stepper& walker) {
  const std::string& version = walker.environment->specification().engine_version;
  return version.substr(version.find(", stepped by "));
}

State senses(Environment& environment) {
  State all = look_at(environment);
  Scene scene;
  environment.scene(scene);
  all.push_back(scene.floor->z);
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

  State any_action(double largest) {
    std::uniform_real_distribution<double> unit(-largest, largest);
    State action(kMotors);
    for (double& value : action) value = double{static_cast<float>(unit(random_))};
    return action;
  }
};

TEST_P(EnvironmentTest, SpecificationNamesTheStepper) {
  EXPECT_EQ(stepper_of(make_by("sse2", GetParam())), ", stepped by the kernel for sse2");
  EXPECT_EQ(stepper_of(make_by("off", GetParam())),
            ", stepped by the library: WALKER_SIM_KERNEL is off");
}

TEST_P(EnvironmentTest, RandomEpisodesAreTheSame) {
  compare(GetParam(), {}, 40, 1000, [&](const Stepper&) { return any_action(1); });
}

TEST_P(EnvironmentTest, EpisodesInAWorldAreTheSame) {
  walker::World world{{"push_interval", {0.1, 0.3}}, {"joint_velocity_noise", {0.1, 0.1}}};
  for (const WorldParameter& parameter : find_registration(GetParam()).world_parameters) {
    world[parameter.name] = {parameter.minimum, parameter.maximum};
  }
  compare(
      GetParam(), {}, 60, 1000, [&](const Stepper&) { return any_action(1); }, world);
}

TEST_P(EnvironmentTest, GaitEpisodesAreTheSame) {
  const auto gait = make_agent("heuristic", make(GetParam())->specification(), 0);
  compare(GetParam(), {}, 2, 1000,
          [&](const Stepper& walker) { return gait->act(walker.observation); });
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

INSTANTIATE_TEST_SUITE_P(Walkers, EnvironmentTest, testing::Values("Walker2d-v4", "Walker2d-v5"));

TEST(KernelEnvironmentTest, OtherFrameSkipsAreTheSame) {
  for (const std::int64_t frames : {1, 3, 17}) {
    compare("Walker2d-v5", {{"frame_skip", frames}}, 4, 60,
            [](const Stepper&) { return State(kMotors, 0.5); });
  }
}

class KernelPhysicsTest : public testing::Test {
 protected:
  void SetUp() override {
    const KernelVariable variable(nullptr);
    kernel_ = make_kernel_physics(model_);
    library_ = std::make_unique<mujoco::LibraryPhysics>(model_);
    ASSERT_EQ(kernel_->stepper().rfind("the kernel for ", 0), 0U) << kernel_->stepper();
  }

  void reset(const State& position, const State& velocity) {
    kernel_->reset(position.data(), velocity.data());
    library_->reset(position.data(), velocity.data());
    expect_same_state();
  }

  /// @return message of the exception that both threw, or "nothing thrown"
  std::string step(const State& control, const mujoco::TrunkForce& force = {}) {
    const auto words = [&](mujoco::Physics& physics) {
      return message_of<std::runtime_error>([&] { physics.step(control.data(), force, 4); });
    };
    const std::string message = words(*kernel_);
    EXPECT_EQ(message, words(*library_));
    expect_same_state();
    return message;
  }

  void expect_same_state() const {
    for (int i = 0; i < kSize; ++i) {
      ASSERT_EQ(to_bits(kernel_->position()[i]), to_bits(library_->position()[i])) << i;
      ASSERT_EQ(to_bits(kernel_->velocity()[i]), to_bits(library_->velocity()[i])) << i;
    }
  }

  mujoco::ModelPointer model_ = mujoco::load_model("walker2d_v5.xml");
  State standing_{model_->qpos0, model_->qpos0 + kSize};
  std::unique_ptr<mujoco::Physics> kernel_;
  std::unique_ptr<mujoco::Physics> library_;
};

TEST_F(KernelPhysicsTest, KeepsNegativeZeros) {
  State position = standing_;
  for (const std::size_t i : {0U, 2U, 4U, 8U}) position[i] = -0.0;
  reset(position, State(kSize, -0.0));
  for (int i = 0; i < 100; ++i) step(State(kMotors, i % 2 == 0 ? 0.0 : -0.0));
}

TEST_F(KernelPhysicsTest, KeepsDenormals) {
  reset(standing_, State(kSize, 5e-324));
  for (int i = 0; i < 100; ++i) step(State(kMotors, -1e-310));
}

/// A control beyond 1e10 leaves a step to the library.
TEST_F(KernelPhysicsTest, PushesInStepsOfTheLibrary) {
  reset(standing_, State(kSize, 0.1));
  for (int i = 0; i < 20; ++i) {
    step(State(kMotors, i % 2 == 0 ? 1e11 : 0.1), {i % 3 == 0 ? 300.0 : 0.0, i % 5 * 100.0});
  }
}

/// The library makes the steps of a symmetric walker, whose velocities are zero.
TEST_F(KernelPhysicsTest, PushesAWalkerAtRest) {
  for (const mujoco::TrunkForce& force : {mujoco::TrunkForce{500, 0}, {0, 500}, {-1e9, 1e12}}) {
    reset(standing_, State(kSize, 0));
    std::string message = "nothing thrown";
    for (int i = 0; i < 20 && message == "nothing thrown"; ++i) {
      message = step(State(kMotors, 0), i == 5 ? force : mujoco::TrunkForce{});
    }
    EXPECT_EQ(message == "nothing thrown", force[1] < 1e3) << message;
  }
}

/// Also from one world to another in the middle of an episode, as when a state is loaded.
TEST_F(KernelPhysicsTest, StepsEveryWorldsModelAsTheLibrary) {
  mujoco::WorldModels models(model_);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::mt19937_64 random(1);
  for (const WorldValues& world : std::vector<WorldValues>{{{"gravity", 0}},
                                                           {{"friction_scale", 0}},
                                                           {{"mass_scale", 0.1}},
                                                           {},
                                                           {{"motor_strength", 2}},
                                                           {{"joint_damping", 3}}}) {
    const mujoco::ModelPointer model = models.model_of(mujoco::physics_of(world));
    kernel_->set_model(model);
    library_->set_model(model);
    EXPECT_EQ(&kernel_->model(), model.get());
    reset(standing_, State(kSize, 0.1));
    for (int i = 0; i < 200; ++i) {
      State control(kMotors);
      for (double& value : control) value = unit(random);
      step(control, {i % 10 == 0 ? 1000 * unit(random) : 0, 0});
    }
  }
}

/// MuJoCo clips large and infinite controls and warns of NaN. The next episode is unaffected.
TEST_F(KernelPhysicsTest, RejectsTheControlsThatTheLibraryRejects) {
  for (const double bad : {kInfinity, -kInfinity, 1e11, kNan}) {
    reset(standing_, State(kSize, 0.1));
    EXPECT_EQ(step(State(kMotors, 0.1)), "nothing thrown");
    State control(kMotors, 0.1);
    control[4] = bad;
    const bool is_refused = step(control).find("CTRL") != std::string::npos;
    EXPECT_EQ(is_refused, std::isnan(bad)) << bad;
  }
  reset(standing_, State(kSize, 0.1));
  EXPECT_EQ(step(State(kMotors, 1e9)), "nothing thrown");
}

TEST_F(KernelPhysicsTest, RejectsTheStatesThatTheLibraryRejects) {
  for (const double bad : {kNan, kInfinity, 2e10, 1e150}) {
    for (int i = 0; i < kSize; ++i) {
      State position = standing_;
      position[i] = bad;
      reset(position, State(kSize, 0.1));
      step(State(kMotors, 0.1));
      State velocity(kSize, 0.1);
      velocity[i] = bad;
      reset(standing_, velocity);
      step(State(kMotors, 0.1));
    }
  }
  reset(standing_, State(kSize, 0.1));
  EXPECT_EQ(step(State(kMotors, 0.1)), "nothing thrown");
}

TEST_F(KernelPhysicsTest, MeasuresAsTheLibrary) {
  reset(standing_, State(kSize, 0.5));
  State control(kMotors, 0);
  for (int i = 0; i < 300; ++i) {
    for (int k = 0; k < kMotors; ++k) control[k] = std::sin(0.3 * i + k);
    step(control);
    State seen[2];
    const mujoco::Physics* const both[] = {kernel_.get(), library_.get()};
    for (int side = 0; side < 2; ++side) {
      both[side]->measure([&](const mjData& data) {
        State& all = seen[side];
        all.assign(data.xpos, data.xpos + std::ptrdiff_t{3} * model_->nbody);
        all.insert(all.end(), data.xquat, data.xquat + std::ptrdiff_t{4} * model_->nbody);
        all.insert(all.end(), data.xaxis, data.xaxis + std::ptrdiff_t{3} * model_->njnt);
        all.insert(all.end(), data.qfrc_actuator, data.qfrc_actuator + kSize);
        for (int k = 0; k < data.ncon; ++k) {
          all.push_back(data.contact[k].geom2);
          all.push_back(data.contact[k].dist);
        }
      });
    }
    ASSERT_EQ(to_bits(seen[0]), to_bits(seen[1])) << i;
  }
}

/// The kernel variable or the model file may change while environments are made.
TEST(KernelPhysicsGroupTest, StepsOtherKindsOfWorldsApart) {
  const mujoco::ModelPointer model = mujoco::load_model("walker2d_v5.xml");
  const mujoco::ModelPointer other_model = mujoco::load_model("walker2d_v4.xml");
  mujoco::WorldModels worlds(model);
  const auto make_by_each = [&] {
    std::vector<std::unique_ptr<mujoco::Physics>> all;
    for (const char* kernel : {"sse2", "off", kernels().front()->instruction_set}) {
      const KernelVariable variable(kernel);
      for (const double mass_scale : {1.0, 1.0, 0.5, 2.0, 3.0}) {
        all.push_back(make_kernel_physics(model));
        all.back()->set_model(worlds.model_of(mujoco::physics_of({{"mass_scale", mass_scale}})));
      }
      all.push_back(make_kernel_physics(other_model));
    }
    return all;
  };
  const auto together = make_by_each();
  const auto apart = make_by_each();
  const State velocity(kSize, 0.3);
  for (const auto* all : {&together, &apart}) {
    for (const auto& physics : *all) physics->reset(model->qpos0, velocity.data());
  }
  const State control(kMotors, 0.7);
  std::vector<mujoco::PhysicsCall> calls(together.size());
  for (int step = 0; step < 100; ++step) {
    const auto force_of = [step](std::size_t i) {
      return mujoco::TrunkForce{(i + step) % 3 == 0 ? 200.0 : 0.0, 0};
    };
    for (std::size_t i = 0; i < calls.size(); ++i) {
      calls[i] = {together[i].get(), control.data(), force_of(i), {}};
    }
    together[step % calls.size()]->step_together(calls.data(), calls.size(), 4);
    for (std::size_t i = 0; i < calls.size(); ++i) {
      ASSERT_FALSE(calls[i].failure);
      apart[i]->step(control.data(), force_of(i), 4);
      for (int k = 0; k < kSize; ++k) {
        ASSERT_EQ(to_bits(together[i]->position()[k]), to_bits(apart[i]->position()[k]));
      }
    }
  }
}

}  // namespace
}  // namespace walker::walker2d

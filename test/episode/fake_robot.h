// Robots without an engine.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include "episode/walker.h"
#include "robots/robot.h"

namespace walker {

/// A robot without observations, sensors or saved states. Derived classes fill the specification.
class BareRobot : public Robot {
 public:
  const Specification& specification() const override { return specification_; }
  void set_world(const WorldValues& /*values*/) override {}
  void change_physics(const WorldValues& /*values*/) override {}
  void observe(double* /*observation*/) const override {}
  void observe(const SensorNoise& /*noise*/, double* observation) const override {
    observe(observation);
  }
  void sense(Sensors& /*sensors*/) override {}
  void scene(Scene& /*scene*/) const override {}
  void save(StateWriter& /*writer*/) const override { throw std::logic_error("save"); }
  std::function<void()> load(StateReader& /*reader*/, const WorldValues& /*values*/,
                             bool /*is_alive*/) override {
    throw std::logic_error("load");
  }

 protected:
  Specification specification_;
};

/// A robot of two joints, whose episodes and failures the test controls. The observation is the
/// episode's number and its steps, the reward the action's sum. The info is the seed below 100 that
/// the generator began with; -1 for none and after a step.
class FakeRobot : public BareRobot {
 public:
  explicit FakeRobot(std::uint32_t max_episode_steps = 0) {
    specification_.id = "Fake-v0";
    specification_.max_episode_steps = max_episode_steps;
    specification_.observation_low = {0, 0};
    specification_.action_low = {-1, -1};
    specification_.joints.resize(2);
    specification_.joints[0].name = "hip";
    specification_.joints[1].name = "knee";
    specification_.info_names = {"seed"};
  }

  void reset(Generator& generator, double* info) override {
    if (reset_fails) throw std::runtime_error("no ground");
    ++episode;
    steps = 0;
    info[0] = seed_of(generator);
    generator.random();
  }
  void step(RobotStep& step) override {
    if (step_fails) throw std::runtime_error("the engine gave up");
    ++steps;
    ++all_steps;
    step.reward = step.action[0] + step.action[1];
    step.terminated = steps == length;
    step.end_reason = step.terminated ? "fell" : "";
    step.info[0] = -1;
  }
  void observe(double* observation) const override {
    observation[0] = episode;
    observation[1] = steps;
  }
  void sense(Sensors& /*sensors*/) override { ++num_senses; }

  int length = 1000;  ///< steps of an episode
  bool reset_fails = false;
  bool step_fails = false;
  int episode = 0;
  int steps = 0;
  int all_steps = 0;
  int num_senses = 0;

 private:
  static int seed_of(const Generator& generator) {
    for (int seed = 0; seed < 100; ++seed) {
      if (Generator(static_cast<std::uint64_t>(seed)).state() == generator.state()) return seed;
    }
    return -1;
  }
};

/// Makes walkers for a pool, as the registry does, and keeps pointers to their robots.
template <typename Fake = FakeRobot>
struct Fakes {
  std::unique_ptr<Environment> operator()() {
    auto robot = std::make_unique<Fake>();
    all->push_back(robot.get());
    return std::make_unique<Walker>(std::move(robot));
  }
  Fake& operator[](std::size_t index) const { return *(*all)[index]; }

  std::shared_ptr<std::vector<Fake*>> all = std::make_shared<std::vector<Fake*>>();
};

}  // namespace walker

// The oracle of the promises: robots stepped alone by their plain engine, without the episode, the
// pool, saved states or a kernel. It shares the robots and the effects of worlds with the product.
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/random.h"
#include "episode/checked_world.h"
#include "episode/disturbances.h"
#include "kernel_variable.h"
#include "promises/promises.h"
#include "robots/robot.h"

namespace walker::promises {

/// A robot and its calls since the last reset. Copying replays them.
class Oracle {
 public:
  explicit Oracle(Case one) : case_(std::move(one)) { make_robot(); }
  Oracle(const Oracle& other) : world(other.world), case_(other.case_) {
    make_robot();
    if (!other.has_begun_) return;
    generator_ = std::make_unique<Generator>(other.begin_);
    begin(other.drawn);
    for (std::size_t i = 0; i <= other.actions_.size(); ++i) {
      for (const auto& [step, position, velocity] : other.coordinates_) {
        if (step == i) set_coordinates(position, velocity);
      }
      if (i < other.actions_.size()) step(other.actions_[i].data());
    }
  }
  Oracle& operator=(const Oracle&) = delete;
  ~Oracle() = default;

  const Specification& specification() const { return robot_->specification(); }

  void reset(Seed seed) {
    if (seed) generator_ = std::make_unique<Generator>(*seed);
    begin(world.empty() ? World{} : CheckedWorld(specification(), world).draw(generator_->state()));
  }

  void step(const double* action) {
    actions_.emplace_back(action, action + specification().action_size());
    error.clear();
    RobotStep step;
    step.robot = robot_.get();
    step.action = action;
    step.info = info.data();
    try {
      if (values_->begin_step(num_steps())) {
        robot_->change_physics(values_->present());
        if (disturbances_) disturbances_->set_forces(values_->present());
      }
      if (disturbances_) disturbances_->begin_step(action, num_steps(), step);
      robot_->step(step);
      observe();
      reward = step.reward;
      terminated = step.terminated;
      truncated = num_steps() >= specification().max_episode_steps;
    } catch (const std::exception& thrown) {
      error = thrown.what();
      reward = 0;
      terminated = true;
      std::fill(info.begin(), info.end(), std::numeric_limits<double>::quiet_NaN());
    }
  }

  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity) {
    if (!has_begun_ || !error.empty() || specification().num_coordinates == 0) return;
    try {
      robot_->set_coordinates(position, velocity, info.data());
    } catch (const std::exception&) {
      return;
    }
    coordinates_.emplace_back(actions_.size(), position, velocity);
    if (disturbances_) disturbances_->forget_past();
    observe();
    terminated = truncated = false;
  }

  World world;  // of the resets to come
  World drawn;  // by the present episode
  std::vector<double> observation, info;
  double reward = 0;
  bool terminated = false;
  bool truncated = false;
  std::string error;  // the engine's; empty: it has not failed

 private:
  void make_robot() {
    const KernelVariable off("off");
    const Parameters complete =
        complete_parameters(parameter_descriptions(case_.id), parameters_of(case_));
    robot_ = find_registration(case_.id).create(case_.id, complete);
    observation.resize(specification().observation_size());
    info.resize(specification().info_names.size());
  }

  void begin(const World& drawn_now) {
    begin_ = generator_->state();
    has_begun_ = true;
    drawn = drawn_now;
    values_.emplace(drawn, specification().dt, begin_);
    const WorldValues& values = values_->present();
    actions_.clear();
    coordinates_.clear();
    error.clear();
    terminated = truncated = false;
    robot_->set_world(values);
    disturbances_.reset();
    if (Disturbances::has_any(values)) {
      disturbances_ = std::make_unique<Disturbances>(values, specification(), begin_);
    }
    try {
      robot_->reset(*generator_, info.data());
      observe();
    } catch (const std::exception& thrown) {
      error = thrown.what();
      terminated = true;
    }
  }

  std::uint32_t num_steps() const { return static_cast<std::uint32_t>(actions_.size()); }

  void observe() {
    if (disturbances_) {
      disturbances_->observe(*robot_, num_steps(), observation.data());
    } else {
      robot_->observe(observation.data());
    }
  }

  Case case_;
  std::unique_ptr<Robot> robot_;
  std::optional<EpisodeValues> values_;
  std::unique_ptr<Disturbances> disturbances_;
  std::unique_ptr<Generator> generator_;
  GeneratorState begin_{};  // before the reset
  bool has_begun_ = false;
  std::vector<std::vector<double>> actions_;  // since the reset
  /// Steps after which coordinates were set, positions and velocities.
  std::vector<std::tuple<std::size_t, std::vector<double>, std::vector<double>>> coordinates_;
};

class Oracles final : public SingleWalkers {
 public:
  Oracles(const Case& one, bool resets_at_once)
      : SingleWalkers(Oracle(one).specification(), resets_at_once) {
    for (std::uint32_t i = 0; i < kNumWalkers; ++i) {
      walkers_.push_back(std::make_unique<Oracle>(one));
    }
  }

  void set_world(std::uint32_t walker, const World& world) override {
    walkers_[walker]->world = world;
  }
  void set_coordinates(std::uint32_t walker, const std::vector<double>& position,
                       const std::vector<double>& velocity) override {
    walkers_[walker]->set_coordinates(position, velocity);
  }
  /// A state is the index of a copy.
  std::vector<std::byte> save(std::uint32_t walker) override {
    saved_.push_back(std::make_unique<Oracle>(*walkers_[walker]));
    return std::vector<std::byte>(saved_.size());
  }
  void load(std::uint32_t walker, const std::vector<std::byte>& state) override {
    walkers_[walker] = std::make_unique<Oracle>(*saved_.at(state.size() - 1));
  }
  /// Does nothing: a refused call must change nothing.
  void refuse(std::uint32_t /*walker*/, const std::string& /*what*/) override {}

 protected:
  void reset_one(std::uint32_t i, Seed seed) override {
    Oracle& walker = *walkers_[i];
    walker.reset(seed);
    add_reset(i, walker.observation.data(), walker.info.data(), walker.drawn, walker.error);
  }
  void step_one(std::uint32_t i, const double* action, std::size_t /*size*/) override {
    Oracle& walker = *walkers_[i];
    walker.step(action);
    add_step(i, walker.observation.data(), walker.reward, walker.terminated, walker.truncated,
             walker.info.data(), walker.error);
  }
  bool has_ended(std::uint32_t i) const override {
    return walkers_[i]->terminated || walkers_[i]->truncated;
  }

 private:
  std::vector<std::unique_ptr<Oracle>> walkers_, saved_;
};

}  // namespace walker::promises

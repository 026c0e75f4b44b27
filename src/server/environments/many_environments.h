// Many environments of a server in a pool, and the account of the one that is shown. No ROS.
#pragma once

#include "server/environments/environments.h"

namespace walker {

/// The environments of a pool.
class ManyEnvironments : public Environments, private ShownEnvironment {
 public:
  /// @param make makes each of the environments, all alike
  ManyEnvironments(const ServerOptions& options,
                   const std::function<std::unique_ptr<Environment>()>& make);

  std::size_t size() const override { return returns_.size(); }
  ShownEnvironment& shown() override { return *this; }
  [[noreturn]] Simulation& only(const std::string& service) override;
  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& rows) override;
  void step(const std::vector<double>& actions, const Batch& rows) override;
  void look(std::size_t index, Instant& instant) override {
    walker::look(pool_.environment(index), steps_[index], instant);
  }
  double episode_return(std::size_t index) const override { return returns_[index]; }
  std::string error(std::size_t index) const override {
    return std::string(pool_.error(index)) +
           pool_.reset_error(index);  // of which it has one at most
  }

 private:
  const Specification& specification() const override { return pool_.specification(); }
  const EpisodeState& state() const override { return state_; }
  const Sensors& sensors() override;
  const Scene& scene() override;

  Environment& shown_environment() { return pool_.environment(state_.environment); }
  void account(const std::vector<double>& actions, const GeneratorState& before, const Batch& rows);
  void begin_account(std::optional<std::uint64_t> seed, const GeneratorState& generator_state,
                     const Batch& rows);
  void read_rows(const Batch& rows);

  Pool pool_;
  std::uint64_t first_seed_;
  // By environment, of its present or last episode.
  std::vector<double> returns_;
  std::vector<std::uint32_t> steps_;

  // Of the one that is shown.
  EpisodeState state_;
  Sensors sensors_;
  Scene scene_;
  bool sensors_are_fresh_ = false;
};

}  // namespace walker

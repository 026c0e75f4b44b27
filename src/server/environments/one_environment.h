// A server's only environment as a batch of one. No ROS.
#pragma once

#include "server/environments/environments.h"

namespace walker {

/// The same simulation whether it is stepped alone or as a batch.
class OneEnvironment : public Environments {
 public:
  OneEnvironment(const std::function<std::unique_ptr<Environment>()>& make,
                 std::optional<std::uint64_t> first_seed, AutoresetMode autoreset_mode)
      : simulation_(make, first_seed), autoreset_mode_(autoreset_mode) {}

  std::size_t size() const override { return 1; }
  ShownEnvironment& shown() override { return simulation_; }
  Simulation& only(const std::string& /*service*/) override { return simulation_; }
  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& rows) override;
  void step(const std::vector<double>& actions, const Batch& rows) override;
  void look(std::size_t /*index*/, Instant& instant) override { simulation_.look(instant); }
  double episode_return(std::size_t /*index*/) const override {
    return simulation_.state().episode_return;
  }
  std::string error(std::size_t /*index*/) const override { return simulation_.state().error; }

 private:
  void write(const Batch& rows) const;

  Simulation simulation_;
  AutoresetMode autoreset_mode_;
};

}  // namespace walker

// Free-running: the server keeps a pace of its own.
#pragma once

#include "base/pacer.h"
#include "server/drive/running.h"

namespace walker {

class FreeDrive : public RunningDrive {
 public:
  FreeDrive(const ServerOptions& options, Simulation& simulation);

  void start() override;
  void restart_schedule() override;
  /// @throws std::invalid_argument for a factor out of range
  void set_real_time_factor(double factor) override;
  std::optional<double> real_time_factor() const override { return pacer_.real_time_factor(); }
  const char* pace() const override;

 private:
  Clock::duration until_step(Clock::time_point now) const override { return pacer_.remaining(now); }
  void step_if_due(Clock::time_point now) override;

  Pacer pacer_;
};

}  // namespace walker

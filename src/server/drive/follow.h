// Free-running under another node's /clock.
#pragma once

#include "server/drive/running.h"
#include "server/time/clock_follower.h"

namespace walker {

class FollowDrive : public RunningDrive {
 public:
  FollowDrive(const ServerOptions& options, Simulation& simulation);

  void restart_schedule() override;
  void set_real_time_factor(double factor) override;
  bool follows_clock() const override { return true; }
  const char* pace() const override { return is_paused() ? "paused" : "follows /clock"; }
  std::string complaint() const override { return is_paused() ? "" : follower_.complaint(); }

 private:
  Clock::duration until_step(Clock::time_point /*now*/) const override {
    return std::chrono::milliseconds(1);
  }
  void step_if_due(Clock::time_point now) override;

  ClockFollower follower_;
};

}  // namespace walker

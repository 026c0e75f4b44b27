// What the drives that step by themselves have in common.
#pragma once

#include "server/drive/drive.h"

namespace walker {

/// Steps by the held effort command, resets itself unless `auto_reset` is off, and can be paused;
/// then services may step. After a reset that failed it waits a second, whatever the pace, so that
/// an engine that fails at every reset keeps neither the processor nor subscribers busy.
class RunningDrive : public Drive {
 public:
  RunningDrive(const ServerOptions& options, Simulation& simulation)
      : Drive(simulation), auto_reset_(options.auto_reset), is_paused_(options.paused) {}

  void start() override { restart_schedule(); }
  Clock::duration until_due(Clock::time_point now) const override;
  void step_if_due() override;
  void require_steps_by_service(const std::string& service) const override;
  void take_command(const std::vector<double>& efforts, const std::string& agent) override {
    simulation_.take_command(efforts, agent);
  }
  bool takes_commands() const override { return true; }
  std::string pause() override;
  std::string unpause() override;
  bool is_paused() const override { return is_paused_; }
  bool stands_still() const override { return is_paused_; }

 protected:
  void begin_episode(std::optional<std::uint64_t> seed) override;
  /// Steps, or resets after the episode's end.
  void step();

 private:
  virtual Clock::duration until_step(Clock::time_point now) const = 0;
  /// Makes the step if it is due.
  virtual void step_if_due(Clock::time_point now) = 0;

  bool runs() const;
  bool waits_to_reset_again(Clock::time_point now) const;
  const EpisodeState& state() const { return simulation_.shown().state(); }

  bool auto_reset_;
  bool is_paused_;
  Clock::time_point resets_again_at_;  // after a reset that failed
};

}  // namespace walker

// The environment server: commands, and the loop that steps when nobody else does.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <std_msgs/Float64MultiArray.h>

#include "core/pacer.h"
#include "server/camera/pictures.h"
#include "server/environments/batch_calls.h"
#include "server/environments/environments.h"
#include "server/environments/restores.h"
#include "server/parameter_reader.h"
#include "server/services.h"
#include "server/time/clock_follower.h"
#include "server/time/simulation_clock.h"
#include "server/time/step_timing.h"
#include "server/topics/diagnostics.h"
#include "server/topics/effort_command.h"
#include "server/topics/episode_statistics.h"
#include "server/topics/publishers.h"
#include "server/transport/service_port.h"
#include "server/transport/waking_queue.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/Transition.h"

namespace walker {

/// Environments on ROS. Services, callbacks, steps and publishing all happen in the thread that
/// calls `run`, so that nothing moves while a service answers. Only pictures are drawn elsewhere.
class Server {
 public:
  using MakeRenderer = DrawingThread::MakeRenderer;

  /// @throws std::exception when the environment cannot be made or /clock has another publisher
  explicit Server(const ServerOptions& options);
  /// The same with environments and renderers that the registry does not know.
  /// @param make_renderer called in another thread
  Server(const ServerOptions& options, const MakeEnvironment& make_environment,
         const MakeRenderer& make_renderer);

  /// Serves until the node is told to stop.
  void run();

  // What the services ask for. Each throws a std::exception that says why not; then nothing has
  // changed. With many environments those that are for one throw.

  /// Begins an episode. Without a seed the generator continues.
  /// @throws also where the engine fails; then the episode has ended with that
  void reset(std::optional<std::uint64_t> seed);
  /// Makes exactly one step.
  void step(const std::vector<double>& action);
  /// Begins episodes of several environments. An engine that fails concerns its own alone.
  void reset_batch(const walker_sim::ResetBatch::Request& request,
                   walker_sim::ResetBatch::Response& response);
  /// Steps every environment once, or resets it where the autoreset mode says so.
  void step_batch(const std::vector<double>& actions, walker_sim::StepBatch::Response& response);
  /// The present episode.
  walker_sim::EpisodeRecord snapshot() const;
  /// A new episode that is, and goes on, as the recorded one: from the time of the reply on.
  void restore(const walker_sim::EpisodeRecord& record,
               const Reply<walker_sim::Restore::Response>& reply);
  /// @param factor simulation time over wall time, 0 .. 1000; 0: as fast as it goes
  void set_real_time_factor(double factor);
  /// @return what has changed
  std::string pause();
  std::string unpause();

  /// Has a picture drawn of what there is now.
  void render(const walker_sim::Render::Request& request,
              const Reply<walker_sim::Render::Response>& reply);

  void tell(walker_sim::Transition& message) const;
  void tell(walker_sim::EnvironmentSpec& message) const;

 private:
  // What decides who steps: the tables Modes and Time.
  bool runs_freely() const;
  bool waits_to_reset_again(Pacer::Clock::time_point now) const;
  bool follows_clock() const;
  Pacer::Clock::duration until_due(Pacer::Clock::time_point now) const;
  void serve(Pacer::Clock::duration longest);
  void offer_services();
  void wait_for_recorder();
  void step_when_due();
  void follow_clock();
  void step_freely();

  void begin_episode(std::optional<std::uint64_t> seed);
  void take_failed_reset(bool failed_before);
  void advance(const std::vector<double>& action);
  void pass_time();
  void pass_time_after_reset();
  void show_step();
  void show_reset();
  void show_restored(EpisodeRecorder& restored, walker_sim::Restore::Response& response);
  void refuse_while_it_runs(const std::string& service) const;
  void on_effort_command(const std_msgs::Float64MultiArray& message);
  void restart_schedule();
  void count_if_clamped(const std::vector<double>& action);
  void refuse(const std::string& reason);

  ServerOptions options_;
  WakingQueue callbacks_;
  ros::NodeHandle node_;
  Environments environments_;
  EpisodeRecorder& shown_;
  ros::Duration dt_;
  SimulationClock clock_;
  Publishers publishers_;
  Pictures pictures_;
  Pacer pacer_;
  ClockFollower follower_;
  EffortCommand command_;
  bool paused_;
  Pacer::Clock::time_point resets_again_at_{};  // after a reset that failed
  ServerCounters counters_;
  StepTiming timing_;
  EpisodeStatistics episodes_;
  BatchCalls batch_calls_;
  Restores restores_;
  Diagnostics diagnostics_;

  ServicePort port_;
  std::optional<Services> services_;  // none while a recorder is waited for
  ros::Subscriber effort_subscriber_;
};

}  // namespace walker

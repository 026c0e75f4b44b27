// Connection to a server that never blocks the GUI's thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/callback_queue.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/service_client.h>
#include <ros/subscriber.h>

#include "rviz_plugins/return_curve.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/GetWorlds.h"
#include "walker_sim/World.h"

namespace walker {

/// What is known of a server.
struct ServerView {
  std::string trouble = "looks for the server";  ///< why it cannot be called; empty: it can
  walker_sim::EnvironmentSpec spec;              ///< of the last server; `id` is empty before
  walker_sim::GetWorlds::Response worlds;        ///< likewise
  bool is_paused = false;
  std::optional<double> wanted_factor;  ///< of real time; none: another node sets the pace
  double factor = 0;                    ///< as measured
  std::string answer;                   ///< to the last call
  bool is_refused = false;              ///< `answer` is the reason
  std::uint64_t num_answers = 0;
  ReturnCurve present, previous;  ///< of episodes
};

/// Calls the server's services and receives its topics in a thread of its own. Every method returns
/// at once; `view` has the answers when they have come.
class ServerLink {
 public:
  ServerLink();
  ServerLink(const ServerLink&) = delete;
  ServerLink& operator=(const ServerLink&) = delete;
  /// Ends a call that is under way.
  ~ServerLink();

  /// @param name of the server's node, relative to this node's namespace
  void connect(const std::string& name);

  /// @param world empty: the server's own
  void reset(std::optional<std::uint64_t> seed, const walker_sim::World& world);
  /// Makes one step with an action of zeros.
  void step();
  void set_paused(bool is_paused);
  void set_real_time_factor(double factor);

  /// Returns a copy. If a call is late, it is given up, and `trouble` says so.
  ServerView view();

 private:
  void run();
  void post(std::function<void()> task);
  template <typename Service>
  bool call(const std::string& service, Service& message);
  template <typename Service>
  void call_and_report(const std::string& service, Service& message, const std::string& done);
  void report(const std::string& answer, bool is_refused);
  void look_for_server();
  void subscribe();
  void take(const walker_sim::Episode& progress);
  void take(const ros::MessageEvent<const diagnostic_msgs::DiagnosticArray>& event);

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  std::string server_;  // resolved
  ros::Subscriber progress_, diagnostics_;
  std::uint32_t episode_ = 0;
  std::uint32_t length_ = 0;  // of the episode so far [steps]

  std::mutex mutex_;  // of the following
  ServerView view_;
  ros::ServiceClient client_;  // of the call that is under way
  std::optional<std::chrono::steady_clock::time_point> called_at_;
  bool is_ending_ = false;

  std::thread thread_;  // last: uses all of the above
};

}  // namespace walker

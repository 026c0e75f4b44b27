// Node of an agent that drives by ~step.
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/node_handle.h>

#include "agents/options.h"
#include "agents/remote_server.h"
#include "base/pacer.h"
#include "ros/node_main.h"

namespace walker {
namespace {

class ServiceAgent {
 public:
  ServiceAgent(const AgentOptions& options, RemoteServer& server,
               const Specification& specification)
      : options_(options),
        server_(server),
        agent_(make_agent(options, specification, server.world())),
        pacer_(specification.dt, options.real_time_factor) {}

  void run() {
    while (ros::ok() && (options_.episodes == 0 || finished_ < options_.episodes)) {
      if (!play_episode()) continue;
      ++finished_;
      ROS_INFO_STREAM("episode " << transition_.episode << ": " << transition_.step
                                 << " steps, return " << transition_.episode_return << ", "
                                 << (transition_.terminated ? "terminated" : "truncated"));
    }
  }

 private:
  /// @return false if the connection was lost or the node shuts down
  bool play_episode() {
    const auto reset = [this](Client& client) {
      client.reset(options_.seed_after(finished_), transition_);
      set_time(ros::Time().fromNSec(transition_.stamp));
    };
    const auto step = [this](Client& client) {
      const std::vector<double>& action = agent_->act(transition_.observation);
      client.step(action.data(), action.size(), transition_);
      set_time(ros::Time().fromNSec(transition_.stamp));
    };
    if (!server_.call(reset)) return false;
    agent_->reset();
    pacer_.restart(Pacer::Clock::now());
    while (ros::ok() && !transition_.terminated && !transition_.truncated) {
      wait_for_next_step();
      if (!server_.call(step)) return false;
    }
    return ros::ok();
  }

  void wait_for_next_step() {
    const Pacer::Clock::duration wait = pacer_.remaining(Pacer::Clock::now());
    if (wait > Pacer::Clock::duration::zero()) std::this_thread::sleep_for(wait);
    pacer_.step_begins(Pacer::Clock::now());
  }

  const AgentOptions& options_;
  RemoteServer& server_;
  std::unique_ptr<Agent> agent_;
  Pacer pacer_;
  Transition transition_;
  std::size_t finished_ = 0;
};

/// Drives a lock-step server by ~reset and ~step. If the connection is lost, waits for the server
/// and does not count the interrupted episode.
void run() {
  const AgentOptions options = read_agent_options();
  if (!options.env.empty()) {
    throw std::invalid_argument("env = " + options.env +
                                ": must be empty for the service agent, whose server has the "
                                "environment; the topic agent takes it");
  }
  RemoteServer server(ros::NodeHandle(), options.server);
  const std::optional<Specification> specification = server.specification();
  if (specification) ServiceAgent(options, server, *specification).run();  // else shutting down
}

}  // namespace
}  // namespace walker

int main(int argc, char** argv) {
  const walker::NodeDescription node{"service_agent", "service_agent",
                                     "Drives a walker by the service ~step.",
                                     walker::agent_parameters()};
  return walker::run_node(argc, argv, node, walker::run);
}

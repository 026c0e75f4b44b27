#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/service.h>
#include <ros/service_client.h>

#include "agents/agents.h"
#include "agents/remote_specification.h"
#include "core/pacer.h"
#include "walker_sim/Reset.h"
#include "walker_sim/Step.h"
#include "walker_sim/Transition.h"

namespace walker {
namespace {

/// Repeats reset, then observe and step until the episode ends.
class ServiceAgent {
 public:
  ServiceAgent(const AgentOptions& options, const ros::NodeHandle& node,
               const Specification& specification)
      : options_(options),
        node_(node),
        agent_(make_agent(options, specification)),
        pacer_(specification.dt, options.real_time_factor) {}

  void run() {
    while (ros::ok() && (options_.episodes == 0 || finished_ < options_.episodes)) {
      if (!connect()) continue;
      if (!play_episode()) continue;
      ++finished_;
      ROS_INFO_STREAM("episode " << transition_.episode << ": " << transition_.step
                                 << " steps, return " << transition_.episode_return << ", "
                                 << (transition_.terminated ? "terminated" : "truncated"));
    }
  }

 private:
  bool connect() {
    if (reset_client_.isValid() && step_client_.isValid()) return true;
    if (!ros::service::waitForService(options_.server + "/step", ros::Duration(1))) return false;
    constexpr bool kPersistent = true;
    reset_client_ = node_.serviceClient<walker_sim::Reset>(options_.server + "/reset", kPersistent);
    step_client_ = node_.serviceClient<walker_sim::Step>(options_.server + "/step", kPersistent);
    return reset_client_.isValid() && step_client_.isValid();
  }

  bool play_episode() {
    walker_sim::Reset reset;
    reset.request = options_.reset_after(finished_);
    if (!make(reset_client_, reset)) return false;
    agent_->reset();
    pacer_.restart(Pacer::Clock::now());
    while (ros::ok() && transition_.terminated == 0 && transition_.truncated == 0) {
      wait_for_next_step();
      walker_sim::Step step;
      step.request.action = agent_->act(transition_.observation);
      if (!make(step_client_, step)) return false;
    }
    return ros::ok();
  }

  /// Takes over the transition of the reply. @return false when the server does not answer
  /// @throws std::runtime_error with the server's words when it refuses
  template <typename Service>
  bool make(ros::ServiceClient& client, Service& call) {
    if (!client.call(call)) {
      ROS_WARN_STREAM("No answer from " << client.getService() << "; waiting for the server");
      return false;
    }
    if (call.response.success == 0) throw std::runtime_error(call.response.status_message);
    transition_ = std::move(call.response.transition);
    return true;
  }

  void wait_for_next_step() {
    const Pacer::Clock::duration wait = pacer_.remaining(Pacer::Clock::now());
    if (wait > Pacer::Clock::duration::zero()) std::this_thread::sleep_for(wait);
    pacer_.step_begins(Pacer::Clock::now());
  }

  const AgentOptions& options_;
  ros::NodeHandle node_;
  ros::ServiceClient reset_client_;
  ros::ServiceClient step_client_;
  std::unique_ptr<Agent> agent_;
  Pacer pacer_;
  walker_sim::Transition transition_;
  std::size_t finished_ = 0;
};

}  // namespace

void drive_by_services(const AgentOptions& options) {
  if (!options.env.empty()) {
    throw std::invalid_argument("env = " + options.env +
                                ": is for the topic agent; this one asks its server");
  }
  ros::NodeHandle node;
  const std::optional<Specification> specification = ask_specification(node, options.server);
  if (specification) ServiceAgent(options, node, *specification).run();  // else told to stop
}

}  // namespace walker

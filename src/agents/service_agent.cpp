#include "agents/service_agent.h"

#include <stdexcept>
#include <thread>
#include <utility>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/service.h>

#include "agents/remote_specification.h"
#include "walker_sim/Reset.h"
#include "walker_sim/Step.h"

namespace walker {

ServiceAgent::ServiceAgent(AgentOptions options) : options_(std::move(options)) {
  if (!options_.env.empty()) {
    throw std::invalid_argument("env = " + options_.env +
                                ": is for the topic agent; this one asks its server");
  }
  const std::optional<Specification> specification = ask_specification(node_, options_.server);
  if (!specification) return;  // told to stop while waiting
  agent_ = make_agent(options_.agent, *specification, options_.agent_seed);
  pacer_ = std::make_unique<Pacer>(specification->dt, options_.real_time_factor);
}

void ServiceAgent::run() {
  while (ros::ok() && agent_ && (options_.episodes == 0 || finished_ < options_.episodes)) {
    if (!connect()) continue;
    if (!play_episode()) continue;
    ++finished_;
    ROS_INFO_STREAM("episode " << transition_.episode << ": " << transition_.step
                               << " steps, return " << transition_.episode_return << ", "
                               << (transition_.terminated ? "terminated" : "truncated"));
  }
}

bool ServiceAgent::connect() {
  if (reset_client_ && reset_client_.isValid() && step_client_ && step_client_.isValid()) {
    return true;
  }
  if (!ros::service::waitForService(options_.server + "/step", ros::Duration(1))) return false;
  constexpr bool kPersistent = true;
  reset_client_ = node_.serviceClient<walker_sim::Reset>(options_.server + "/reset", kPersistent);
  step_client_ = node_.serviceClient<walker_sim::Step>(options_.server + "/step", kPersistent);
  return reset_client_.isValid() && step_client_.isValid();
}

bool ServiceAgent::play_episode() {
  if (!reset(options_.seed_after(finished_))) return false;
  agent_->reset();
  pacer_->restart(Pacer::Clock::now());
  while (ros::ok() && transition_.terminated == 0 && transition_.truncated == 0) {
    wait_for_next_step();
    if (!step(agent_->act(transition_.observation))) return false;
  }
  return ros::ok();
}

bool ServiceAgent::reset(std::optional<std::uint64_t> seed) {
  walker_sim::Reset call;
  call.request.has_seed = static_cast<std::uint8_t>(seed.has_value());
  call.request.seed = seed.value_or(0);
  return make(reset_client_, call);
}

bool ServiceAgent::step(const std::vector<double>& action) {
  walker_sim::Step call;
  call.request.action = action;
  return make(step_client_, call);
}

/// Takes over the transition of the reply. @return false when the server does not answer
/// @throws std::runtime_error with the server's words when it refuses
template <typename Service>
bool ServiceAgent::make(ros::ServiceClient& client, Service& call) {
  if (!client.call(call)) {
    ROS_WARN_STREAM("No answer from " << client.getService() << "; waiting for the server");
    return false;
  }
  if (call.response.success == 0) throw std::runtime_error(call.response.status_message);
  transition_ = std::move(call.response.transition);
  return true;
}

void ServiceAgent::wait_for_next_step() {
  const Pacer::Clock::duration wait = pacer_->remaining(Pacer::Clock::now());
  if (wait > Pacer::Clock::duration::zero()) std::this_thread::sleep_for(wait);
  pacer_->step_begins(Pacer::Clock::now());
}

}  // namespace walker

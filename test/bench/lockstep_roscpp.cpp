// Steps one environment in lock-step through roscpp. Prints one line of JSON.
//   walker_sim_lockstep_roscpp --server /walker_sim --seconds S
#include <stdexcept>
#include <string>

#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/service.h>
#include <ros/service_client.h>

#include "bench/program.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/Reset.h"
#include "walker_sim/Step.h"

namespace walker::bench {
namespace {

/// Calls a service. Returns whether the episode has ended.
/// @throws std::runtime_error unless the server answers with success
template <typename Service>
bool call(ros::ServiceClient& client, Service& service) {
  if (!client.call(service)) throw std::runtime_error(client.getService() + ": no answer");
  if (service.response.success == 0) throw std::runtime_error(service.response.status_message);
  const walker_sim::Transition& transition = service.response.transition;
  return transition.terminated != 0 || transition.truncated != 0;
}

void run(const Arguments& arguments) {
  const std::string& server = arguments.text("server");
  ros::NodeHandle node;
  walker_sim::GetSpec get_spec;
  if (!ros::service::call(server + "/get_spec", get_spec)) {
    throw std::runtime_error(server + "/get_spec: no answer");
  }
  ros::ServiceClient step_client = node.serviceClient<walker_sim::Step>(server + "/step", true);
  ros::ServiceClient reset_client = node.serviceClient<walker_sim::Reset>(server + "/reset", true);
  walker_sim::Reset reset;
  walker_sim::Step step;
  reset.request.has_seed = 1;
  call(reset_client, reset);
  reset.request.has_seed = 0;
  Actions actions(get_spec.response.spec.action_size);
  Latencies latencies;
  const Slice slice = measure(arguments.number("seconds"), 1, [&] {
    const double* action = actions.next();
    step.request.action.assign(action, action + actions.size());
    bool has_ended = false;
    latencies.time([&] { has_ended = call(step_client, step); });
    if (has_ended) call(reset_client, reset);
  });
  print(1, slice, latencies);
}

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  return walker::bench::run_program("walker_sim_lockstep_roscpp", [&] {
    ros::init(argc, argv, "lockstep_roscpp", ros::init_options::AnonymousName);
    walker::bench::run({argv + 1, argv + argc, {"server", "seconds"}});
  });
}

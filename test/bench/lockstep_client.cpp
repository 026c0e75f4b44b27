// Steps one environment in lock-step over ROS and prints one line of JSON.
//   walker_sim_lockstep_client --client ours|roscpp --server /walker_sim --seconds S
// Both clients play the same episodes.
#include <exception>
#include <iostream>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/service_client.h>

#include "bench/arguments.h"
#include "bench/round_trips.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/Reset.h"
#include "walker_sim/Step.h"
#include "walker_sim/client.h"

namespace walker::bench {
namespace {

class OurClient {
 public:
  explicit OurClient(const std::string& server) : client_(make_options(server)) {}

  std::size_t action_size() { return client_.specification().action_size; }
  void reset(std::optional<std::uint64_t> seed) { client_.reset(seed, transition_); }
  void step(const std::vector<double>& action) {
    client_.step(action.data(), action.size(), transition_);
  }
  bool has_ended() const { return transition_.terminated || transition_.truncated; }

 private:
  static ClientOptions make_options(const std::string& server) {
    ClientOptions options;
    options.server = server;
    return options;
  }

  Client client_;
  Transition transition_;
};

class RoscppClient {
 public:
  explicit RoscppClient(const std::string& server)
      : get_spec_(node_.serviceClient<walker_sim::GetSpec>(server + "/get_spec")),
        reset_(node_.serviceClient<walker_sim::Reset>(server + "/reset", true)),
        step_(node_.serviceClient<walker_sim::Step>(server + "/step", true)) {}

  std::size_t action_size() {
    walker_sim::GetSpec call;
    if (!get_spec_.call(call)) throw std::runtime_error(get_spec_.getService() + ": failed");
    return call.response.spec.action_size;
  }

  void reset(std::optional<std::uint64_t> seed) {
    reset_call_.request.has_seed = seed.has_value() ? 1 : 0;
    reset_call_.request.seed = seed.value_or(0);
    require(reset_.call(reset_call_), reset_call_.response);
    has_ended_ = false;
  }

  void step(const std::vector<double>& action) {
    step_call_.request.action = action;
    require(step_.call(step_call_), step_call_.response);
    const walker_sim::Transition& transition = step_call_.response.transition;
    has_ended_ = transition.terminated != 0 || transition.truncated != 0;
  }

  bool has_ended() const { return has_ended_; }

 private:
  template <typename Response>
  static void require(bool answered, const Response& response) {
    if (!answered) throw std::runtime_error("the server did not answer");
    if (response.success == 0) throw std::runtime_error(response.status_message);
  }

  ros::NodeHandle node_;
  ros::ServiceClient get_spec_;
  ros::ServiceClient reset_;
  ros::ServiceClient step_;
  walker_sim::Reset reset_call_;
  walker_sim::Step step_call_;
  bool has_ended_ = false;
};

std::vector<std::vector<double>> draw_actions(std::size_t size) {
  constexpr int kActions = 1000;
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<std::vector<double>> actions(kActions, std::vector<double>(size));
  for (std::vector<double>& action : actions) {
    for (double& value : action) value = double{uniform(generator)};
  }
  return actions;
}

template <typename AnyClient>
void measure(AnyClient client, double seconds) {
  RoundTrips round_trips(seconds);
  const std::vector<std::vector<double>> actions = draw_actions(client.action_size());
  client.reset(0);
  std::size_t next = 0;
  round_trips.run(
      [&] {
        client.step(actions[next]);
        next = (next + 1) % actions.size();
      },
      [&] {
        if (client.has_ended()) client.reset(std::nullopt);
      });
  round_trips.print();
}

void run(int argc, char** argv) {
  const Arguments arguments(argv + 1, argv + argc, {"client", "server", "seconds"});
  const std::string& kind = arguments.text("client");
  const double seconds = arguments.number("seconds");
  if (kind == "ours") {
    measure(OurClient(arguments.text("server")), seconds);
  } else if (kind == "roscpp") {
    ros::init(argc, argv, "lockstep_client", ros::init_options::AnonymousName);
    measure(RoscppClient(arguments.text("server")), seconds);
  } else {
    throw std::invalid_argument("--client = " + kind + "; must be ours or roscpp");
  }
}

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  try {
    walker::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}

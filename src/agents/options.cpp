#include "agents/options.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include <ros/console.h>
#include <ros/package.h>

#include "base/limits.h"
#include "base/posix.h"
#include "ros/private_parameters.h"
#include "walker_sim/policy.h"

namespace walker {

std::vector<ParameterDescription> agent_parameters() {
  constexpr double kMaxEpisodes = 4294967295.0;
  constexpr double kMaxTolerance = 1;
  constexpr double kMaxSeed = 2147483647.0;  // XML-RPC integers have 32 bits
  return {
      {"agent", std::string("heuristic"), "", "Agent: policy, heuristic or random.", 0, 0},
      {"policy", std::string(), "",
       "Policy file; shipped: the package's policy for the environment; robust: its robust one; "
       "empty: the robust one if the world is not Gymnasium's, else the shipped one.",
       0, 0},
      {"server", std::string("walker_sim"), "", "Name of the server's node.", 0, 0},
      {"env", std::string(), "", "Id of the environment; empty: the server's.", 0, 0},
      {"seeds", std::string(), "",
       "Seeds of the episodes, used in turn, separated by spaces; empty: the server's.", 0, 0},
      {"agent_seed", std::int64_t{0}, "", "Seed of the random agent.", 0, kMaxSeed},
      {"episodes", std::int64_t{0}, "", "Number of episodes; 0: unlimited.", 0, kMaxEpisodes},
      {"real_time_factor", 0.0, "",
       "Simulation time over wall time in lock-step; 0: as fast as possible.", 0,
       kMaxRealTimeFactor},
      {"stamp_tolerance", 0.0, "s",
       "Largest difference between the stamps of one instant; 0: equal stamps.", 0, kMaxTolerance},
  };
}

std::optional<std::uint64_t> AgentOptions::seed_after(std::size_t finished) const {
  if (seeds.empty()) return std::nullopt;
  return seeds[finished % seeds.size()];
}

AgentOptions read_agent_options() {
  Parameters given = private_parameters();
  take_as_text("seeds", given);
  take_numbers(agent_parameters(), given);
  const Parameters complete = complete_parameters(agent_parameters(), given);
  AgentOptions options;
  options.agent = std::get<std::string>(complete.at("agent"));
  options.policy = std::get<std::string>(complete.at("policy"));
  options.server = std::get<std::string>(complete.at("server"));
  options.agent_seed =
      static_cast<std::uint64_t>(std::get<std::int64_t>(complete.at("agent_seed")));
  options.episodes = static_cast<std::uint32_t>(std::get<std::int64_t>(complete.at("episodes")));
  options.env = std::get<std::string>(complete.at("env"));
  options.real_time_factor = std::get<double>(complete.at("real_time_factor"));
  options.stamp_tolerance = std::get<double>(complete.at("stamp_tolerance"));
  const std::string seeds = std::get<std::string>(complete.at("seeds"));
  std::istringstream texts(seeds);
  for (std::string text; std::getline(texts, text, ' ');) {
    if (const auto seed = parse_seed("seeds", text)) options.seeds.push_back(*seed);
  }
  if (!options.env.empty() && !options.seeds.empty()) {
    throw std::invalid_argument("seeds = " + seeds + ": must be empty with env = " + options.env +
                                ", because then no server begins the episodes");
  }
  return options;
}

std::unique_ptr<Agent> make_agent(const AgentOptions& options, const Specification& specification,
                                  const World& world) {
  if (options.agent != "policy") {
    if (!options.policy.empty()) {
      throw std::invalid_argument("policy = " + options.policy +
                                  ": must be empty with agent = " + options.agent);
    }
    if (options.agent != "heuristic" && options.agent != "random") {
      throw std::invalid_argument("agent = " + options.agent +
                                  ": must be policy, heuristic or random");
    }
    return make_agent(options.agent, specification, options.agent_seed);
  }
  const std::string& policy = options.policy;
  if (!policy.empty() && policy != "shipped" && policy != "robust") {
    return make_policy_agent(expand_home(policy), specification);
  }
  const std::string file =
      ros::package::getPath("walker_sim") + "/assets/policies/" + specification.id;
  const std::string robust = file + "-robust.safetensors";
  const bool has_robust = std::ifstream(robust).good();
  if (policy == "robust" && !has_robust) {
    throw std::invalid_argument("policy = robust: the package has none for " + specification.id);
  }
  const bool is_chosen_here = policy.empty() && has_robust && !world.empty();
  if (is_chosen_here) {
    ROS_INFO(
        "The world is not Gymnasium's, so the robust policy walks; the other is policy:=shipped");
  }
  const bool is_robust = policy == "robust" || is_chosen_here;
  return make_policy_agent(is_robust ? robust : file + ".safetensors", specification);
}

}  // namespace walker

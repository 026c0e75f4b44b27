// Plays one episode in lock-step: a trained network drives a walker through the server's services.
// Needs no ROS library: walker_sim/client.h looks the server up at the ROS_MASTER_URI.
#include <walker_sim/client.h>
#include <walker_sim/policy.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

/// Retries for 30 s, because roslaunch starts the server at the same time.
std::unique_ptr<walker::Client> connect(const std::string& server) {
  constexpr std::chrono::seconds kPatience{30};
  walker::ClientOptions options;
  options.server = server;
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (true) {
    try {
      return std::make_unique<walker::Client>(options);
    } catch (const walker::ConnectionError&) {
      if (std::chrono::steady_clock::now() > give_up) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

void play(const std::string& server, const std::string& policy_file,
          std::optional<std::uint64_t> seed) {
  walker::Policy policy(policy_file);
  const std::unique_ptr<walker::Client> client = connect(server);
  const walker::ServerSpecification specification = client->specification();
  if (specification.observation_size != policy.observation_size() ||
      specification.action_size != policy.action_size()) {
    throw std::invalid_argument(policy_file + " is a policy for " + policy.id() + "; " + server +
                                " has a " + specification.id);
  }
  std::vector<double> action(policy.action_size());
  walker::PolicyInput input(policy);
  walker::Transition state;
  client->reset(seed, state);
  while (!state.terminated && !state.truncated) {
    policy.act(state.observation.data(), input, action.data());
    client->step(action.data(), action.size(), state);
  }
  std::printf("%u steps, return %.17g\n", state.step, state.episode_return);
}

}  // namespace

int main(int argc, char** argv) {
  // roslaunch appends __name and __log arguments, which this program ignores.
  if (argc < 3) {
    std::fprintf(stderr, "usage: episode SERVER POLICY.safetensors [SEED]\n");
    return 2;
  }
  try {
    std::optional<std::uint64_t> seed;
    if (argc > 3 && argv[3][0] != '_') seed = std::stoull(argv[3]);
    play(argv[1], argv[2], seed);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "episode: %s\n", error.what());
    return 1;
  }
}

// A scripted server with walker_sim's services, and a client of it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "as_numbers.h"
#include "client/messages.h"
#include "client/scripted_server.h"
#include "walker_sim/client.h"

namespace walker::test {

/// End of the client's error message for a call whose connection broke.
inline const std::string kLost =
    "; the server may or may not have executed the call, and a restarted server has lost its "
    "episode: reset before the next step";

inline ServerSpecification example_specification() {
  ServerSpecification spec;
  spec.interface_version = 1;
  spec.id = "Walker-v1";
  spec.num_envs = 2;
  spec.parameter_names = {"a", "bc"};
  spec.parameter_values = {"", "0.5"};
  spec.world = {{"gravity", {-2, -1}}};
  spec.observation_size = 3;
  spec.observation_dtype = "float64";
  spec.observation_low = {-1, -2, -3};
  spec.observation_high = {1, 2, 3};
  spec.action_size = 1;
  spec.action_low = {-1};
  spec.action_high = {1};
  spec.dt = 0.02;
  spec.max_episode_steps = 1600;
  spec.reward_threshold = 300;
  spec.joint_names = {"hip"};
  spec.info_names = {"x_position"};
  spec.mode = "lockstep";
  spec.autoreset_mode = "disabled";
  spec.engine = "none";
  spec.engine_version = "1.0";
  spec.engine_path = "/nowhere";
  spec.version = "1.0.0";
  return spec;
}

inline Message& append(const World& world, Message& message) {
  message.number(static_cast<std::uint32_t>(world.size()));
  for (const auto& [name, range] : world) {
    message.text(name).number(range.low).number(range.high);
    message.number(std::uint8_t{range.is_log_uniform});
  }
  return message;
}

inline Message& append(const std::vector<EnvironmentWorld>& worlds, Message& message) {
  message.number(static_cast<std::uint32_t>(worlds.size()));
  for (const EnvironmentWorld& world : worlds) {
    append(world.world, message.number(world.environment));
  }
  return message;
}

inline std::string to_bytes(const ServerSpecification& spec) {
  Message message;
  message.number(spec.interface_version).text(spec.id).number(spec.num_envs);
  message.texts(spec.parameter_names).texts(spec.parameter_values);
  append(spec.world, message.text(spec.world.empty() ? "gymnasium" : ""));
  message.number(spec.observation_size).text(spec.observation_dtype);
  message.array(spec.observation_low).array(spec.observation_high);
  message.number(spec.action_size).array(spec.action_low).array(spec.action_high);
  message.number(spec.dt).number(spec.max_episode_steps).number(spec.reward_threshold);
  message.texts(spec.joint_names).texts(spec.info_names).text(spec.mode);
  message.text(spec.autoreset_mode).text(spec.engine).text(spec.engine_version);
  return message.text(spec.engine_path).text(spec.version).bytes();
}

inline Transition example_transition() {
  Transition transition;
  transition.stamp = 3000000020;
  transition.environment = 1;
  transition.episode = 7;
  transition.step = 9;
  transition.action = {0.25};
  transition.observation = {1, -2, 0.5};
  transition.reward = -0.125;
  transition.episode_return = 12.5;
  transition.terminated = true;
  transition.info = {0.75};
  transition.error = "why";
  return transition;
}

/// Two environments: the first is truncated, the second terminated with a final observation.
inline BatchTransition example_batch() {
  BatchTransition batch;
  batch.observations = {1, 2, 3, 4, 5, 6};
  batch.rewards = {-1, -2};
  batch.terminated = {0, 1};
  batch.truncated = {1, 0};
  batch.episodes = {5, 6};
  batch.steps = {7, 8};
  batch.info = {9, 10};
  batch.failed_environments = {1};
  batch.failed_at_reset = {0};
  batch.failures = {"the engine"};
  batch.final_environments = {1};
  batch.final_observations = {11, 12, 13};
  batch.final_info = {14};
  batch.worlds = {{1, as_numbers({{"gravity", -5}, {"pit_gap", 0.5}})}};
  return batch;
}

inline std::string to_bytes(const BatchTransition& batch) {
  Message message;
  message.number(std::uint8_t{1}).text("").array(batch.observations).array(batch.rewards);
  message.array(batch.terminated).array(batch.truncated).array(batch.episodes);
  message.array(batch.steps).array(batch.info).array(batch.failed_environments);
  message.array(batch.failed_at_reset).texts(batch.failures).array(batch.final_environments);
  message.array(batch.final_observations).array(batch.final_info);
  return append(batch.worlds, message).bytes();
}

inline std::string to_bytes(const BatchReset& reset) {
  Message message;
  message.number(std::uint8_t{1}).text("");
  message.array(reset.observations).array(reset.info).array(reset.failed_environments);
  return append(reset.worlds, message.texts(reset.failures)).bytes();
}

/// Response of ~step: `success`, `status_message`, then the transition.
inline std::string to_bytes(const Transition& transition, bool success = true,
                            const std::string& status_message = "") {
  constexpr std::uint64_t kPerSecond = 1000000000;
  Message message;
  message.number(std::uint8_t{success}).text(status_message);
  message.number(std::uint32_t{5});  // the header's sequence number
  message.number(static_cast<std::uint32_t>(transition.stamp / kPerSecond));
  message.number(static_cast<std::uint32_t>(transition.stamp % kPerSecond)).text("odom");
  message.number(transition.environment).number(transition.episode).number(transition.step);
  message.array(transition.action).array(transition.observation);
  message.number(transition.reward).number(transition.episode_return);
  message.number(std::uint8_t{transition.terminated});
  message.number(std::uint8_t{transition.truncated});
  return message.array(transition.info).text(transition.error).bytes();
}

/// Response of ~reset and ~restore.
inline std::string to_bytes(const Reset& reset) {
  Message world;
  return to_bytes(reset.transition) + append(reset.world, world).bytes();
}

inline std::string to_bytes(const RepeatedStep& repeated) {
  return to_bytes(repeated.transition) +
         Message().number(repeated.steps).number(repeated.total_reward).bytes();
}

/// Response of ~render: the success fields, then a sensor_msgs/Image.
struct Picture {
  std::string encoding = "rgb8";
  std::uint32_t width = 2;
  std::uint32_t height = 1;
  std::uint32_t row_bytes = 6;
  std::string data = "\1\2\3\4\5\xff";
  std::uint8_t is_bigendian = 0;

  std::string bytes() const {
    Message message;
    message.number(std::uint8_t{1}).text("");
    message.number(std::uint32_t{0}).number(std::uint32_t{3}).number(std::uint32_t{20});
    message.text("camera").number(height).number(width).text(encoding).number(is_bigendian);
    return message.number(row_bytes).text(data).bytes();
  }
};

inline tcpros::Fields take_header(Peer& peer) {
  const std::string header = peer.take_frame();
  return tcpros::parse_header(reinterpret_cast<const std::uint8_t*>(header.data()), header.size());
}

inline void open(Peer& peer, ServiceIndex service) {
  take_header(peer);
  peer.give(header({{"md5sum", kServiceTypes[service].md5sum}, {"callerid", "/walker_sim"}}));
}

/// Script of a connection that answers each request with the next of `answers`.
/// @param requests receives the requests' payloads, if not null
inline ScriptedServer::Script answering(ServiceIndex service,
                                        const std::vector<std::string>& answers,
                                        std::vector<std::string>* requests = nullptr) {
  return [service, answers, requests](Peer& peer) {
    open(peer, service);
    for (const std::string& answer : answers) {
      const std::string request = peer.take_frame();
      if (requests != nullptr) requests->push_back(request);
      peer.give(answer);
    }
  };
}

/// Frame of the example transition, as ~step answers.
inline std::string example_answer() { return answer(to_bytes(example_transition())); }

inline ClientOptions options_for(const ScriptedServer& master) {
  ClientOptions options;
  options.master_uri = "http://" + master.address();
  return options;
}

/// Script of the get_spec connection that the client's constructor opens.
inline ScriptedServer::Script telling(const ServerSpecification& specification) {
  return answering(kGetSpec, {answer(to_bytes(specification))});
}

inline void tell_specification(Peer& peer) { telling(example_specification())(peer); }

/// A client, its master and its server. The server answers get_spec, then plays `scripts`, one per
/// further connection.
class ScriptedWalker {
 public:
  explicit ScriptedWalker(std::vector<ScriptedServer::Script> scripts, double timeout = 30,
                          std::function<bool()> is_interrupted = {},
                          const ServerSpecification& specification = example_specification())
      : server_(after(telling(specification), std::move(scripts))),
        master_(std::vector<ScriptedServer::Script>(kMaxLookUps, master_of(server_.address()))) {
    ClientOptions options = options_for(master_);
    options.timeout = timeout;
    options.is_interrupted = std::move(is_interrupted);
    client_ = std::make_unique<Client>(options);
  }

  Client& client() { return *client_; }
  std::string address() const { return server_.address(); }

  void step() { client_->step(&action_, 1, transition); }

  Transition transition;

 private:
  static constexpr std::size_t kMaxLookUps = 10;

  static std::vector<ScriptedServer::Script> after(const ScriptedServer::Script& first,
                                                   std::vector<ScriptedServer::Script> scripts) {
    scripts.insert(scripts.begin(), first);
    return scripts;
  }

  double action_ = 0.25;
  ScriptedServer server_;
  ScriptedServer master_;
  std::unique_ptr<Client> client_;  // destroyed before the servers, whose scripts may wait for EOF
};

}  // namespace walker::test

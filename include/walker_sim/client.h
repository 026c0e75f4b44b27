// A client of a server on a ROS master, without any ROS library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker {

/// The master or the server cannot be reached, the connection broke, or what came is not what it
/// must be; the next call tries again, over new connections.
struct WALKER_SIM_EXPORT ConnectionError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The server refused; the message is its own. The connection stays, and nothing has moved, unless
/// it was a reset at which the engine failed: then there is no episode.
struct WALKER_SIM_EXPORT RequestRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A signal ended the call (`ClientOptions::is_interrupted`); as after a ConnectionError, whether
/// it was made is not known, and the next call tries again.
struct WALKER_SIM_EXPORT Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted by a signal"; }
};

struct ClientOptions {
  std::string server = "/walker_sim";  ///< the server's resolved node name
  std::string master_uri;              ///< empty: ROS_MASTER_URI, or http://localhost:11311
  /// Of each call, and of each connection before it: wall time, above 0 [s]. The system's look-up
  /// of a host's name is not in it: that has the resolver's own timeouts.
  double timeout = 10;
  /// Whether a signal has come that ends the call with Interrupted. Asked in the calling thread
  /// when a signal has interrupted its wait and, as a signal may come beside a wait, ten times a
  /// second in a call that lasts. Must not throw. Without it a call goes on after a signal.
  std::function<bool()> is_interrupted;
  /// By which the server tells clients from one another, e.g. in its log: a node's full name.
  /// Empty: /walker_sim_client_ with the process's number.
  std::string caller;
};

/// Transition.msg; its comments give the units.
struct Transition {
  std::uint64_t stamp = 0;  ///< simulation time [ns]
  std::uint32_t environment = 0;
  std::uint32_t episode = 0;
  std::uint32_t step = 0;
  std::vector<double> action;
  std::vector<double> observation;
  double reward = 0;
  double episode_return = 0;
  bool terminated = false;
  bool truncated = false;
  std::vector<double> info;
  std::string error;
};

/// StepMany.srv's response.
struct RepeatedStep {
  Transition transition;    ///< of the last step
  std::uint32_t steps = 0;  ///< done; fewer than asked for where the episode has ended
  double total_reward = 0;  ///< of these steps
};

/// StepBatch.srv's response; rows in the order of the environments.
struct BatchTransition {
  std::vector<double> observations;      ///< num_envs x observation size
  std::vector<double> rewards;           ///< num_envs
  std::vector<std::uint8_t> terminated;  ///< num_envs
  std::vector<std::uint8_t> truncated;   ///< num_envs
  std::vector<std::uint32_t> episodes;   ///< num_envs
  std::vector<std::uint32_t> steps;      ///< num_envs
  std::vector<double> info;              ///< num_envs x info names
  // The environments whose engine failed in this call, with its messages. Under same_step one may
  // be listed twice, the step first.
  std::vector<std::uint32_t> failed_environments;
  std::vector<std::uint8_t> failed_at_reset;  ///< 1: at the reset of its present episode
  std::vector<std::string> failures;
  // Under same_step only: the episodes that ended in this call.
  std::vector<std::uint32_t> final_environments;
  std::vector<double> final_observations;  ///< final_environments x observation size
  std::vector<double> final_info;          ///< final_environments x info names
};

/// ResetBatch.srv's response; rows in the order asked for.
struct BatchReset {
  std::vector<double> observations;
  std::vector<double> info;
  // The environments whose engine failed, with its messages.
  std::vector<std::uint32_t> failed_environments;
  std::vector<std::string> failures;
};

/// EnvironmentSpec.msg.
struct ServerSpecification {
  std::uint32_t interface_version = 0;
  std::string id;
  std::uint32_t num_envs = 0;
  std::vector<std::string> parameter_names;
  std::vector<std::string> parameter_values;
  std::uint32_t observation_size = 0;
  std::string observation_dtype;
  std::vector<double> observation_low;
  std::vector<double> observation_high;
  std::uint32_t action_size = 0;
  std::vector<double> action_low;
  std::vector<double> action_high;
  double dt = 0;
  std::uint32_t max_episode_steps = 0;
  double reward_threshold = 0;
  std::vector<std::string> joint_names;
  std::vector<std::string> info_names;
  std::string mode;
  std::string autoreset_mode;
  std::string engine;
  std::string engine_version;
  std::string engine_path;
  std::string version;
};

/// Drives a server through its services over connections that stay open. Not thread-safe.
///
/// A call blocks on its own socket until the answer is there: no thread stands between. When the
/// connection breaks (the server died, or was started again), the call throws ConnectionError, and
/// the next one looks the server up anew. A call is never sent twice: after a ConnectionError
/// nobody knows whether the server has made it. What is kept between calls is memory only, so that
/// a step allocates nothing, and the sizes that the server has last told with its specification: an
/// answer of other sizes, or with an index beyond them, is a ConnectionError. Texts are UTF-8:
/// other bytes are escaped, in hexadecimal as C does it.
///
/// It belongs to the process that made it: in the child of a fork every call is a ConnectionError
/// that says so, and the parent's goes on.
class WALKER_SIM_EXPORT Client {
 public:
  /// Connects, and asks for the specification.
  /// @throws ConnectionError naming the master, the service and the cause; Interrupted;
  ///         std::invalid_argument naming an option, its value and what is allowed
  explicit Client(const ClientOptions& options = {});
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  /// ~get_spec: as of now, also after the server was started again. To be asked for where that may
  /// have been with other parameters.
  /// @throws ConnectionError, Interrupted
  ServerSpecification specification();

  // Each of these throws ConnectionError, Interrupted or RequestRefused; then the result is as it
  // was. Memory is kept from call to call; a result's vectors may change places with the client's.

  /// ~reset. @param seed none: the generator continues
  void reset(std::optional<std::uint64_t> seed, Transition& transition);
  /// ~step. @param action `size` values, one per joint, unitless
  void step(const double* action, std::size_t size, Transition& transition);
  /// ~step_many: repeats an action, at the most until the episode ends. A server of an older
  /// version has no such service: only this call then fails, as a ConnectionError.
  /// @param action `size` values, one per joint, unitless
  /// @param steps  1 .. 100
  void step_many(const double* action, std::size_t size, std::uint32_t steps,
                 RepeatedStep& repeated);
  /// ~snapshot: the present episode, from its beginning to now.
  /// @param record receives EpisodeRecord.msg as it is sent; opaque here
  void snapshot(std::vector<std::uint8_t>& record);
  /// ~restore: the record's episode takes the place of the present one, and goes on.
  /// @param record      as `snapshot` gave it, of this server or another
  /// @param transition receives what the record's last step gave
  void restore(const std::vector<std::uint8_t>& record, Transition& transition);
  /// ~reset_batch.
  /// @param environments which; empty: all
  /// @param seeds        empty, or one per listed environment (none: its generator continues)
  void reset_batch(const std::vector<std::uint32_t>& environments,
                   const std::vector<std::optional<std::uint64_t>>& seeds, BatchReset& reset);
  /// ~step_batch. @param actions num_envs x action size, row-major, `size` values in all
  void step_batch(const double* actions, std::size_t size, BatchTransition& transition);
  /// ~render: what an environment shows now. A server of an older version has no such service:
  /// only this call then fails, as a ConnectionError.
  /// @param environment index within the server
  /// @param encoding    rgb8 (also when empty) fills `image.rgb`; 32FC1 fills `image.depth`
  /// @param camera      parameters in place of the server's own
  /// @param image       its camera_pose is left alone, for the service does not tell it
  void render(std::uint32_t environment, const std::string& encoding, const Parameters& camera,
              Image& image);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace walker

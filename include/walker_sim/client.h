// A client of a server on a ROS master, without any ROS library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/errors.h"
#include "walker_sim/export.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"
#include "walker_sim/world.h"

namespace walker {

struct ClientOptions {
  std::string server = "/walker_sim";  ///< the server's resolved node name
  std::string master_uri;              ///< empty: ROS_MASTER_URI, or http://localhost:11311
  /// Timeout of a call, including the connection that it may have to open: wall time in
  /// (0, 1e6] [s]. It does not cover DNS look-ups, which have the resolver's own timeouts.
  double timeout = 10;
  /// Returns whether a signal has arrived that ends the call with Interrupted. Runs in the calling
  /// thread, when a signal interrupts its wait and ten times a second during a call, as a signal
  /// may arrive outside a wait. Must not throw. Empty: calls continue after a signal.
  std::function<bool()> is_interrupted;
  /// Full node name by which the server identifies the client, e.g. in its log.
  /// Empty: /walker_sim_client_ followed by the process id.
  std::string caller;
  /// Longest time that a call polls for its answer before it blocks, in [0, 1000] [us]; 0: none;
  /// -1: twenty times what waking a thread costs on this machine, 50 to 1000 us. A call polls only
  /// while recent answers came within that time.
  std::int64_t spin_us = -1;
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

/// Reset.srv's response.
struct Reset {
  Transition transition;
  World world;  ///< drawn by the episode; empty: Gymnasium's world
};

/// EnvironmentWorld.msg.
struct EnvironmentWorld {
  std::uint32_t environment = 0;
  World world;  ///< drawn by its episode
};

/// StepMany.srv's response.
struct RepeatedStep {
  Transition transition;    ///< of the last step
  std::uint32_t steps = 0;  ///< steps made; fewer than requested if the episode ended
  double total_reward = 0;  ///< sum over these steps
};

/// StepBatch.srv's response; one row per environment, by index.
struct BatchTransition {
  std::vector<double> observations;      ///< num_envs x observation size
  std::vector<double> rewards;           ///< num_envs
  std::vector<std::uint8_t> terminated;  ///< num_envs
  std::vector<std::uint8_t> truncated;   ///< num_envs
  std::vector<std::uint32_t> episodes;   ///< num_envs
  std::vector<std::uint32_t> steps;      ///< num_envs
  std::vector<double> info;              ///< num_envs x info names
  // Environments whose engine failed in this call, and the engine's messages. With same_step an
  // environment may appear twice: first for its step, then for its reset.
  std::vector<std::uint32_t> failed_environments;
  std::vector<std::uint8_t> failed_at_reset;  ///< 1: at the reset of its current episode; 0: step
  std::vector<std::string> failures;
  // With same_step only: the episodes that ended in this call.
  std::vector<std::uint32_t> final_environments;
  std::vector<double> final_observations;  ///< final_environments x observation size
  std::vector<double> final_info;          ///< final_environments x info names
  /// What was drawn by environments that were reset in this call; not of those in Gymnasium's
  /// world.
  std::vector<EnvironmentWorld> worlds;
};

/// ResetBatch.srv's response; rows in the order of the request.
struct BatchReset {
  std::vector<double> observations;
  std::vector<double> info;
  // Environments whose engine failed, and the engine's messages.
  std::vector<std::uint32_t> failed_environments;
  std::vector<std::string> failures;
  std::vector<EnvironmentWorld> worlds;  ///< what was drawn; not of those in Gymnasium's world
};

/// EnvironmentSpec.msg.
struct ServerSpecification {
  std::uint32_t interface_version = 0;
  std::string id;
  std::uint32_t num_envs = 0;
  std::vector<std::string> parameter_names;
  std::vector<std::string> parameter_values;
  World world;  ///< of the shown environment's resets to come; empty: Gymnasium's
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

/// Calls a server's services over persistent connections. Not thread-safe.
///
/// A call blocks on a socket in the calling thread until the answer is complete. If the connection
/// breaks (the server died or was restarted), the call throws ConnectionError, and the next call
/// looks the server up again. A call is never sent twice: after a ConnectionError it is unknown
/// whether the server executed it.
///
/// Buffers are reused, so that a step allocates no memory. Answers are validated against the last
/// received specification: a wrong size or an index out of range is a ConnectionError. Strings are
/// UTF-8; bytes that are not valid UTF-8 are escaped in hexadecimal.
///
/// A client belongs to the process that constructed it. In the child of a fork every call throws
/// ConnectionError; the parent's client is not affected.
class WALKER_SIM_EXPORT Client {
 public:
  /// Connects and reads the specification.
  /// @throws ConnectionError naming the master, the service and the cause; Interrupted;
  ///         std::invalid_argument naming the invalid option, its value and the allowed values
  explicit Client(const ClientOptions& options = {});
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  /// ~get_spec: the current specification, also of a restarted server. Call it again if the server
  /// may have been restarted with other parameters.
  /// @throws ConnectionError, Interrupted
  ServerSpecification specification();

  // The calls below throw ConnectionError, Interrupted, RequestRefused, or std::invalid_argument
  // if the request is too large to send; the result is then unchanged. Memory is reused: a
  // result's vectors may be swapped with the client's own.

  /// ~reset. @param seed std::nullopt: the generator continues
  void reset(std::optional<std::uint64_t> seed, Transition& transition);
  /// @param world of this and the following episodes; empty: Gymnasium's. std::nullopt: the
  /// server's
  void reset(std::optional<std::uint64_t> seed, const std::optional<World>& world, Reset& reset);
  /// ~step. @param action `size` values, one per joint, unitless
  void step(const double* action, std::size_t size, Transition& transition);
  /// ~step_many: repeats an action until the steps are made or the episode ends. Older servers lack
  /// this service: only this call then throws ConnectionError.
  /// @param action as for `step`
  /// @param steps  1 .. 100
  void step_many(const double* action, std::size_t size, std::uint32_t steps,
                 RepeatedStep& repeated);
  /// ~snapshot: records the current episode from its beginning.
  /// @param record receives the serialized EpisodeRecord.msg; opaque to the client
  void snapshot(std::vector<std::uint8_t>& record);
  /// ~restore: replaces the current episode by the recorded one, which then continues.
  /// @param record     from `snapshot`, of this server or another
  /// @param transition receives the transition of the record's last step
  void restore(const std::vector<std::uint8_t>& record, Transition& transition);
  void restore(const std::vector<std::uint8_t>& record, Reset& reset);
  /// ~set_state: sets generalized positions and velocities; the episode continues from there, even
  /// if it has ended.
  /// @param environment index within the server
  /// @param position, velocity in the engine's order [m, rad, m/s, rad/s]
  /// @param transition  receives the present step with the state that was set
  void set_state(std::uint32_t environment, const std::vector<double>& position,
                 const std::vector<double>& velocity, Transition& transition);
  /// ~reset_batch.
  /// @param environments indices; empty: all
  /// @param seeds empty, or one per listed environment; std::nullopt: its generator continues
  void reset_batch(const std::vector<std::uint32_t>& environments,
                   const std::vector<std::optional<std::uint64_t>>& seeds, BatchReset& reset);
  /// @param worlds of these and the following episodes: one for all, or one per listed environment;
  ///               empty: the server's
  void reset_batch(const std::vector<std::uint32_t>& environments,
                   const std::vector<std::optional<std::uint64_t>>& seeds,
                   const std::vector<World>& worlds, BatchReset& reset);
  /// ~set_world: sets the worlds of environments, from each one's next reset on.
  /// @param environments indices; empty: all
  /// @param worlds one for all, or one per listed environment; an empty World is Gymnasium's
  void set_world(const std::vector<std::uint32_t>& environments, const std::vector<World>& worlds);
  /// ~step_batch. @param actions num_envs x action size, row-major, `size` values in total
  void step_batch(const double* actions, std::size_t size, BatchTransition& transition);
  /// ~render: draws the current state of an environment. Older servers lack this service: only this
  /// call then throws ConnectionError.
  /// @param environment index within the server
  /// @param encoding    rgb8 (also when empty) fills `image.rgb`; 32FC1 fills `image.depth`
  /// @param camera      parameters that override the server's
  /// @param image       its camera_pose is unchanged: the service does not return it
  void render(std::uint32_t environment, const std::string& encoding, const Parameters& camera,
              Image& image);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace walker

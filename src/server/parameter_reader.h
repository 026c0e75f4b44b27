// The server's options, out of its private parameters.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/parameters.h"
#include "walker_sim/pool.h"

namespace walker {

enum class Mode { free, lockstep };

/// "free" or "lockstep".
const char* to_text(Mode mode);

/// What walker_sim's private parameters choose; defaults and ranges in `server_parameters()`.
struct ServerOptions {
  std::string id;
  Mode mode;
  std::uint32_t num_envs = 1;
  std::uint32_t num_threads = 0;  ///< that step many environments; 0: one per processor
  /// What happens at an episode's end: in lock-step when ~step_batch comes next, else by itself.
  AutoresetMode autoreset_mode = AutoresetMode::next_step;
  std::uint32_t shown_environment = 0;  ///< index of the one that the topics tell of
  std::optional<std::uint64_t> seed;    ///< none: drawn
  double real_time_factor;              ///< 0: as fast as it goes
  bool auto_reset;
  double command_timeout;  ///< [s]; 0: never
  bool publish_clock;
  bool paused;
  double camera_rate = 0;  ///< pictures per second of simulation time; 0: of every state
  std::string recorder;    ///< full name of the node that is waited for; empty: none
  std::string tf_prefix;   ///< without slashes at its ends; may be empty
  Parameters environment;  ///< the environment's own
  Parameters camera;       ///< those of its camera, under the names that `make_renderer` takes
};

/// The server's own parameters; those of the environment and of its camera come beside them.
std::vector<ParameterDescription> server_parameters();

/// How the server calls a parameter of the camera: camera_width for width, camera_id for camera_id.
std::string camera_parameter(const std::string& name);

/// The camera's parameters as the server calls them.
/// @throws std::invalid_argument for an unknown id
std::vector<ParameterDescription> server_camera_parameters(const std::string& id);

/// The names of those that some environment or its camera has beside `server_parameters()`.
std::vector<std::string> environment_parameter_names();

/// Reads and checks all private parameters of this node.
/// @throws std::invalid_argument naming the parameter, its value and what is allowed
ServerOptions read_server_options();

/// `frame` under the prefix, without a leading slash, as robot_state_publisher names frames.
std::string prefixed(const std::string& tf_prefix, const std::string& frame);

}  // namespace walker

// The server's options, read from its private parameters.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/parameters.h"
#include "walker_sim/pool.h"
#include "walker_sim/world.h"

namespace walker {

enum class Mode { free, lockstep };

const char* to_text(Mode mode);

/// Values of walker_sim's private parameters; `server_parameters()` has their defaults and ranges.
struct ServerOptions {
  std::string id;
  Mode mode;
  std::uint32_t num_envs = 1;
  std::uint32_t num_threads = 0;  ///< for several environments; 0: one per processor
  /// What follows an episode's end: within ~step_batch in lockstep, automatically in mode free.
  AutoresetMode autoreset_mode = AutoresetMode::next_step;
  std::uint32_t shown_environment = 0;  ///< index of the published environment
  std::optional<std::uint64_t> seed;    ///< none: drawn at random
  World world;                          ///< of all environments; empty: Gymnasium's
  double real_time_factor;              ///< 0: as fast as possible
  bool auto_reset;
  double command_timeout;  ///< [s]; 0: none
  bool publish_clock;
  bool paused;
  double max_topic_rate = 0;         ///< states that topics show per second in lockstep; 0: all
  double camera_rate = 0;            ///< pictures per second of simulation time; 0: one per state
  std::chrono::microseconds spin{};  ///< longest time to poll for the next request
  int realtime_priority = 0;         ///< of the thread that steps; 0: the system's usual schedule
  std::string recorder;              ///< full name of the node to wait for; empty: none
  std::string tf_prefix;             ///< without leading and trailing slashes; may be empty
  Parameters environment;            ///< of the environment
  Parameters camera;                 ///< of its camera, with the names that `make_renderer` takes
};

/// Descriptions of the server's own parameters, without those of the environment and its camera.
std::vector<ParameterDescription> server_parameters();

/// The server's name of a camera parameter: camera_width for width, camera_id for camera_id.
std::string camera_parameter(const std::string& name);

/// Descriptions of the camera's parameters, with the server's names.
/// @throws std::invalid_argument if the id is unknown
std::vector<ParameterDescription> server_camera_parameters(const std::string& id);

/// The server's names of the parameters of all environments and their cameras.
std::vector<std::string> environment_parameter_names();

/// Reads and checks all private parameters of this node.
/// @throws std::invalid_argument naming the parameter, its value and what is allowed
ServerOptions read_server_options();

}  // namespace walker

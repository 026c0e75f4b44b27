#include "server/parameter_reader.h"

#include <set>
#include <stdexcept>

#include <ros/names.h>
#include <ros/param.h>
#include <ros/this_node.h>

#include "base/limits.h"
#include "base/spin_wait.h"
#include "ros/private_parameters.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr double kMaxTimeout = 3600;
constexpr double kMaxRate = 1000;
constexpr int kMaxRealtimePriority = 99;  // of Linux
constexpr double kMaxTopicRate = 1e6;

Mode parse_mode(const std::string& text) {
  if (text == to_text(Mode::free)) return Mode::free;
  if (text == to_text(Mode::lockstep)) return Mode::lockstep;
  throw std::invalid_argument("parameter mode = " + text + ": must be free or lockstep");
}

AutoresetMode parse_autoreset_mode(const std::string& text) {
  if (const auto mode = find_autoreset_mode(text)) return *mode;
  throw std::invalid_argument("parameter autoreset_mode = " + text +
                              ": must be next_step, same_step or disabled");
}

/// Finds the nearest tf_prefix up the namespaces, as robot_state_publisher does.
std::string find_tf_prefix() {
  std::string key;
  std::string prefix;
  if (ros::param::search(ros::this_node::getName(), "tf_prefix", key)) ros::param::get(key, prefix);
  const std::size_t first = prefix.find_first_not_of('/');
  if (first == std::string::npos) return "";
  return prefix.substr(first, prefix.find_last_not_of('/') - first + 1);
}

/// Resolves the recorder's name in the namespace of this node.
std::string resolve_recorder(const std::string& name) {
  if (name.empty()) return "";
  std::string error;
  if (!ros::names::validate(name, error)) {
    throw std::invalid_argument("parameter wait_for_recorder = " + name +
                                ": must be the name of a node, or empty; " + error);
  }
  return ros::names::resolve(name);
}

/// Converts a YAML mapping `world`, which the parameter server keeps as world/NAME, to text.
void take_mapping_as_text(Parameters& given) {
  const std::string prefix = "world/";
  std::string text;
  for (auto next = given.lower_bound(prefix);
       next != given.end() && next->first.compare(0, prefix.size(), prefix) == 0;) {
    text += (text.empty() ? "{" : ", ") + next->first.substr(prefix.size()) + ": " +
            to_string(next->second);
    next = given.erase(next);
  }
  if (!text.empty()) given["world"] = text + "}";
}

/// @throws std::invalid_argument if the environment cannot apply the world
World read_world(const std::string& id, const std::string& text) {
  if (text.empty()) return {};
  try {
    World world = load_world(text);
    check_world(id, world);
    return world;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("parameter world = " + text + ": " + error.what());
  }
}

/// The id, whose parameters must be known before all can be checked.
std::string read_id(const Parameters& given) {
  const auto found = given.find("env");
  const ParameterValue value =
      found == given.end() ? server_parameters().front().default_value : found->second;
  if (const auto* id = std::get_if<std::string>(&value)) return *id;
  throw std::invalid_argument("parameter env = " + to_string(value) + ": must be a text");
}

std::uint32_t to_uint32(const Parameters& parameters, const char* name) {
  return static_cast<std::uint32_t>(std::get<std::int64_t>(parameters.at(name)));
}

/// Reads the options for several environments.
void read_batch_options(const Parameters& parameters, ServerOptions& options) {
  options.num_envs = to_uint32(parameters, "num_envs");
  options.num_threads = to_uint32(parameters, "num_threads");
  options.shown_environment = to_uint32(parameters, "shown_environment");
  options.autoreset_mode =
      parse_autoreset_mode(std::get<std::string>(parameters.at("autoreset_mode")));
  if (options.mode == Mode::free) {
    if (options.num_envs > 1) {
      throw std::invalid_argument("parameter num_envs = " + std::to_string(options.num_envs) +
                                  ": must be 1 in mode free, where one effort_command drives one "
                                  "walker; mode lockstep allows more");
    }
    options.autoreset_mode =
        options.auto_reset ? AutoresetMode::next_step : AutoresetMode::disabled;
  }
  if (options.shown_environment >= options.num_envs) {
    throw std::invalid_argument(
        "parameter shown_environment = " + std::to_string(options.shown_environment) +
        ": must be an integer in [0, " + std::to_string(options.num_envs - 1) +
        "], for num_envs = " + std::to_string(options.num_envs));
  }
}

}  // namespace

const char* to_text(Mode mode) { return mode == Mode::free ? "free" : "lockstep"; }

std::vector<ParameterDescription> server_parameters() {
  return {
      {"env", std::string("BipedalWalker-v3"), "", "Id of the environment.", 0, 0},
      {"mode", std::string("free"), "",
       "Stepping mode: free (the server steps) or lockstep (clients step by ~step).", 0, 0},
      {"num_envs", std::int64_t{1}, "",
       "Number of environments; more than one needs mode lockstep.", 1, kMaxEnvironments},
      {"num_threads", std::int64_t{0}, "",
       "Threads that step several environments; 0: one per processor.", 0, kMaxThreads},
      {"autoreset_mode", std::string("next_step"), "",
       "What ~step_batch does after an episode ends: next_step, same_step or disabled.", 0, 0},
      {"shown_environment", std::int64_t{0}, "",
       "Index of the environment whose topics are published; less than num_envs.", 0,
       kMaxEnvironments - 1},
      {"seed", std::string(), "",
       "Seed of the first reset if its request has none, as decimal text; empty: drawn at random. "
       "Environment i uses seed + i.",
       0, 0},
      {"world", std::string(), "",
       "World of all environments: a preset, a YAML file or {NAME: NUMBER, NAME: [LOW, HIGH], "
       "NAME: {log: [LOW, HIGH]}}; empty: Gymnasium's.",
       0, 0},
      {"real_time_factor", 1.0, "",
       "Simulation time over wall time in mode free; 0: as fast as possible.", 0,
       kMaxRealTimeFactor},
      {"auto_reset", true, "",
       "Start the next episode automatically in mode free; after a failed reset a second of wall "
       "time later.",
       0, 0},
      {"command_timeout", 0.5, "s",
       "Age after which zero torque replaces an effort command, in wall time if real_time_factor "
       "is "
       "0; 0: never.",
       0, kMaxTimeout},
      {"publish_clock", true, "",
       "Publish /clock; false: follow it in mode free, which needs /use_sim_time.", 0, 0},
      {"paused", false, "", "Start paused in mode free.", 0, 0},
      {"spin_us", std::int64_t{kMeasuredSpin}, "us",
       "Longest time that the server polls for the next request after an answer, before it blocks; "
       "it polls only while requests come that soon. 0: never; -1: twenty times what waking a "
       "thread costs here.",
       kMeasuredSpin, kMaxSpinMicroseconds},
      {"realtime_priority", std::int64_t{0}, "",
       "Priority under SCHED_FIFO of the thread that steps, before all ordinary threads of the "
       "machine; needs the permission for it. 0: the ordinary schedule.",
       0, kMaxRealtimePriority},
      {"wait_for_recorder", std::string(), "",
       "Name of the recording node: the server neither steps nor advertises services before that "
       "node subscribes to episode_record, which replay needs. Empty: do not wait.",
       0, 0},
      {"tf_prefix", std::string(), "",
       "Prefix of all frames. If it is not given, the nearest tf_prefix in the enclosing "
       "namespaces is used.",
       0, 0},
      {"max_topic_rate", 100.0, "1/s",
       "Largest number of states per second of wall time that topics show in mode lockstep while "
       "calls follow each other within 1 ms. transition, episode and episode_record have all "
       "states; pictures keep camera_rate. 0: all states.",
       0, kMaxTopicRate},
      {"camera_rate", 25.0, "1/s",
       "Pictures per second of simulation time while there are subscribers; 0: one per state.", 0,
       kMaxRate},
      {"diagnostic_period", 1.0, "s", "Wall time between diagnostics.", 0.01, kMaxTimeout},
  };
}

std::string camera_parameter(const std::string& name) {
  const std::string prefix = "camera_";
  return name.rfind(prefix, 0) == 0 ? name : prefix + name;
}

std::vector<ParameterDescription> server_camera_parameters(const std::string& id) {
  std::vector<ParameterDescription> descriptions = camera_parameter_descriptions(id);
  for (ParameterDescription& description : descriptions) {
    description.name = camera_parameter(description.name);
  }
  return descriptions;
}

std::vector<std::string> environment_parameter_names() {
  std::set<std::string> names;
  for (const Registration& registration : registrations()) {
    for (const auto& one : parameter_descriptions(registration.id)) names.insert(one.name);
    for (const auto& one : server_camera_parameters(registration.id)) names.insert(one.name);
  }
  return {names.begin(), names.end()};
}

ServerOptions read_server_options() {
  Parameters given = private_parameters();
  take_as_text("seed", given);
  take_mapping_as_text(given);
  ServerOptions options;
  options.id = read_id(given);
  const std::vector<ParameterDescription> environment = parameter_descriptions(options.id);
  const std::vector<ParameterDescription> camera = server_camera_parameters(options.id);
  std::vector<ParameterDescription> all = server_parameters();
  all.insert(all.end(), environment.begin(), environment.end());
  all.insert(all.end(), camera.begin(), camera.end());
  take_numbers(all, given);
  const Parameters complete = complete_parameters(all, given);
  for (const ParameterDescription& description : environment) {
    options.environment[description.name] = complete.at(description.name);
  }
  for (const ParameterDescription& description : camera_parameter_descriptions(options.id)) {
    options.camera[description.name] = complete.at(camera_parameter(description.name));
  }
  options.mode = parse_mode(std::get<std::string>(complete.at("mode")));
  options.seed = parse_seed("seed", std::get<std::string>(complete.at("seed")));
  options.world = read_world(options.id, std::get<std::string>(complete.at("world")));
  options.real_time_factor = std::get<double>(complete.at("real_time_factor"));
  options.auto_reset = std::get<bool>(complete.at("auto_reset"));
  read_batch_options(complete, options);
  options.command_timeout = std::get<double>(complete.at("command_timeout"));
  options.publish_clock = std::get<bool>(complete.at("publish_clock"));
  options.paused = std::get<bool>(complete.at("paused"));
  options.max_topic_rate = std::get<double>(complete.at("max_topic_rate"));
  options.camera_rate = std::get<double>(complete.at("camera_rate"));
  options.spin = spin_limit(std::get<std::int64_t>(complete.at("spin_us")));
  options.realtime_priority = static_cast<int>(to_uint32(complete, "realtime_priority"));
  options.recorder = resolve_recorder(std::get<std::string>(complete.at("wait_for_recorder")));
  options.tf_prefix = find_tf_prefix();
  return options;
}

}  // namespace walker

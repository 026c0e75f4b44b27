#include "client/messages.h"

#include <algorithm>

namespace walker {
namespace {

// Source: sensor_msgs/image_encodings.h.
constexpr const char* kColorEncoding = "rgb8";
constexpr const char* kDepthEncoding = "32FC1";

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("its answer's " + what);
}

void check_size(const char* field, std::size_t size, std::size_t wanted) {
  if (size == wanted) return;
  fail(std::string(field) + " has " + std::to_string(size) + " elements; must have " +
       std::to_string(wanted));
}

std::string element(const char* field, std::size_t index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

[[noreturn]] void fail_index(const std::string& field, std::uint32_t environment,
                             std::size_t num_envs) {
  fail(field + " is " + std::to_string(environment) +
       "; must be below num_envs = " + std::to_string(num_envs));
}

void check_flags(const char* field, const std::vector<std::uint8_t>& flags) {
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (flags[i] <= 1) continue;
    fail(element(field, i) + " is " + std::to_string(flags[i]) + "; must be 0 or 1");
  }
}

/// Requires strictly increasing indices below `num_envs`.
void check_environments(const char* field, const std::vector<std::uint32_t>& environments,
                        std::size_t num_envs) {
  for (std::size_t i = 0; i < environments.size(); ++i) {
    const std::uint32_t index = environments[i];
    if (index >= num_envs) fail_index(element(field, i), index, num_envs);
    if (i > 0 && index <= environments[i - 1]) {
      fail(element(field, i) + " is " + std::to_string(index) + "; must be above the one before, " +
           std::to_string(environments[i - 1]));
    }
  }
}

void check_failures(const std::vector<std::uint32_t>& environments,
                    const std::vector<std::string>& failures, std::size_t num_envs) {
  check_size("failures", failures.size(), environments.size());
  for (std::size_t i = 0; i < environments.size(); ++i) {
    if (environments[i] < num_envs) continue;
    fail_index(element("failed_environments", i), environments[i], num_envs);
  }
}

}  // namespace

void refuse(std::string_view reason) {
  throw RequestRefused(reason.empty() ? "the server gives no reason" : to_utf8(reason));
}

namespace {

/// Reads `success` and `status_message`. @throws RequestRefused if `success` is false
void read_outcome(Reader& reader) {
  bool success = false;
  reader.read(success);
  const std::string_view message = reader.text();
  if (!success) refuse(message);
}

/// Reads a std_msgs/Header and returns its stamp [ns].
std::uint64_t read_header(Reader& reader) {
  std::uint32_t sequence_number = 0;
  std::uint32_t seconds = 0;
  std::uint32_t nanoseconds = 0;
  reader.read(sequence_number, seconds, nanoseconds);
  reader.text();
  constexpr std::uint64_t kPerSecond = 1000000000;
  return seconds * kPerSecond + nanoseconds;
}

/// Reads a WorldParameter[].
World read_world(Reader& reader) {
  constexpr std::size_t kMinBytes = tcpros::kLengthBytes + 2 * sizeof(double) + sizeof(bool);
  World world;
  const std::uint32_t size = reader.count(kMinBytes);
  if (size > kMaxWorldParameters) {
    fail("world has " + std::to_string(size) + " parameters; must have at most " +
         std::to_string(kMaxWorldParameters));
  }
  for (std::uint32_t i = 0; i < size; ++i) {
    std::string name;
    WorldRange range;
    reader.read(name, range.low, range.high, range.is_log_uniform);
    if (!world.emplace(name, range).second) {
      fail("world has " + printable(name, kMaxQuotedBytes) + " twice");
    }
  }
  return world;
}

/// Reads what an episode has drawn: numbers, and ranges of what changes within it.
World read_drawn_world(Reader& reader) {
  World world = read_world(reader);
  const bool can_change = world.count(kChangeInterval) != 0;
  for (const auto& [name, range] : world) {
    const bool is_range = can_change && name != kChangeInterval && range.low < range.high;
    if (is_range || range.is_number()) continue;
    fail("world has a range for " + printable(name, kMaxQuotedBytes) + "; must have a number");
  }
  return world;
}

void read_worlds(Reader& reader, std::size_t num_envs, std::vector<EnvironmentWorld>& worlds) {
  constexpr std::size_t kMinBytes = 2 * sizeof(std::uint32_t);
  const std::size_t size = reader.count(kMinBytes);
  if (size > num_envs) {
    fail("worlds has " + std::to_string(size) + " elements; must have at most " +
         std::to_string(num_envs));
  }
  worlds.resize(size);
  for (std::size_t i = 0; i < worlds.size(); ++i) {
    reader.read(worlds[i].environment);
    if (worlds[i].environment >= num_envs) {
      fail_index(element("worlds", i) + ".environment", worlds[i].environment, num_envs);
    }
    worlds[i].world = read_drawn_world(reader);
  }
}

void read_fields(Reader& reader, Transition& transition) {
  transition.stamp = read_header(reader);
  reader.read(transition.environment, transition.episode, transition.step, transition.action,
              transition.observation, transition.reward, transition.episode_return,
              transition.terminated, transition.truncated, transition.info, transition.error);
}

void check(const ServerSpecification& server, const Transition& transition) {
  check_size("observation", transition.observation.size(), server.observation_size);
  check_size("info", transition.info.size(), server.info_names.size());
  if (transition.environment >= server.num_envs) {
    fail_index("environment", transition.environment, server.num_envs);
  }
  check_size("action", transition.action.size(), transition.step == 0 ? 0 : server.action_size);
}

/// Checks a picture's width or height, if the request set it.
void check_requested(const Parameters& camera, const char* name, std::uint32_t received) {
  const auto found = camera.find(name);
  if (found == camera.end()) return;
  const auto* const requested = std::get_if<std::int64_t>(&found->second);
  if (requested == nullptr || *requested == received) return;
  throw std::runtime_error(std::string("the picture's ") + name + " is " +
                           std::to_string(received) + " instead of " + std::to_string(*requested));
}

}  // namespace

void write(Writer& writer, const std::optional<World>& world) {
  writer.text(world && world->empty() ? kGymnasiumsWorld : "");
  writer.number(world ? static_cast<std::uint32_t>(world->size()) : 0U);
  if (!world) return;
  for (const auto& [name, range] : *world) {
    writer.text(name);
    writer.number(range.low);
    writer.number(range.high);
    writer.number(std::uint8_t{range.is_log_uniform});
  }
}

void write(Writer& writer, const std::vector<World>& worlds) {
  writer.number(static_cast<std::uint32_t>(worlds.size()));
  for (const World& world : worlds) write(writer, std::optional<World>(world));
}

std::size_t max_answer_bytes(ServiceIndex service, const ServerSpecification& server) {
  constexpr std::size_t kWords = std::size_t{1} << 20U;  // strings and small fields
  constexpr std::size_t kTexts = 1536;                   // the message of an environment's failure
  constexpr std::size_t kNumbers =
      sizeof(double) + 3 * sizeof(std::uint8_t) + 4 * sizeof(std::uint32_t);
  const std::size_t row =
      (std::size_t{server.observation_size} + server.info_names.size()) * sizeof(double);
  const std::size_t action = server.action_size * sizeof(double);
  std::size_t bytes = row + action + kWords;  // a transition
  if (service == kGetSpec) bytes = kMaxSpecificationBytes;
  if (service == kResetBatch || service == kStepBatch) {  // includes final rows
    bytes = server.num_envs * (2 * row + kNumbers + kTexts + kMaxWorldBytes) + kWords;
  }
  if (service == kSnapshot) {
    const std::size_t steps = kMaxRecordedSteps * (action + sizeof(std::uint64_t));
    bytes = steps + kMaxRecordedPushes * kPushBytes + kMaxRecordedCoordinates * kCoordinatesBytes +
            kMaxSpecificationBytes + kWords;
  }
  if (service == kRender) bytes = std::size_t{kMaxPixels} * kMaxPixels * sizeof(float) + kWords;
  return std::min(bytes, tcpros::kMaxMessageBytes);
}

void read(Reader& reader, ServerSpecification& server) {
  reader.read(server.interface_version, server.id, server.num_envs, server.parameter_names,
              server.parameter_values);
  reader.text();  // the preset: gymnasium, without parameters, or empty
  server.world = read_world(reader);
  reader.read(server.observation_size, server.observation_dtype, server.observation_low,
              server.observation_high, server.action_size, server.action_low, server.action_high,
              server.dt, server.max_episode_steps, server.reward_threshold, server.joint_names,
              server.info_names, server.mode, server.autoreset_mode, server.engine,
              server.engine_version, server.engine_path, server.version);
  reader.finish();
  if (server.num_envs < 1 || server.num_envs > kMaxEnvironments) {
    fail("num_envs is " + std::to_string(server.num_envs) + "; must be in [1, " +
         std::to_string(kMaxEnvironments) + "]");
  }
  check_size("parameter_values", server.parameter_values.size(), server.parameter_names.size());
  check_size("observation_low", server.observation_low.size(), server.observation_size);
  check_size("observation_high", server.observation_high.size(), server.observation_size);
  check_size("action_low", server.action_low.size(), server.action_size);
  check_size("action_high", server.action_high.size(), server.action_size);
  check_size("joint_names", server.joint_names.size(), server.action_size);
}

void read(Reader& reader) {
  read_outcome(reader);
  reader.finish();
}

void read(Reader& reader, const ServerSpecification& server, Reset& reset) {
  read_outcome(reader);
  read_fields(reader, reset.transition);
  reset.world = read_drawn_world(reader);
  reader.finish();
  check(server, reset.transition);
}

void read(Reader& reader, const ServerSpecification& server, Transition& transition) {
  read_outcome(reader);
  read_fields(reader, transition);
  reader.finish();
  check(server, transition);
}

void read(Reader& reader, const ServerSpecification& server, std::uint32_t steps,
          RepeatedStep& repeated) {
  read_outcome(reader);
  read_fields(reader, repeated.transition);
  reader.read(repeated.steps, repeated.total_reward);
  reader.finish();
  check(server, repeated.transition);
  if (repeated.steps < 1 || repeated.steps > steps) {
    fail("steps is " + std::to_string(repeated.steps) + "; must be in [1, " +
         std::to_string(steps) + "]");
  }
}

void read(Reader& reader, const ServerSpecification& /*server*/,
          std::vector<std::uint8_t>& record) {
  read_outcome(reader);
  const std::size_t size = reader.size();
  const std::uint8_t* const begin = reader.bytes(size);
  record.assign(begin, begin + size);
}

void read(Reader& reader, const ServerSpecification& server, std::size_t rows, BatchReset& reset) {
  read_outcome(reader);
  reader.read(reset.observations, reset.info, reset.failed_environments);
  reader.read_texts(reset.failures, rows);
  read_worlds(reader, server.num_envs, reset.worlds);
  reader.finish();
  check_failures(reset.failed_environments, reset.failures, server.num_envs);
  check_size("observations", reset.observations.size(), rows * server.observation_size);
  check_size("info", reset.info.size(), rows * server.info_names.size());
}

void read(Reader& reader, const ServerSpecification& server, BatchTransition& batch) {
  read_outcome(reader);
  reader.read(batch.observations, batch.rewards, batch.terminated, batch.truncated, batch.episodes,
              batch.steps, batch.info, batch.failed_environments, batch.failed_at_reset);
  reader.read_texts(batch.failures, std::size_t{2} * server.num_envs);
  reader.read(batch.final_environments, batch.final_observations, batch.final_info);
  read_worlds(reader, server.num_envs, batch.worlds);
  reader.finish();
  check_failures(batch.failed_environments, batch.failures, server.num_envs);
  check_size("failed_at_reset", batch.failed_at_reset.size(), batch.failures.size());
  check_flags("failed_at_reset", batch.failed_at_reset);
  const std::size_t rows = server.num_envs;
  check_size("observations", batch.observations.size(), rows * server.observation_size);
  check_size("rewards", batch.rewards.size(), rows);
  check_size("terminated", batch.terminated.size(), rows);
  check_flags("terminated", batch.terminated);
  check_size("truncated", batch.truncated.size(), rows);
  check_flags("truncated", batch.truncated);
  check_size("episodes", batch.episodes.size(), rows);
  check_size("steps", batch.steps.size(), rows);
  check_size("info", batch.info.size(), rows * server.info_names.size());
  check_environments("final_environments", batch.final_environments, rows);
  const std::size_t ended = batch.final_environments.size();
  check_size("final_observations", batch.final_observations.size(),
             ended * server.observation_size);
  check_size("final_info", batch.final_info.size(), ended * server.info_names.size());
}

void read(Reader& reader, const std::string& encoding, const Parameters& camera, Image& image) {
  constexpr std::size_t kChannels = 3;
  read_outcome(reader);
  read_header(reader);
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string received_encoding;
  bool is_bigendian = false;
  std::uint32_t row_bytes = 0;
  reader.read(height, width, received_encoding, is_bigendian, row_bytes);
  const bool is_depth = encoding == kDepthEncoding;
  const std::string wanted_encoding = is_depth ? kDepthEncoding : kColorEncoding;
  if (received_encoding != wanted_encoding || is_bigendian) {
    throw std::runtime_error("the picture's encoding is " + printable(received_encoding) +
                             (is_bigendian ? ", big-endian" : "") + " instead of " +
                             wanted_encoding);
  }
  check_requested(camera, "width", width);
  check_requested(camera, "height", height);
  const std::size_t wanted_bytes = std::size_t{width} * (is_depth ? sizeof(float) : kChannels);
  if (row_bytes != wanted_bytes) {
    throw std::runtime_error("the picture's rows have " + std::to_string(row_bytes) +
                             " bytes instead of " + std::to_string(wanted_bytes));
  }
  const std::string_view data = reader.text();  // a uint8[] has a string's form
  const std::size_t bytes = std::size_t{row_bytes} * height;
  if (data.size() != bytes) {
    throw std::runtime_error(std::to_string(data.size()) + " bytes of data came instead of " +
                             std::to_string(bytes));
  }
  reader.finish();
  image.rgb.clear();
  image.depth.clear();
  if (is_depth) {
    image.depth.resize(bytes / sizeof(float));
    data.copy(reinterpret_cast<char*>(image.depth.data()), bytes);
  } else {
    image.rgb.assign(data.begin(), data.end());
  }
  image.width = width;
  image.height = height;
}

}  // namespace walker

#include "client/messages.h"

#include "core/limits.h"

namespace walker {
namespace {

// As sensor_msgs/image_encodings.h names them.
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

template <typename Number>
Numbers<Number> array_of(Reader& reader, const char* field, std::size_t size) {
  const Numbers<Number> numbers = reader.array<Number>();
  check_size(field, numbers.size(), size);
  return numbers;
}

std::string element(const char* field, std::size_t index, std::uint64_t value) {
  return std::string(field) + "[" + std::to_string(index) + "] is " + std::to_string(value);
}

/// One per environment.
Numbers<std::uint8_t> flags_of(Reader& reader, const char* field, std::size_t size) {
  const auto flags = array_of<std::uint8_t>(reader, field, size);
  for (std::size_t i = 0; i < size; ++i) {
    if (flags[i] > 1) fail(element(field, i, flags[i]) + "; must be 0 or 1");
  }
  return flags;
}

/// In their order, so that each comes once.
Numbers<std::uint32_t> environments_of(Reader& reader, const char* field, std::size_t num_envs) {
  const auto environments = reader.array<std::uint32_t>();
  for (std::size_t i = 0; i < environments.size(); ++i) {
    const std::uint32_t index = environments[i];
    if (index >= num_envs) {
      fail(element(field, i, index) + "; must be below num_envs = " + std::to_string(num_envs));
    }
    if (i > 0 && index <= environments[i - 1]) {
      fail(element(field, i, index) + "; must be above the one before, " +
           std::to_string(environments[i - 1]));
    }
  }
  return environments;
}

/// std_msgs/Header, of which the stamp matters.
/// @return [ns]
std::uint64_t read_header(Reader& reader) {
  reader.number<std::uint32_t>();  // the sequence number
  const auto seconds = reader.number<std::uint32_t>();
  const auto nanoseconds = reader.number<std::uint32_t>();
  reader.text();
  constexpr std::uint64_t kPerSecond = 1000000000;
  return seconds * kPerSecond + nanoseconds;
}

/// A picture's width or height, where it was asked for.
void check_asked(const Parameters& camera, const char* name, std::uint32_t told) {
  const auto found = camera.find(name);
  if (found == camera.end()) return;
  const auto* const asked = std::get_if<std::int64_t>(&found->second);
  if (asked == nullptr || *asked == told) return;
  throw std::runtime_error(std::string("the picture's ") + name + " is " + std::to_string(told) +
                           " instead of " + std::to_string(*asked));
}

/// By what the specification says of itself.
void check(const ServerSpecification& told) {
  if (told.num_envs < 1 || told.num_envs > kMostEnvironments) {
    fail("num_envs is " + std::to_string(told.num_envs) + "; must be in [1, " +
         std::to_string(kMostEnvironments) + "]");
  }
  check_size("parameter_values", told.parameter_values.size(), told.parameter_names.size());
  check_size("observation_low", told.observation_low.size(), told.observation_size);
  check_size("observation_high", told.observation_high.size(), told.observation_size);
  check_size("action_low", told.action_low.size(), told.action_size);
  check_size("action_high", told.action_high.size(), told.action_size);
  check_size("joint_names", told.joint_names.size(), told.action_size);
}

}  // namespace

AnswerSizes::AnswerSizes(const ServerSpecification& specification)
    : num_envs(specification.num_envs),
      observation(specification.observation_size),
      action(specification.action_size),
      info(specification.info_names.size()) {}

void read(Reader& reader, ServerSpecification& specification) {
  ServerSpecification told;
  told.interface_version = reader.number<std::uint32_t>();
  told.id = reader.text();
  told.num_envs = reader.number<std::uint32_t>();
  told.parameter_names = reader.texts();
  told.parameter_values = reader.texts();
  told.observation_size = reader.number<std::uint32_t>();
  told.observation_dtype = reader.text();
  reader.array<double>().copy_to(told.observation_low);
  reader.array<double>().copy_to(told.observation_high);
  told.action_size = reader.number<std::uint32_t>();
  reader.array<double>().copy_to(told.action_low);
  reader.array<double>().copy_to(told.action_high);
  told.dt = reader.number<double>();
  told.max_episode_steps = reader.number<std::uint32_t>();
  told.reward_threshold = reader.number<double>();
  told.joint_names = reader.texts();
  told.info_names = reader.texts();
  told.mode = reader.text();
  told.autoreset_mode = reader.text();
  told.engine = reader.text();
  told.engine_version = reader.text();
  told.engine_path = reader.text();
  told.version = reader.text();
  reader.finish();
  check(told);
  specification = std::move(told);
}

void read(Reader& reader, const AnswerSizes& sizes, Transition& transition) {
  const std::uint64_t stamp = read_header(reader);
  const auto environment = reader.number<std::uint32_t>();
  const auto episode = reader.number<std::uint32_t>();
  const auto step = reader.number<std::uint32_t>();
  const auto action = reader.array<double>();
  const auto observation = array_of<double>(reader, "observation", sizes.observation);
  const auto reward = reader.number<double>();
  const auto episode_return = reader.number<double>();
  const bool terminated = reader.flag();
  const bool truncated = reader.flag();
  const auto info = array_of<double>(reader, "info", sizes.info);
  const std::string_view error = reader.text();
  reader.finish();
  if (environment >= sizes.num_envs) {
    fail("environment is " + std::to_string(environment) +
         "; must be below num_envs = " + std::to_string(sizes.num_envs));
  }
  check_size("action", action.size(), step == 0 ? 0 : sizes.action);
  transition.stamp = stamp;
  transition.environment = environment;
  transition.episode = episode;
  transition.step = step;
  action.copy_to(transition.action);
  observation.copy_to(transition.observation);
  transition.reward = reward;
  transition.episode_return = episode_return;
  transition.terminated = terminated;
  transition.truncated = truncated;
  info.copy_to(transition.info);
  transition.error = error;
}

void read(Reader& reader, const AnswerSizes& sizes, std::size_t rows, BatchReset& reset) {
  const auto observations = array_of<double>(reader, "observations", rows * sizes.observation);
  const auto info = array_of<double>(reader, "info", rows * sizes.info);
  reader.finish();
  observations.copy_to(reset.observations);
  info.copy_to(reset.info);
}

void read(Reader& reader, const AnswerSizes& sizes, BatchTransition& transition) {
  const std::size_t rows = sizes.num_envs;
  const auto observations = array_of<double>(reader, "observations", rows * sizes.observation);
  const auto rewards = array_of<double>(reader, "rewards", rows);
  const auto terminated = flags_of(reader, "terminated", rows);
  const auto truncated = flags_of(reader, "truncated", rows);
  const auto episodes = array_of<std::uint32_t>(reader, "episodes", rows);
  const auto steps = array_of<std::uint32_t>(reader, "steps", rows);
  const auto info = array_of<double>(reader, "info", rows * sizes.info);
  const auto ended = environments_of(reader, "final_environments", rows);
  const auto final_observations =
      array_of<double>(reader, "final_observations", ended.size() * sizes.observation);
  const auto final_info = array_of<double>(reader, "final_info", ended.size() * sizes.info);
  reader.finish();
  observations.copy_to(transition.observations);
  rewards.copy_to(transition.rewards);
  terminated.copy_to(transition.terminated);
  truncated.copy_to(transition.truncated);
  episodes.copy_to(transition.episodes);
  steps.copy_to(transition.steps);
  info.copy_to(transition.info);
  ended.copy_to(transition.final_environments);
  final_observations.copy_to(transition.final_observations);
  final_info.copy_to(transition.final_info);
}

void read(Reader& reader, const std::string& encoding, const Parameters& camera, Image& image) {
  constexpr std::size_t kChannels = 3;
  read_header(reader);
  const auto height = reader.number<std::uint32_t>();
  const auto width = reader.number<std::uint32_t>();
  const std::string told_encoding(reader.text());
  const bool is_bigendian = reader.flag();
  const auto row_bytes = reader.number<std::uint32_t>();
  const bool is_depth = encoding == kDepthEncoding;
  const std::string wanted_encoding = is_depth ? kDepthEncoding : kColorEncoding;
  if (told_encoding != wanted_encoding || is_bigendian) {
    throw std::runtime_error("the picture's encoding is " + told_encoding +
                             (is_bigendian ? ", big-endian" : "") + " instead of " +
                             wanted_encoding);
  }
  check_asked(camera, "width", width);
  check_asked(camera, "height", height);
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
  const auto* const begin = reinterpret_cast<const std::uint8_t*>(data.data());
  if (is_depth) {
    Numbers<float>(begin, bytes / sizeof(float)).copy_to(image.depth);
    image.rgb.clear();
  } else {
    image.rgb.assign(begin, begin + bytes);
    image.depth.clear();
  }
  image.width = width;
  image.height = height;
}

}  // namespace walker

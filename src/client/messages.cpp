#include "client/messages.h"

namespace walker {
namespace {

// As sensor_msgs/image_encodings.h names them.
constexpr const char* kColorEncoding = "rgb8";
constexpr const char* kDepthEncoding = "32FC1";

/// std_msgs/Header, of which the stamp matters [ns].
void read_header(Reader& reader, std::uint64_t& stamp) {
  std::uint32_t sequence = 0;
  std::uint32_t seconds = 0;
  std::uint32_t nanoseconds = 0;
  reader.number(sequence);
  reader.number(seconds);
  reader.number(nanoseconds);
  reader.skip_text();
  constexpr std::uint64_t kPerSecond = 1000000000;
  stamp = seconds * kPerSecond + nanoseconds;
}

}  // namespace

void read(Reader& reader, Transition& transition) {
  read_header(reader, transition.stamp);
  reader.number(transition.environment);
  reader.number(transition.episode);
  reader.number(transition.step);
  reader.array(transition.action);
  reader.array(transition.observation);
  reader.number(transition.reward);
  reader.number(transition.episode_return);
  reader.flag(transition.terminated);
  reader.flag(transition.truncated);
  reader.array(transition.info);
  reader.text(transition.error);
}

void read(Reader& reader, BatchReset& reset) {
  reader.array(reset.observations);
  reader.array(reset.info);
}

void read(Reader& reader, BatchTransition& transition) {
  reader.array(transition.observations);
  reader.array(transition.rewards);
  reader.array(transition.terminated);
  reader.array(transition.truncated);
  reader.array(transition.episodes);
  reader.array(transition.steps);
  reader.array(transition.info);
  reader.array(transition.final_environments);
  reader.array(transition.final_observations);
  reader.array(transition.final_info);
}

void read(Reader& reader, ServerSpecification& specification) {
  reader.number(specification.interface_version);
  reader.text(specification.id);
  reader.number(specification.num_envs);
  reader.array(specification.parameter_names);
  reader.array(specification.parameter_values);
  reader.number(specification.observation_size);
  reader.text(specification.observation_dtype);
  reader.array(specification.observation_low);
  reader.array(specification.observation_high);
  reader.number(specification.action_size);
  reader.array(specification.action_low);
  reader.array(specification.action_high);
  reader.number(specification.dt);
  reader.number(specification.max_episode_steps);
  reader.number(specification.reward_threshold);
  reader.array(specification.joint_names);
  reader.array(specification.info_names);
  reader.text(specification.mode);
  reader.text(specification.autoreset_mode);
  reader.text(specification.engine);
  reader.text(specification.engine_version);
  reader.text(specification.engine_path);
  reader.text(specification.version);
}

void read(Reader& reader, const std::string& encoding, Image& image) {
  constexpr std::size_t kChannels = 3;
  std::uint64_t stamp = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::string told_encoding;
  bool is_bigendian = false;
  std::uint32_t row_bytes = 0;
  read_header(reader, stamp);
  reader.number(height);
  reader.number(width);
  reader.text(told_encoding);
  reader.flag(is_bigendian);
  reader.number(row_bytes);
  const bool is_depth = encoding == kDepthEncoding;
  const std::string wanted_encoding = is_depth ? kDepthEncoding : kColorEncoding;
  if (told_encoding != wanted_encoding || is_bigendian) {
    throw std::runtime_error("the picture's encoding is " + told_encoding +
                             (is_bigendian ? ", big-endian" : "") + " instead of " +
                             wanted_encoding);
  }
  const std::size_t wanted_bytes = std::size_t{width} * (is_depth ? sizeof(float) : kChannels);
  if (row_bytes != wanted_bytes) {
    throw std::runtime_error("the picture's rows have " + std::to_string(row_bytes) +
                             " bytes instead of " + std::to_string(wanted_bytes));
  }
  const std::size_t bytes = std::size_t{row_bytes} * height;
  if (is_depth) {
    reader.packed(bytes, image.depth);
    image.rgb.clear();
  } else {
    reader.packed(bytes, image.rgb);
    image.depth.clear();
  }
  image.width = width;
  image.height = height;
}

}  // namespace walker

#include "ros/message_conversions.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

void check_sizes(const std::vector<std::string>& names, const std::vector<std::string>& values) {
  if (names.size() == values.size()) return;
  throw std::invalid_argument("parameter_values has " + std::to_string(values.size()) +
                              " values; must have " + std::to_string(names.size()) +
                              ", one per parameter name");
}

/// Presets only: a request must not read the server's files.
World preset(const std::string& name) {
  const std::vector<std::string> known = world_presets();
  if (std::find(known.begin(), known.end(), name) != known.end()) return load_world(name);
  refuse_unknown("world preset " + printable(name, kMaxQuotedBytes), name, known);
}

World ranges_of(const std::vector<walker_sim::WorldParameter>& parameters) {
  World world;
  for (const walker_sim::WorldParameter& parameter : parameters) {
    const WorldRange range{parameter.low, parameter.high, parameter.log_uniform != 0};
    if (world.emplace(parameter.name, range).second) continue;
    throw std::invalid_argument("world parameter " + printable(parameter.name, kMaxQuotedBytes) +
                                " is given twice");
  }
  return world;
}

std::vector<walker_sim::WorldParameter> to_parameters(const World& world) {
  std::vector<walker_sim::WorldParameter> parameters;
  for (const auto& [name, range] : world) {
    walker_sim::WorldParameter& parameter = parameters.emplace_back();
    parameter.name = name;
    parameter.low = range.low;
    parameter.high = range.high;
    parameter.log_uniform = static_cast<std::uint8_t>(range.is_log_uniform);
  }
  return parameters;
}

}  // namespace

Parameters parameters_of(const std::string& id, const std::vector<std::string>& names,
                         const std::vector<std::string>& values) {
  check_sizes(names, values);
  std::vector<std::string> assignments;
  assignments.reserve(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) assignments.push_back(names[i] + "=" + values[i]);
  return parse_assignments(parameter_descriptions(id), assignments);
}

EpisodeRecord to_record(const walker_sim::EpisodeRecord& message) {
  check_sizes(message.spec.parameter_names, message.spec.parameter_values);
  EpisodeRecord record;
  record.id = message.spec.id;
  for (std::size_t i = 0; i < message.spec.parameter_names.size(); ++i) {
    record.parameters.emplace_back(message.spec.parameter_names[i],
                                   message.spec.parameter_values[i]);
  }
  record.engine = message.spec.engine;
  record.engine_version = message.spec.engine_version;
  if (message.episode.has_seed != 0) record.seed = message.episode.seed;
  std::copy(message.episode.generator_state.begin(), message.episode.generator_state.end(),
            record.generator_state.begin());
  record.world = ranges_of(message.episode.world);
  record.num_steps = message.episode.length;
  record.actions = message.actions;
  record.pushes.reserve(message.pushes.size());
  for (const walker_sim::Push& push : message.pushes) {
    record.pushes.push_back({push.step, {push.link, push.force_x, push.force_z, push.torque_y}});
  }
  record.coordinates.reserve(message.coordinates.size());
  for (const walker_sim::Coordinates& set : message.coordinates) {
    record.coordinates.push_back({set.step, set.position, set.velocity});
  }
  record.checksums = message.checksums;
  return record;
}

void to_message(EpisodeRecord&& record, walker_sim::EpisodeRecord& message) {
  message.actions = std::move(record.actions);
  message.pushes.clear();
  message.pushes.reserve(record.pushes.size());
  for (const auto& [step, wrench] : record.pushes) {
    walker_sim::Push& push = message.pushes.emplace_back();
    push.step = step;
    push.link = wrench.link;
    push.force_x = wrench.force_x;
    push.force_z = wrench.force_z;
    push.torque_y = wrench.torque_y;
  }
  message.coordinates.clear();
  message.coordinates.reserve(record.coordinates.size());
  for (RecordedCoordinates& set : record.coordinates) {
    walker_sim::Coordinates& coordinates = message.coordinates.emplace_back();
    coordinates.step = set.step;
    coordinates.position = std::move(set.position);
    coordinates.velocity = std::move(set.velocity);
  }
  message.checksums = std::move(record.checksums);
}

std::optional<World> to_world(const walker_sim::World& message) {
  if (message.preset.empty() && message.parameters.empty()) return std::nullopt;
  World world = ranges_of(message.parameters);
  if (!message.preset.empty()) world.merge(preset(message.preset));  // keeps what is given
  return world;
}

void to_message(const World& world, walker_sim::World& message) {
  message.preset = world.empty() ? kGymnasiumsWorld : "";
  message.parameters = to_parameters(world);
}

void to_message(const World& drawn, std::vector<walker_sim::WorldParameter>& message) {
  message = to_parameters(drawn);
}

}  // namespace walker

#include "ros/records.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parameter_text.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using Texts = std::vector<std::string>;

void check_sizes(const Texts& names, const Texts& values) {
  if (names.size() == values.size()) return;
  throw std::invalid_argument("parameter_values has " + std::to_string(values.size()) +
                              " values; must have " + std::to_string(names.size()) +
                              ", one per parameter name");
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

Parameters parameters_of(const walker_sim::EnvironmentSpec& message) {
  return parameters_of(message.id, message.parameter_names, message.parameter_values);
}

std::optional<std::uint64_t> seed_of(const walker_sim::Episode& message) {
  if (message.has_seed == 0) return std::nullopt;
  return message.seed;
}

GeneratorState generator_state_of(const walker_sim::Episode& message) {
  GeneratorState state{};
  std::copy(message.generator_state.begin(), message.generator_state.end(), state.begin());
  return state;
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
  record.seed = seed_of(message.episode);
  record.generator_state = generator_state_of(message.episode);
  record.num_steps = message.episode.length;
  record.actions = message.actions;
  record.checksums = message.checksums;
  return record;
}

}  // namespace walker

#include "core/episode_record.h"

#include <algorithm>
#include <stdexcept>

#include "core/random.h"

namespace walker {
namespace {

void compare(const std::string& field, const std::string& recorded, const std::string& own) {
  if (recorded == own) return;
  throw std::invalid_argument(field + " = " + recorded + " in the record; here it is " + own);
}

void compare_parameters(const EpisodeRecord& record, const EpisodeRecord& own) {
  for (const auto& [name, value] : own.parameters) {
    const auto found = std::find_if(record.parameters.begin(), record.parameters.end(),
                                    [&name = name](const auto& one) { return one.first == name; });
    compare("parameter " + name, found == record.parameters.end() ? "(absent)" : found->second,
            value);
  }
  for (const auto& [name, value] : record.parameters) {
    const auto has_name = [&name = name](const auto& one) { return one.first == name; };
    if (std::any_of(own.parameters.begin(), own.parameters.end(), has_name)) continue;
    compare("parameter " + name, value, "(absent)");
  }
}

}  // namespace

EpisodeRecord describe_origin(const Specification& specification) {
  EpisodeRecord record;
  record.id = specification.id;
  for (const auto& [name, value] : specification.parameters) {
    record.parameters.emplace_back(name, to_string(value));
  }
  record.engine = specification.engine;
  record.engine_version = specification.engine_version;
  return record;
}

void check_repeatable(const EpisodeRecord& record, const Specification& specification) {
  const EpisodeRecord own = describe_origin(specification);
  compare("id", record.id, own.id);
  compare_parameters(record, own);
  compare("engine", record.engine, own.engine);
  compare("engine_version", record.engine_version, own.engine_version);
  if (!specification.episodes_are_independent) {
    throw std::invalid_argument(
        "an episode of this environment depends on those before it (parameter reuse_world), which "
        "a record does not have");
  }
  if (record.seed && Generator(*record.seed).state() != record.generator_state) {
    throw std::invalid_argument("generator_state is not that of seed = " +
                                std::to_string(*record.seed));
  }
  if (record.actions.size() % specification.action_size() != 0) {
    throw std::invalid_argument("actions has " + std::to_string(record.actions.size()) +
                                " values; must be a multiple of " +
                                std::to_string(specification.action_size()));
  }
}

}  // namespace walker

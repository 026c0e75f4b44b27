#include "ros/worlds.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "base/parameter_text.h"
#include "base/printable_text.h"

namespace walker {
namespace {

/// Presets only: a request must not read the server's files.
World preset(const std::string& name) {
  const std::vector<std::string> known = world_presets();
  if (std::find(known.begin(), known.end(), name) != known.end()) return load_world(name);
  refuse_unknown("world preset " + printable(name, kMaxQuotedBytes), name, known);
}

World ranges_of(const std::vector<walker_sim::WorldParameter>& parameters) {
  World world;
  for (const walker_sim::WorldParameter& parameter : parameters) {
    if (world.emplace(parameter.name, WorldRange{parameter.low, parameter.high}).second) continue;
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
  }
  return parameters;
}

}  // namespace

std::optional<World> to_world(const walker_sim::World& message) {
  if (message.preset.empty() && message.parameters.empty()) return std::nullopt;
  World world = ranges_of(message.parameters);
  if (!message.preset.empty()) world.merge(preset(message.preset));  // keeps what is given
  return world;
}

WorldValues to_values(const std::vector<walker_sim::WorldParameter>& message) {
  WorldValues values;
  for (const auto& [name, range] : ranges_of(message)) {
    if (!range.is_number()) {
      throw std::invalid_argument("world parameter " + to_string(World{{name, range}}) +
                                  ": what was drawn must be a number, low == high");
    }
    values[name] = range.low;
  }
  return values;
}

void to_message(const World& world, walker_sim::World& message) {
  message.preset = world.empty() ? kGymnasiumsWorld : "";
  message.parameters = to_parameters(world);
}

void to_message(const WorldValues& values, std::vector<walker_sim::WorldParameter>& message) {
  message = to_parameters(as_numbers(values));
}

}  // namespace walker

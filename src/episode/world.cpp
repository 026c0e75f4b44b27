#include "walker_sim/world.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "base/parameter_text.h"
#include "base/posix.h"
#include "base/printable_text.h"
#include "episode/builtin_worlds.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// Parameters of disturbance, actuation and sensing, which all robots have.
std::vector<WorldParameter> common_parameters(const Registration& registration) {
  constexpr double kMaxPushes = 20;  // in defaults
  // Two errors then differ by less than half a turn, by which imu and observation count turns.
  constexpr double kMaxPitchNoise = 0.4;
  const double push = registration.push_impulse;
  const auto noise = [](const char* quantity, const char* of, const char* unit, double maximum) {
    return WorldParameter{std::string(quantity) + "_noise",
                          unit,
                          "Standard deviation of the error of " + std::string(of) + ".",
                          0,
                          0,
                          maximum};
  };
  return {
      {kChangeInterval, "s",
       "Time from one draw of the physics to the next, in whole steps; within an episode those "
       "parameters of physics change that have ranges.",
       kNothing, 1e-3, 1000},
      {"push_interval", "s", "Time from one push on the trunk to the next, in whole steps.",
       kNothing, 1e-3, 1000},
      {"push_impulse", "N s", "Impulse of a push; its direction is drawn.", push, 0,
       kMaxPushes * push},
      {"action_delay", "s",
       "Time until an action acts, in whole steps; until the first one acts, zeros do.", 0, 0, 1},
      {"action_noise", "", "Standard deviation of the error of each action.", 0, 0, 10},
      {"observation_delay", "s", "Time until a state is observed, in whole steps.", 0, 0, 1},
      {"dropout", "", "Probability that a step repeats the last observation.", 0, 0, 1},
      noise("joint_position", "each measured joint angle", "rad", 10),
      noise("joint_velocity", "each measured joint speed", "rad/s", 100),
      noise("orientation", "the trunk's measured pitch", "rad", kMaxPitchNoise),
      noise("angular_velocity", "the trunk's measured turning speed", "rad/s", 100),
      noise("linear_velocity", "each component of the trunk's measured velocity", "m/s", 100)};
}

std::string number_text(double value) { return to_string(ParameterValue(value)); }

std::string text_of(const WorldRange& range) {
  const bool is_nan = std::isnan(range.low) && std::isnan(range.high);  // unequal to itself
  if (range.is_number() || is_nan) return number_text(range.low);
  const std::string ends = "[" + number_text(range.low) + ", " + number_text(range.high) + "]";
  return range.is_log_uniform ? "{log: " + ends + "}" : ends;
}

[[noreturn]] void refuse(const std::string& name, const WorldRange& range,
                         const std::string& allowed) {
  throw std::invalid_argument("world parameter " + name + " = " + text_of(range) + ": " + allowed);
}

/// Refuses a name that this environment does not have.
[[noreturn]] void refuse_name(const std::string& id, const std::string& name,
                              const WorldRange& range) {
  const auto has_name = [&name](const WorldParameter& known) { return known.name == name; };
  for (const Registration& other : registrations()) {
    const std::vector<WorldParameter> theirs = world_parameters(other.id);
    if (std::any_of(theirs.begin(), theirs.end(), has_name)) {
      refuse(name, range, "cannot be applied by " + id + "; " + other.id + " has it");
    }
  }
  std::vector<std::string> known;
  for (const WorldParameter& parameter : world_parameters(id)) known.push_back(parameter.name);
  refuse_unknown("world parameter " + name + " = " + text_of(range), name, known);
}

void check_range(const WorldParameter& parameter, const WorldRange& range) {
  const double low = range.low;
  const double high = range.high;
  const std::string bounds = "[" + number_text(parameter.minimum) + ", " +
                             number_text(parameter.maximum) + "]" +
                             (parameter.unit.empty() ? "" : " " + parameter.unit);
  if (!std::isfinite(low) || !std::isfinite(high)) {
    refuse(parameter.name, range, "must be finite, in " + bounds);
  }
  if (low > high) {
    refuse(parameter.name, range, "must be a number, or a range [low, high] with low <= high");
  }
  if (low < parameter.minimum || high > parameter.maximum) {
    refuse(parameter.name, range, "must be in " + bounds);
  }
  if (parameter.is_whole && (std::trunc(low) != low || std::trunc(high) != high)) {
    refuse(parameter.name, range, "must be a whole number, or a range of whole numbers");
  }
  if (!range.is_log_uniform) return;
  if (parameter.is_whole) refuse(parameter.name, range, "must be drawn uniformly, without log");
  if (low <= 0 && high >= 0) refuse(parameter.name, range, "with log must not contain 0");
}

void check_change_interval(const World& world, const std::vector<WorldParameter>& parameters) {
  const auto interval = world.find(kChangeInterval);
  if (interval == world.end()) return;
  const bool has_any =
      std::any_of(parameters.begin(), parameters.end(), [&world](const WorldParameter& parameter) {
        const auto found = world.find(parameter.name);
        return parameter.can_change && found != world.end() && !found->second.is_number();
      });
  if (has_any) return;
  refuse(interval->first, interval->second,
         "has no effect without a range of physics, such as gravity: [-12, -8]");
}

}  // namespace

std::vector<WorldParameter> world_parameters(const std::string& id) {
  const Registration& registration = find_registration(id);
  std::vector<WorldParameter> parameters = registration.world_parameters;
  const std::vector<WorldParameter> common = common_parameters(registration);
  parameters.insert(parameters.end(), common.begin(), common.end());
  return parameters;
}

void check_world(const std::string& id, const World& world) {
  if (world.empty()) return;
  const std::vector<WorldParameter> parameters = world_parameters(id);
  for (const auto& [name, range] : world) {
    const auto found =
        std::find_if(parameters.begin(), parameters.end(),
                     [&name = name](const auto& known) { return known.name == name; });
    if (found == parameters.end()) refuse_name(id, name, range);
    check_range(*found, range);
  }
  check_change_interval(world, parameters);
  const auto impulse = world.find("push_impulse");
  if (impulse != world.end() && world.count("push_interval") == 0) {
    refuse(impulse->first, impulse->second, "has no effect without push_interval");
  }
  const Registration& registration = find_registration(id);
  if (registration.check_world) registration.check_world(world);
}

std::vector<std::string> world_presets() {
  std::vector<std::string> names;
  for (const auto& preset : builtin_worlds()) names.push_back(preset.first);
  return names;
}

World load_world(const std::string& preset_or_file) {
  const auto preset = builtin_worlds().find(preset_or_file);
  if (preset != builtin_worlds().end()) {
    return parse_world(preset->second, "preset " + preset->first);
  }
  if (!preset_or_file.empty() && preset_or_file.front() == '{') {
    return parse_world(preset_or_file, printable(preset_or_file));
  }
  const std::string path = expand_home(preset_or_file);
  if (is_irregular_file(path)) {
    throw std::invalid_argument("world " + printable(preset_or_file) +
                                ": must be a preset or a regular YAML file");
  }
  std::ifstream file(path);
  constexpr std::size_t kMaxBytes = 1U << 16U;
  std::string text(kMaxBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.is_open() || file.bad()) {
    refuse_unknown("world " + preset_or_file + ", neither a preset nor a readable YAML file",
                   preset_or_file, world_presets());
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxBytes) {
    throw std::invalid_argument("world " + printable(preset_or_file) + ": has more than " +
                                std::to_string(kMaxBytes) + " bytes");
  }
  return parse_world(text, printable(preset_or_file));
}

std::string to_string(const World& world) {
  std::string text = "{";
  for (const auto& [name, range] : world) {
    text += (text.size() > 1 ? ", " : "") + name + ": " + text_of(range);
  }
  return text + "}";
}

}  // namespace walker

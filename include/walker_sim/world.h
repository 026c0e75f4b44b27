// Worlds: levels, physics, disturbances, delays and noise beyond Gymnasium's environments.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "walker_sim/export.h"

namespace walker {

/// A number (low == high), or a range from which every episode draws.
struct WorldRange {
  double low = 0;
  double high = 0;
  bool is_log_uniform =
      false;  ///< draws the magnitude's logarithm uniformly, else the value itself

  bool is_number() const { return low == high; }
  friend bool operator==(const WorldRange& a, const WorldRange& b) {
    return a.low == b.low && a.high == b.high && a.is_log_uniform == b.is_log_uniform;
  }
};

/// Ranges by parameter name. A parameter that is absent has the value of Gymnasium's environment;
/// the empty world is Gymnasium's.
using World = std::map<std::string, WorldRange>;

/// The preset that is the empty world.
inline constexpr const char* kGymnasiumsWorld = "gymnasium";

/// The parameter of the time from one draw of the physics to the next.
inline constexpr const char* kChangeInterval = "change_interval";

/// Values that act in a step.
using WorldValues = std::map<std::string, double>;

/// Meaning and limits of a world's parameter in one environment.
struct WorldParameter {
  std::string name;
  std::string unit;         ///< empty: unitless
  std::string description;  ///< one sentence
  double default_value;     ///< Gymnasium's; NaN: Gymnasium's environment has nothing of the kind
  double minimum;
  double maximum;
  bool is_whole = false;    ///< takes and draws whole numbers only
  bool can_change = false;  ///< a range is drawn again within an episode, every `change_interval`
};

/// Returns the value of this name, or `absent`.
inline double value_or(const WorldValues& values, const std::string& name, double absent) {
  const auto found = values.find(name);
  return found == values.end() ? absent : found->second;
}

/// Returns the parameters that an environment can apply.
/// @throws std::invalid_argument if the id is unknown
WALKER_SIM_EXPORT std::vector<WorldParameter> world_parameters(const std::string& id);

/// @throws std::invalid_argument naming the parameter, its value and what is allowed if one is
///         unknown (with the nearest known name), cannot be applied by this environment or has no
///         effect beside the others, or if a range is reversed, non-finite, out of bounds or, drawn
///         by its logarithm, contains 0
WALKER_SIM_EXPORT void check_world(const std::string& id, const World& world);

/// Names of the presets, the files of config/worlds, in alphabetical order.
WALKER_SIM_EXPORT std::vector<std::string> world_presets();

/// Returns the preset of this name, or else the world of this YAML file.
/// @throws std::invalid_argument naming the preset or file, and what is wrong with it
WALKER_SIM_EXPORT World load_world(const std::string& preset_or_file);

/// Parses a YAML mapping of names to numbers, lists of two or {log: [LOW, HIGH]}; docs/worlds.md
/// says in which forms.
/// @param source name of the text in messages
/// @throws std::invalid_argument naming the source and the entry
WALKER_SIM_EXPORT World parse_world(const std::string& text, const std::string& source);

/// Formats a world as one line of YAML: {gravity: -10.0, push_impulse: [0.0, 5.0]}.
WALKER_SIM_EXPORT std::string to_string(const World& world);

}  // namespace walker

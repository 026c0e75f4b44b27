// A record of an episode that suffices to repeat it with bitwise equal results.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"

namespace walker {

struct EpisodeRecord {
  std::string id;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< complete, values as text
  std::string engine;
  std::string engine_version;
  std::optional<std::uint64_t> seed;  ///< of the reset; nullopt: the generator continued
  GeneratorState generator_state{};   ///< before the reset
  std::uint32_t num_steps = 0;
  std::vector<double> actions;  ///< steps x action size, as given [unitless]
  /// Checksums of the transitions, the reset's first (EpisodeRecord.msg has the formula). They are
  /// verified when the record is repeated; empty: not compared.
  std::vector<std::uint64_t> checksums;
};

/// Returns a record with only the origin: id, parameters, engine and its version.
WALKER_SIM_EXPORT EpisodeRecord describe_origin(const Specification& specification);

/// Checks that an environment of this specification repeats the record with bitwise equal results.
/// @throws std::invalid_argument naming the first field that differs or is malformed, with both
///         values, or if episodes of the environment depend on earlier ones
WALKER_SIM_EXPORT void check_repeatable(const EpisodeRecord& record,
                                        const Specification& specification);

}  // namespace walker

// An episode as what determines it: repeated from here it is the same to the bit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"

namespace walker {

/// Where an episode came from and what was done in it.
struct EpisodeRecord {
  std::string id;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< complete, values as text
  std::string engine;
  std::string engine_version;
  std::optional<std::uint64_t> seed;  ///< with which the episode began; none: generator continued
  GeneratorState generator_state{};   ///< before the reset
  std::uint32_t num_steps = 0;
  std::vector<double> actions;  ///< step x action, as given [unitless]
  double episode_return = 0;    ///< sum of the rewards, by which a repetition is checked
};

/// The part of a record that says on what the episode was played.
WALKER_SIM_EXPORT EpisodeRecord describe_origin(const Specification& specification);

/// Whether an environment of this specification repeats the record to the bit.
/// @throws std::invalid_argument naming the first field that differs or is malformed, with both
///         values; also where episodes depend on those before them
WALKER_SIM_EXPORT void check_repeatable(const EpisodeRecord& record,
                                        const Specification& specification);

}  // namespace walker

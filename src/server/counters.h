// What a server counts.
#pragma once

#include <cstdint>

namespace walker {

/// Since the start, of all environments.
struct ServerCounters {
  std::uint64_t steps = 0;
  std::uint64_t resets = 0;    ///< restores too
  std::uint64_t advances = 0;  ///< of simulation time, by one dt each
  std::uint64_t simulation_errors = 0;
  std::uint64_t refused_commands = 0;  ///< effort commands with an error, or in lock-step
  std::uint64_t clamped_commands = 0;  ///< actions and efforts beyond the bounds
  std::uint64_t command_timeouts = 0;
  std::uint64_t missed_deadlines = 0;
};

}  // namespace walker

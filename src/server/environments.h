// The pool of environments of a server. No ROS.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "episode/episode.h"
#include "server/parameter_reader.h"
#include "walker_sim/pool.h"

namespace walker {

using MakeEnvironment = std::function<std::unique_ptr<Environment>()>;

/// Makes a server's pool. Environment i begins with seed + i; a single one records its actions.
///
/// Under same_step the server resets ended environments itself after it has published their last
/// states. The pool's next step only repeats resets that failed.
Pool make_pool(const ServerOptions& options, const MakeEnvironment& make);

/// @throws std::logic_error if there are several, naming `service` and what to call instead
Episode& single_episode(Pool& pool, const std::string& service);

/// @throws std::invalid_argument naming `field` if the index is out of range
void check_environment(const Pool& pool, const std::string& field, std::uint32_t index);

}  // namespace walker

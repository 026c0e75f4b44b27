// The environments of a server: a pool of one or many. No ROS.
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

/// The pool of a server. Its first resets use the server's seed + the environment's index; a single
/// environment records its actions.
///
/// Under same_step the server itself begins the next episodes, after it has published the last
/// states; what is left to the pool's next step are resets that failed.
Pool make_pool(const ServerOptions& options, const MakeEnvironment& make);

/// The only environment.
/// @param service that is called
/// @throws std::logic_error if there are many, naming the service and what to call instead
Episode& single_episode(Pool& pool, const std::string& service);

/// @param field that has this index
/// @throws std::invalid_argument naming the field if no environment has this index
void check_environment(const Pool& pool, const std::string& field, std::uint32_t index);

}  // namespace walker

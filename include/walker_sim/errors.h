// Exceptions of environments and of clients.
#pragma once

#include <exception>
#include <stdexcept>

#include "walker_sim/export.h"

namespace walker {

/// The action has the wrong size or is non-finite. Nothing has moved.
struct WALKER_SIM_EXPORT InvalidAction : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// A step without a running episode: before the first reset, or after the end. Nothing has moved.
struct WALKER_SIM_EXPORT ResetNeeded : std::logic_error {
  using std::logic_error::logic_error;
};

/// The master or the server is unreachable, the connection broke, or an answer is malformed. The
/// next call opens new connections.
struct WALKER_SIM_EXPORT ConnectionError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The server refused the request; the message is the server's. The connection stays open. Nothing
/// has moved, except if the engine failed at a reset: then there is no episode.
struct WALKER_SIM_EXPORT RequestRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A signal ended the call (`ClientOptions::is_interrupted`). As after a ConnectionError, it is
/// unknown whether the server executed the call, and the next call opens new connections.
struct WALKER_SIM_EXPORT Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted by a signal"; }
};

}  // namespace walker

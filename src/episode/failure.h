// What becomes of a step or a reset at which an engine fails.
#pragma once

#include <cstdint>
#include <exception>
#include <optional>
#include <string>

#include "walker_sim/environment.h"

namespace walker {

// The end reasons.
inline constexpr const char* kStepFailed = "the simulation failed";
inline constexpr const char* kResetFailed = "the simulation failed at its reset";

/// The engine's words.
std::string words_of(const std::exception_ptr& thrown);

/// Ends an episode in its step: terminated, without reward and info. The observation stays as it
/// was.
/// @param error the engine's words, outliving the result
void fail_step(const char* error, const Specification& specification, Result& result);

/// Resets. Where the engine fails, the episode has ended before its first step: as above, with an
/// observation of zeros, so that nothing depends on what was before.
/// @return the engine's words, which the result does not have; empty: it has not failed
std::string try_reset(Environment& environment, std::optional<std::uint64_t> seed, Result& result);

}  // namespace walker

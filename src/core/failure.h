// What becomes of a step or a reset at which an engine fails.
#pragma once

#include <exception>
#include <string>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"

namespace walker {

// The end reasons.
inline constexpr const char* kStepFailed = "the simulation failed";
inline constexpr const char* kResetFailed = "the simulation failed at its reset";

/// The engine's words.
WALKER_SIM_EXPORT std::string words_of(const std::exception_ptr& thrown);

/// Ends an episode in its step: terminated, without reward and info. The observation stays as it
/// was.
/// @param error the engine's words, outliving the result
void fail_step(const char* error, const Specification& specification, Result& result);

/// Ends an episode before its first step: the same, with an observation of zeros, so that nothing
/// depends on what was before.
WALKER_SIM_EXPORT void fail_reset(const char* error, const Specification& specification,
                                  Result& result);

}  // namespace walker

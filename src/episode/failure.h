// What an episode says when an engine fails.
#pragma once

#include <exception>
#include <string>

namespace walker {

// End reasons.
inline constexpr const char* kStepFailed = "the simulation failed";
inline constexpr const char* kResetFailed = "the simulation failed at its reset";

/// The exception's message, never empty.
std::string message_of(const std::exception_ptr& thrown);

}  // namespace walker

// Message of an expected exception.
#pragma once

#include <string>

namespace walker {

/// Returns the message of the `Exception` that `call` throws, or "nothing thrown".
template <typename Exception, typename Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Exception& exception) {
    return exception.what();
  }
  return "nothing thrown";
}

}  // namespace walker

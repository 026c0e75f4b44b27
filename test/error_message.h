// What an exception says.
#pragma once

#include <string>

namespace walker {

/// Text of the `Exception` that `call` throws; "nothing thrown" without one.
template <typename Exception, typename Call>
std::string message_of(Call call) {
  try {
    call();
  } catch (const Exception& exception) {
    return exception.what();
  }
  return "nothing thrown";
}

}  // namespace walker

#include "episode/failure.h"

namespace walker {

std::string message_of(const std::exception_ptr& thrown) {
  std::string message;
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& exception) {
    message = exception.what();
  } catch (...) {
    message = "the exception is not a std::exception";
  }
  return message.empty() ? "the exception has no message" : message;
}

}  // namespace walker

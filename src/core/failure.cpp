#include "core/failure.h"

#include <algorithm>
#include <limits>

namespace walker {

std::string words_of(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& exception) {
    return exception.what();
  } catch (...) {
    return "something that is no std::exception was thrown";
  }
}

void fail_step(const char* error, const Specification& specification, Result& result) {
  std::fill_n(result.info, specification.info_names.size(),
              std::numeric_limits<double>::quiet_NaN());  // absent
  result.reward = 0;
  result.terminated = true;
  result.truncated = false;
  result.end_reason = kStepFailed;
  result.error = error;
}

void fail_reset(const char* error, const Specification& specification, Result& result) {
  fail_step(error, specification, result);
  std::fill_n(result.observation, specification.observation_size(), 0);
  result.end_reason = kResetFailed;
}

}  // namespace walker

#include "episode/failure.h"

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

std::string try_reset(Environment& environment, std::optional<std::uint64_t> seed, Result& result) {
  result = {result.observation, result.info};
  try {
    environment.reset(seed, result);
    return "";
  } catch (...) {
    fail_step("", environment.specification(), result);
    std::fill_n(result.observation, environment.specification().observation_size(), 0);
    result.end_reason = kResetFailed;
    return words_of(std::current_exception());
  }
}

}  // namespace walker

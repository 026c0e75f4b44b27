// Sets the environment variable WALKER_SIM_KERNEL for the duration of a test.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>

#include "stepper.h"

namespace walker {

class KernelVariable {
 public:
  /// @param value null unsets the variable
  explicit KernelVariable(const char* value) {
    if (const char* const before = std::getenv(kName)) before_ = before;
    set(value);
  }
  KernelVariable(const KernelVariable&) = delete;
  KernelVariable& operator=(const KernelVariable&) = delete;
  ~KernelVariable() { set(before_ ? before_->c_str() : nullptr); }

 private:
  static constexpr const char* kName = "WALKER_SIM_KERNEL";

  static void set(const char* value) {
    if (value == nullptr) {
      unsetenv(kName);
    } else {
      setenv(kName, value, 1);
    }
  }

  std::optional<std::string> before_;
};

inline Stepper make_by(const char* kernel, const std::string& id,
                       const Parameters& parameters = {}) {
  const KernelVariable variable(kernel);
  return Stepper(id, parameters);
}

}  // namespace walker

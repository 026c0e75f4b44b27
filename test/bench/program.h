// What the benchmark programs share: command-line options, measurement loop, actions, main().
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iomanip>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/random.h"

namespace walker::bench {

/// Calls `run` and returns the exit status of main(). Prints an exception to standard error.
template <typename Run>
int run_program(const char* name, const Run& run) {
  try {
    run();
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    std::cerr << name << ": " << error.what() << '\n';
    return EXIT_FAILURE;
  }
}

/// Parses options of the form `--name value`. All are required.
class Arguments {
 public:
  /// @param needed option names without the dashes
  /// @throws std::invalid_argument naming the option that is missing, unknown or without a value
  Arguments(char** begin, char** end, const std::set<std::string>& needed) {
    for (char** argument = begin; argument < end; argument += 2) {
      const std::string option = *argument;
      const std::string name = option.rfind("--", 0) == 0 ? option.substr(2) : "";
      if (needed.count(name) == 0) throw std::invalid_argument(option + ": unknown option");
      if (argument + 1 == end) throw std::invalid_argument(option + ": needs a value");
      values_[name] = argument[1];
    }
    for (const std::string& name : needed) {
      if (values_.count(name) == 0) throw std::invalid_argument("--" + name + ": is missing");
    }
  }

  const std::string& text(const std::string& name) const { return values_.at(name); }

  /// @throws std::invalid_argument unless the value consists of comma-separated numbers
  std::vector<double> numbers(const std::string& name) const {
    std::vector<double> numbers;
    std::istringstream stream(text(name));
    char comma = ',';
    for (double number = 0; comma == ',' && stream >> number; stream >> comma) {
      numbers.push_back(number);
      comma = 0;
    }
    if (numbers.empty() || !stream.eof()) {
      throw std::invalid_argument("--" + name + " = " + text(name) + ": must be numbers");
    }
    return numbers;
  }

  double number(const std::string& name) const { return numbers(name).front(); }

 private:
  std::map<std::string, std::string> values_;
};

using Clock = std::chrono::steady_clock;

struct Slice {
  std::uint64_t steps = 0;
  double seconds = 0;            ///< wall time
  double processor_seconds = 0;  ///< of all threads of this process
};

inline double processor_time() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  constexpr double kNanosecond = 1e-9;
  return static_cast<double>(time.tv_sec) + kNanosecond * static_cast<double>(time.tv_nsec);
}

/// Calls `step`, which makes `steps_a_call` steps, for `seconds`. A warm-up of a quarter of that
/// time, for caches, branch predictors and the clock frequency, is not counted.
template <typename Step>
Slice measure(double seconds, std::size_t steps_a_call, Step&& step) {
  constexpr double kWarmUp = 0.25;
  Slice slice;
  for (const double duration : {kWarmUp * seconds, seconds}) {
    slice.steps = 0;
    const double processor = processor_time();
    const Clock::time_point begin = Clock::now();
    do {
      step();
      slice.steps += steps_a_call;
      slice.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    } while (slice.seconds < duration);
    slice.processor_seconds = processor_time() - processor;
  }
  return slice;
}

/// Durations of calls.
class Latencies {
 public:
  template <typename Call>
  void time(const Call& call) {
    const Clock::time_point begin = Clock::now();
    call();
    microseconds_.push_back(
        std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }

  bool is_empty() const { return microseconds_.empty(); }

  /// @param fraction in [0, 1]
  double quantile(double fraction) {
    std::sort(microseconds_.begin(), microseconds_.end());
    const auto last = static_cast<double>(microseconds_.size() - 1);
    return microseconds_[static_cast<std::size_t>(fraction * last)];
  }

 private:
  std::vector<double> microseconds_;
};

/// Prints a slice as one line of JSON.
inline void print(std::size_t num_envs, const Slice& slice, Latencies latencies = {}) {
  constexpr int kDigits = 9;
  std::cout << std::setprecision(kDigits) << "{\"num_envs\": " << num_envs
            << ", \"steps\": " << slice.steps << ", \"seconds\": " << slice.seconds
            << ", \"processor_seconds\": " << slice.processor_seconds;
  if (!latencies.is_empty()) {
    std::cout << ", \"latency_us\": {\"p50\": " << latencies.quantile(0.5)
              << ", \"p99\": " << latencies.quantile(0.99) << "}";
  }
  std::cout << "}\n";
}

/// Rows of precomputed random float32 values in [-1, 1], returned cyclically.
class Actions {
 public:
  /// @param row values per row: number of environments times action size
  explicit Actions(std::size_t row)
      : row_(row), values_(std::max<std::size_t>(kValues / row, 1) * row) {
    Generator generator(0);
    for (double& value : values_) value = static_cast<float>(generator.uniform(-1, 1));
  }

  const double* next() {
    const double* row = values_.data() + next_;
    next_ = (next_ + row_) % values_.size();
    return row;
  }

  std::size_t size() const { return row_; }

 private:
  static constexpr std::size_t kValues = 32768;
  std::size_t row_;
  std::vector<double> values_;
  std::size_t next_ = 0;
};

}  // namespace walker::bench

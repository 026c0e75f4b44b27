// A fuzz target: a function that takes any bytes and comes back. One file, one target.
// ./scripts/dev/fuzz makes a program of each with libFuzzer; corpus_test.cpp runs those of a room
// in the ordinary tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

namespace walker::fuzz {

struct Target {
  const char* name;
  void (*run)(const std::uint8_t* data, std::size_t size);
};

/// Those that are linked.
inline std::vector<Target>& targets() {
  static std::vector<Target> all;
  return all;
}

/// Makes a target known before main.
struct Registered {
  Registered(const char* name, void (*run)(const std::uint8_t* data, std::size_t size)) {
    targets().push_back({name, run});
  }
};

/// Ends the program where what was read contradicts what is promised of it.
inline void require(bool is_so, const char* what) {
  if (is_so) return;
  std::fprintf(stderr, "fuzz target: not so: %s\n", what);
  std::abort();
}

/// What was read is refused: that is an answer, where it says why.
inline void accept(const std::exception& refusal) {
  require(*refusal.what() != 0, "a refusal says why");
}

}  // namespace walker::fuzz

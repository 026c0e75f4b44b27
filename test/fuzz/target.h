// A fuzz target: a function that accepts any bytes and returns. Each target has one file.
// ./scripts/dev/fuzz builds a libFuzzer program of each; corpus_test.cpp runs a room's targets in
// the ordinary tests.
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

inline std::vector<Target>& targets() {
  static std::vector<Target> all;
  return all;
}

/// Whether the input is a file seed_* of the corpus. Targets that read what the product has written
/// require that they accept it: a refused seed leads to little of their code.
inline bool is_seed = false;

struct Registered {
  Registered(const char* name, void (*run)(const std::uint8_t* data, std::size_t size)) {
    targets().push_back({name, run});
  }
};

inline void require(bool is_so, const char* what) {
  if (is_so) return;
  std::fprintf(stderr, "fuzz target: not so: %s\n", what);
  std::abort();
}

/// Accepts a refused input, provided that the refusal states a reason.
inline void accept(const std::exception& refusal) {
  require(*refusal.what() != 0, "a refusal says why");
}

}  // namespace walker::fuzz

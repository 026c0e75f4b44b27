// A generator that there may be, in a saved state.
#pragma once

#include <optional>

#include "base/random.h"
#include "base/state_bytes.h"

namespace walker {

inline void write_generator(const std::optional<Generator>& generator, StateWriter& writer) {
  writer.number(std::uint8_t{generator.has_value()});
  if (!generator) return;
  const GeneratorState state = generator->state();
  writer.numbers(state.data(), state.size());
}

inline GeneratorState read_generator_state(StateReader& reader) {
  GeneratorState state{};
  reader.numbers(state.data(), state.size());
  return state;
}

/// @throws std::invalid_argument
inline std::optional<Generator> read_generator(StateReader& reader) {
  if (!reader.flag()) return std::nullopt;
  return Generator(read_generator_state(reader));
}

}  // namespace walker

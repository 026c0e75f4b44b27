// Executes the commands of a test that writes to a pipe. A command is one line of tab-separated
// words on stdin; raw doubles follow if the command takes any. The answer is a line `ok BYTES`
// followed by that many bytes, or a line `error MESSAGE`. Numbers are 64 bits in native byte order.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "walker_sim/environment.h"

namespace walker {

class Answer {
 public:
  void add(double value) { add_bytes(value); }
  template <typename Range>
  void add_all(const Range& range) {
    for (const auto& element : range) add(element);
  }
  void add(const GeneratorState& state) {
    for (const std::uint64_t word : state) add_bytes(word);
  }
  void add(const std::string& text) { bytes_ += text; }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename T>
  void add_bytes(const T& value) {
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), &value, sizeof(T));
    bytes_.append(raw.data(), raw.size());
  }

  std::string bytes_;
};

inline std::vector<double> read_numbers(std::size_t count) {
  std::vector<double> numbers(count);
  std::string raw(count * sizeof(double), '\0');
  std::cin.read(raw.data(), static_cast<std::streamsize>(raw.size()));
  if (!std::cin) throw std::runtime_error("the input ended within the numbers of a command");
  std::memcpy(numbers.data(), raw.data(), raw.size());
  return numbers;
}

template <typename T>
T read(std::istream& words) {
  T value{};
  if (!(words >> value)) throw std::invalid_argument("a word of the command is missing or wrong");
  return value;
}

/// Reads the remaining words, which may contain spaces.
inline std::vector<std::string> read_rest(std::istream& words) {
  words >> std::ws;
  std::vector<std::string> rest;
  for (std::string word; std::getline(words, word, '\t');) rest.push_back(word);
  return rest;
}

/// @param obey Answer(const std::string& line)
template <typename Obey>
void serve(Obey obey) {
  std::ios::sync_with_stdio(false);
  for (std::string line; std::getline(std::cin, line);) {
    try {
      const Answer answer = obey(line);
      std::cout << "ok " << answer.bytes().size() << '\n' << answer.bytes() << std::flush;
    } catch (const std::exception& exception) {
      std::cout << "error " << exception.what() << '\n' << std::flush;
    }
  }
}

}  // namespace walker

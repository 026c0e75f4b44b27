// Texts of a stranger's as messages show them.
#pragma once

#include <cstddef>
#include <string>

namespace walker {

/// In one line, without control characters, and not too long: messages end at a zero byte.
inline std::string printable(const std::string& text) {
  constexpr std::size_t kLongest = 300;
  constexpr const char* kDigits = "0123456789abcdef";
  std::string result;
  for (const char c : text.substr(0, kLongest)) {
    const auto code = static_cast<unsigned char>(c);
    constexpr unsigned char kDelete = 0x7f;
    if (code >= ' ' && code != kDelete) {
      result += c;
    } else {
      result += {'\\', 'x', kDigits[code >> 4U], kDigits[code & 0xfU]};
    }
  }
  if (text.size() > kLongest) result += "... (" + std::to_string(text.size()) + " bytes)";
  return result;
}

}  // namespace walker

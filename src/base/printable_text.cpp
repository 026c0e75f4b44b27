#include "base/printable_text.h"

#include <algorithm>
#include <cstdint>

namespace walker {
namespace {

std::uint8_t byte_at(std::string_view text, std::size_t index) {
  return static_cast<std::uint8_t>(text[index]);
}

bool is_continuation(std::uint8_t byte) { return (byte & 0xC0U) == 0x80U; }

/// Returns the size in bytes of the UTF-8 character at the text's beginning; 0: it is invalid.
/// Source: The Unicode Standard 15.0, table 3-7.
std::size_t character_size(std::string_view text) {
  const std::uint8_t first = byte_at(text, 0);
  if (first < 0x80) return 1;
  if (first < 0xC2 || first > 0xF4) return 0;
  std::size_t size = 4;
  if (first < 0xF0) size = 3;
  if (first < 0xE0) size = 2;
  if (text.size() < size) return 0;
  for (std::size_t i = 1; i < size; ++i) {
    if (!is_continuation(byte_at(text, i))) return 0;
  }
  const std::uint8_t second = byte_at(text, 1);
  if (first == 0xE0 && second < 0xA0) return 0;  // overlong encoding
  if (first == 0xED && second > 0x9F) return 0;  // UTF-16 surrogate
  if (first == 0xF0 && second < 0x90) return 0;  // overlong encoding
  if (first == 0xF4 && second > 0x8F) return 0;  // above U+10FFFF
  return size;
}

bool is_control(std::string_view character) {
  const std::uint8_t first = byte_at(character, 0);
  if (character.size() == 1) return first < 0x20 || first == 0x7F;
  return first == 0xC2 && byte_at(character, 1) < 0xA0;  // U+0080 .. U+009F
}

void append_escaped(std::string_view bytes, std::string& text) {
  constexpr const char* kDigits = "0123456789abcdef";
  for (const char c : bytes) {
    if (c == '\n') {
      text += "\\n";
    } else if (c == '\t') {
      text += "\\t";
    } else {
      const auto byte = static_cast<std::uint8_t>(c);
      text += {'\\', 'x', kDigits[byte >> 4U], kDigits[byte & 0xFU]};
    }
  }
}

std::string escaped(std::string_view text, bool escapes_controls) {
  std::string fit;
  fit.reserve(text.size());
  while (!text.empty()) {
    const std::size_t size = character_size(text);
    const std::string_view next = text.substr(0, std::max<std::size_t>(size, 1));
    const bool ends_texts = next[0] == '\0';  // what() of an exception ends there
    if (size == 0 || ends_texts || (escapes_controls && is_control(next))) {
      append_escaped(next, fit);
    } else {
      fit += next;
    }
    text.remove_prefix(next.size());
  }
  return fit;
}

}  // namespace

std::string printable(std::string_view text, std::size_t most) {
  if (text.size() <= most) return escaped(text, true);
  std::size_t head = most / 2;
  std::size_t tail = text.size() - most / 2;
  for (int i = 0; i < 3; ++i) {  // do not split a character
    if (head > 0 && is_continuation(byte_at(text, head))) --head;
    if (tail < text.size() && is_continuation(byte_at(text, tail))) ++tail;
  }
  return escaped(text.substr(0, head), true) + " [... " + std::to_string(tail - head) +
         " bytes left out ...] " + escaped(text.substr(tail), true);
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = character_size(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

std::string to_utf8(std::string_view text) { return escaped(text, false); }

}  // namespace walker

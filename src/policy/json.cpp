#include "policy/json.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>

namespace walker::json {
namespace {

constexpr int kDeepest = 8;  // a policy's header has 3 levels

class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  Value document() {
    Value value = read(0);
    skip_blanks();
    if (at_ != text_.size()) fail("has more after its end");
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument("its header " + what + " at byte " + std::to_string(at_));
  }

  void skip_blanks() { at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size()); }

  char next() {
    skip_blanks();
    if (at_ == text_.size()) fail("ends early");
    return text_[at_];
  }

  void expect(char wanted) {
    if (next() != wanted) fail(std::string("has no ") + wanted);
    ++at_;
  }

  /// Consumes a comma or `end`. @return whether another element follows
  bool goes_on(char end) {
    if (next() == ',') {
      ++at_;
      return true;
    }
    expect(end);
    return false;
  }

  Value read(int depth) {  // NOLINT(misc-no-recursion): bounded
    if (depth > kDeepest) fail("is nested too deep");
    switch (next()) {
      case '{':
        return {read_object(depth)};
      case '[':
        return {read_array(depth)};
      case '"':
        return {read_text()};
      default:
        return {read_whole()};
    }
  }

  Object read_object(int depth) {  // NOLINT(misc-no-recursion)
    Object object;
    expect('{');
    if (next() == '}') {
      ++at_;
      return object;
    }
    do {
      if (next() != '"') fail("has no name");
      std::string name = read_text();
      expect(':');
      Value value = read(depth + 1);
      if (!object.emplace(std::move(name), std::move(value)).second) fail("has a name twice");
    } while (goes_on('}'));
    return object;
  }

  Array read_array(int depth) {  // NOLINT(misc-no-recursion)
    Array array;
    expect('[');
    if (next() == ']') {
      ++at_;
      return array;
    }
    do {
      array.push_back(read(depth + 1));
    } while (goes_on(']'));
    return array;
  }

  std::string read_text() {
    std::string result;
    for (++at_; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '"') {
        ++at_;
        return result;
      }
      if (static_cast<unsigned char>(c) < ' ') fail("has a control character in a text");
      result += c == '\\' ? read_escape() : c;
    }
    fail("ends early");
  }

  /// Decodes the escapes that our writer uses. It has no Unicode escapes: its headers are ASCII.
  char read_escape() {
    if (++at_ == text_.size()) fail("ends early");
    constexpr std::string_view kLetters = "\"\\/bfnrt";
    constexpr std::string_view kMeanings = "\"\\/\b\f\n\r\t";
    const std::size_t found = kLetters.find(text_[at_]);
    if (found == std::string_view::npos) fail("has an escape that policies do not use");
    return kMeanings[found];
  }

  std::uint64_t read_whole() {
    constexpr std::uint64_t kMax = std::numeric_limits<std::uint64_t>::max() / 10 - 1;
    const std::size_t begin = at_;
    std::uint64_t value = 0;
    for (; at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9'; ++at_) {
      if (value > kMax) fail("has a number that is too large");
      value = value * 10 + static_cast<std::uint64_t>(text_[at_] - '0');
    }
    if (at_ == begin) fail("has neither text, whole number, array nor object");
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

template <typename Kind>
const Kind& get(const Value& value, const std::string& what, const char* kind) {
  if (const Kind* found = std::get_if<Kind>(&value.content)) return *found;
  throw std::invalid_argument(what + " is no " + kind);
}

}  // namespace

std::uint64_t Value::whole(const std::string& what) const {
  return get<std::uint64_t>(*this, what, "whole number");
}

const std::string& Value::text(const std::string& what) const {
  return get<std::string>(*this, what, "text");
}

const Array& Value::array(const std::string& what) const {
  return get<Array>(*this, what, "array");
}

const Object& Value::object(const std::string& what) const {
  return get<Object>(*this, what, "object");
}

Value parse(std::string_view text) { return Reader(text).document(); }

}  // namespace walker::json

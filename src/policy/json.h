// JSON of a safetensors header: objects, arrays, texts and non-negative whole numbers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace walker::json {

struct Value;
using Array = std::vector<Value>;
using Object = std::map<std::string, Value>;

struct Value {
  std::variant<std::uint64_t, std::string, Array, Object> content;

  // Each throws std::invalid_argument naming `what` if the value is of another kind.
  std::uint64_t whole(const std::string& what) const;
  const std::string& text(const std::string& what) const;
  const Array& array(const std::string& what) const;
  const Object& object(const std::string& what) const;
};

/// @throws std::invalid_argument for anything else, with the index of the byte
Value parse(std::string_view text);

}  // namespace walker::json

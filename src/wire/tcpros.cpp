#include "wire/tcpros.h"

#include <stdexcept>

namespace walker::tcpros {

void append_header(const Fields& fields, Bytes& bytes) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + kLengthBytes);
  for (const auto& [name, value] : fields) {
    bytes.resize(bytes.size() + kLengthBytes);
    store_length(name.size() + 1 + value.size(), &bytes[bytes.size() - kLengthBytes]);
    bytes.insert(bytes.end(), name.begin(), name.end());
    bytes.push_back('=');
    bytes.insert(bytes.end(), value.begin(), value.end());
  }
  store_length(bytes.size() - begin - kLengthBytes, &bytes[begin]);
}

std::optional<Field> take_field(MessageReader& header) {
  const std::optional<std::string_view> text = header.try_text();
  if (!text) return std::nullopt;
  const std::size_t equals = text->find('=');
  if (equals == std::string_view::npos) return Field{};
  return Field{text->substr(0, equals), text->substr(equals + 1)};
}

Fields parse_header(const std::uint8_t* bytes, std::size_t size) {
  Fields fields;
  MessageReader header(bytes, size, "connection header");
  while (header.size() > 0) {
    const std::optional<Field> field = take_field(header);
    if (!field) {
      throw std::runtime_error("connection header: a field is longer than the header");
    }
    if (field->name.empty()) {
      throw std::runtime_error("connection header: a field is not of the form name=value");
    }
    if (!fields.emplace(field->name, field->value).second) {
      throw std::runtime_error("connection header: " + std::string(field->name) + " comes twice");
    }
  }
  return fields;
}

}  // namespace walker::tcpros

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

Fields parse_header(const std::uint8_t* bytes, std::size_t size) {
  Fields fields;
  const std::uint8_t* const end = bytes + size;
  while (bytes != end) {
    const auto left = static_cast<std::size_t>(end - bytes);
    if (left < kLengthBytes || load_length(bytes) > left - kLengthBytes) {
      throw std::runtime_error("connection header: a field is longer than the header");
    }
    const std::string field(bytes + kLengthBytes, bytes + kLengthBytes + load_length(bytes));
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw std::runtime_error("connection header: a field is not of the form name=value");
    }
    if (!fields.emplace(field.substr(0, equals), field.substr(equals + 1)).second) {
      throw std::runtime_error("connection header: " + field.substr(0, equals) + " comes twice");
    }
    bytes += kLengthBytes + field.size();
  }
  return fields;
}

}  // namespace walker::tcpros

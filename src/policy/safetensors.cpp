#include "policy/safetensors.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>
#include <stdexcept>
#include <string_view>

namespace walker {
namespace {

constexpr std::size_t kMaxHeader = std::size_t{1} << 20U;
constexpr std::size_t kMaxValues = std::size_t{1} << 26U;

/// All supported machines are little-endian, as the file is.
template <typename Number>
Number read_as(const char* bytes) {
  Number value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

template <typename Number>
void append_values(const char* bytes, std::size_t count, std::vector<double>& values) {
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(double{read_as<Number>(bytes + i * sizeof(Number))});
  }
}

/// Reads the header's JSON, whose structure is fixed: objects, arrays, strings and non-negative
/// integers. Each method throws std::invalid_argument with the byte's index for anything else.
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view text) : text_(text) {}

  /// Calls `read_value(name)` for each member, which reads its value.
  template <typename ReadValue>
  void object(const ReadValue& read_value) {
    std::set<std::string> names;
    list('{', '}', [&] {
      const std::string name = string();
      if (!names.insert(name).second) fail("has the name " + name + " twice");
      expect(':');
      read_value(name);
    });
  }

  std::vector<std::size_t> integers() {
    std::vector<std::size_t> values;
    list('[', ']', [&] { values.push_back(integer()); });
    return values;
  }

  std::string string() {
    expect('"');
    std::string result;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '"') {
        ++at_;
        return result;
      }
      if (static_cast<unsigned char>(c) < ' ') fail("has a control character in a string");
      result += c == '\\' ? escape() : c;
    }
    fail("ends early");
  }

  void end() {
    skip_blanks();
    if (at_ != text_.size()) fail("has more after its end");
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument("its header " + what + " at byte " + std::to_string(at_));
  }

  void skip_blanks() { at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size()); }

  /// Consumes `wanted` if it comes next.
  bool skip(char wanted) {
    skip_blanks();
    if (at_ == text_.size()) fail("ends early");
    if (text_[at_] != wanted) return false;
    ++at_;
    return true;
  }

  void expect(char wanted) {
    if (!skip(wanted)) fail(std::string("has no ") + wanted);
  }

  template <typename ReadElement>
  void list(char begin, char end, const ReadElement& read_element) {
    expect(begin);
    if (skip(end)) return;
    do {
      read_element();
    } while (skip(','));
    expect(end);
  }

  /// Decodes all escapes except Unicode's: the headers of our writer are ASCII.
  char escape() {
    if (++at_ == text_.size()) fail("ends early");
    constexpr std::string_view kLetters = "\"\\/bfnrt";
    constexpr std::string_view kMeanings = "\"\\/\b\f\n\r\t";
    const std::size_t found = kLetters.find(text_[at_]);
    if (found == std::string_view::npos) fail("has an escape that policies do not use");
    return kMeanings[found];
  }

  std::size_t integer() {
    skip_blanks();
    std::size_t value = 0;
    const char* const begin = text_.data() + at_;
    const auto [stop, error] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (error != std::errc()) fail("has no integer from 0 to 2^64 - 1");
    at_ += static_cast<std::size_t>(stop - begin);
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

/// A tensor's member of the header.
struct Entry {
  std::string type;
  std::vector<std::size_t> shape;
  std::vector<std::size_t> offsets;
};

Entry read_entry(HeaderReader& header, const std::string& name) {
  Entry entry;
  header.object([&](const std::string& key) {
    if (key == "dtype") {
      entry.type = header.string();
    } else if (key == "shape") {
      entry.shape = header.integers();
    } else if (key == "data_offsets") {
      entry.offsets = header.integers();
    } else {
      throw std::invalid_argument(name + " has " + key + ", which is unknown");
    }
  });
  return entry;
}

/// @param left bytes of the file that the other tensors have left; reduced by this one's. Without
///             this limit, many overlapping tensors of a small file could exhaust the memory
Tensor read_tensor(const std::string& name, const Entry& entry, const char* begin, std::size_t size,
                   std::size_t& left) {
  Tensor tensor;
  std::size_t count = 1;
  for (const std::size_t extent : entry.shape) {
    if (extent == 0 || extent > kMaxValues / count) {
      throw std::invalid_argument(name + " has an extent of " + std::to_string(extent) +
                                  "; must be above 0, for at most " + std::to_string(kMaxValues) +
                                  " values in all");
    }
    count *= extent;
  }
  tensor.shape = entry.shape;
  const bool is_single = entry.type == "F32";
  if (!is_single && entry.type != "F64") {
    throw std::invalid_argument(name + " is of type " + entry.type + "; must be F32 or F64");
  }
  if (entry.offsets.size() != 2) {
    throw std::invalid_argument(name + " has " + std::to_string(entry.offsets.size()) +
                                " data_offsets; must have 2");
  }
  const std::size_t from = entry.offsets[0];
  const std::size_t to = entry.offsets[1];
  if (from > to || to > size) {
    throw std::invalid_argument(name + " ends at byte " + std::to_string(to) + " of " +
                                std::to_string(size));
  }
  const std::size_t needed = count * (is_single ? sizeof(float) : sizeof(double));
  if (to - from != needed) {
    throw std::invalid_argument(name + " has " + std::to_string(to - from) + " bytes; its shape " +
                                "needs " + std::to_string(needed));
  }
  if (to - from > left) {
    throw std::invalid_argument(name + " has " + std::to_string(to - from) +
                                " bytes; the other tensors leave " + std::to_string(left) +
                                " of the " + std::to_string(size));
  }
  left -= to - from;
  tensor.values.reserve(count);
  if (is_single) {
    append_values<float>(begin + from, count, tensor.values);
  } else {
    append_values<double>(begin + from, count, tensor.values);
  }
  for (const double value : tensor.values) {
    if (!std::isfinite(value)) {
      throw std::invalid_argument(name + " has a value that is not finite");
    }
  }
  return tensor;
}

}  // namespace

Tensors read_safetensors(const std::vector<char>& data) {
  std::uint64_t header_size = 0;
  if (data.size() < sizeof(header_size)) {
    throw std::invalid_argument("it has " + std::to_string(data.size()) +
                                " bytes; must have at least " +
                                std::to_string(sizeof(header_size)));
  }
  header_size = read_as<std::uint64_t>(data.data());
  const std::size_t rest = data.size() - sizeof(header_size);
  if (header_size > rest || header_size > kMaxHeader) {
    throw std::invalid_argument("it declares a header of " + std::to_string(header_size) +
                                " bytes; must be at most " +
                                std::to_string(std::min(rest, kMaxHeader)));
  }
  const char* const header = data.data() + sizeof(header_size);
  const char* const values = header + header_size;
  HeaderReader reader(std::string_view(header, header_size));
  std::size_t left = rest - header_size;
  Tensors tensors;
  reader.object([&](const std::string& name) {
    if (name == "__metadata__") {
      reader.object([&](const std::string& key) { tensors.metadata[key] = reader.string(); });
    } else {
      const Entry entry = read_entry(reader, name);
      tensors.by_name[name] = read_tensor(name, entry, values, rest - header_size, left);
    }
  });
  reader.end();
  return tensors;
}

}  // namespace walker

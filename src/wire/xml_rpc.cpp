#include "wire/xml_rpc.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <string_view>
#include <utility>

namespace walker::xml_rpc {
namespace {

constexpr std::array<std::pair<std::string_view, char>, 5> kEntities{
    {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}}};

std::string escaped(const std::string& text) {
  std::string xml;
  for (const char c : text) {
    const auto* const entity = std::find_if(kEntities.begin(), kEntities.end(),
                                            [c](const auto& entry) { return entry.second == c; });
    if (entity == kEntities.end()) {
      xml += c;
    } else {
      xml += entity->first;
    }
  }
  return xml;
}

/// Recursive-descent parser. Each method consumes what it is named after.
class Parser {
 public:
  explicit Parser(const std::string& xml) : xml_(xml) {}

  Value answer() {
    skip_blanks();
    if (takes("<?xml")) {
      const std::size_t end = xml_.find("?>", position_);
      if (end == std::string::npos) fail("an XML declaration without its end");
      position_ = end + 2;
    }
    take("<methodResponse>");
    if (takes("<fault>")) {
      const Value fault = value(0);
      take("</fault>");
      end();
      throw Fault(fault_text(fault));
    }
    take("<params>");
    take("<param>");
    Value result = value(0);
    take("</param>");
    take("</params>");
    end();
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error("not an XML-RPC answer: " + what + " at byte " +
                             std::to_string(position_));
  }

  void skip_blanks() {
    while (position_ < xml_.size() && std::isspace(static_cast<unsigned char>(xml_[position_]))) {
      ++position_;
    }
  }

  bool comes(std::string_view token) const {
    return xml_.compare(position_, token.size(), token) == 0;
  }

  /// Skips white space, which is insignificant between tags.
  bool takes(std::string_view token) {
    skip_blanks();
    if (!comes(token)) return false;
    position_ += token.size();
    return true;
  }

  void take(std::string_view token) {
    if (!takes(token)) fail("no " + std::string(token));
  }

  void end() {
    take("</methodResponse>");
    skip_blanks();
    if (position_ != xml_.size()) fail("something after the end");
  }

  Value value(int depth) {
    constexpr int kMaxDepth = 16;
    if (depth > kMaxDepth) fail("values nested deeper than 16");
    take("<value>");
    // Content without a type tag is a string, including its white space.
    const std::size_t begin = position_;
    skip_blanks();
    Value result;
    if (comes("<") && !comes("</")) {
      result = typed(depth);
    } else {
      position_ = begin;
      result.text = characters();
    }
    take("</value>");
    return result;
  }

  Value typed(int depth) {
    Value result;
    if (takes("<array>")) {
      result.kind = Value::Kind::array;
      if (!takes("<data/>")) {
        take("<data>");
        while (!takes("</data>")) result.elements.push_back(value(depth + 1));
      }
      take("</array>");
      return result;
    }
    if (takes("<struct>")) {
      result.kind = Value::Kind::structure;
      while (takes("<member>")) {
        take("<name>");
        characters();  // a fault, the only structure in use, needs no names
        take("</name>");
        result.elements.push_back(value(depth + 1));
        take("</member>");
      }
      take("</struct>");
      return result;
    }
    return scalar();
  }

  Value scalar() {
    constexpr std::array<std::pair<std::string_view, Value::Kind>, 6> kTypes{
        {{"i4", Value::Kind::integer},
         {"int", Value::Kind::integer},
         {"i8", Value::Kind::integer},
         {"boolean", Value::Kind::boolean},
         {"double", Value::Kind::floating},
         {"string", Value::Kind::text}}};
    Value result;
    for (const auto& [name, kind] : kTypes) {
      const std::string tag(name);
      if (takes("<" + tag + "/>")) {
        if (kind != Value::Kind::text) fail("an empty " + tag);
        return result;
      }
      if (!takes("<" + tag + ">")) continue;
      result.kind = kind;
      result.text = characters();
      if (kind == Value::Kind::integer) result.integer = to_integer(result.text);
      take("</" + tag + ">");
      return result;
    }
    fail("a value of an unknown type");
  }

  std::int64_t to_integer(const std::string& text) const {
    std::int64_t number = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, number);
    if (error != std::errc() || stop != end) fail("\"" + text + "\" in place of an integer");
    return number;
  }

  /// Text up to the next tag. XML forbids NUL, which would truncate an exception's message.
  std::string characters() {
    std::string text;
    while (position_ < xml_.size() && xml_[position_] != '<') {
      if (xml_[position_] == 0) fail("a zero byte");
      text += xml_[position_] == '&' ? entity() : std::string(1, xml_[position_++]);
    }
    return text;
  }

  std::string entity() {
    for (const auto& [name, character] : kEntities) {
      if (!comes(name)) continue;
      position_ += name.size();
      return {character};
    }
    fail("an unknown entity");
  }

  static std::string fault_text(const Value& fault) {
    for (const Value& element : fault.elements) {
      if (element.kind == Value::Kind::text && !element.text.empty()) return element.text;
    }
    return "a fault without a text";
  }

  const std::string& xml_;
  std::size_t position_ = 0;
};

}  // namespace

std::string make_call(const std::string& method, const std::vector<std::string>& arguments,
                      const std::string& value) {
  std::string xml = "<?xml version=\"1.0\"?>\n<methodCall><methodName>" + escaped(method) +
                    "</methodName><params>";
  for (const std::string& argument : arguments) {
    xml += "<param><value><string>" + escaped(argument) + "</string></value></param>";
  }
  if (!value.empty()) xml += "<param>" + value + "</param>";
  return xml + "</params></methodCall>\n";
}

Value parse_answer(const std::string& xml) { return Parser(xml).answer(); }

}  // namespace walker::xml_rpc

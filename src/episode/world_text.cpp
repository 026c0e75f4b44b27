// The subset of YAML in which worlds are written; docs/worlds.md describes it.
#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "walker_sim/world.h"

namespace walker {
namespace {

constexpr const char* kSpace = " \t\r\n";

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(kSpace) + 1 - begin);
}

bool starts_with(const std::string& text, const std::string& prefix) {
  return text.compare(0, prefix.size(), prefix) == 0;
}

/// Whether the text begins with a word of YAML's, which a blank or the end follows.
bool has_mark(const std::string& text, const std::string& mark) {
  return starts_with(text, mark) && trimmed(text.substr(mark.size(), 1)).empty();
}

std::string without_comment(const std::string& line) {
  for (std::size_t at = line.find('#'); at != std::string::npos; at = line.find('#', at + 1)) {
    if (at == 0 || line[at - 1] == ' ' || line[at - 1] == '\t') return line.substr(0, at);
  }
  return line;
}

[[noreturn]] void refuse(const std::string& source, const std::string& reason) {
  throw std::invalid_argument("world " + source + ": " + reason);
}

/// Returns the lines of the only document, without comments, marks and blanks at their ends.
std::vector<std::string> lines_of(const std::string& text, const std::string& source) {
  const std::string byte_order_mark = "\xEF\xBB\xBF";
  std::istringstream stream(starts_with(text, byte_order_mark) ? text.substr(3) : text);
  std::vector<std::string> lines;
  bool has_begun = false;
  bool has_ended = false;
  for (std::string line; std::getline(stream, line);) {
    line = without_comment(line);
    const bool begins = has_mark(line, "---");
    const bool ends = has_mark(line, "...");
    if (!has_begun && starts_with(line, "%")) continue;  // a directive
    if (begins || ends) line.erase(0, 3);
    line.erase(line.find_last_not_of(kSpace) + 1);
    if (begins ? has_begun : has_ended && !line.empty()) {
      refuse(source, "must be one YAML document");
    }
    has_begun = has_begun || begins || !line.empty();
    has_ended = has_ended || ends;
    if (!line.empty()) lines.push_back(line);
  }
  return lines;
}

/// Number of brackets that a line opens and does not close.
std::ptrdiff_t opened_brackets(const std::string& line) {
  const auto count = [&line](char letter) { return std::count(line.begin(), line.end(), letter); };
  return count('[') + count('{') - count(']') - count('}');
}

/// Splits at the commas that are not in brackets. A last one may have nothing behind it.
std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char letter : text) {
    depth += static_cast<int>(letter == '[' || letter == '{');
    depth -= static_cast<int>(letter == ']' || letter == '}');
    if (letter == ',' && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += letter;
    }
  }
  if (trimmed(parts.back()).empty()) parts.pop_back();
  return parts;
}

/// Whether a line leaves its value to the next lines: only an anchor or a tag may follow its colon.
bool is_open(const std::string& line) {
  const std::size_t colon = line.rfind(": ");
  if (colon == std::string::npos) return line.back() == ':';
  std::istringstream words(line.substr(colon + 2));
  for (std::string word; words >> word;) {
    if (!starts_with(word, "&") && word != "!!python/tuple") return line.back() == ':';
  }
  return true;
}

/// Returns the entries NAME: VALUE of a text, or of {A: 1, B: [2, 3]}. They keep their line breaks.
std::vector<std::string> entries_of(const std::string& document, const std::string& source) {
  std::vector<std::string> entries;
  std::ptrdiff_t depth = 0;
  std::string last = " ";
  for (const std::string& line : lines_of(document, source)) {
    const std::string text = trimmed(line);
    const bool is_value = has_mark(text, "-") || (line.front() != text.front() && is_open(last));
    if (!entries.empty() && (depth > 0 || is_value)) {
      entries.back() += "\n" + text;
    } else {
      entries.push_back(text);
      depth = 0;
    }
    last = text;
    depth += opened_brackets(line);
  }
  if (entries.size() != 1) return entries;
  const std::string& whole = entries.front();
  const bool has_braces = whole.size() > 1 && whole.front() == '{' && whole.back() == '}';
  return has_braces ? split(whole.substr(1, whole.size() - 2)) : entries;
}

std::string without_quotes(const std::string& name) {
  const bool is_quoted = name.size() > 1 && name.front() == name.back() &&
                         (name.front() == '"' || name.front() == '\'');
  return is_quoted ? name.substr(1, name.size() - 2) : name;
}

/// Returns the elements of [LOW, HIGH], or of lines "- LOW" and "- HIGH".
std::vector<std::string> elements_of(const std::string& value) {
  const std::string text = trimmed(value);
  if (text.size() > 1 && text.front() == '[' && text.back() == ']') {
    return split(text.substr(1, text.size() - 2));
  }
  std::vector<std::string> elements;
  if (value.empty() || value.front() != '\n') return elements;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!has_mark(line, "-")) return {};
    elements.push_back(line.substr(1));
  }
  return elements;
}

std::optional<WorldRange> read_pair(const std::string& value) {
  const std::vector<std::string> elements = elements_of(value);
  if (elements.size() != 2) return std::nullopt;
  const auto low = parse_number(trimmed(elements[0]));
  const auto high = parse_number(trimmed(elements[1]));
  return low && high ? std::optional(WorldRange{*low, *high}) : std::nullopt;
}

/// Returns the pair's text of {log: PAIR}, or of log: PAIR on the lines after the name.
std::optional<std::string> logarithmic_pair(const std::string& value) {
  std::string text = trimmed(value);
  const bool has_braces = text.size() > 1 && text.front() == '{' && text.back() == '}';
  if (!has_braces && (value.empty() || value.front() != '\n')) return std::nullopt;
  if (has_braces) text = trimmed(text.substr(1, text.size() - 2));
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return std::nullopt;
  if (without_quotes(trimmed(text.substr(0, colon))) != "log") return std::nullopt;
  return text.substr(colon + 1);
}

/// Reads a value after an optional anchor and an optional tag !!python/tuple. yaml.dump writes an
/// anchor and aliases for a value that occurs twice.
/// @param anchors values of earlier entries' anchors; receives this entry's
std::optional<WorldRange> read_value(std::string value, std::map<std::string, WorldRange>& anchors,
                                     bool may_be_logarithmic = true) {
  std::string anchor;
  for (int words = 0; words < 3; ++words) {
    value.erase(0, std::min(value.find_first_not_of(" \t"), value.size()));
    const std::string word = value.substr(0, value.find_first_of(kSpace));
    if (starts_with(word, "&")) {
      anchor = word.substr(1);
    } else if (word != "!!python/tuple") {
      break;
    }
    value.erase(0, word.size());
  }
  if (starts_with(value, "*")) {
    const auto found = anchors.find(trimmed(value.substr(1)));
    return found == anchors.end() ? std::nullopt : std::optional(found->second);
  }
  std::optional<WorldRange> range = read_pair(value);
  if (const auto number = parse_number(trimmed(value))) range = {*number, *number};
  const auto pair = may_be_logarithmic ? logarithmic_pair(value) : std::nullopt;
  if (pair) {
    const bool is_number = parse_number(trimmed(*pair)).has_value();
    range = is_number ? std::nullopt : read_value(*pair, anchors, false);
    if (!range || range->is_log_uniform) return std::nullopt;
    range->is_log_uniform = !range->is_number();
  }
  if (range && !anchor.empty()) anchors[anchor] = *range;
  return range;
}

}  // namespace

World parse_world(const std::string& text, const std::string& source) {
  World world;
  std::map<std::string, WorldRange> anchors;
  for (const std::string& entry : entries_of(text, source)) {
    const std::size_t colon = entry.find(':');
    const std::string name = without_quotes(trimmed(entry.substr(0, colon)));
    const std::optional<WorldRange> range =
        colon == std::string::npos ? std::nullopt : read_value(entry.substr(colon + 1), anchors);
    if (name.empty() || !range) {
      refuse(source, printable(trimmed(entry)) +
                         ": must be NAME: NUMBER, NAME: [LOW, HIGH] or NAME: {log: [LOW, HIGH]}");
    }
    if (!world.emplace(name, *range).second) refuse(source, printable(name) + " is given twice");
  }
  return world;
}

}  // namespace walker

// Locale-independent conversion between numbers and decimal text.
#pragma once

#include <clocale>
#include <cstdlib>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>
#include <string>

namespace walker {

/// A std::ostringstream that ignores the global locale: decimal point, no grouping.
class ClassicStream : public std::ostringstream {
 public:
  ClassicStream() { imbue(std::locale::classic()); }
};

/// The "C" locale, for C functions with the suffix _l.
inline locale_t c_locale() {
  static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
  return locale;
}

inline void read_number(const std::string& text, float& value) {
  value = strtof_l(text.c_str(), nullptr, c_locale());
}
inline void read_number(const std::string& text, double& value) {
  value = strtod_l(text.c_str(), nullptr, c_locale());
}

/// Returns the shortest decimal text that reads back as the same float or double, e.g. 0.1, 1e-07.
template <typename Number>
std::string shortest_text(Number value) {
  using Limits = std::numeric_limits<Number>;
  std::string text;
  // Streams omit trailing zeros, so starting at digits10 still yields 0.1 for 0.1.
  for (int digits = Limits::digits10; digits <= Limits::max_digits10; ++digits) {
    ClassicStream stream;
    stream.precision(digits);
    stream << value;
    text = stream.str();
    Number again{};
    read_number(text, again);
    if (again == value) break;
  }
  return text;
}

/// Returns the number with `digits` decimals; by default as std::to_string in the C locale.
inline std::string fixed_text(double value, int digits = 6) {
  ClassicStream stream;
  stream << std::fixed << std::setprecision(digits) << value;
  return stream.str();
}

}  // namespace walker

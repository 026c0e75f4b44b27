// Numbers as decimal texts, alike in every locale of the process: of C's and of C++'s own.
#pragma once

#include <clocale>
#include <cstdlib>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>
#include <string>

namespace walker {

/// Writes numbers with a point and without grouping. A std::ostringstream follows the global
/// locale.
class ClassicStream : public std::ostringstream {
 public:
  ClassicStream() { imbue(std::locale::classic()); }
};

/// Locale of C's functions whose names end in _l.
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

/// The shortest decimal text that reads back as the same number, e.g. 0.1, 1e-07.
/// @tparam Number float or double
template <typename Number>
std::string shortest_text(Number value) {
  using Limits = std::numeric_limits<Number>;
  std::string text;
  // Trailing zeros are not printed, so the digits that every decimal text survives are not too
  // many for 0.1.
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

/// The number with so many digits after the point, as std::to_string writes it in the C locale.
inline std::string fixed_text(double value, int digits = 6) {
  ClassicStream stream;
  stream << std::fixed << std::setprecision(digits) << value;
  return stream.str();
}

}  // namespace walker

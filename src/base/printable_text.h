// Texts of others, fit to be shown: in a log, an error, a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "walker_sim/export.h"

namespace walker {

constexpr std::size_t kMaxPrintableBytes = 1000;  ///< of a text before it loses its middle
constexpr std::size_t kMaxQuotedBytes = 200;      ///< the same for a peer's text within a message

/// On one line: control characters, and bytes that are no UTF-8, become \n, \t or \x1b. Of a long
/// text the middle is left out, with a word on how much that is: what stands at its beginning and
/// its end tells most.
WALKER_SIM_EXPORT std::string printable(std::string_view text,
                                        std::size_t most = kMaxPrintableBytes);

WALKER_SIM_EXPORT bool is_utf8(std::string_view text);

/// The same text, but for bytes that are no UTF-8, which become \xff, and zero bytes, at which the
/// text of an exception would end.
WALKER_SIM_EXPORT std::string to_utf8(std::string_view text);

}  // namespace walker

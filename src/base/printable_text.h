// Escapes untrusted text for logs, error messages and terminals.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "walker_sim/export.h"

namespace walker {

constexpr std::size_t kMaxPrintableBytes = 1000;  ///< longer texts are truncated in the middle
constexpr std::size_t kMaxQuotedBytes = 200;      ///< the same for peers' text within a message

/// Returns the text on one line: control characters and bytes that are not valid UTF-8 are escaped
/// as \n, \t or \x1b. If it is longer than `most` bytes, its middle is replaced by the number of
/// bytes left out; the beginning and the end are the most informative parts.
WALKER_SIM_EXPORT std::string printable(std::string_view text,
                                        std::size_t most = kMaxPrintableBytes);

WALKER_SIM_EXPORT bool is_utf8(std::string_view text);

/// Escapes bytes that are not valid UTF-8 as \xff, and zero bytes, which would end the text of an
/// exception.
WALKER_SIM_EXPORT std::string to_utf8(std::string_view text);

}  // namespace walker

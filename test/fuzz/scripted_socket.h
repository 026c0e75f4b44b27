// In place of wire/socket.cpp: connections whose peers say what a fuzzer made up. A piece of it
// may be read after each connection and each request; where no piece is left, the peer closes.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

namespace walker::fuzz {

using Pieces = std::deque<std::vector<std::uint8_t>>;

/// What the next connections read.
Pieces& script();

}  // namespace walker::fuzz

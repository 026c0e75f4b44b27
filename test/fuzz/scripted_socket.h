// Replaces wire/socket.cpp by connections whose peers send the fuzzer's pieces. One piece becomes
// readable after each send; when none is left, the peer closes.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

namespace walker::fuzz {

using Pieces = std::deque<std::vector<std::uint8_t>>;

Pieces& script();

}  // namespace walker::fuzz

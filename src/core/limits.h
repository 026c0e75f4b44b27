// What a server and its clients agree on without a word.
#pragma once

#include <cstdint>

namespace walker {

constexpr std::uint32_t kMostEnvironments = 100000;  ///< in one server

}  // namespace walker

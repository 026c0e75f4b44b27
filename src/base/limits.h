// What a server and its clients agree on without a word.
#pragma once

#include <cstdint>

namespace walker {

constexpr std::uint32_t kMostEnvironments = 100000;    ///< in one server
constexpr std::uint32_t kMostRecordedSteps = 1000000;  ///< of an episode
constexpr std::uint32_t kMostTexts = 4096;             ///< in one array; robots have some ten
constexpr std::uint32_t kMostRecordTextBytes = 1
                                               << 20;  ///< of an episode's record, in all its texts
constexpr std::uint32_t kMostPixels = 4096;            ///< of a picture's width and height

}  // namespace walker

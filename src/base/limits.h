// Limits that several rooms share.
#pragma once

#include <cstddef>
#include <cstdint>

namespace walker {

constexpr std::size_t kCacheLine = 64;      ///< alignment of what different threads write [bytes]
constexpr std::size_t kMaxGroupSize = 64;   ///< robots that are stepped together
constexpr std::size_t kMaxEndReason = 100;  ///< bytes reserved for it, so that no step allocates
constexpr std::size_t kMaxPoolSize = 1U << 20U;       ///< environments of a pool
constexpr std::uint32_t kMaxEnvironments = 100000;    ///< in one server
constexpr std::uint32_t kMaxRecordedSteps = 1000000;  ///< of an episode
constexpr std::uint32_t kMaxTexts = 4096;             ///< in one array; robots have some ten
constexpr std::uint32_t kMaxRecordTextBytes = 1
                                              << 20;  ///< of an episode's record, in all its texts
constexpr std::uint32_t kMaxPixels = 4096;            ///< of a picture's width and height

}  // namespace walker

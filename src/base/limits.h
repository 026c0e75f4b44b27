// Limits that several rooms share.
#pragma once

#include <cstddef>
#include <cstdint>

namespace walker {

/// Alignment of data that different threads write [bytes].
constexpr std::size_t kCacheLine = 64;

/// Upper bound of the robots that are stepped together.
constexpr std::size_t kMaxGroupSize = 64;

/// Upper bound of a pool's environments.
constexpr std::size_t kMaxPoolSize = std::size_t{1} << 20U;

/// Upper bound of a server's environments.
constexpr std::uint32_t kMaxEnvironments = 100000;

/// Upper bound of a pool's threads.
constexpr std::size_t kMaxThreads = 1024;

/// Upper bound of simulation time over wall time.
constexpr double kMaxRealTimeFactor = 1000;

/// Upper bound of a recorded episode's steps.
constexpr std::uint32_t kMaxRecordedSteps = 1000000;

/// Upper bound of an episode record's strings together [bytes].
constexpr std::uint32_t kMaxRecordTextBytes = 1U << 20U;

/// Memory that an end reason reserves, so that no step allocates [bytes].
constexpr std::size_t kMaxEndReason = 100;

/// Upper bound of the strings in one array of a message; robots have some ten.
constexpr std::uint32_t kMaxTexts = 4096;

/// Upper bound of a picture's width and height.
constexpr std::uint32_t kMaxPixels = 4096;

/// 2^53: a double holds every integer up to this size.
constexpr double kMaxExactInteger = 9007199254740992.0;

}  // namespace walker

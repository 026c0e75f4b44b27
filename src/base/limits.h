// Limits shared by several components.
#pragma once

#include <cstddef>
#include <cstdint>

namespace walker {

/// Alignment of data that different threads write [bytes].
constexpr std::size_t kCacheLine = 64;

/// Upper bound of the robots stepped as one group.
constexpr std::size_t kMaxGroupSize = 64;

/// Upper bound of a pool's environments.
constexpr std::size_t kMaxPoolSize = std::size_t{1} << 20U;

/// Upper bound of a server's environments.
constexpr std::uint32_t kMaxEnvironments = 100000;

/// Upper bound of a pool's threads.
constexpr std::size_t kMaxThreads = 1024;

constexpr double kMaxRealTimeFactor = 1000;

constexpr std::uint32_t kMaxRecordedSteps = 1000000;
constexpr std::size_t kMaxRecordedPushes = 100000;
constexpr std::size_t kPushBytes = 2 * sizeof(std::uint32_t) + 3 * sizeof(double);  // Push.msg
constexpr std::size_t kMaxRecordedCoordinates = 10000;
/// Upper bound of Coordinates.msg, for 16 coordinates; the robots have at most 9.
constexpr std::size_t kCoordinatesBytes =
    3 * sizeof(std::uint32_t) + std::size_t{2} * 16 * sizeof(double);

/// Upper bound of each component of a push by hand in axes of its link, far above any weight
/// [N, N m].
constexpr double kMaxPush = 1e6;

/// Upper bound of each component in axes of odom: a rotation enlarges a component by sqrt(3) at
/// most.
constexpr double kMaxTurnedPush = 2 * kMaxPush;

/// Upper bound of the total size of an episode record's strings [bytes].
constexpr std::uint32_t kMaxRecordTextBytes = 1U << 20U;

/// Capacity reserved for an end reason, so that steps do not allocate [bytes].
constexpr std::size_t kMaxEndReason = 100;

/// Upper bound of the strings in one array of a message; robots have about ten. Arrays of messages
/// have one element per environment at most.
constexpr std::uint32_t kMaxTexts = 4096;

/// Upper bounds of one world in a message; robots have about 50 parameters.
constexpr std::size_t kMaxWorldParameters = 256;
constexpr std::size_t kMaxWorldBytes = 4096;

/// Upper bound of an image's width and height.
constexpr std::uint32_t kMaxPixels = 4096;

/// 2^53: a double represents every integer up to this magnitude.
constexpr double kMaxExactInteger = 9007199254740992.0;

}  // namespace walker
